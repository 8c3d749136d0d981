"""How much a hypothesis explains that it has not seen, and whether a meaningless term would explain as
much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.tracer.fit import Fit, Fitter
from aesi.tracer.problem import Problem

BLOCKS = 10
PLACEBOS = 12
REFITS = 3
REFIT_STEPS = 3
"""Of a refit, which starts where all data ended."""


def blocks_of(problem: Problem, count: int = BLOCKS) -> list[Array]:
    """Rows of `count` contiguous blocks, shared among the records by their length."""
    total = sum(r.n_fit for r in problem.records)
    blocks: list[Array] = []
    for rows in problem.slices:
        length = rows.stop - rows.start
        pieces = max(1, round(count * length / total))
        blocks += [b for b in np.array_split(np.arange(rows.start, rows.stop), pieces) if len(b)]
    return blocks


def held_out_residual(problem: Problem, fit: Fit) -> Array:
    """(n,) V: the residual of each block at the parameters that the other blocks give.

    The model is taken as linear around the fit, which is exact to the order of the parameters' change when a
    block is left out; no simulation is spent.
    """
    free = _movable(fit)
    bounds = np.array([k.working_bounds for k in fit.knobs])[free]
    room = bounds - fit.x[free][:, None]
    return _held_out(problem, fit, fit.residual_v, fit.jacobian[:, free], _prior(fit)[free], room)


def _prior(fit: Fit) -> Array:
    """Precision of each knob before any data: of its tolerance or expected size, or that of its flat range."""
    width = np.array([np.ptp(k.working_bounds) for k in fit.knobs])
    root = _pull(fit)
    return np.where(root > 0, root**2, 12.0 / width**2)


def _pull(fit: Fit) -> Array:
    return np.array([k.prior_root for k in fit.knobs])


def _movable(fit: Fit) -> IntArray:
    bounds = np.array([k.working_bounds for k in fit.knobs])
    return np.flatnonzero((fit.x > bounds[:, 0]) & (fit.x < bounds[:, 1]))


def _held_out(
    problem: Problem, fit: Fit, residual: Array, jacobian: Array, prior: Array, room: Array | None = None
) -> Array:
    whitened, _ = problem.whiten(np.column_stack([residual, jacobian]), fit.noise)
    e, sensitivities = whitened[:, 0], whitened[:, 1:]
    precision = sensitivities.T @ sensitivities + np.diag(prior)
    ridge = 1e-9 * np.diag(np.diag(precision) + 1e-300)
    out = np.empty_like(residual)
    for rows in blocks_of(problem):
        s = sensitivities[rows]
        change = np.linalg.lstsq(precision - s.T @ s + ridge, -s.T @ e[rows], rcond=None)[0]
        if room is not None:
            change = np.clip(change, room[:, 0], room[:, 1])
        out[rows] = residual[rows] - jacobian[rows] @ change
    return out


def refitted_rmse_v(problem: Problem, fit: Fit) -> float:
    """As `held_out_rmse_v`, by refits without every third block in turn: for a model that is not linear over the
    distance that its parameters move, at the price of simulations.  Infinite where one cannot be simulated."""
    blocks = blocks_of(problem)
    left = np.empty_like(fit.residual_v)
    for first in range(REFITS):
        out = np.concatenate(blocks[first::REFITS]).astype(int)
        e = refitted_without(problem, fit, out)
        if e is None:
            return float(np.inf)
        left[out] = e
    return float(np.sqrt(np.mean(left**2)))


def refitted_without(problem: Problem, fit: Fit, out: IntArray | BoolArray) -> Array | None:
    """V: the residual on the rows `out` of a refit that has not seen them; None where it cannot be simulated."""
    seen = np.ones(len(fit.residual_v))
    seen[out] = 0.0
    fitter = Fitter(replace(problem, weights=seen), fit.hypothesis)
    e = fitter.residual(fitter.descend(fit.x, fit.noise, REFIT_STEPS))
    return None if e is None else e[out]


def held_out_rmse_v(problem: Problem, fit: Fit) -> float:
    """Root mean square of `held_out_residual`."""
    return float(np.sqrt(np.mean(held_out_residual(problem, fit) ** 2)))


def placebo_gain(problem: Problem, parent: Fit, child: Fit, rng: np.random.Generator) -> float:
    """Largest held-out gain in mean square, V2, that meaningless terms bring to `parent`.

    A placebo is what the effect did to the voltage, shifted in time by a random share of the record and half
    of the
    times reversed: as many parameters, the same smoothness, no physics.
    """
    new = [j for j, k in enumerate(child.knobs) if k.key not in {p.key for p in parent.knobs}]
    if not new:
        return 0.0
    free = _movable(parent)
    prior = _prior(parent)[free]
    base = float(np.mean(_held_out(problem, parent, parent.residual_v, parent.jacobian[:, free], prior) ** 2))
    columns = child.jacobian[:, new]
    grown = np.concatenate([prior, _prior(child)[new]])
    gains = []
    for _ in range(PLACEBOS):
        fake = _shuffled(problem, columns, rng)
        step = _linear_refit(problem, parent, free, fake, grown)
        moved = np.column_stack([parent.jacobian[:, free], fake])
        residual = parent.residual_v - moved @ step
        gains.append(base - float(np.mean(_held_out(problem, parent, residual, moved, grown) ** 2)))
    return max(0.0, *gains)


def _shuffled(problem: Problem, columns: Array, rng: np.random.Generator) -> Array:
    share, reverse = rng.uniform(0.15, 0.85), bool(rng.integers(2))
    out = np.empty_like(columns)
    for rows in problem.slices:
        part = np.roll(columns[rows], int(share * (rows.stop - rows.start)), axis=0)
        out[rows] = part[::-1] if reverse else part
    return out


def _linear_refit(problem: Problem, parent: Fit, free: IntArray, fake: Array, prior: Array) -> Array:
    table = np.column_stack([parent.residual_v, parent.jacobian[:, free], fake])
    whitened, _ = problem.whiten(table, parent.noise)
    s = whitened[:, 1:]
    precision = s.T @ s + np.diag(prior)
    ridge = 1e-9 * np.diag(np.diag(precision) + 1e-300)
    pull = np.zeros(len(precision))
    pull[: len(free)] = _pull(parent)[free] ** 2 * parent.x[free]
    return np.asarray(
        np.linalg.lstsq(precision + ridge, s.T @ whitened[:, 0] - pull, rcond=None)[0], dtype=float
    )


def structured_v(problem: Problem, residual: Array) -> float:
    """Root mean square of what is left beyond the sensors' white noise."""
    noise = np.concatenate([np.full(r.n_fit, r.noise_v**2) for r in problem.records])
    return float(np.sqrt(max(np.mean(residual**2) - np.mean(noise), 0.0)))
