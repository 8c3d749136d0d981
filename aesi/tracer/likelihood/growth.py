"""Grow a hypothesis by one effect: the effect's parameters are fitted by Gauss-Newton, all others to first order.

    min over u of  min over z  |W (e(u) - J z)|^2 + |x + z|^2 + |u|^2        u of the effect, x + z of the parent   (1)

The inner minimum is a projection (variable projection, Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), so that
a step costs as many simulations as the effect has parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from threading import Lock

import numpy as np

from aesi.errors import FitError
from aesi.numerics.bounded import descend, foreseen_cost, slope_within
from aesi.numerics.typing import Array, IntArray
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.free_parameter import (
    FURTHEST_SDS,
    ON_BOUND_SDS,
    FreeParameter,
    at_ends,
    by_owner,
    starts,
    values_of,
)
from aesi.tracer.case.problem import STEP, InverseProblem, ValuesByOwner
from aesi.tracer.likelihood.fit import FittedHypothesis, no_gain
from aesi.tracer.likelihood.gaussian import (
    BlockSums,
    Linearised,
    PredictiveScore,
    best_over_sizes,
    block_sums,
    score_at_size,
)
from aesi.tracer.likelihood.model_error import PRIORS, Size, SplitTable, fast_file_errors_v, whitened
from aesi.tracer.likelihood.size_sums import SizeSums

ROUNDS = 6
"""Most evaluations of the sensitivities in one descent."""


@dataclass(frozen=True, eq=False)
class Parent:
    """A fitted hypothesis to grow effects on, with its sensitivities whitened once at each size of the model error."""

    problem: InverseProblem
    blocks: Blocks
    fit: FittedHypothesis
    _white: dict[Size, tuple[Array, Array]] = field(default_factory=dict, init=False)
    _whitening: Lock = field(default_factory=Lock, init=False)

    def whitened_columns(self, size: Size) -> tuple[Array, Array]:
        """(whitened sensitivities and errors of the file within seconds (n, m + k), log|C| (n,)); cached."""
        with self._whitening:
            if size not in self._white:
                self._white[size] = self._columns.whitened(size)
            return self._white[size]

    @cached_property
    def _columns(self) -> SplitTable:
        return SplitTable(self.problem, self.blocks, self.fit.point.table()[:, 1:])

    @cached_property
    def movable(self) -> IntArray:
        """Numbers of the parameters that may move to first order: all but those on a hard bound (a resistance of zero),
        which a linear form would cross. A bound at FURTHEST_SDS is not a hard one: there the prior keeps the parameter
        back."""
        bounds = np.array([f.bounds for f in self.fit.free]).reshape(-1, 2)
        reached = np.column_stack(at_ends(self.fit.point.x, bounds[:, 0], bounds[:, 1]))
        hard = np.abs(bounds) < FURTHEST_SDS - ON_BOUND_SDS
        return np.flatnonzero(~(reached & hard).any(axis=1))


@dataclass(frozen=True, eq=False)
class Grown:
    """A parent hypothesis with one more effect: the effect's parameters are fitted, the parent's move to first order.

    free, point : the movable parameters and the linearisation in them.  on_bounds : values of those parameters of the
    effect that ended on a bound.  held : values of the parent's parameters on a hard bound.
    u : (k,) coordinates of the effect's parameters.  slopes_v : (n, k) V, their sensitivities there.
    """

    hypothesis: tuple[str, ...]
    free: tuple[FreeParameter, ...]
    point: Linearised
    score: PredictiveScore
    simulations: int
    on_bounds: Mapping[tuple[str, str], float]
    held: Mapping[tuple[str, str], float]
    u: Array
    slopes_v: Array

    @property
    def values_by_key(self) -> dict[tuple[str, str], float]:
        """(owner, name) -> value, those of the parent with their first-order change."""
        x = self.point.x + self.score.shift
        moved = {f.key: f.value(float(v)) for f, v in zip(self.free, x, strict=True)}
        return {**self.on_bounds, **moved}

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """owner -> name -> value, with the parent's parameters that are held on a hard bound."""
        return by_owner({**self.held, **self.values_by_key}, self.hypothesis)


