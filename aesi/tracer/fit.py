"""Fitting one hypothesis: bounded least squares with the residual's autocorrelation accounted for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aesi.numerics.bounded import descend
from aesi.numerics.noise.coloured import ColouredNoise, fit_noise
from aesi.numerics.typing import Array
from aesi.tracer.knobs import SOC0, Knob, starts, values_by_owner
from aesi.tracer.problem import Hypothesis, Problem

FREE_STEP = 2e-3
TOLERATED_STEP = 0.2
GAIN_NATS = 0.1
"""A descent stops when a step gains less than this in log-likelihood."""
NOISE_ROUNDS = 2
REFRESH = 4
"""Steps over which the slopes of what is tolerated, which moves little, are kept."""
REMEMBERED = 4
"""Residuals: a point is met again as trial, as start of the next step and as the end."""
REPEATS = 100
"""Samples over which what a model misses stays the same, at the one sample a second that fits see."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis at its best.

    x : (n_knobs,) working coordinates.  residual_v : (n_fit,) V, measured - model.  jacobian : (n_fit,
    n_knobs) V per
    working unit, of the model.  noise : one model of the residual a record.  covariance : of x.
    log_evidence : Laplace approximation, nats.  simulations : how many were spent.
    """

    hypothesis: Hypothesis
    knobs: tuple[Knob, ...]
    x: Array
    residual_v: Array
    jacobian: Array
    noise: tuple[ColouredNoise, ...]
    covariance: Array
    log_likelihood: float
    log_evidence: float
    simulations: int

    @property
    def rmse_v(self) -> float:
        """Root mean square of the residual on the fit part, thinned."""
        return float(np.sqrt(np.mean(self.residual_v**2)))

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """owner -> name -> value."""
        return values_by_owner(self.knobs, self.x)

    @property
    def placed(self) -> dict[tuple[str, str], float]:
        """(owner, name) -> value."""
        return {k.key: k.to_value(float(x)) for k, x in zip(self.knobs, self.x, strict=True)}

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Free knobs that ended on a bound, as effect.parameter."""
        return tuple(
            f"{k.owner}.{k.name}"
            for k, x in zip(self.knobs, self.x, strict=True)
            if k.at_bound(k.to_value(float(x)))
        )

    def interval(self, index: int, sigmas: float = 1.96) -> tuple[float, float]:
        """Values of a knob at -/+ `sigmas` deviations."""
        knob = self.knobs[index]
        reach = sigmas * float(np.sqrt(max(self.covariance[index, index], 0.0)))
        return knob.to_value(self.x[index] - reach), knob.to_value(self.x[index] + reach)


