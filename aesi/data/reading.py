"""Options for reading a file: the user's statements on its columns, units, sign and rows."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from typing import Any, Literal, get_args

from aesi.data.readers.formats.format import Sign
from aesi.data.state import Direction
from aesi.errors import DataError, in_words
from aesi.records.checked import is_finite_number

Duplicates = Literal["refuse", "first", "last"]
SUFFIXES = (
    ".gz",
    ".csv",
    ".txt",
    ".tsv",
    ".bdf",
    ".parquet",
    ".xlsx",
    ".mpt",
    ".mpr",
    ".nda",
    ".ndax",
    ".mat",
)
"""Suffixes of files that are not part of a record's name."""

EXAMPLES = {
    "columns": '{"current_a": "I"}',
    "units": '{"current_a": "mA"}',
    "state_words": '{"E": "discharge"}',
}


@dataclass(frozen=True)
class Reading:
    """The user's statements on files; everything else is taken from their headers.

    columns : quantity, or `state`, `cycle`, `step` -> the file's name for it; None leaves out the temperature, or the
        voltage of a current to simulate; a number states the temperature of every row, degC or as `units` says.
    units : quantity -> unit of the file's column (`mA`, `mV`, `ms`, `h`, `K`, `h:m:s`, `date`, a strptime pattern).
    sign : direction in which the file's current is positive; None: that of the export, else discharge.
    state_words : word of the state column -> charge, discharge or rest, for words that are not known.
    cycle, step : keep the rows with this number, or "from:to".  start_s, stop_s : keep the rows between these times, s.
    duplicates : which of several rows with the same time to keep; None: the first in a known export, whose cyclers
        write the end of a step and the start of the next with the same time; any other file is refused.
    """

    columns: Mapping[str, str | None] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    sign: Sign | None = None
    state_words: Mapping[str, Direction] = field(default_factory=dict)
    cycle: str | None = None
    step: str | None = None
    start_s: float | None = None
    stop_s: float | None = None
    duplicates: Duplicates | None = None

    def __post_init__(self) -> None:
        for quantity, column in by_quantity("columns", self.columns).items():
            if not (column is None or isinstance(column, str)):
                raise DataError(
                    f"the column of {quantity} is {column!r}; give its name as text, or None to leave the quantity out."
                )
        for quantity, unit in by_quantity("units", self.units).items():
            if not isinstance(unit, str):
                raise DataError(
                    f"the unit of {quantity} is {unit!r}; give it as text, as in {EXAMPLES['units']}."
                )
        _check_choice("sign", self.sign, get_args(Sign))
        _check_choice("duplicates", self.duplicates, get_args(Duplicates))
        for name in ("cycle", "step"):
            bounds(name, getattr(self, name))
        for end, time in (("from", self.start_s), ("up to", self.stop_s)):
            if time is not None and not is_finite_number(time):
                raise DataError(
                    f"a record cannot be read {end} {time!r} s; give a time in seconds, or leave it out."
                )

    @property
    def selectors(self) -> tuple[str, ...]:
        """The columns by which rows are chosen: cycle, step."""
        return tuple(name for name in ("cycle", "step") if getattr(self, name) is not None)

    def but(self, **changes: Any) -> Reading:
        """A copy with these fields changed."""
        return replace(self, **changes)


def column_name(given: Any) -> Any:
    """A column as it is given; a number, which states a temperature, as text."""
    if isinstance(given, bool) or not isinstance(given, Real):
        return given
    return str(given)


def by_quantity(name: str, given: Any, of: str = "quantities") -> dict[str, Any]:
    """An argument that has a value for each quantity, as a dict; an empty one for None.

    name, of : of the argument and what its keys are, for the sentence.  Raises DataError where it is no mapping.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        raise DataError(
            f"{name} = {in_words(given)} names no {of}; give a dict from each to its value, as in {EXAMPLES[name]}."
        )
    return dict(given)


def bounds(name: str, text: str | None) -> tuple[float, float] | None:
    """'3' as (3, 3), '3:5' as (3, 5); None for None.  Raises DataError for anything else."""
    if text is None:
        return None
    first, to, last = str(text).partition(":")
    try:
        return float(first), float(last if to else first)
    except ValueError:
        raise DataError(f"{name} = {text!r} has to be a number, or from:to, as in 3 or 3:5.") from None


def record_name(path: str | Path) -> str:
    """Name of the record in a file: W8_0.5C for W8_0.5C.csv.gz."""
    path = Path(path)
    while path.suffix.lower() in SUFFIXES:
        path = path.with_suffix("")
    return path.name


def record_names(paths: Sequence[Path]) -> list[str]:
    """Names of the records in several files, different for different files: equal names get the name of their folder in
    front, and of the folders above as far as needed. Files of the same folder keep their suffix then. A link has its
    own name: that of its target may be a checksum."""
    files = [Path(os.path.abspath(path)) for path in paths]
    names = {file: record_name(file) for file in files}
    beside = Counter((file.parent, name) for file, name in names.items())
    names = {file: file.name if beside[file.parent, name] > 1 else name for file, name in names.items()}
    for depth in range(max((len(file.parts) for file in files), default=0)):
        shared = Counter(names.values())
        names = {
            file: f"{file.parts[-2 - depth]} {name}"
            if shared[name] > 1 and depth < len(file.parts) - 2
            else name
            for file, name in names.items()
        }
    return [names[file] for file in files]


def _check_choice(what: str, value: str | None, choices: tuple[str, ...]) -> None:
    if value is not None and value not in choices:
        raise DataError(f"{what} = {value!r} is unknown; give {' or '.join(choices)}.")