class EffectGrowth:
    """The fit of one effect on top of a parent.

    size : size of the model error at which the effect's parameters are fitted, one of those tried.
    end_u : (k,) coordinates of the effect's parameters at the end of an earlier descent; None descends.  near_u : (k,)
    the same at the end of a descent with the other model of the cell, as a start; None starts from the best of several
    starts.
    """

    def __init__(
        self,
        parent: Parent,
        effect: str,
        size: Size,
        end_u: Array | None = None,
        near_u: Array | None = None,
    ) -> None:
        self.parent, self.effect, self.size = parent, effect, size
        self.end_u = end_u
        self.problem, fit = parent.problem, parent.fit
        # Numbers of the parent's parameters that move to first order; those of the effect itself do not.
        self.parent_columns = np.array([j for j in parent.movable if fit.free[j].owner != effect], dtype=int)
        self.added = tuple(self.problem.parameters_of(effect))
        bounds = np.array([f.bounds for f in self.added]).reshape(-1, 2)
        self.low, self.high = bounds[:, 0], bounds[:, 1]
        self.near_u = near_u
        own_starts = [np.clip(u, self.low, self.high) for u in starts(self.added)]
        self.starts = own_starts if near_u is None else [near_u]
        self.parent_values: ValuesByOwner = {o: v for o, v in fit.values.items() if o != effect}
        self.simulations = 0
        self.fast_errors_v = fast_file_errors_v(self.problem, parent.blocks, (*fit.hypothesis, effect))
        self._errors: dict[bytes, Array | None] = {}
        self._slopes: dict[bytes, Array] = {}

    @cached_property
    def q(self) -> Array:
        """(n + m + c, m + c) orthonormal basis of the whitened sensitivities of the m other parameters and the c errors
        of the file within seconds, with their prior."""
        off = whitened(self.problem, self.parent.blocks, self.fast_errors_v, self.size)[0]
        known_columns = np.column_stack(
            [self.parent.whitened_columns(self.size)[0][:, self.parent_columns], off]
        )
        return np.linalg.qr(np.vstack([known_columns, np.eye(known_columns.shape[1])]))[0]

    def from_own_starts(self) -> EffectGrowth:
        """The same growth, started from the effect's own starts and not from the end of another descent."""
        return self if self.near_u is None else EffectGrowth(self.parent, self.effect, self.size)

    def error_v(self, u: Array) -> Array | None:
        """(n,) V, measured - model; None where the model fails."""
        key = u.tobytes()
        if key not in self._errors:
            self._errors[key] = self._simulated_error_v(u)
        return self._errors[key]

    def _simulated_error_v(self, u: Array) -> Array | None:
        self.simulations += 1
        predicted = self.problem.predict({**self.parent_values, **values_of(self.added, u, (self.effect,))})
        return None if predicted is None else self.problem.measured - predicted

    def jacobian(self, u: Array, e: Array) -> Array | None:
        """(n, k) V, sensitivities of the model per prior standard deviation, by one-sided differences within the
        bounds; None where the model fails."""
        if u.tobytes() in self._slopes:
            return self._slopes[u.tobytes()]
        out = np.zeros((len(e), len(u)))
        for j, bounds in enumerate(zip(self.low, self.high, strict=True)):
            slope = slope_within(self._simulated_error_v, u, e, j, bounds, STEP)
            if slope is None:
                return None
            out[:, j] = -slope
        self._slopes[u.tobytes()] = out
        return out

    def projected(self, columns: Array, tail: Array) -> Array:
        """(n + m + c, j) whitened columns (n, j), stacked on those of the m other parameters' prior, `tail` (m, j), and
        on zeros for the c errors of the file within seconds; minus their projection onto `q`."""
        white = whitened(self.problem, self.parent.blocks, columns, self.size)[0]
        stacked = np.vstack([white, tail, np.zeros((self.fast_errors_v.shape[1], columns.shape[1]))])
        return stacked - self.q @ (self.q.T @ stacked)

    def residual(self, u: Array) -> Array | None:
        """Least-squares residual of (1): the whitened residual at the inner minimum, then the coordinates."""
        e = self.error_v(u)
        if e is None:
            return None
        tail = -self.parent.fit.point.x[self.parent_columns][:, None]
        return np.concatenate([self.projected(e[:, None], tail)[:, 0], u])

    def slopes(self, u: Array, residual: Array) -> Array | None:
        """(rows, k) slopes of `residual` (rows,)."""
        e = self.error_v(u)
        jacobian = None if e is None else self.jacobian(u, e)
        if jacobian is None:
            return None
        return np.vstack(
            [self.projected(-jacobian, np.zeros((len(self.parent_columns), len(u)))), np.eye(len(u))]
        )

    def held_on_bounds(self) -> dict[tuple[str, str], float]:
        """(owner, name) -> value of the parent's parameters on a hard bound, where they stay."""
        movable, fit = set(self.parent.movable.tolist()), self.parent.fit
        return {
            f.key: f.value(float(x))
            for j, (f, x) in enumerate(zip(fit.free, fit.point.x, strict=True))
            if j not in movable and f.owner != self.effect
        }

    def possible_changes_v(self) -> Array:
        """(n, c) V, changes of the voltage that the effect can make, as columns: the sensitivities at each start and at
        the end of the descent, if there is one, and the change from the parent to there; c is 0 where none of these can
        be simulated."""
        columns = [np.zeros((len(self.parent.fit.point.residual_v), 0))]
        end = [] if self.end_u is None else [self.end_u]
        for u in {one.tobytes(): one for one in (*self.starts, *end)}.values():
            e = self.error_v(u)
            jacobian = None if e is None else self.jacobian(u, e)
            if e is not None and jacobian is not None:
                columns += [jacobian, (self.parent.fit.point.residual_v - e)[:, None]]
        return np.hstack(columns)

    def first_slopes(self) -> Array | None:
        """(n, k) V, sensitivities at the start of the descent; None where it cannot be simulated there."""
        u = self._most_promising()
        e = None if u is None else self.error_v(u)
        return None if u is None or e is None else self.jacobian(u, e)

    def grow(self) -> Grown | None:
        """The effect fitted on its parent: the end of its descent within the bounds, scored; None where the effect
        cannot be simulated, or has no score."""
        self.end_u = u = self._descended() if self.end_u is None else self.end_u
        if u is None:
            return None
        e = self.error_v(u)
        jacobian = None if e is None else self.jacobian(u, e)
        try:
            return None if e is None or jacobian is None else _scored(self, u, e, jacobian)
        except FitError:
            return None

    def _descended(self) -> Array | None:
        start = self._most_promising()
        if start is None:
            return None
        jumps = self.problem.jumps(self.added)
        return descend(self, start, self.low, self.high, ROUNDS, self._no_gain, jumps=jumps).known_x

    def _no_gain(self, residual: Array) -> float:
        """Nats that count as no gain over a `residual`."""
        return no_gain(residual[: len(self.problem.measured)])

    def _most_promising(self) -> Array | None:
        """The start from which one step reduces the objective most; None where no start can be simulated."""
        if len(self.starts) == 1:
            return self.starts[0]
        costs = []
        for u in self.starts:
            residual = self.residual(u)
            slopes = None if residual is None else self.slopes(u, residual)
            if residual is not None and slopes is not None:
                costs.append((foreseen_cost(u, residual, slopes, self.low, self.high), u))
        return min(costs, key=lambda one: one[0])[1] if costs else None


