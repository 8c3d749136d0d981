"""A hypothesis linearised about a point, with Gaussian errors, and its predictive density of left-out blocks.

    y = f(x) + J z + e,   x + z ~ N(0, 1),   e ~ N(0, C), independent between blocks    (1)

With whitened residual r and sensitivities J, a set S of blocks has the marginal density

    -2 log p(y_S) = r'r + x'x - b'A^-1 b + log|A| + log|C| + n log 2 pi,   A = 1 + J'J,   b = J'r - x     (2)

and the log predictive density of blocks F, given the others, is log p(y_F | y_-F) = log p(y) - log p(y_-F).
Bishop, Pattern Recognition and Machine Learning (2006), section 3.5.

Parameters have bounds, which (1) does not know. Those that all data together push onto a bound are held there, and (2)
is for the others. The evidence (marginal likelihood) also integrates over a held parameter: along its distance d >= 0
from the bound, with the free parameters marginalised and the other held ones fixed, the density is

    p(d) ~ exp(g d - a d^2 / 2)    g < 0 where the data push onto the bound, a > 0 their curvature    (3)

"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear
from scipy.special import log_ndtr

from aesi.errors import FitError
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import FURTHEST_SDS, ON_BOUND_SDS, at_ends
from aesi.tracer.likelihood.model_error import LOG_2PI, Size


@dataclass(frozen=True, eq=False)
class BlockSums:
    """Sums over the rows of each block, whitened.

    square : (b,) r'r.  moment : (b, m) J'r.  gram : (b, m, m) J'J.  log_det : (b,) log|C|.  rows : (b,) their number.
    """

    square: Array
    moment: Array
    gram: Array
    log_det: Array
    rows: Array

    def take(self, columns: IntArray) -> BlockSums:
        """The sums of some of the parameters alone.  columns : their numbers."""
        return BlockSums(
            self.square,
            self.moment[:, columns],
            self.gram[:, columns[:, None], columns[None, :]],
            self.log_det,
            self.rows,
        )

    def moved(self, z: Array) -> BlockSums:
        """The sums about the point x + z, z (m,)."""
        along = self.gram @ z
        square = self.square - 2.0 * self.moment @ z + along @ z
        return BlockSums(square, self.moment - along, self.gram, self.log_det, self.rows)


def block_sums(blocks: Blocks, table: Array, log_det: Array) -> BlockSums:
    """The sums of each block.  table : (n, 1 + m), whitened residual and sensitivities.  log_det : (n,) of each row."""
    m = table.shape[1]
    count = len(blocks)
    products = np.empty((count, m, m))
    for k, rows in enumerate(blocks.rows):
        products[k] = table[rows].T @ table[rows]
    return sums_of_products(blocks, products, log_det)


def sums_of_products(blocks: Blocks, products: Array, log_det: Array) -> BlockSums:
    """The sums of each block.  products : (b, 1 + m, 1 + m) products of the whitened residual and sensitivities with
    each other.  log_det : (n,) of each row."""
    return BlockSums(
        products[:, 0, 0],
        products[:, 1:, 0],
        products[:, 1:, 1:],
        np.add.reduceat(log_det, blocks.starts[:-1]),
        np.diff(blocks.starts).astype(float),
    )


class Solved(NamedTuple):
    """The solution A^-1 b of (2), for one system or for a stack of them.

    root : (m, m) lower triangular factor of A.  shift : (m,) A^-1 b.
    """

    root: Array
    shift: Array

    @classmethod
    def of(cls, gram: Array, moment: Array, x: Array) -> Solved:
        """gram : (..., m, m) J'J.  moment : (..., m) J'r.  x : (m,) the point."""
        a, b = gram + np.eye(len(x)), moment - x
        root = np.asarray(np.linalg.cholesky(a), dtype=float)
        return cls(root, np.asarray(np.linalg.solve(a, b[..., None])[..., 0], dtype=float))


def gains(gram: Array, moment: Array, x: Array) -> Array:
    """(f,) b'A^-1 b - log|A| of (2), nats.  gram : (f, m, m) J'J.  moment : (f, m) J'r.  x : (m,) the point.

    The Cholesky factor of A bordered by b has L^-1 b in its last row (L: factor of A), so that nothing has to be
    solved.
    """
    m, b = len(x), moment - x
    bordered = np.zeros((len(b), m + 1, m + 1))
    bordered[:, :m, :m] = gram + np.eye(m)
    bordered[:, m, :m] = b
    bordered[:, m, m] = 1.0 + 2.0 * (b**2).sum(axis=-1)  # more than b'A^-1 b, since A is more than 1
    root = np.linalg.cholesky(bordered)
    log_det = 2.0 * np.log(np.diagonal(root, axis1=-2, axis2=-1)[:, :m]).sum(axis=-1)
    return np.asarray((root[:, m, :m] ** 2).sum(axis=-1) - log_det, dtype=float)


@lru_cache(maxsize=64)
def _left_out(folds: tuple[tuple[int, ...], ...], blocks: int) -> Array:
    """(f, b) one where the fold leaves the block out."""
    out = np.zeros((len(folds), blocks))
    for k, fold in enumerate(folds):
        out[k, list(fold)] = 1.0
    out.flags.writeable = False
    return out


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior of the parameters in (1), given all blocks, and given all but each fold.

    sums : of the hypothesis.  x : (m,) the point.  folds : sets of blocks left out in turn.
    """

    sums: BlockSums
    x: Array
    folds: tuple[tuple[int, ...], ...]

    @property
    def _left_out(self) -> Array:
        """(f, b) one where the fold leaves the block out."""
        return _left_out(self.folds, len(self.sums.square))

    @cached_property
    def solved(self) -> Solved:
        """(2) solved with all blocks."""
        return Solved.of(self.sums.gram.sum(axis=0), self.sums.moment.sum(axis=0), self.x)

    @cached_property
    def _without(self) -> tuple[Array, Array]:
        """(f, m, m) J'J and (f, m) J'r without each fold."""
        kept = 1.0 - self._left_out
        return np.tensordot(kept, self.sums.gram, axes=(1, 0)), kept @ self.sums.moment

    @cached_property
    def _solved_without(self) -> Solved:
        """(f,) (2) solved without each fold."""
        return Solved.of(*self._without, self.x)

    @cached_property
    def _gains(self) -> Array:
        """(f + 1,) b'A^-1 b - log|A| without each fold, and from all data."""
        gram, moment = self._without
        return gains(
            np.concatenate([gram, self.sums.gram.sum(axis=0)[None]]),
            np.concatenate([moment, self.sums.moment.sum(axis=0)[None]]),
            self.x,
        )

    @property
    def covariances_without(self) -> Array:
        """(f, m, m) posterior covariance of the parameters without each fold."""
        inverse = np.linalg.inv(self._solved_without.root)
        return np.asarray(np.swapaxes(inverse, -1, -2) @ inverse)

    @cached_property
    def log_density(self) -> Array:
        """(f,) log p(y_F | y_-F) of each fold, nats."""
        by_data = self._left_out @ (self.sums.square + self.sums.log_det + LOG_2PI * self.sums.rows)
        return np.asarray(-0.5 * (by_data - self._gains[-1] + self._gains[:-1]))

    @cached_property
    def evidence(self) -> float:
        """log p(y) of all blocks, nats."""
        by_data = float(np.sum(self.sums.square + self.sums.log_det + LOG_2PI * self.sums.rows))
        return -0.5 * (by_data + float(self.x @ self.x) - float(self._gains[-1]))

    @property
    def shifts(self) -> Array:
        """(f, m) change of the parameters where a fold is left out."""
        return self._solved_without.shift

    @property
    def shift(self) -> Array:
        """(m,) change of the parameters to where all data put them."""
        return self.solved.shift

    @cached_property
    def covariance(self) -> Array:
        """(m, m) posterior covariance of the parameters given all data."""
        inverse = np.linalg.inv(self.solved.root)
        return np.asarray(inverse.T @ inverse)


