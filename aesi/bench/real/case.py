"""Description of one case of `aesi bench real`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from aesi.bench.real.faults import FaultKind

Group = Literal[
    "withheld", "fault", "physics", "ageing", "witness", "control", "fault_beside", "control_beside"
]
"""Kind of a case.

withheld : a temperature column is withheld.  fault : an instrument fault is added.  physics : a contact resistance is
added to the record, or capacity to the cell file.  ageing : the cell has lost capacity, or is fresh.  witness : an
impedance spectrum was measured beside the record.  control : nothing is added or withheld.  fault_beside and
control_beside : as fault (and contact resistance) and control, with a known-good record of the cell given to the
tracer.
"""


@dataclass(frozen=True)
class Take:
    """A record that a case uses.

    set, file : data set and record.  stop_s : s, only the rows up to this time are used; None uses all.
    temperature : whether the tracer is given the temperature column.
    """

    set: str
    file: str
    stop_s: float | None = None
    temperature: bool = True


@dataclass(frozen=True)
class Fault:
    """A fault that is added to the record or to the cell file.  size : in the unit that `faults` gives for its kind."""

    kind: FaultKind
    size: float


@dataclass(frozen=True)
class RealCase:
    """One case.

    cell : name of a file in the folder of cell files, or `set:file` of a data set.  take : the record.
    soc0 : state of charge at its first row, 0 to 1; None if unknown.
    answers : effects each of which is a right answer; empty if no effect may be named.
    source : where the answer is known from, in words.
    parameters : `effect.parameter` -> true value, SI.  fault : what is added to the record or the cell file.
    measured : how a true value is read off a record: 'temperature' (mean of the thermocouple), 'capacity' (share lost
    against the record in `against`) or 'declared capacity' (share that the record in `against` lacks of the capacity of
    the file).  spectra : impedance file in the data set of the record, measured beside it.
    good : records of the same cell that the tracer is told to be good.
    matched : name of the control without the fault, or with the withheld column.
    development : whether the figures of this case may choose rules and defaults.
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
