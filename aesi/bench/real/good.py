"""Cases with known-good records of the same cell: the faults of the plan again, and records without a fault."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aesi.bench.real.case import RealCase, Take
from aesi.data.catalogue import HG2, NMC, PANASONIC

GOOD: dict[str, tuple[str, ...]] = {
    HG2: ("25degC_mixed3",),
    PANASONIC: ("25degC_cycle_3",),
    NMC: ("C2", "1C"),
}
"""Data set -> its known-good records: another drive of the kind that the faults are added to, or discharges if there is
no other."""
WITHOUT_FAULT: dict[str, tuple[str, ...]] = {
    HG2: ("25degC_la92", "25degC_us06", "25degC_cap_1c_b"),
    PANASONIC: ("25degC_hwfet", "25degC_cycle_2", "25degC_us06"),
    NMC: (),
}
"""Data set -> records for the cases without a fault. The record that the faults are added to is one in addition."""


def beside_good(cases: Sequence[RealCase]) -> list[RealCase]:
    """Each case with a fault in the record, with the known-good records of its cell added; then the cases without a
    fault.  cases : of the plan."""
    faulty = [c for c in cases if c.fault is not None and c.fault.kind != "capacity_in_file"]
    first = {c.take.set: c for c in reversed(faulty)}
    return [
        *(
            replace(
                c,
                name=f"beside-{c.name}",
                group="fault_beside",
                good=_good(c),
                matched=_nothing(c, c.take.file),
            )
            for c in faulty
        ),
        *(
            _without_fault(first[cell], file)
            for cell, files in WITHOUT_FAULT.items()
            for file in (first[cell].take.file, *files)
        ),
    ]


def _without_fault(case: RealCase, file: str) -> RealCase:
    return replace(
        case,
        name=_nothing(case, file),
        group="control_beside",
        take=replace(case.take, file=file),
        soc0=1.0,
        answers=(),
        source="the same cell at the same temperature, nothing added",
        parameters={},
        fault=None,
        good=_good(case),
        matched=None,
    )


def _good(case: RealCase) -> tuple[Take, ...]:
    return tuple(Take(case.take.set, file) for file in GOOD[case.take.set])


def _nothing(case: RealCase, file: str) -> str:
    return f"beside-nothing-{case.take.set}-{file}"
