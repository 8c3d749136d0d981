"""Records without a temperature that the declared cell could have given in the cold.

A cell in the cold drops by more and is cut off earlier: at the temperature that its file declares, its record looks
like that of a smaller cell. What is missing is then the temperature, which a discovery can find. So before a record is
refused, it is simulated by the declared cell at lower temperatures, and by cells of other sizes at the declared one. It
is refused where none of these temperatures fits best and allows the file's capacity, and where another size explains
its voltage better.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import AesiError, DataError
from aesi.numerics.metrics import rms
from aesi.physics import initial_state, simulate
from aesi.physics.effects import CATALOGUE
from aesi.physics.effects.ambient_temperature import depends_on_temperature
from aesi.physics.record_checks import check_measured
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement

COLD = CATALOGUE["ambient_temperature"]
"""What a record may be explained by, within its own bounds."""
STEP_K = 5.0
"""K between the temperatures that are tried."""
SIZES = np.geomspace(1.0 / 16.0, 2.0, 16)
"""Sizes of other cells that are tried, over the declared one. 18 measured records of an LG 18650HG2 and a Panasonic
NCR18650PF at -20 to 2 degC that do not fit the files of their cells at 25 degC are 66 to 162 mV off at the best
temperature, which is -25 to 5 degC, and at least 1.4 times as much with the best size; of a 12.5 Ah pouch cell with
the file of one of 30 Ah it is the other way round."""


def with_cold_admitted(case: Case) -> Case:
    """The case, with a note on each record that can be of its cell only if that was colder than declared.

    Raises DataError for a record that cannot be of the cell: at any temperature, or, if `ambient_temperature` is not
    among the effects that are tried or the record has a temperature, at the declared or measured one.
    """
    declared, searched = case.declared(), COLD.id in case.tried()
    given = replace(declared, model=case.model or declared.model)
    return case.with_each(lambda record: _admitted(given, record, case.soc0, searched))


def _admitted(given: HybridModel, record: Measurement, soc0: float | None, searched: bool) -> Measurement:
    """The record, with a note where it is of the cell only in the cold.  Raises DataError where it cannot be at all."""
    try:
        check_measured(given.cell, [record])
    except DataError:
        found = _in_the_cold(given, record, soc0) if searched and record.temperature_degc is None else None
        if found is None:
            raise
        return replace(record, notes=(*record.notes, found))
    return record


def _in_the_cold(given: HybridModel, record: Measurement, soc0: float | None) -> str | None:
    """A sentence on why the record can be of a colder cell; None where it cannot."""
    coldest, _ = COLD.parameters["shift_k"].bounds
    acts = any(one.id == COLD.id for one in given.effects)
    if acts or not depends_on_temperature(given.cell) or not _allowed(given, record, coldest):
        return None
    shifts = np.arange(-STEP_K, coldest - 0.5 * STEP_K, -STEP_K)
    colder_v = [_error_v(given, record, soc0, shift_k=float(shift)) for shift in shifts]
    best = int(np.argmin(colder_v))
    at_the_end = best == len(shifts) - 1  # where colder would be better
    if at_the_end or not _allowed(given, record, shifts[best]):
        return None
    sizes_v = [_error_v(given, record, soc0, size=float(size)) for size in SIZES]
    if min(sizes_v) <= colder_v[best]:
        return None
    declared = given.cell.initial_temperature_k - ZERO_CELSIUS_K
    return (
        f"{record.name}: its charge and voltages are not those of {given.cell.name} at the {declared:.4g} degC that "
        f"its file declares, but can be at some {declared + shifts[best]:.0f} degC: it was cold, or it is another "
        "cell's; a column temperature_degc would tell."
    )


def _allowed(given: HybridModel, record: Measurement, shift_k: float) -> bool:
    """Whether charge and voltages allow the file's capacity at `shift_k` from the declared temperature."""
    degc = given.cell.initial_temperature_k + shift_k - ZERO_CELSIUS_K
    try:
        check_measured(given.cell, [replace(record, temperature_degc=np.full(len(record), degc))])
    except DataError:
        return False
    return True


def _error_v(
    given: HybridModel, record: Measurement, soc0: float | None, *, shift_k: float = 0.0, size: float = 1.0
) -> float:
    """V RMS of a cell `size` times as large as the declared one, at `shift_k` from its temperature; infinite where it
    cannot be simulated."""
    effects = (*given.effects, COLD.activate(shift_k=shift_k))
    record = replace(record, current_a=record.current_a / size)  # all else of a cell goes with its area
    hold = record.hold_taken
    try:
        start = initial_state(given.cell, record, soc0, hold, effects, shared=True, model=given.model)
        run = simulate(
            given.cell,
            record.time_s,
            record.current_a,
            start.soc,
            effects,
            None,
            hold,
            on_depletion="clip",
            model=given.model,
        )
    except AesiError:
        return float("inf")
    return rms(record.voltage_v - run.voltage_v)