class Fitter:
    """Counts simulations and carries the pieces of one fit."""

    def __init__(self, problem: Problem, hypothesis: Hypothesis) -> None:
        self.problem = problem
        self.hypothesis = hypothesis
        self.knobs = tuple(problem.knobs(hypothesis))
        self.measured = problem.measured
        bounds = np.array([k.working_bounds for k in self.knobs])
        self.low, self.high = bounds[:, 0], bounds[:, 1]
        self.prior = np.array([k.prior_root for k in self.knobs])
        self.steps = np.array([TOLERATED_STEP if k.sd is not None else FREE_STEP for k in self.knobs])
        self.simulations = 0
        self.remembered: dict[bytes, Array | None] = {}

    def residual(self, x: Array) -> Array | None:
        """(n,) V, or None where the model fails."""
        key = x.tobytes()
        if key not in self.remembered:
            while len(self.remembered) >= REMEMBERED:
                del self.remembered[next(iter(self.remembered))]
            self.remembered[key] = self._simulated(x)
        return self.remembered[key]

    def _simulated(self, x: Array) -> Array | None:
        self.simulations += 1
        predicted = self.problem.predict(self.knobs, x)
        return None if predicted is None else self.measured - np.concatenate(predicted)

    def jacobian(self, x: Array, residual: Array, kept: dict[int, Array] | None = None) -> Array | None:
        """(n, n_knobs) V per working unit, by one-sided differences that stay inside the box.

        kept : columns of linear or tolerated knobs from an earlier point of the same descent; filled where it lacks
        them.
        """
        columns = np.zeros((len(residual), len(x)))
        for j, step in enumerate(self.steps):
            if kept is not None and j in kept:
                columns[:, j] = kept[j]
                continue
            for h in (step, -step) if x[j] + step <= self.high[j] else (-step, step):
                moved = x.copy()
                moved[j] = x[j] + h
                slope = self._slope(moved, j, residual)
                if slope is not None:
                    columns[:, j] = slope / h
                    break
            else:
                return None
            if kept is not None and (self.knobs[j].linear or self.knobs[j].sd is not None):
                kept[j] = columns[:, j]
        return columns

    def _slope(self, moved: Array, j: int, residual: Array) -> Array | None:
        """(n,) V: what a move of one knob does to the model; a record's state of charge leaves the others alone."""
        self.simulations += 1
        knob = self.knobs[j]
        only = int(knob.name) if knob.owner == SOC0 else None
        predicted = self.problem.predict(self.knobs, moved, only)
        if predicted is None:
            return None
        rows = slice(None) if only is None else self.problem.slices[only]
        out = np.zeros_like(residual)
        out[rows] = residual[rows] - (self.measured[rows] - np.concatenate(predicted))
        return out

    def cost(self, x: Array, noise: Sequence[ColouredNoise]) -> float:
        """Half of what a descent lowers; infinite where the model fails."""
        e = self.residual(x)
        if e is None:
            return np.inf
        r = self.problem.whiten(self.problem.saturated(e)[:, None], noise)[0][:, 0]
        pull = self.prior * x
        return 0.5 * float(r @ r + pull @ pull)

    def descend(self, x0: Array, noise: Sequence[ColouredNoise], steps: int) -> Array:
        """Penalised generalised least squares under a fixed noise model."""
        kept: dict[int, Array] = {}

        def cost(x: Array) -> float:
            return self.cost(x, noise)

        def linearise(x: Array) -> tuple[Array, Array] | None:
            e = self.residual(x)
            jacobian = None if e is None else self.jacobian(x, e, kept)
            if e is None or jacobian is None:
                return None
            table = np.column_stack([e, -jacobian]) * self.problem.leniency(e)[:, None]
            table, _ = self.problem.whiten(table, noise)
            return (
                np.concatenate([table[:, 0], self.prior * x]),
                np.vstack([table[:, 1:], np.diag(self.prior)]),
            )

        x, left = x0, steps
        while left > 0:
            end = descend(linearise, cost, x, self.low, self.high, min(left, REFRESH), GAIN_NATS)
            x, left = end.x, left - end.steps
            if end.steps < REFRESH and not (end.stalled and end.steps > 1):
                break
            kept = {j: column for j, column in kept.items() if self.knobs[j].linear}
        return x

    def descend_white(self, x0: Array, steps: int) -> Array | None:
        """Plain least squares; None where the model fails at the start."""
        e = self.residual(np.clip(x0, self.low, self.high))
        return None if e is None else self.descend(x0, self.white(e), steps)

    def noise_of(self, residual: Array, start: Sequence[ColouredNoise] | None = None) -> list[ColouredNoise]:
        """The noise model of each record's residual."""
        out = []
        for i, (rows, record) in enumerate(zip(self.problem.slices, self.problem.records, strict=True)):
            times = record.thin.time_s[: record.n_fit]
            out.append(fit_noise(residual[rows], times, record.noise_v, start[i] if start else None))
        return out

    def white(self, residual: Array) -> list[ColouredNoise]:
        """Plain least squares: every sample counts, at the scale of its record's residual, or of the model's error,
        which says as little as its repeating samples do."""
        if self.problem.model_error_v is not None:
            weight_v = self.problem.model_error_v * REPEATS**0.5
            return [ColouredNoise(weight_v, 1e-9, 100.0)] * len(self.problem.records)
        return [
            ColouredNoise(max(float(np.sqrt(np.mean(residual[rows] ** 2))), r.noise_v), 1e-9, 100.0)
            for rows, r in zip(self.problem.slices, self.problem.records, strict=True)
        ]