@dataclass(frozen=True, eq=False)
class Linearised:
    """A hypothesis linearised about a point.

    x : (m,) coordinates.  residual_v : (n,) V, measured - model.  jacobian_v : (n, m) V, sensitivities of the model.
    bounds : (m, 2) of the coordinates.  fast_errors_v : (n, k) V, errors that the file may have within seconds, per
    standard deviation: part of the model error, not of the model.
    """

    x: Array
    residual_v: Array
    jacobian_v: Array
    bounds: Array
    fast_errors_v: Array

    def table(self) -> Array:
        """(n, 1 + m + k) V: residual, sensitivities, errors of the file within seconds."""
        return np.column_stack([self.residual_v, self.jacobian_v, self.fast_errors_v])

    @property
    def padded_x(self) -> Array:
        """(m + k,) coordinates, zero for the errors of the file within seconds."""
        return np.concatenate([self.x, np.zeros(self.fast_errors_v.shape[1])])

    @property
    def padded_bounds(self) -> Array:
        """(m + k, 2) bounds; the errors of the file within seconds have those of own parameters."""
        return np.vstack([self.bounds, bounds_of_own(self.fast_errors_v.shape[1])])


def bounds_of_own(k: int) -> Array:
    """(k, 2) bounds of coordinates of own parameters."""
    return np.tile([-FURTHEST_SDS, FURTHEST_SDS], (k, 1))


