"""Does what was fitted carry over: to records that it has not seen, and over the range that the cell file declares?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import AesiError
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.cell import Cell
from aesi.records import Measurement
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import values_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.likelihood.model_state import ModelState

WORSE = 1.05
"""A hypothesis may leave so much more than the better of the declared and the recalibrated model on a part left out. A
convention: within 5 % two models do as well."""
ORDINARY_C = (1.0, -0.5)
FAST_C = (2.0, 3.0)
"""Full discharges and charges that a model has to be good for; fast ones can deplete the electrolyte of a real cell."""
STEP_S = 10.0
"""Between rows of a full discharge or charge."""


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


def left_out_errors(problem: InverseProblem, blocks: Blocks, one: Explanation | None) -> LeftOut:
    """What a hypothesis leaves on each record at the parameters that the others give (of a single record: on its last
    third), simulated with the whole model at the change to first order; None: the model as declared."""
    many = len(problem.records) > 1
    errors = []
    for k in range(len(problem.records)):
        try:
            if one is None:
                state = ModelState(problem)
            else:
                x = one.point.x + one.score.shifts["record" if many else "end"][k]
                state = ModelState(problem, values_of(one.free, x), tuple(one.hypothesis))
            record = problem.records[k]
            run = state.simulated(record, None if many and one is not None else k, thin=True)
        except AesiError:
            errors.append(np.inf)
            continue
        rows = problem.slices[k]
        residual = (record.thin.voltage_v - run.voltage_v)[: record.n_fit]
        out = np.isin(blocks.of_row[rows], blocks.folds["record" if many else "end"][k])
        errors.append(float(np.sqrt(np.mean(residual[out] ** 2))))
    return LeftOut(tuple(errors))


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
