"""Maximum a posteriori fits: Gauss-Newton with the whole model, or in the parameters of one effect alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import numpy as np

from aesi.errors import FitError
from aesi.numerics.bounded import descend, slope_within
from aesi.numerics.metrics import rms
from aesi.numerics.threads import side_by_side
from aesi.numerics.typing import Array, BoolArray
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import FreeParameter, values_of
from aesi.tracer.case.problem import STEP, InverseProblem
from aesi.tracer.likelihood.gaussian import (
    Linearised,
    Posterior,
    PredictiveScore,
    ScoreAtSize,
    best_over_sizes,
    block_sums,
    score_at_size,
)
from aesi.tracer.likelihood.model_error import PRIORS, Size, SplitTable, fast_file_errors_v, whitened
from aesi.tracer.likelihood.size_sums import SizeSums

GAIN_NATS = 0.05
"""A descent stops where a step gains less than this, nats. The gain counts relative to the mean square of the whitened
errors that the step starts from, where that exceeds 1 (`beyond_expected`). Relative to that at the start of the
descent, fits of a virtual hysteresis ended 16 to 91 nats short (four draws, NMC cell)."""


@dataclass(frozen=True, eq=False)
class FittedHypothesis:
    """A fitted hypothesis.

    hypothesis : ids of its effects.  free : its parameters.  point : linearisation at the optimum.  score : on unseen
    data.  simulations : spent on the fit.
    as_declared : True where the linearisation is at the declared values of the own parameters, not at the optimum.
    """

    hypothesis: tuple[str, ...]
    free: tuple[FreeParameter, ...]
    point: Linearised
    score: PredictiveScore
    simulations: int
    as_declared: bool = False

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """owner -> name -> value."""
        return values_of(self.free, self.point.x, self.hypothesis)

    @property
    def values_by_key(self) -> dict[tuple[str, str], float]:
        """(owner, name) -> value."""
        return {f.key: f.value(float(x)) for f, x in zip(self.free, self.point.x, strict=True)}

    @property
    def rmse_v(self) -> float:
        """RMS residual on the fitted rows, V."""
        return rms(self.point.residual_v)

    @property
    def at_bounds(self) -> tuple[str, ...]:
        """Parameters of effects that ended on a bound, as effect.parameter."""
        return tuple(
            f"{f.owner}.{f.name}"
            for f, x in zip(self.free, self.point.x, strict=True)
            if f.on_bound(float(x))
        )


class HypothesisFitter:
    """Simulations, sensitivities and Gauss-Newton descents of one hypothesis."""

    def __init__(self, problem: InverseProblem, blocks: Blocks, hypothesis: Sequence[str]) -> None:
        self.problem, self.blocks, self.hypothesis = problem, blocks, tuple(hypothesis)
        self.free = problem.free(self.hypothesis)
        bounds = np.array([f.bounds for f in self.free])
        self.low, self.high = bounds[:, 0], bounds[:, 1]
        self.simulations = 0
        self._errors: dict[bytes, Array | None] = {}
        self._last_slopes: tuple[bytes, Array | None] = (b"", None)

    def residual(self, x: Array) -> Array | None:
        """(n,) V, measured - model; None where the model fails."""
        key = x.tobytes()
        if key not in self._errors:
            self.simulations += 1
            predicted = self.problem.predict(values_of(self.free, x, self.hypothesis))
            self._errors[key] = None if predicted is None else self.problem.measured - predicted
        return self._errors[key]

    def jacobian(self, x: Array, residual: Array) -> Array | None:
        """(n, k) V, sensitivities of the model per prior standard deviation, by one-sided differences within the
        bounds; None where the model fails."""
        if self._last_slopes[0] == x.tobytes():
            return self._last_slopes[1]
        columns = []
        for column, simulations in side_by_side(partial(self._slope, x, residual), range(len(x))):
            self.simulations += simulations
            if column is None:
                return None
            columns.append(column)
        out = np.column_stack(columns)
        self._last_slopes = (x.tobytes(), out)
        return out

    def _slope(self, x: Array, residual: Array, j: int) -> tuple[Array | None, int]:
        """(column j of the jacobian (n,) V, or None where the model fails on both sides; number of simulations)."""
        only = self.free[j].record
        rows = slice(None) if only is None else self.problem.slices[only]
        simulations = 0

        def error_v(moved: Array) -> Array | None:
            nonlocal simulations
            simulations += 1
            predicted = self.problem.predict(values_of(self.free, moved, self.hypothesis), only)
            return None if predicted is None else self.problem.measured[rows] - predicted

        slope = slope_within(error_v, x, residual[rows], j, (self.low[j], self.high[j]), STEP)
        if slope is None:
            return None, simulations
        column = np.zeros(len(residual))
        column[rows] = -slope
        return column, simulations

    def closest(self, starts: Sequence[Array], size: Size) -> Array:
        """The one of these coordinates from which a descent at this size of the model error has least to go; the first
        of equal ones."""
        return min(starts, key=lambda x: self.cost(np.clip(x, self.low, self.high), size))

    def cost(self, x: Array, size: Size) -> float:
        """Minus the logarithm of the posterior density at x, up to a constant, nats, at this size of the model error;
        infinite where the model fails."""
        residual = _Whitened(self, size, np.ones(len(self.problem.measured), dtype=bool)).residual(x)
        return np.inf if residual is None else 0.5 * float(residual @ residual)

    def descend(
        self,
        x: Array,
        size: Size,
        rounds: int,
        slopes_v: Array | None = None,
        without: Sequence[int] = (),
    ) -> Array:
        """Coordinates after a descent from x with a fixed size of the model error.

        Both sides of a jump are tried (`InverseProblem.jumps`): on a slow discharge and a drive (blind set, seed 40,
        case 35) a fit ended 350 nats short, at a lag of -1 ms.

        rounds : most evaluations of the jacobian.  slopes_v : (n, k) V, approximate sensitivities at x to begin with.
        without : blocks that are left out.
        """
        objective = _Whitened(self, size, ~np.isin(self.blocks.of_row, without))
        begin = None if slopes_v is None else objective.columns(slopes_v)
        jumps = self.problem.jumps(self.free)
        return descend(objective, x, self.low, self.high, rounds, objective.no_gain, begin, jumps).known_x

    def finished(self, x: Array) -> FittedHypothesis | None:
        """The fit that ended at x, with its score; None where the model fails there, or has no score."""
        e = self.residual(x)
        jacobian = None if e is None else self.jacobian(x, e)
        if e is None or jacobian is None:
            return None
        fast_errors_v = fast_file_errors_v(self.problem, self.blocks, self.hypothesis)
        point = Linearised(x, e, jacobian, np.column_stack([self.low, self.high]), fast_errors_v)
        try:
            score = scored(self.problem, self.blocks, point)
        except FitError:
            return None
        return FittedHypothesis(self.hypothesis, self.free, point, score, self.simulations)


def beyond_expected(white: Array) -> float:
    """Mean square of whitened errors (n,), at least 1.

    Where errors are larger than the noise and the model error by which they were whitened, a difference of two sums of
    squares is too large by this factor, as evidence.
    """
    return max(float(np.mean(white**2)), 1.0)


def no_gain(white: Array) -> float:
    """Nats that count as no gain over whitened errors (n,)."""
    return GAIN_NATS * beyond_expected(white)


def scored(problem: InverseProblem, blocks: Blocks, point: Linearised) -> PredictiveScore:
    """The predictive score of a linearised hypothesis, at the size of the model error where it is highest.  Raises
    FitError as `score_at_size`."""
    prior, sums = PRIORS[problem.trust], SizeSums(SplitTable(problem, blocks, point.table()))
    scores = [point_score_at_size(sums, point, size, prior.log_density(size)) for size in prior.sizes]
    return best_over_sizes(scores, len(point.x))


def point_score_at_size(sums: SizeSums, point: Linearised, size: Size, log_prior: float = 0.0) -> ScoreAtSize:
    """The score of a linearised hypothesis at one size of the model error.  sums : over its `point.table()`."""
    return score_at_size(
        sums.table.blocks, sums.at(size), point.padded_x, point.padded_bounds, size, log_prior
    )


@dataclass(frozen=True, eq=False)
class _Whitened:
    """Least-squares residual that a descent minimises at one size of the model error: the whitened residual of the n
    rows that are `kept` (True for them), projected off the errors that the file may have within seconds, then the
    coordinates (their prior)."""

    fitter: HypothesisFitter
    size: Size
    kept: BoolArray

    @cached_property
    def _error_basis(self) -> Array:
        """(n + k, k) orthonormal basis of the errors that the file may have within seconds, with their prior."""
        fitter = self.fitter
        errors = self._whitened_rows(fast_file_errors_v(fitter.problem, fitter.blocks, fitter.hypothesis))
        return np.asarray(np.linalg.qr(np.vstack([errors, np.eye(errors.shape[1])]))[0])

    def errors(self, error_v: Array) -> Array:
        """(n + k,) a residual (n,) V, whitened and projected."""
        return np.asarray(self._projected(error_v[:, None])[:, 0])

    def residual(self, x: Array) -> Array | None:
        """(n + k + m,) what a descent minimises, at x (m,); None where the model fails."""
        e = self.fitter.residual(x)
        return None if e is None else np.concatenate([self.errors(e), x])

    def slopes(self, x: Array, residual: Array) -> Array | None:
        """(n + k + m, m) slopes of `residual`; None where the model fails."""
        e = self.fitter.residual(x)
        jacobian = None if e is None else self.fitter.jacobian(x, e)
        return None if jacobian is None else self.columns(jacobian)

    def no_gain(self, residual: Array) -> float:
        """Nats that count as no gain over a `residual` (n + k + m,)."""
        return no_gain(residual[: len(residual) - len(self.fitter.free)])

    def columns(self, jacobian_v: Array) -> Array:
        """(n + k + m, m) slopes of the residual for the sensitivities (n, m) V of the model."""
        return np.vstack([-self._projected(jacobian_v), np.eye(jacobian_v.shape[1])])

    def _projected(self, columns_v: Array) -> Array:
        """(n + k, j) columns (n, j) V, whitened and projected off `_error_basis`."""
        white, k = self._whitened_rows(columns_v), self._error_basis.shape[1]
        stacked = np.vstack([white, np.zeros((k, columns_v.shape[1]))])
        return np.asarray(stacked - self._error_basis @ (self._error_basis.T @ stacked)) if k else white

    def _whitened_rows(self, columns_v: Array) -> Array:
        return whitened(self.fitter.problem, self.fitter.blocks, columns_v, self.size)[0][self.kept]


class LinearForm(Protocol):
    """A hypothesis that is linearised about a point, with its score."""

    @property
    def point(self) -> Linearised: ...
    @property
    def score(self) -> PredictiveScore: ...


def held_out_residual(blocks: Blocks, fit: LinearForm) -> Array:
    """(n,) V, residual of each block at the parameters fitted to the other blocks, by the linearised model."""
    shifts = fit.score.shifts["block"][blocks.of_row]
    return fit.point.residual_v - np.einsum("ij,ij->i", fit.point.jacobian_v, shifts)


def _posterior(
    problem: InverseProblem,
    blocks: Blocks,
    fit: LinearForm,
    size: Size,
    folds: tuple[tuple[int, ...], ...] = (),
) -> Posterior:
    """Posterior of the parameters, followed by the file's errors within seconds, at this size of the model error."""
    white, log_det = whitened(problem, blocks, fit.point.table(), size)
    return Posterior(block_sums(blocks, white, log_det), fit.point.padded_x, folds)