PARTITIONS_OF_CONDITIONS = ("record", "rate", "charge")


@dataclass(frozen=True, eq=False)
class PredictiveScore:
    """Cross-validated score of a hypothesis, at the size of the model error where its total is highest.

    size : that size.  log_density : partition -> (f,) log predictive density of each left-out fold, nats.
    total : mean of the sum over blocks and of the mean over the partitions by condition, plus the log prior of the
    size, nats.  evidence : log marginal likelihood at that size, nats.
    shifts : partition -> (f, m) change of the coordinates when each fold is left out.  shift : (m,) change of the
    coordinates from the point to the optimum of all data.  covariance : (m, m) posterior covariance there. A parameter
    that is held on a bound is shifted to it in every fold, and has no covariance.
    """

    size: Size
    log_density: Mapping[str, Array]
    total: float
    evidence: float
    shifts: Mapping[str, Array]
    shift: Array
    covariance: Array

    @property
    def delta_v(self) -> float:
        """Size of the lasting part of the model error, V."""
        return self.size.delta_v

    def take(self, columns: IntArray) -> PredictiveScore:
        """The score with the shifts and the covariance of some of the parameters; the others are marginalised."""
        shifts = {name: shift[:, columns] for name, shift in self.shifts.items()}
        covariance = self.covariance[np.ix_(columns, columns)]
        return replace(self, shifts=shifts, shift=self.shift[columns], covariance=covariance)


def held_at_bounds(posterior: Posterior, bounds: Array) -> tuple[Array, BoolArray]:
    """(change (m,) of the coordinates, held (m,)): the parameters that all data together push onto a bound are moved to
    it and held there; the change is zero for the others.  bounds : (m, 2) of the coordinates."""
    low, high = bounds[:, 0] - posterior.x, bounds[:, 1] - posterior.x
    root, best = posterior.solved
    if np.all((low < best) & (best < high)):
        return np.zeros(len(best)), np.zeros(len(best), dtype=bool)
    ends = np.maximum(high, low + ON_BOUND_SDS)
    inside = lsq_linear(root.T, root.T @ best, (low, ends), method="bvls").x
    lowest, highest = at_ends(inside, low, ends)
    held = lowest | highest
    return np.where(held, inside, 0.0), held


class BoundDensity(NamedTuple):
    """The density (3) of one held parameter.  slope : g, per coordinate, positive into the range.  curvature : a, per
    square of a coordinate."""

    slope: float
    curvature: float

    @property
    def log_mass(self) -> float:
        """Logarithm of the integral of (3) over d, nats, in units of the root of 2 pi."""
        beyond = self.slope / float(np.sqrt(self.curvature))
        return 0.5 * (beyond**2 - float(np.log(self.curvature))) + float(log_ndtr(beyond))


def densities_at_bounds(sums: BlockSums, x: Array, bounds: Array, held: BoolArray) -> dict[int, BoundDensity]:
    """Number of each held parameter -> its density (3).

    sums : about x (m,), where the held parameters are on their bounds (m, 2).  held : (m,) True for these.
    """
    a = sums.gram.sum(axis=0) + np.eye(len(x))
    b = sums.moment.sum(axis=0) - x
    free, out = np.flatnonzero(~held), {}
    for j in np.flatnonzero(held).tolist():
        onto_free = np.linalg.solve(a[np.ix_(free, free)], a[free, j])  # marginalises the free parameters
        slope = float(b[j] - onto_free @ b[free])
        inwards = 1.0 if on_lower_bound(x[j], bounds[j]) else -1.0
        out[j] = BoundDensity(inwards * slope, float(a[j, j] - onto_free @ a[free, j]))
    return out