def fit_hypothesis(problem: Problem, hypothesis: Hypothesis, warm: Sequence[Array] = ()) -> Fit | None:
    """The best fit of a hypothesis over several starts, or None where no start can be simulated.

    warm : further starting vectors, in the knobs' order.
    """
    fitter = Fitter(problem, hypothesis)
    best: tuple[float, Array] | None = None
    for x0 in [*warm, *(starts(fitter.knobs) if not warm or hypothesis else [])]:
        x = fitter.descend_white(x0, REFRESH)
        e = None if x is None else fitter.residual(x)
        if x is None or e is None:
            continue
        left = float(np.sum(problem.weighted(problem.saturated(e)[:, None]) ** 2))
        if best is None or left < best[0]:
            best = left, x
    if best is None:
        return None
    x = fitter.descend_white(best[1], problem.steps - REFRESH)
    return None if x is None else _polish(fitter, x)


def _polish(fitter: Fitter, x: Array) -> Fit | None:
    e = fitter.residual(x)
    assert e is not None
    own = fitter.problem.model_error_v is None
    noise = fitter.noise_of(e) if own else fitter.white(e)
    for _ in range(NOISE_ROUNDS if own else 0):
        x = fitter.descend(x, noise, max(fitter.problem.steps // 2, 3))
        e = fitter.residual(x)
        assert e is not None
        noise = fitter.noise_of(e, noise)
    jacobian = fitter.jacobian(x, e)
    return None if jacobian is None else summarise(fitter, x, e, jacobian, noise)


def summarise(fitter: Fitter, x: Array, e: Array, jacobian: Array, noise: list[ColouredNoise]) -> Fit:
    """Covariance and evidence at a fitted point."""
    counted = jacobian * fitter.problem.leniency(e)[:, None]
    table, log_det = fitter.problem.whiten(np.column_stack([fitter.problem.saturated(e), counted]), noise)
    whitened, sensitivities = table[:, 0], table[:, 1:]
    n = len(e)
    likelihood = -0.5 * (float(whitened @ whitened) + log_det + n * float(np.log(2 * np.pi)))
    precision = sensitivities.T @ sensitivities + np.diag(fitter.prior**2)
    free = fitter.prior == 0
    width = fitter.high - fitter.low
    precision[free, free] += 12.0 / width[free] ** 2  # a flat range is no wider than its own deviation
    _, log_precision = np.linalg.slogdet(precision)
    normal = fitter.prior[~free]
    log_prior = -0.5 * float(np.sum((normal * x[~free]) ** 2) + len(normal) * np.log(2 * np.pi))
    log_prior += float(np.sum(np.log(normal)))
    log_prior -= float(np.sum(np.log(width[free])))
    evidence = likelihood + log_prior + 0.5 * len(x) * float(np.log(2 * np.pi)) - 0.5 * float(log_precision)
    return Fit(
        fitter.hypothesis,
        fitter.knobs,
        x,
        e,
        jacobian,
        tuple(noise),
        np.asarray(np.linalg.pinv(precision, hermitian=True), dtype=float),
        likelihood,
        evidence,
        fitter.simulations,
    )


def as_dict(fit: Fit) -> dict[str, Any]:
    """What is needed to take a fit up again: plain numbers."""
    return {
        "hypothesis": list(fit.hypothesis),
        "x": [float(v) for v in fit.x],
        "noise": [[m.white, m.slow, m.tau_s] for m in fit.noise],
        "simulations": fit.simulations,
    }


def from_dict(problem: Problem, stored: dict[str, Any]) -> Fit | None:
    """Inverse of `as_dict`; None where the stored vector does not fit the knobs of today."""
    fitter = Fitter(problem, tuple(stored["hypothesis"]))
    x = np.array(stored["x"], dtype=float)
    if x.shape != fitter.low.shape:
        return None
    e = fitter.residual(x)
    jacobian = None if e is None else fitter.jacobian(x, e)
    if e is None or jacobian is None:
        return None
    noise = [ColouredNoise(*map(float, m)) for m in stored["noise"]]
    return summarise(fitter, x, e, jacobian, noise)
