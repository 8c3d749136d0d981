"""A table of a benchmark in a page of the docs, between two marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def write_between(page: str, begin: str, end: str, lines: Sequence[str]) -> None:
    """Put lines of Markdown between the marks `begin` and `end` of a page, in the place of what stood there."""
    path = Path(page)
    text = path.read_text(encoding="utf-8")
    before, after = text.split(begin)[0], text.split(end)[1]
    body = "\n".join(lines)
    path.write_text(f"{before}{begin}\n{body}\n{end}{after}", encoding="utf-8")
