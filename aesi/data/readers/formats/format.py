"""What a maker's export looks like: the names of its columns, their units, its sign.

A format is recognised by its column names as a whole, wherever the line with them stands; blocks above it are
passed over. Nothing else is told from the content.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from aesi.data import units

Sign = Literal["discharge-positive", "charge-positive"]


@dataclass(frozen=True)
class Name:
    """One way in which a maker names a column.

    pattern : of the whole name as `plain` writes it; a group `unit` takes the unit that stands in the name.
    unit : where the name does not say it.
    reference : pattern of the column of the other electrode. Where that is there, both are potentials against a
    reference electrode, and the quantity is their difference.
    """

    pattern: str
    unit: str = ""
    reference: str = ""


@dataclass(frozen=True)
class Format:
    """One maker's export.

    marks : patterns that all have to be found among the names of the columns, and together in no other export.
    columns : quantity, or `state`, `cycle`, `step` -> the maker's names for it, the preferred first.
    sign : of a current that is written with a sign; magnitudes take theirs from the `state` column.
    """

    name: str
    marks: tuple[str, ...]
    columns: Mapping[str, tuple[Name, ...]]
    sign: Sign = "charge-positive"

    def recognises(self, header: Sequence[str]) -> bool:
        """Whether these are the names of its columns."""
        names = [plain(name) for name in header]
        return all(any(re.fullmatch(mark, name) for name in names) for mark in self.marks)

    def find(self, quantity: str, header: Sequence[str]) -> tuple[int, str] | None:
        """Position of a quantity's column and the unit it is in ('' for none); None where it is not there."""
        names = [plain(name) for name in header]
        for candidate in self.columns.get(quantity, ()):
            for position, name in enumerate(names):
                match = re.fullmatch(candidate.pattern, name)
                if match is None:
                    continue
                unit = candidate.unit
                if "unit" in match.groupdict() and match["unit"]:
                    unit = units.spelt(quantity, match["unit"]) or unit
                if quantity not in units.SI or unit:
                    return position, unit
        return None

    def reference_column(self, quantity: str, position: int, header: Sequence[str]) -> str | None:
        """Name of the column that has to be subtracted from that at `position` to give the quantity; None for none."""
        names = [plain(name) for name in header]
        reference = [
            c.reference
            for c in self.columns[quantity]
            if c.reference and re.fullmatch(c.pattern, names[position])
        ]
        return next(
            (header[i] for i, name in enumerate(names) for one in reference if re.fullmatch(one, name)), None
        )


def plain(name: str) -> str:
    """A column's name in lower case, underscores as blanks, one blank at most, without quotes and `~`."""
    text = unicodedata.normalize("NFKC", name).lower().replace("_", " ").strip(" ~\"'\ufeff")
    return re.sub(r"\s+", " ", text)
