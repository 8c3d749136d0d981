"""Pages made at build time: catalogue of effects, benchmarks, command line, and files of the repository."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from runpy import run_path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:  # mkdocs imports a hook by its path
    sys.path.insert(0, str(ROOT))

KINDS = {
    "physics": "Physics the model lacks",
    "parameter": "Parameters that may be declared wrongly",
    "instrument": "Instrument faults that imitate physics",
}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace `<!-- generated: name -->` by what the generator of that name writes."""
    for name, write in GENERATORS.items():
        marker = f"<!-- generated: {name} -->"
        if marker in markdown:
            markdown = markdown.replace(marker, write())
    return markdown


def catalogue() -> str:
    """Every effect of the catalogue, by kind."""
    from aesi.physics.effects import CATALOGUE

    parts = []
    for kind, title in KINDS.items():
        effects = [effect for effect in CATALOGUE.values() if effect.kind == kind]
        if effects:
            parts.append(f"## {title}\n")
            parts += [_effect(effect) for effect in effects]
    return "\n".join(parts)


def _effect(effect: Any) -> str:
    lines = [
        f"### {effect.id}\n",
        f"{effect.summary}.\n",
        "```text",
        textwrap.dedent(effect.equation),
        "```\n",
    ]
    if effect.validity:
        lines.append(f"{effect.validity}\n")
    if effect.source:
        lines.append(f"Source: {effect.source}\n")
    if effect.parameters:
        lines += [
            "| parameter | unit | typical | range | meaning |",
            "|---|---|---:|---:|---|",
            *(_parameter(name, parameter) for name, parameter in effect.parameters.items()),
            "",
        ]
    return "\n".join(lines)


def _parameter(name: str, parameter: Any) -> str:
    low, high = parameter.bounds
    scale = " (log)" if parameter.log else ""
    about = [parameter.description] if parameter.description else []
    if parameter.neutral is not None:
        about.append(f"without effect at {parameter.neutral:g}")
    about.append(f"range: {parameter.source}")
    limits = f"{low:g} to {high:g}{scale}"
    cells = (f"`{name}`", parameter.unit, f"{parameter.default:g}", limits, "; ".join(about))
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def benchmarks() -> str:
    """docs/benchmarks.json: the newest lines that `aesi bench --json` printed, and how watched figures moved."""
    from flows.benchmarks.history import latest, read_history

    entries = read_history(ROOT / "docs" / "benchmarks.json")
    if not entries:
        return "No benchmark has been recorded in this checkout; `aesi bench` runs them."
    by_name: dict[str, list[tuple[Any, dict[str, Any]]]] = {}
    for entry, line in latest(entries).values():
        if line["bench"] in IN_COLUMNS:
            continue
        by_name.setdefault(line["bench"], []).append((entry, line))
    parts: list[str] = []
    for name, found in by_name.items():
        parts += [
            f"## {name}\n",
            *(f"{text}\n" for text in dict.fromkeys(_origin(entry) for entry, _ in found)),
        ]
        parts.append(_table([line for _, line in found]))
    return "\n".join([*parts, _over_time(entries)])


def dfn_curve() -> str:
    """Error against time of the porous electrode, from the newest recorded lines."""
    from flows.benchmarks.history import latest, read_history

    entries = read_history(ROOT / "docs" / "benchmarks.json")
    drawn = run_path(str(Path(__file__).with_name("curve.py")))["curve"]
    return str(
        drawn([line for _, line in latest(entries).values() if line["bench"] == "dfn" and "who" in line])
    )


def columns_of(bench: str) -> str:
    """A figure a row and a labelled run a column, oldest first: what a change of method brought stays to be seen."""
    from flows.benchmarks.history import read_history

    runs = [
        (entry, line)
        for entry in read_history(ROOT / "docs" / "benchmarks.json")
        for line in entry.lines
        if line["bench"] == bench and line.get("label")
    ]
    if not runs:
        return f"No run has been recorded in this checkout; `aesi bench {bench}` makes one."
    heads = [f"{line['label']}, seed {line['seed']}, commit `{entry.commit[:7]}`" for entry, line in runs]
    rows = [
        f"| {title} | " + " | ".join(_figure(line, key) for _, line in runs) + " |"
        for key, title in IN_COLUMNS[bench]
    ]
    return "\n".join(["| | " + " | ".join(heads) + " |", "|---|" + "---:|" * len(runs), *rows, ""])


def _figure(line: dict[str, Any], key: str) -> str:
    """A rate with its interval and its cases, or a plain figure."""
    if f"{key}_pct" not in line:
        return _cell(line.get(key))
    if line[f"{key}_pct"] is None or not line.get(f"{key}_95_pct"):
        return "–"
    low, high = line[f"{key}_95_pct"]
    return f"{line[f'{key}_pct']:.0f} % [{low:.0f}, {high:.0f}] of {line[f'{key}_cases']}"


def _origin(entry: Any) -> str:
    load = "" if entry.load is None else f", load {entry.load:.1f} at the start"
    return f"Measured on {entry.machine}, {entry.date}, commit `{entry.commit[:7]}`{load}."


def _over_time(entries: list[Any]) -> str:
    """Every recorded value of the figures that should not get worse."""
    from flows.benchmarks.history import case_of, figures

    moved: dict[tuple[Any, ...], list[str]] = {}
    for entry in entries:
        for line in entry.lines:
            for figure, value in figures(line).items():
                moved.setdefault((*case_of(line), figure), []).append(f"{_cell(float(value))} ({entry.date})")
    rows = [
        f"| {bench} | {', '.join(_cell(each) for each in case)} | {figure} | {' → '.join(values)} |"
        for (bench, *case, figure), values in moved.items()
    ]
    head = ["## Over time\n", "| benchmark | case | figure | recorded |", "|---|---|---|---|"]
    return "\n".join([*head, *rows, ""])


