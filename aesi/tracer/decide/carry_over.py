"""Does what was fitted carry over: to records that it has not seen, and over the range that the cell file declares?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import AesiError
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.cell import Cell
from aesi.records import Measurement
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.free_parameter import coordinates_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import HypothesisFitter
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.states import ModelState

REFIT_STEPS = 4
SEEN_SHARE = 2.0 / 3.0
"""Of a single record, in time: what is fitted where no other record can be left out."""
WORSE = 1.05
"""A hypothesis may leave so much more than the better of the declared and the recalibrated model on a part left out."""
ORDINARY_C = (1.0, -0.5)
FAST_C = (2.0, 3.0)
"""Full discharges and charges that a model has to be good for; fast ones can deplete the electrolyte of a real cell."""
STEP_S = 10.0


@dataclass(frozen=True)
class LeftOut:
    """RMSE by part left out in turn, V: (k,) of one model, infinite where it could not be simulated."""

    rmse_v: tuple[float, ...]

    @property
    def pooled_v(self) -> float:
        """Over all parts, V."""
        return float(np.sqrt(np.mean(np.square(self.rmse_v))))

    def no_worse_than(self, others: Sequence[LeftOut]) -> bool:
        """On every part at most `WORSE` times the best of the others."""
        return all(
            own <= WORSE * min(other.rmse_v[k] for other in others) for k, own in enumerate(self.rmse_v)
        )


def left_out_errors(problem: InverseProblem, one: Explanation | None) -> LeftOut:
    """What a hypothesis, refitted without each record in turn, leaves on it (of a single record: on its last third);
    None: the model as declared, which nothing is fitted of."""
    errors = []
    for part, record, index in _parts(problem):
        try:
            state = ModelState(problem) if one is None else _refitted(part, one)
            run = None if state is None else state.simulated(record, index, thin=True)
        except AesiError:
            run = None
        if run is None:
            errors.append(np.inf)
            continue
        seen = part.records[0].n_fit if index is not None else 0
        rows = slice(seen, record.n_fit)
        errors.append(float(np.sqrt(np.mean((record.thin.voltage_v - run.voltage_v)[rows] ** 2))))
    return LeftOut(tuple(errors))


def _parts(problem: InverseProblem):  # type: ignore[no-untyped-def]
    records = problem.records
    if len(records) > 1:
        for k, record in enumerate(records):
            rest = tuple(r for i, r in enumerate(records) if i != k)
            yield _with(problem, rest, [i for i in range(len(records)) if i != k]), record, None
        return
    (record,) = records
    seen = max(int(SEEN_SHARE * record.n_fit), 2)
    yield _with(problem, (replace(record, n_fit=seen),), [0]), record, 0


def _with(problem: InverseProblem, records: tuple, kept: Sequence[int]) -> InverseProblem:  # type: ignore[type-arg]
    reduction = problem.reduction
    if reduction is not None:
        columns = tuple(reduction.columns_v[k][: r.n_fit] for k, r in zip(kept, records, strict=True))
        reduction = replace(reduction, columns_v=columns)
    return replace(problem, records=records, reduction=reduction)


def _refitted(part: InverseProblem, one: Explanation) -> ModelState | None:
    fitter = HypothesisFitter(part, blocks_of(part), one.hypothesis)
    x = fitter.descend(coordinates_of(fitter.free, dict(one.placed)), one.score.delta_v, REFIT_STEPS)
    fit = fitter.finished(x)
    return None if fit is None else ModelState.of(part, fit)


def range_fault(state: ModelState, rates_c: Sequence[float] = (*ORDINARY_C, *FAST_C)) -> str | None:
    """Why the model cannot be simulated over the range that the cell declares, although the declared model can: full
    discharges and charges at these rates, at the temperatures of the records; None where it can."""
    declared = ModelState(state.problem)
    for temperature in _temperatures(state.problem):
        for rate in rates_c:
            fault = _fault(state, rate, temperature)
            if fault is not None and _fault(declared, rate, temperature) is None:
                return fault
    return None


def _temperatures(problem: InverseProblem) -> tuple[float | None, ...]:
    measured = [r.data.temperature_degc for r in problem.records]
    known = [t for t in measured if t is not None]
    if not known:
        return (None,)
    return tuple({float(min(t.min() for t in known)), float(max(t.max() for t in known))})


def _fault(state: ModelState, rate: float, temperature: float | None) -> str | None:
    """A sentence where the model runs empty before the voltage reaches its limit."""
    cell = state.problem.cell
    hours = 1.0 / abs(rate)
    time: Array = np.arange(0.0, hours * SECONDS_PER_HOUR, STEP_S)
    current = np.full(len(time), rate * cell.nominal_capacity_ah)
    kelvin = None if temperature is None else np.full(len(time), temperature)
    profile = Measurement(time, current, np.zeros(len(time)), kelvin, name="range")
    what = f"{'a full discharge' if rate > 0 else 'a charge'} at {abs(rate):g}C"
    try:
        run = state.problem.run(profile, 1.0 if rate > 0 else 0.0, state.effects(), "linear")
    except AesiError as error:
        return f"{what} cannot be simulated: {error}"
    if not np.isfinite(run.voltage_v).all():
        return f"{what} has no finite voltage"
    empty = np.flatnonzero(run.series["depleted"] > 0)
    if not len(empty):
        return None
    over = np.flatnonzero(_beyond_limit(cell, rate, run.voltage_v))
    if len(over) and over[0] <= empty[0]:
        return None
    return (
        f"{what} runs out of lithium or of salt at {time[empty[0]]:g} s, before it reaches its voltage limit"
    )


def _beyond_limit(cell: Cell, rate: float, voltage_v: Array) -> BoolArray:
    return voltage_v < cell.lower_voltage_v if rate > 0 else voltage_v > cell.upper_voltage_v
