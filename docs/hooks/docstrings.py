"""Docstrings on the pages of the reference: `name : what it is` becomes an item of a list.

In the code arguments stand one after the other, several to a line where they are short; as they are, Markdown would
run them together to one paragraph.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension

NAMES = r"\w+(?:(?:, | to )\w+)*"
STARTS = re.compile(rf"^{NAMES} : ")
BETWEEN = re.compile(rf"  (?={NAMES} : )")
ENDS = re.compile(r"^(Returns?|Raises?|Yields?) ")


class Lists(Extension):
    """Makes the lists in every docstring that the reference shows."""

    def on_object(self, *, obj: Any, **_: Any) -> None:
        """Rewrite the docstring of an object, where it has one."""
        if obj.docstring is not None:
            obj.docstring.value = as_lists(obj.docstring.value)


def as_lists(text: str) -> str:
    """The docstring in Markdown: its arguments as items, and what it returns and raises in paragraphs of their own."""
    out: list[str] = []
    in_item = False
    for line in text.splitlines():
        if ENDS.match(line):
            out += ["", line]
            in_item = False
        elif not line or (line.startswith("    ") and not in_item):
            out.append(line)  # between paragraphs, and in code
            in_item = False
        else:
            before, *items = ["", *BETWEEN.split(line)] if STARTS.match(line) else BETWEEN.split(line)
            if before:
                out.append(f"    {before.strip()}" if in_item else before)
            if items and not in_item:
                out.append("")
                in_item = True
            out += map(_item, items)
    return "\n".join(out)


def _item(text: str) -> str:
    names, _, what = text.partition(" : ")
    code = re.sub(r"\b(?!to\b)\w+", r"`\g<0>`", names)
    return f"- {code}: {what.strip()}"