def _table(rows: list[dict[str, Any]]) -> str:
    """Few values stand below each other; several lines of one benchmark become rows."""
    keys = list(dict.fromkeys(key for row in rows for key in row if key != "bench"))
    if len(rows) == 1:
        (row,) = rows
        body = [f"| {key} | {_cell(row[key])} |" for key in keys if key != "confusion"]
        table = ["| figure | value |", "|---|---:|", *body, ""]
        return "\n".join([*table, *_confusion(row["confusion"])] if "confusion" in row else table)
    body = ["| " + " | ".join(_cell(row.get(key)) for key in keys) + " |" for row in rows]
    return "\n".join(["| " + " | ".join(keys) + " |", "|" + "---|" * len(keys), *body, ""])


def _confusion(matrix: dict[str, dict[str, int]]) -> list[str]:
    """What was in the data against what was said; a wrong answer may be one that is declared indistinguishable."""
    rows = []
    for label, said in matrix.items():
        answers = [f"{answer} ({count})" for answer, count in sorted(said.items(), key=lambda one: -one[1])]
        rows.append(f"| {label} | {', '.join(answers)} |")
    return ["| in the data | answers (cases) |", "|---|---|", *rows, ""]


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, dict | list):
        return f"`{json.dumps(value)}`"
    return str(value).replace("|", "\\|")


def command_line() -> str:
    """`--help` of every command."""
    from typer.main import get_command

    from flows.cli import app

    root: Any = get_command(app)
    parts = []
    for name, command in _commands(root, "aesi"):
        context = command.make_context(name, [], resilient_parsing=True)
        parts += [f"## {name}\n", "```text", command.get_help(context), "```\n"]
    return "\n".join(parts)


def _commands(group: Any, prefix: str) -> list[tuple[str, Any]]:
    found = []
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            found += _commands(command, f"{prefix} {name}")
        else:
            found.append((f"{prefix} {name}", command))
    return found


def contributing() -> str:
    """CONTRIBUTING.md of the repository, with its links as the site has them."""
    return _from_root("CONTRIBUTING.md")


def changelog() -> str:
    """CHANGELOG.md of the repository."""
    return _from_root("CHANGELOG.md")


def _from_root(name: str) -> str:
    text = (ROOT / name).read_text(encoding="utf-8")
    return text.replace("](docs/", "](").replace("](CHANGELOG.md)", "](changelog.md)")


IN_COLUMNS = {
    "blind": (
        ("cases", "cases"),
        ("not_made", "beside them, that the laboratory could not make"),
        ("no_answer", "without an answer (out of time, or refused)"),
        ("effect_exact", "effects named exactly"),
        ("seen_exact", "the same, of those that say enough of unseen data to be named at all"),
        ("effect_grouped", "effects named within a group of three"),
        ("effect_lenient", "the same, listed alternatives counted as right"),
        ("pair_both_named", "pairs, both named"),
        ("stranger_unknown", "strangers called `unknown`"),
        ("stranger_false_name", "names given to strangers"),
        ("none_false_name", "names given where nothing is missing"),
        ("effect_false_name", "names beside the right ones, or instead of them"),
        ("false_name_beside_unknown", "wrong names beside `unknown`"),
        ("fitted_called_found", "right and fitted to the noise, called `found`"),
        ("after_over_noise_median", "error on unseen data over the noise, median"),
        ("parameter_error_median", "largest relative error of a parameter, median"),
        ("parameters_covered", "parameters inside their 90 % interval"),
        ("processor_s_median", "processor seconds a case, median"),
    ),
    "real": (
        ("ran", "cases"),
        ("no_answer", "without an answer (out of time, or refused)"),
        ("withheld_named", "temperatures named"),
        ("withheld_within_2k", "temperatures within 2 K"),
        ("withheld_course_rms_k_median", "course of the temperatures named, RMS, K, median"),
        ("withheld_error_halved", "error on unseen data at least halved, of those named"),
        ("warming_named", "records that warm up: heat or temperature named"),
        ("fault_named", "faults named"),
        ("wrong_soc0_silent", "wrong initial states without a name"),
        ("wrong_soc0_error_median", "share of the wrong initial state left, median"),
        ("physics_named", "contacts and capacity named"),
        ("size_error_median", "relative error of the size, median"),
        ("size_covered", "sizes inside their 90 % interval"),
        ("control_silent", "controls without a name"),
        ("control_matched_false", "controls with the name of a case matched to them"),
        ("ageing_named", "ageing named, or rightly not"),
        ("ageing_within_2pp", "capacity within 2 percentage points of the measured one"),
        ("witness_within_15pct", "resistances within 15 % of the spectra's"),
        ("witness_ohmic_off_median", "ohmic resistance off the spectrum's, share, median"),
        ("witness_transfer_off_median", "charge transfer off the spectrum's, share, median"),
        ("after_worse", "worse on unseen data than the better of declared and recalibrated"),
        ("processor_s_median", "processor seconds a case, median"),
        ("processor_s_total", "processor seconds of all"),
    ),
}
"""Benchmarks whose runs stand side by side: key of a figure and what it is."""

GENERATORS: dict[str, Callable[[], str]] = {
    "catalogue": catalogue,
    "benchmarks": benchmarks,
    "dfn curve": dfn_curve,
    "blind": lambda: columns_of("blind"),
    "real": lambda: columns_of("real"),
    "command line": command_line,
    "contributing": contributing,
    "changelog": changelog,
}
