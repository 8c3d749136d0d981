"""Approximations of the model itself (numerics, reduction to a single particle), settled before the search."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.physics.simulation import ModelName
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE
from aesi.tracer.case.problem import InverseProblem, ValuesByOwner

MODELS: tuple[ModelName, ModelName] = ("espm", "dfn")

NOTABLE_SHARE = 0.1
"""Share of the noise: an approximation that moves the voltage by more (RMS) is undone in every hypothesis. A
convention: one that moves it by less raises an error by half a percent at most."""
LEAST_V = 1e-4
"""RMS difference of two solvers of one model, V: 99 of 100 right hypotheses err by less
(`python -m aesi.bench.solver_error`)."""


def with_fine_numerics(problem: InverseProblem) -> InverseProblem:
    """The problem on a finer basis and shorter steps, where the declared ones move the voltage notably."""
    finer = next((e for e in problem.effects.values() if e.refines == "discretisation"), None)
    if finer is None:
        return problem
    effects = (*problem.fixed, finer.activate())
    moved = []
    for record, data in zip(problem.records, problem.fit_parts, strict=True):
        coarse = problem.run(data, record.soc0, problem.fixed, record.thin_hold).voltage_v
        moved.append(problem.run(data, record.soc0, effects, record.thin_hold).voltage_v - coarse)
    shift = rms(np.concatenate(moved))
    if shift > NOTABLE_SHARE * problem.noise_v:
        return replace(problem, fixed=effects)
    return with_approximation_kept(problem, shift)


def with_approximation_kept(problem: InverseProblem, shift_v: float) -> InverseProblem:
    """The problem, with a further approximation of its model kept, which moves the voltage by `shift_v` (V RMS)."""
    return replace(problem, approximated_v=float(np.hypot(problem.approximated_v, shift_v)))


@dataclass(frozen=True)
class Reduction:
    """Difference of the single particle model and the porous electrode model of one cell.

    shift_v : RMS difference of the voltages over the fitted rows, V.  noise_v : noise of these rows, V, with the
    uncertainty from thinning.  of : which cell, in words.
    """

    shift_v: float
    noise_v: float
    of: str

    @property
    def notable(self) -> bool:
        """True where the difference is too large to be neglected."""
        return self.shift_v > max(NOTABLE_SHARE * self.noise_v, LEAST_V)

    @property
    def sentence(self) -> str:
        """How far the two models differ, compared with the noise: a clause for messages."""
        times = self.shift_v / self.noise_v
        return (
            f"the porous electrode (dfn) and the single particle (espm) of {self.of} differ by "
            f"{MV_PER_V * self.shift_v:.2f} mV RMS here, {f'{times:.0f}' if times >= 10.0 else f'{times:.2g}'} times "
            f"the noise of the rows that are fitted ({MV_PER_V * self.noise_v:.2f} mV)"
        )


def reduction_of(problem: InverseProblem, values: ValuesByOwner | None = None) -> Reduction | None:
    """The difference of the two models of a cell on its records. None where one of them cannot be simulated, or where
    the declared model already holds an effect that undoes the reduction.

    values : owner -> name -> value of a fitted hypothesis; None takes the declared cell.
    """
    if any(active.effect.refines == "reduction" for active in problem.fixed):
        return None
    declared = {STATE_OF_CHARGE: {str(i): record.soc0 for i, record in enumerate(problem.records)}}
    reduced_v, full_v = (
        replace(problem, model=name).predict(declared if values is None else values) for name in MODELS
    )
    if reduced_v is None or full_v is None:
        return None
    shift_v = rms(full_v - reduced_v)
    return Reduction(shift_v, problem.noise_v, "the declared cell" if values is None else "what was found")
