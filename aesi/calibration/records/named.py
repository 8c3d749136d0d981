"""Unique names for the records of a calibration, which are the keys of all that is given and found for a record."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import count

from aesi.errors import DataError
from aesi.records import Measurement


def uniquely_named(
    records: Sequence[Measurement], given: Mapping[str, Mapping[str, object]]
) -> tuple[Measurement, ...]:
    """The records; those that share a name are numbered: `us06 (1)`, `us06 (2)`.

    given : what it is, in a word ("temperature") -> record name -> what the user gave for that record.
    Raises DataError where something is given under a name that several records share.
    """
    counts = Counter(record.name for record in records)
    for what, by_name in given.items():
        for name in by_name:
            if counts[name] > 1:
                raise DataError(
                    f"the {what} of {name}: {counts[name]} records have this name; give each one of its own."
                )
    taken = {name for name, many in counts.items() if many == 1}
    out = []
    for record in records:
        name = record.name
        if counts[name] > 1:
            name = next(free for k in count(1) if (free := f"{record.name} ({k})") not in taken)
            taken.add(name)
        out.append(record if name == record.name else replace(record, name=name))
    return tuple(out)
