"""A table of a benchmark in a page of the docs, between two marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from aesi.errors import InputError
from aesi.numerics.files.whole import write_whole


def check_marks(page: str, begin: str, end: str) -> None:
    """Raises InputError where `write_between` has no page with both marks to write to."""
    try:
        text = Path(page).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"--set write={page}: no page that can be read ({getattr(error, 'strerror', None) or 'it is no text'}); "
            "name one that is there."
        ) from None
    _, found, below = text.partition(begin)
    if not found or end not in below:
        raise InputError(
            f"--set write={page}: the page has no lines {begin} and, below it, {end}, between which the table is "
            "written; add them."
        )


def write_between(page: str, begin: str, end: str, lines: Sequence[str]) -> None:
    """Put lines of Markdown between the marks `begin` and `end` of a page, in the place of what stood there."""
    path = Path(page)
    before, _, below = path.read_text(encoding="utf-8").partition(begin)
    after = below.partition(end)[2]
    body = "\n".join(lines)
    write_whole(path, f"{before}{begin}\n{body}\n{end}{after}")