def expected_score(parent: Parent, slopes_v: Array) -> float:
    """Expected score (`PredictiveScore.total`, nats) of a parent with one more effect, to first order and without a
    simulation. The gain over the parent is this minus the parent's own score.

    slopes_v : (n, k) V, sensitivities of the effect as they were on another parent.
    The model error has the size of the parent's score or that of a right hypothesis, whichever scores higher; -inf
    where there is no score.
    """
    fit, prior = parent.fit, PRIORS[parent.problem.trust]
    own = SplitTable(parent.problem, parent.blocks, np.column_stack([fit.point.residual_v, slopes_v]))
    x = np.concatenate([fit.point.padded_x, np.zeros(slopes_v.shape[1])])
    open_ends = np.tile([-np.inf, np.inf], (slopes_v.shape[1], 1))
    bounds = np.vstack([fit.point.padded_bounds, open_ends])
    totals = []
    for size in {fit.score.size, prior.nearest(prior.median)}:
        known, log_det = parent.whitened_columns(size)
        new, _ = own.whitened(size)
        sums = block_sums(parent.blocks, np.column_stack([new[:, :1], known, new[:, 1:]]), log_det)
        try:
            totals.append(score_at_size(parent.blocks, sums, x, bounds, size, prior.log_density(size)).total)
        except FitError:
            return -np.inf
    return max(totals)


