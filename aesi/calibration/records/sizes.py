"""The capacity of a record's cell: by the charge that a full discharge takes, and by the one that fills it.

A full discharge needs no model and no potential, but is a test of the capacity: from full to empty, without a load that
ends it early, and not in the cold. So it tells, too, whether the records of one run can be of one cell. A charge that
ends at the upper cut-off voltage ends full by definition, at any rate and temperature; the state of charge that it
begins at is read from its voltage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.advice import listed
from aesi.calibration.start import NEAR_THE_SIZE, charge_hold, emptied_ah, full_discharge_ah
from aesi.errors import DataError
from aesi.physics.cell import Cell
from aesi.physics.cell.health import LEAST_SOH, MOST_SOH
from aesi.physics.initial_state import REST_C_RATE, InitialState, initial_state
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
AGED = 0.92
"""Least share of the capacity in the cell's file that a discharge to empty shows without a note. With the shipped files
of their own cells, a Panasonic NCR18650PF and an LG 18650HG2, measured ones at 1C and C/20 show 0.934 to 1.044; the
last 1C discharge of that Panasonic, which took 2.43 Ah after its drives and 2.80 Ah before, shows 0.89 and 0.91."""

AGED_SDS = 2.0
"""Deviations that the capacity of a charge to full is from the file's at least where a note tells it. A convention."""


def capacity_test_ah(cell: Cell, record: Measurement) -> float | None:
    """Charge of a full discharge between the cut-offs of a cell, Ah, as the capacity of the record's cell; None where
    the record has no full discharge, or one that was faster than `FASTEST_C` or may have been too cold to show it."""
    charge_ah = full_discharge_ah(cell, record)
    return charge_ah if charge_ah is not None and _tells_capacity(record, charge_ah) else None


@dataclass(frozen=True)
class ChargedShare:
    """Capacity of a cell as a charge to full shows it.

    share, sd : of the capacity in the cell's file, and its standard deviation.  charge_ah : brought by the record, Ah.
    """

    share: float
    sd: float
    charge_ah: float


def charged_share(cell: Cell, record: Measurement, start: InitialState) -> ChargedShare | None:
    """Capacity of the cell by a record that ends with a charge to full; None for other records, and for one that starts
    under a load or too soon after one. Its state is then read from the first minutes of the charge, which are on
    another branch of the open-circuit voltage than the file. Of 35 charges of a Panasonic NCR18650PF the 29 that begin
    at rest show the share of their day within 0.015 RMS, the six others within 0.035.

        share = charge brought / (capacity of the file (1 - state of charge at the first row))

    start : of the record, in the windows of the file.
    """
    full = _full_at_end(cell, record)
    if full is None or start.basis == "load" or start.soc >= 1.0:
        return None
    row, full_sd = full
    charge_ah = -float(record.discharged_ah(record.hold_taken)[row])
    if charge_ah <= 0.0:
        return None  # it ends no fuller than it began
    share = charge_ah / (cell.capacity_ah * (1.0 - start.soc))
    return ChargedShare(share, share * float(np.hypot(start.sd, full_sd)) / (1.0 - start.soc), charge_ah)


def ends_full(cell: Cell, record: Measurement) -> bool:
    """Whether a record ends with a charge to full, of which `charged_share` tells the capacity."""
    return _full_at_end(cell, record) is not None


def _full_at_end(cell: Cell, record: Measurement) -> tuple[int, float] | None:
    """(index of the first row of the rest that ends a record, standard deviation of the state of charge of 1 there),
    where a charge to full came before; None elsewhere."""
    flows = np.flatnonzero(np.abs(record.current_a) > REST_C_RATE * cell.capacity_ah)
    if not len(flows) or flows[-1] + 1 == len(record) or record.current_a[flows[-1]] > 0.0:
        return None
    first = int(flows[-1]) + 1
    try:
        end = initial_state(cell, record.take(slice(first, None)))
    except DataError:  # a voltage of no state of this cell
        return None
    return (first, end.sd) if end.basis == "full charge" else None


def aged_sentence(cell: Cell, record: Measurement, start: InitialState) -> str:
    """A sentence where a record shows another capacity than the cell's file has; '' elsewhere.

    A charge to full does where the two are more than `AGED_SDS` deviations apart. A discharge to empty does below
    `AGED` of the file's, but not where the load or the cold may have ended it (`capacity_test_ah`), nor where it takes
    less than `NEAR_THE_SIZE` of that capacity, which makes much of an error of the state of charge that it starts at.

    start : of the record.
    """
    charged = charged_share(cell, record, start)
    if charged is not None:
        # Beyond these limits it is another cell's record, which other messages say.
        apart = abs(charged.share - 1.0) > AGED_SDS * charged.sd and LEAST_SOH <= charged.share <= MOST_SOH
        return _charged_sentence(cell, record, start, charged) if apart else ""
    return _discharged_sentence(cell, record, start.soc)


def _charged_sentence(cell: Cell, record: Measurement, start: InitialState, charged: ChargedShare) -> str:
    return (
        f"{record.name}: from a state of charge of {start.soc:.3f} it is full after {charged.charge_ah:.3g} Ah, as a "
        f"cell with {charged.share:.3f} +/- {charged.sd:.3f} of the {cell.capacity_ah:.3g} Ah in the cell's file; if "
        f"it has aged, --soh {charged.share:.3f} takes it so."
    )


def _discharged_sentence(cell: Cell, record: Measurement, soc0: float) -> str:
    taken_ah = record.discharged_ah(charge_hold(record))
    charge_ah = emptied_ah(cell, record, taken_ah, 0, len(record))
    if charge_ah is None or not _tells_capacity(record, charge_ah):
        return ""
    held_ah = soc0 * cell.capacity_ah  # 0 at the start of a charge from empty
    if charge_ah < NEAR_THE_SIZE * cell.capacity_ah or charge_ah >= AGED * held_ah:
        return ""
    share = charge_ah / held_ah
    return (
        f"{record.name}: from a state of charge of {soc0:.3f} it is empty after {charge_ah:.3g} Ah, as a cell with "
        f"{share:.2f} of the {cell.capacity_ah:.3g} Ah in the cell's file; if it has aged, --soh {share:.2f} takes it "
        "so."
    )


def _tells_capacity(record: Measurement, charge_ah: float) -> bool:
    """Whether a discharge to empty, of that charge, was slow and warm enough for that to be what the cell holds."""
    fastest_a, degc = float(np.max(record.current_a)), record.temperature_degc
    if degc is None:
        return fastest_a <= SLOW_C * charge_ah
    warm = float(np.min(degc[record.current_a > 0.0], initial=np.inf)) >= COLD_DEGC
    return warm and fastest_a <= FASTEST_C * charge_ah


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
