"""A table of formatted cells, set as Markdown, LaTeX or CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

ABSENT = "–"


@dataclass(frozen=True)
class Table:
    """A table ready to be set: `key` names it in LaTeX labels, `rows` hold formatted cells, name first."""

    key: str
    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def to_markdown(table: Table) -> str:
    """Caption, then a pipe table with the numbers aligned to the right."""
    rule = ["---"] + ["---:"] * (len(table.header) - 1)
    lines = [_pipe(table.header), "|" + "|".join(rule) + "|", *(_pipe(row) for row in table.rows)]
    return f"{table.caption}\n\n" + "\n".join(lines) + "\n"


def to_latex(table: Table) -> str:
    """A floating table in the style of booktabs; needs that package and a UTF-8 engine or inputenc."""
    body = [_ampersand(table.header), r"\midrule", *(_ampersand(row) for row in table.rows)]
    return "\n".join(
        [
            r"\begin{table}[htbp]",
            r"\centering",
            rf"\caption{{{_tex(table.caption)}}}",
            rf"\label{{tab:{table.key}}}",
            rf"\begin{{tabular}}{{l{'r' * (len(table.header) - 1)}}}",
            r"\toprule",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def to_csv(table: Table) -> str:
    """The caption as a comment line, then comma-separated cells; absent values are empty."""
    out = io.StringIO()
    out.write(f"# {table.caption}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table.header)
    writer.writerows([["" if cell == ABSENT else cell for cell in row] for row in table.rows])
    return out.getvalue()


def _pipe(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _ampersand(cells: Sequence[str]) -> str:
    return " & ".join(_tex(cell) for cell in cells) + r" \\"


_TEX = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    ABSENT: "--",
}


def _tex(text: str) -> str:
    return "".join(_TEX.get(character, character) for character in text)
