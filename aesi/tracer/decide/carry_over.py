"""Does a fit carry over to records that it has not seen, and over the range that the cell file declares?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.cell import Cell
from aesi.records import Measurement
from aesi.tracer.case.blocks import RANGES, Blocks
from aesi.tracer.case.problem import INDEPENDENT_CHARGE, InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.model_error import MEASURED_V, MOST_MEASURED_V
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.hypothesis_fits import values_without

ORDINARY_C = (1.0, -0.5)
FAST_C = (2.0, 3.0)
"""C-rates (discharge positive) of full discharges and charges that a model has to run; fast ones can deplete the
electrolyte of a real cell."""
BY_CHANCE = 1.0 + (2.0 / RANGES / INDEPENDENT_CHARGE) ** -0.5
"""Factor by which an RMS error over one range of charge may differ by chance, given how long errors of measured cells
stay correlated: an RMS of N independent samples has a relative standard deviation of one over the root of 2 N."""
LEAST_SHARE = 0.8
"""Least duration of a full discharge, over that of the declared model: a model that runs empty later is already close
to its voltage limit. On development records of `aesi bench real` without their temperature, models
that ran empty at 85 and 90 % of it left 7.1 and 5.0 mV of the last part (declared 22.9), those at 68 and 3 % left
152 and 94 (what was named alone 78)."""
STEP_S = 10.0
"""s between the rows of a full discharge or charge."""


@dataclass(frozen=True)
class LeftOut:
    """Errors of one model on data that it has not seen, V RMS; infinite where it could not be simulated.

    by_record : (k,) on each record, all rows as measured, with the model fitted to the other records.  by_range : (p,)
    on the thinned rows of each record by range of charge, down-weighted where the initial state is too uncertain.
    """

    by_record: tuple[float, ...]
    by_range: tuple[float, ...]

    @property
    def pooled_v(self) -> float:
        """RMS of `by_record`, V."""
        return rms(self.by_record)

    def harms(self, other: LeftOut) -> bool:
        """Whether the model is worse than another one in a range of charge, by more than the usual error of measured
        cells and by more than chance."""
        allowed = np.maximum(np.hypot(other.by_range, MOST_MEASURED_V), BY_CHANCE * np.array(other.by_range))
        return bool(np.any(np.array(self.by_range) > allowed))


def left_out_errors(problem: InverseProblem, blocks: Blocks, one: FittedHypothesis | None) -> LeftOut:
    """The errors of a hypothesis on each record, fitted to the other records; for a single record, on its last third,
    fitted to the rest.

    one : the hypothesis; None takes the declared model.
    """
    folds = blocks.folds["record" if len(problem.records) > 1 else "end"]
    charges = [np.isin(blocks.of_row, charge) for charge in blocks.folds["charge"]]
    weights = np.sqrt(_evidence_weights(problem))
    by_record, by_range = [], []
    for k, fold in enumerate(folds):
        out = np.isin(blocks.of_row, fold)
        whole, seen = _left_out_residuals(problem, blocks, one, k, fold)
        by_record.append(rms(whole))
        weighted = weights[out] * seen
        by_range += [rms(weighted[charge[out]]) for charge in charges if charge[out].any()]
    return LeftOut(tuple(by_record), tuple(by_range))


def _evidence_weights(problem: InverseProblem) -> Array:
    """(n,) weight of each row, 0 to 1, as evidence of a fault of the model, where its record is left out.

    The initial state of such a record (`ModelState.simulated`) is uncertain. Where it changes the voltage by more than
    the usual error of measured cells, as on the knee at the end of a discharge, an error is no evidence against the
    model. The left-out part of a single record begins at the end of the rest, where the state is known.
    """
    if len(problem.records) == 1:
        return np.ones(len(problem.measured))
    return np.asarray(MEASURED_V**2 / (MEASURED_V**2 + problem.start_slope_v**2))


def _left_out_residuals(
    problem: InverseProblem, blocks: Blocks, one: FittedHypothesis | None, k: int, fold: Sequence[int]
) -> tuple[Array, Array]:
    """(residual of all rows as measured (n_whole,), residual of the thinned rows (n_out,)), V, over a fold of record k.
    Where the model fails both are infinite, the first with a single row.

    Thinned rows are means over seconds, which hide a lag of an instrument that the rows as measured show.
    """
    out = np.isin(blocks.of_row[problem.slices[k]], fold)
    record = problem.records[k]
    index = None if len(problem.records) > 1 else k
    state = ModelState(problem)
    try:
        if one is not None:
            state = ModelState(problem, values_without(problem, blocks, one, fold), one.hypothesis)
        whole, seen = (state.simulated(record, index, thin) for thin in (False, True))
    except AesiError:
        return np.full(1, np.inf), np.full(np.count_nonzero(out), np.inf)
    begins_s = record.thin.time_s[: record.n_fit][out][0]
    rows = slice(int(np.searchsorted(record.data.time_s, begins_s)), record.n_fit_whole)
    left_v = (record.data.voltage_v - whole.voltage_v)[rows]
    return left_v, (record.thin.voltage_v - seen.voltage_v)[: record.n_fit][out]


def range_fault(state: ModelState, rates_c: Sequence[float]) -> str | None:
    """Why the model fails on a full discharge or charge that the declared model can run, a clause; None where it runs
    them all: at these C-rates, at the temperatures of the records.

    A particle surface may run out of lithium at the very end of a discharge, with the voltage close to its limit. The
    model is at fault only where it runs out long before the declared one ends.
    """
    declared = ModelState(state.problem)
    for degc, rate_c in product(temperatures_degc(state.problem), rates_c):
        ends_s, fault = _course_end(state, rate_c, degc)
        if fault is not None:
            declared_s, declared_fault = _course_end(declared, rate_c, degc)
            if declared_fault is None and ends_s < LEAST_SHARE * declared_s:
                return fault
    return None


def temperatures_degc(problem: InverseProblem) -> tuple[float | None, ...]:
    """The lowest and the highest measured temperature of the records, degC; (None,) where none was measured."""
    measured = [r.data.temperature_degc for r in problem.records]
    known = [t for t in measured if t is not None]
    if not known:
        return (None,)
    return tuple(dict.fromkeys((float(min(t.min() for t in known)), float(max(t.max() for t in known)))))


def _course_end(state: ModelState, rate_c: float, degc: float | None) -> tuple[float, str | None]:
    """(time at which a full discharge or charge ends, s; a clause where it fails: it cannot be simulated, or the model
    runs empty before its voltage limit; else None)."""
    cell = state.problem.cell
    profile, soc0 = full_course(cell, rate_c, degc)
    time = profile.time_s
    what = f"{'a full discharge' if rate_c > 0 else 'a charge'} at {abs(rate_c):g}C"
    try:
        run = state.problem.run(profile, soc0, state.effects(), "linear")
    except AesiError as error:
        return 0.0, f"{what} cannot be simulated ({str(error).rstrip('.')})"
    over = np.append(np.flatnonzero(_beyond_limit(cell, rate_c, run.voltage_v)), len(time) - 1)[0]
    empty = np.append(np.flatnonzero(run.series["depleted"] > 0), len(time))[0]
    if over <= empty:
        return float(time[over]), None
    return float(time[empty]), (
        f"{what} runs out of lithium or of salt at {time[empty]:g} s, before it reaches its voltage limit"
    )


def full_course(cell: Cell, rate_c: float, degc: float | None) -> tuple[Measurement, float]:
    """(full discharge (rate_c > 0) or charge at constant current, without voltages; state of charge at its first row).

    rate_c : C-rate, 1/h, of the nominal capacity.  degc : temperature, degC, or None. The course moves all charge
    between the stoichiometry limits, which may exceed the nominal capacity: the knee of a discharge lies at its end.
    """
    current_a = rate_c * cell.nominal_capacity_ah
    steps = math.ceil(SECONDS_PER_HOUR * cell.capacity_ah / abs(current_a) / STEP_S)
    time = STEP_S * np.arange(steps + 1, dtype=np.float64)
    current = np.full(len(time), current_a)
    temperature = None if degc is None else np.full(len(time), degc)
    course = Measurement(time, current, np.zeros(len(time)), temperature, name="range")
    return course, 1.0 if rate_c > 0 else 0.0


def _beyond_limit(cell: Cell, rate_c: float, voltage_v: Array) -> BoolArray:
    return voltage_v < cell.lower_voltage_v if rate_c > 0 else voltage_v > cell.upper_voltage_v
