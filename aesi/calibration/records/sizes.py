"""Whether the records of one run can be of one cell, by the charge that a full discharge takes.

It needs no model and no potential, but a test of the capacity: from full to empty, without a load that ends it early,
and not in the cold.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aesi.advice import listed
from aesi.calibration.start import full_discharge_ah
from aesi.physics.cell import Cell
from aesi.physics.record_checks import COLD_DEGC
from aesi.records import Measurement

FASTEST_C = 1.25
"""Largest C-rate, of its own charge, of a discharge that counts: 1C as of the nominal capacity is 1.1C of an LG
18650HG2 that holds less. Drives are cut off under their peaks, of a Panasonic NCR18650PF at 84 % of its charge at
C/20."""
SLOW_C = 0.1
"""Largest C-rate of a discharge that counts without a temperature: at -20 degC an LG 18650HG2 still gives 90 % of its
charge at C/20, and at 1C 58 %."""
OF_ONE_CELL = 0.7
"""Least ratio of two such discharges, or of one to the capacity in the file, that is not noted. Of 229 measured records
of five cells nine hold one; in those of one cell, and beside its file, it is 0.90 at least. Beside an LG M50T or its
file an 18650 has 0.52 to 0.61. A cell may age by as much, which the note says."""


def capacity_test_ah(cell: Cell, record: Measurement) -> float | None:
    """Charge of a full discharge between the cut-offs of a cell that tells the capacity of the record's cell, Ah; None
    where the record holds none, was loaded faster than `FASTEST_C`, or was or may have been too cold for that."""
    charge_ah = full_discharge_ah(cell, record)
    if charge_ah is None:
        return None
    fastest_a, degc = float(np.max(record.current_a)), record.temperature_degc
    if degc is None:
        return charge_ah if fastest_a <= SLOW_C * charge_ah else None
    warm = float(np.min(degc[record.current_a > 0.0], initial=np.inf)) >= COLD_DEGC
    return charge_ah if warm and fastest_a <= FASTEST_C * charge_ah else None


def other_sizes(cell: Cell, records: Sequence[Measurement]) -> dict[str, float]:
    """Name of a record -> charge of its full discharge, Ah, for those that take less than `OF_ONE_CELL` of the largest
    one; empty where none does."""
    return _smaller(_capacities_ah(cell, records))


def sizes_sentence(cell: Cell, records: Sequence[Measurement], file_ah: float = 0.0) -> str:
    """A sentence on the records that `other_sizes` has; '' where there is none.

    file_ah : capacity in the cell's file, which counts as a full discharge; 0 for none.
    """
    capacities = _capacities_ah(cell, records)
    others = _smaller(capacities, file_ah)
    if not others:
        return ""
    name = max(capacities, key=lambda one: capacities[one])
    charges = listed([f"{charge:.3g}" for charge in others.values()])
    if file_ah >= capacities[name]:
        largest, beside = file_ah, f"the file of {cell.name} has {file_ah:.3g}"
    else:
        largest, beside = capacities[name], f"one in {name} takes {capacities[name]:.3g}"
    lost = 100.0 * (1.0 - min(others.values()) / largest)
    whose = "the record is" if len(others) == 1 else "the records are"
    return (
        f"{listed(list(others))}: a full discharge takes {charges} Ah, and {beside}: {whose} of another cell, or the "
        f"cell had lost {lost:.0f} % of its capacity by then."
    )


def _capacities_ah(cell: Cell, records: Sequence[Measurement]) -> dict[str, float]:
    found = {record.name: capacity_test_ah(cell, record) for record in records}
    return {name: charge for name, charge in found.items() if charge is not None}


def _smaller(capacities_ah: Mapping[str, float], file_ah: float = 0.0) -> dict[str, float]:
    largest = max([file_ah, *capacities_ah.values()])
    return {name: charge for name, charge in capacities_ah.items() if charge < OF_ONE_CELL * largest}