def _scored(growth: EffectGrowth, u: Array, e: Array, jacobian: Array) -> Grown:
    parent, fit = growth.parent, growth.parent.fit
    lowest, highest = at_ends(u, growth.low, growth.high)
    inside = ~(lowest | highest)  # a linear form ignores bounds
    x = np.concatenate([fit.point.x[growth.parent_columns], u[inside]])
    bounds = np.vstack(
        [
            fit.point.bounds[growth.parent_columns],
            np.column_stack([growth.low, growth.high])[inside].reshape(-1, 2),
        ]
    )
    slopes = np.column_stack([fit.point.jacobian_v[:, growth.parent_columns], jacobian[:, inside]])
    point = Linearised(x, e, slopes, bounds, growth.fast_errors_v)
    prior, sums_at = PRIORS[growth.problem.trust], _sums_of(growth, point)
    scores = [
        score_at_size(
            parent.blocks, sums_at(size), point.padded_x, point.padded_bounds, size, prior.log_density(size)
        )
        for size in prior.sizes
    ]
    hypothesis = (*fit.hypothesis, growth.effect)
    free = (
        *(fit.free[j] for j in growth.parent_columns),
        *(f for f, i in zip(growth.added, inside, strict=True) if i),
    )
    on_bounds = {f.key: f.value(float(v)) for f, v, i in zip(growth.added, u, inside, strict=True) if not i}
    score, held = best_over_sizes(scores, len(x)), growth.held_on_bounds()
    return Grown(hypothesis, free, point, score, growth.simulations, on_bounds, held, u, jacobian)


def _sums_of(growth: EffectGrowth, point: Linearised) -> Callable[[Size], BlockSums]:
    """Size of the model error -> sums over each block of a linear form whose first parameters are the parent's. Where
    columns have to be whitened at each size, those of the parent are shared by all growths on it."""
    parent, blocks = growth.parent, growth.parent.blocks
    if blocks.windows is not None:
        return SizeSums(SplitTable(growth.problem, blocks, point.table())).at
    added = point.jacobian_v[:, len(growth.parent_columns) :]
    own = SplitTable(growth.problem, blocks, np.column_stack([point.residual_v, added, point.fast_errors_v]))

    def at(size: Size) -> BlockSums:
        known, _ = parent.whitened_columns(size)
        new, log_det = own.whitened(size)
        return block_sums(
            blocks, np.column_stack([new[:, :1], known[:, growth.parent_columns], new[:, 1:]]), log_det
        )

    return at


Explanation = FittedHypothesis | Grown
"""A hypothesis that was tried: fitted with the whole model, or grown (to first order, except its last effect)."""
