"""What the model itself approximates, settled before anything is sought in the cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from aesi.physics.effect import Effect
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE
from aesi.tracer.case.problem import InverseProblem, ReductionError, ValuesByOwner

NOTABLE_SHARE = 0.1
"""Of the noise: an approximation that moves the voltage by more than this is taken back in every hypothesis."""


def _refining(effects: Mapping[str, Effect], what: str) -> Effect | None:
    return next((effect for effect in effects.values() if effect.refines == what), None)


def with_fine_numerics(problem: InverseProblem) -> InverseProblem:
    """The problem on a finer basis and shorter steps, where the declared ones move the voltage notably."""
    finer = _refining(problem.effects, "discretisation")
    if finer is None:
        return problem
    effects = (*problem.fixed, finer.activate())
    moved = []
    for record, data in zip(problem.records, problem.seen, strict=True):
        coarse = problem.run(data, record.soc0, problem.fixed, record.thin_hold).voltage_v
        moved.append(problem.run(data, record.soc0, effects, record.thin_hold).voltage_v - coarse)
    shift = float(np.sqrt(np.mean(np.concatenate(moved) ** 2)))
    return replace(problem, fixed=effects) if shift > NOTABLE_SHARE * _noise_v(problem) else problem


def with_reduction_error(problem: InverseProblem, values: ValuesByOwner) -> InverseProblem:
    """The problem with what the declared porous electrode has beyond the reduced model, at these values, as a column;
    as it was where that is not notable."""
    effect = _refining(problem.effects, "reduction")
    if effect is None or effect.id in {a.id for a in problem.fixed}:
        return problem
    full = effect.activate(**{name: p.bounds[1] for name, p in effect.parameters.items()})
    values = {owner: given for owner, given in values.items() if owner != effect.id}
    active = problem.active(values)
    columns = []
    for i, (record, data) in enumerate(zip(problem.records, problem.seen, strict=True)):
        soc0 = values[STATE_OF_CHARGE][str(i)]
        reduced = problem.run(data, soc0, active, record.thin_hold).voltage_v
        columns.append(problem.run(data, soc0, (*active, full), record.thin_hold).voltage_v - reduced)
    size = float(np.sqrt(np.mean(np.concatenate(columns) ** 2)))
    if not np.isfinite(size) or size <= NOTABLE_SHARE * _noise_v(problem):
        return replace(problem, reduction=None)
    return replace(problem, reduction=ReductionError(effect, tuple(columns)))


def _noise_v(problem: InverseProblem) -> float:
    return float(np.sqrt(np.mean(problem.white_v**2)))
