"""What a case on measured records is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from aesi.bench.real.faults import FaultKind

Group = Literal[
    "withheld", "fault", "physics", "ageing", "witness", "control", "fault_beside", "control_beside"
]
"""`beside`: with a record of the cell beside it that is known to be good."""


@dataclass(frozen=True)
class Take:
    """A record of a data set, or its first `stop_s` seconds.

    temperature : whether the finder is given the thermocouple.
    """

    set: str
    file: str
    stop_s: float | None = None
    temperature: bool = True


@dataclass(frozen=True)
class Fault:
    """What is put into the record (or into the cell file) and by how much, SI."""

    kind: FaultKind
    size: float


@dataclass(frozen=True)
class RealCase:
    """One case.

    cell : a file in the folder of cell files, or `set:file` of a data set.
    answers : any of these effects is the right name; none where no name is right.
    parameters : parameter of an effect -> its true value.  measured : where the true value is itself read off a
    record: 'temperature' (the thermocouple), 'capacity' (share lost against the record in `against`) or 'declared
    capacity' (share that the record in `against` lacks of what the file declares).
    spectra : file of impedance in the record's set, taken beside the record.
    good : records of the same cell that the finder is told to be good.
    matched : the case that is the same without what was put in or withheld.
    source : of the answer.  development : whether its figures choose anything.
    """

    name: str
    group: Group
    cell: str
    take: Take
    soc0: float | None
    answers: tuple[str, ...]
    source: str
    parameters: Mapping[str, float] = field(default_factory=dict)
    fault: Fault | None = None
    measured: Literal["temperature", "capacity", "declared capacity"] | None = None
    against: Take | None = None
    spectra: str | None = None
    good: tuple[Take, ...] = ()
    matched: str | None = None
    development: bool = False