def on_lower_bound(x: float, bounds: Array) -> bool:
    """Whether a parameter that is held is on the lower of its bounds (2,)."""
    return bool(x - bounds[0] <= bounds[1] - x)


@dataclass(frozen=True, eq=False)
class ScoreAtSize:
    """A linearised hypothesis at one size of the model error, evaluated as far as sizes have to be compared.

    posterior : of the free (not held) parameters.  folds : by partition.  x : (m,) the point.  bounds : (m, 2).
    sums : over all parameters, about that point.  to_bounds : (m,) change that moves the held parameters to their
    bounds.  held : (m,) True for these.  log_prior : of the size, nats.
    """

    posterior: Posterior
    folds: Mapping[str, Sequence[Sequence[int]]]
    x: Array
    bounds: Array
    sums: BlockSums
    to_bounds: Array
    held: BoolArray
    size: Size
    log_prior: float

    def _by_partition(self, of_folds: Array) -> dict[str, Array]:
        ends = np.cumsum([len(folds) for folds in self.folds.values()])[:-1]
        return dict(zip(self.folds, np.split(of_folds, ends), strict=True))

    @cached_property
    def log_density(self) -> dict[str, Array]:
        """By partition, (f,) nats of each fold."""
        return self._by_partition(self.posterior.log_density)

    @cached_property
    def total(self) -> float:
        """As `PredictiveScore.total`."""
        parts = self.log_density
        conditions = [float(parts[name].sum()) for name in PARTITIONS_OF_CONDITIONS if name in parts]
        return 0.5 * float(parts["block"].sum()) + 0.5 * float(np.mean(conditions)) + self.log_prior

    @property
    def score(self) -> PredictiveScore:
        """The full score at this size."""
        posterior, free, m = self.posterior, np.flatnonzero(~self.held), len(self.x)
        whole = np.tile(self.to_bounds, (len(posterior.folds), 1))
        whole[:, free] = posterior.shifts
        shift, covariance = self.to_bounds.copy(), np.zeros((m, m))
        shift[free], covariance[np.ix_(free, free)] = posterior.shift, posterior.covariance
        shifts = self._by_partition(whole)
        return PredictiveScore(
            self.size, self.log_density, self.total, self._evidence, shifts, shift, covariance
        )

    @property
    def _evidence(self) -> float:
        """As `PredictiveScore.evidence`: that of the free parameters, plus (3) and the prior of the held ones."""
        if not self.held.any():
            return self.posterior.evidence
        x = self.x + self.to_bounds
        densities = densities_at_bounds(self.sums.moved(self.to_bounds), x, self.bounds, self.held)
        of_held = sum(density.log_mass for density in densities.values()) - 0.5 * float(
            np.sum(x[self.held] ** 2)
        )
        return self.posterior.evidence + of_held


def score_at_size(
    blocks: Blocks, sums: BlockSums, x: Array, bounds: Array, size: Size, log_prior: float
) -> ScoreAtSize:
    """A linearised hypothesis at one size of the model error.

    sums : whitened at that size, about the point x (m,).  bounds : (m, 2) of the coordinates.  log_prior : of the size,
    nats.
    Raises FitError for sensitivities so large that the prior, the 1 of A in (2), is lost in the rounding of the sums.
    """
    if not np.finfo(float).eps * float(np.trace(sums.gram.sum(axis=0))) < 1.0:
        raise FitError("the voltage changes too steeply with the parameters: no score can be told.")
    folds = tuple(fold for of_name in blocks.folds.values() for fold in of_name)
    posterior = Posterior(sums, x, folds)
    to_bounds, held = held_at_bounds(posterior, bounds)
    if held.any():
        free = np.flatnonzero(~held)
        posterior = Posterior(sums.moved(to_bounds).take(free), x[free], folds)
    return ScoreAtSize(posterior, blocks.folds, x, bounds, sums, to_bounds, held, size, log_prior)


def best_over_sizes(scores: Sequence[ScoreAtSize], n_parameters: int) -> PredictiveScore:
    """The score at the size of the model error with the highest total, for the first `n_parameters`; the others are
    marginalised."""
    return max(scores, key=lambda score: score.total).score.take(np.arange(n_parameters))
