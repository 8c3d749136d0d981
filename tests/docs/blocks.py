"""The fenced blocks of a Markdown page, in order, with what the page says about how to test them.

A directive stands in a comment right above its block:

    <!-- test: slow -->               only in the slow tests
    <!-- test: skip=why -->           not run, for that reason
    <!-- test: file=name.yaml -->     the content of that file, written to the working folder
    <!-- test: needs=about_energy_nmc -->    run where that measured data set is on the machine
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path

BLOCK = re.compile(
    r"^(?:<!-- test: (?P<directives>.*?) -->\n)?```(?P<language>\w*)[^\n]*\n(?P<body>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
TESTED = ("python", "console")
DIRECTIVES = {"slow", "skip", "file", "needs"}


@dataclass(frozen=True)
class Block:
    """One fenced block; `line` is that of its first fence."""

    language: str
    body: str
    line: int
    directives: dict[str, str] = field(default_factory=dict)

    @property
    def is_tested(self) -> bool:
        """Whether the block is run, or written as a file that others need."""
        return "file" in self.directives or self.language in TESTED


def blocks(page: Path) -> list[Block]:
    """All fenced blocks of a page."""
    text = page.read_text(encoding="utf-8")
    return [
        Block(
            language=match["language"],
            body=match["body"],
            line=text[: match.start()].count("\n") + 1,
            directives=_directives(match["directives"] or ""),
        )
        for match in BLOCK.finditer(text)
    ]


def _directives(text: str) -> dict[str, str]:
    """Name -> value.  Raises ValueError for a name that means nothing: a block would be run that should not be."""
    pairs = (item.partition("=") for item in text.split(";") if item.strip())
    found = {name.strip(): value.strip() for name, _, value in pairs}
    unknown = found.keys() - DIRECTIVES
    if unknown:
        raise ValueError(f"<!-- test: {text} -->: there is no {', '.join(sorted(unknown))}.")
    return found