def covariance_at(problem: InverseProblem, blocks: Blocks, fit: LinearForm, size: Size) -> Array:
    """(m, m) posterior covariance of the coordinates, for a model error of this size, without bounds as that of
    `prediction_sd_v`."""
    own = slice(0, len(fit.point.x))
    return _posterior(problem, blocks, fit, size).covariance[own, own]


def prediction_sd_v(
    problem: InverseProblem, blocks: Blocks, fit: LinearForm, size: Size, partition: str = "block"
) -> Array:
    """(n,) V, standard deviation of the predicted voltage of each block, with the parameters fitted to the blocks
    outside its fold, for a model error of this size. It is of (1) of `gaussian`, which knows no bounds: a parameter
    that the score holds on one counts here as uncertain to both sides of it.

    partition : one of `blocks.folds` in which each block is left out once.
    """
    x, jacobian = fit.point.x, fit.point.jacobian_v
    folds = blocks.folds[partition]
    posterior = _posterior(problem, blocks, fit, size, folds)
    out = np.empty(len(jacobian))
    for fold, covariance in zip(folds, posterior.covariances_without, strict=True):
        rows = np.isin(blocks.of_row, fold)
        own = covariance[: len(x), : len(x)]
        out[rows] = np.sqrt(np.einsum("ij,ij->i", jacobian[rows] @ own, jacobian[rows]))
    return out
