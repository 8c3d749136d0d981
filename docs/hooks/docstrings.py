"""Docstrings on the pages of the reference: `name : what it is` becomes an item of a list.

In the code arguments stand one after the other, several to a line where they are short; as they are, Markdown would
run them together to one paragraph.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension

NAMES = r"\w+(?:, \w+)*"
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
        if STARTS.match(line):
            if not in_item:
                out.append("")
            out += map(_item, BETWEEN.split(line))
            in_item = True
        elif ENDS.match(line):
            out += ["", line]
            in_item = False
        elif in_item and line:
            rest, *items = BETWEEN.split(line)
            out += [f"    {rest.strip()}", *map(_item, items)]
        else:
            out.append(line)
            in_item = False
    return "\n".join(out)


def _item(text: str) -> str:
    names, _, what = text.partition(" : ")
    code = ", ".join(f"`{name}`" for name in names.split(", "))
    return f"- {code}: {what.strip()}"
