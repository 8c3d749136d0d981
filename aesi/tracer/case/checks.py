"""Checks that a case can be decided at all, made before any hypothesis is fitted; an error is one sentence."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aesi.constants import MV_PER_V
from aesi.errors import AesiError, DataError
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.physics.start.charge import check_charge
from aesi.records import Run
from aesi.tracer.case.blocks import BLOCKS
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import PreparedRecord

FEWEST_SAMPLES = 200
"""Fewest fitted rows of a record shorter than ten times SHORTEST_S. A longer one needs only `BLOCKS` rows."""
SHORTEST_S = 300.0
"""Shortest record: in less, neither diffusion nor the slope of the open-circuit voltage shows."""
LEAST_C_RATE = 0.02
"""A record whose current stays below this C-rate holds no load: its overpotential is within the errors of open-circuit
potentials. A convention, like the rate below which a current counts as a rest (`aesi.physics.initial_state`)."""
FOREIGN_CELL_V = 0.25
"""Median absolute error, V, below which a model of the right chemistry stays, however badly parametrised. The
file of an LG M50, sized to cells of other makes, errs by 50 to 115 mV RMS on their drives from 10 to 40 degC
(`aesi bench cells`, declared; docs/cells.md). At 0 degC and below it errs by 100 mV and more, 468 at worst."""
CONDITIONS = 5
"""Number of values, evenly over its range, that are tried for a quantity that was not measured: a cell at -10 degC
without a measured temperature is off by 290 mV."""


def check_compared(problem: InverseProblem) -> None:
    """Raises DataError where no record that is known to be good has been at the states of charge of the others."""
    if problem.has_good and not (problem.compared & problem.good_rows).any():
        others = ", ".join(r.name for r in problem.records if not r.good)
        raise DataError(
            f"no record that is known to be good passes through the states of charge of {others}, so that it says "
            "nothing of the model's error there; give one that does."
        )


def check_record(cell: Cell, record: PreparedRecord) -> None:
    """Raises DataError for a record that is too short, or that asks for more charge than the cell has."""
    thin = record.thin
    until = min(record.fit_until_s, thin.time_s[-1])
    duration = float(until - thin.time_s[0])
    fewest = FEWEST_SAMPLES if duration < 10 * SHORTEST_S else BLOCKS
    if record.n_fit < fewest or duration < SHORTEST_S:
        kept_back = len(thin) - record.n_fit
        beside = f" ({kept_back} more kept back for the test)" if kept_back else ""
        raise DataError(
            f"{record.name}: {duration:.0f} s and {record.n_fit} rows to fit{beside} are too little to decide; "
            f"give at least {fewest} rows over {max(SHORTEST_S, np.floor(duration)):.0f} s for the fit."
        )
    rate = float(np.max(np.abs(thin.current_a[: record.n_fit]))) / cell.nominal_capacity_ah
    if rate < LEAST_C_RATE:
        raise DataError(
            f"{record.name}: the current never exceeds {rate:.2g} C, so the cell does not respond and nothing can be "
            "decided; give data with load steps."
        )
    check_charge(cell, record.data, record.soc0, record.hold)


def check_same_cell(problem: InverseProblem, record: PreparedRecord, declared: Run) -> None:
    """Raises DataError where the declared model is so far off that the data must come from another cell.

    declared : simulation of the declared model over the thinned rows (n_thin,).  Where the record lacks a quantity that
    an effect infers (temperature), the error is raised only if the model is as far off at every value tried.
    """
    typical = _typical_v(record, declared.voltage_v)
    if typical <= FOREIGN_CELL_V:
        return
    for condition in _unmeasured(problem, record):
        try:
            run = problem.run(record.thin, record.soc0, (*problem.fixed, condition), record.thin_hold)
        except AesiError:
            continue
        if _typical_v(record, run.voltage_v) <= FOREIGN_CELL_V:
            return
    empty = declared.series["depleted"] > 0.0
    ends = (
        f", and runs empty or full at {stamp(record.thin.time_s[np.argmax(empty)])} s" if empty.any() else ""
    )
    raise DataError(
        f"{record.name}: the model of {problem.cell.name} is {MV_PER_V * typical:.0f} mV off in the median, which no "
        f"single effect does{ends}; the file seems to come from another cell, or soc0 or the temperature is wrong."
    )


def _typical_v(record: PreparedRecord, voltage_v: Array) -> float:
    return float(np.median(np.abs(record.thin.voltage_v - voltage_v)))


def _unmeasured(problem: InverseProblem, record: PreparedRecord) -> Iterator[ActiveEffect]:
    """The effects that infer a quantity which the record lacks (its temperature), each active at `CONDITIONS` values
    over the range of its one parameter; effects with more parameters are skipped."""
    for effect in problem.effects.values():
        if effect.infers is None or record.data.temperature_degc is not None or len(effect.parameters) != 1:
            continue
        (name, parameter), *_ = effect.parameters.items()
        for value in np.linspace(*parameter.bounds, CONDITIONS):
            yield effect.activate(**{name: float(value)})
