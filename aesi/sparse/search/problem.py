"""Everything that a whole search shares, computed once: library, resamples, triangular factors.

All candidates of a search are judged on the same resamples (common random numbers), so their Gram matrices
can be computed once for the whole library and sliced. Three kinds of row weights are fitted:

- moving-block bootstrap resamples, for the ensemble and its out-of-bag loss;
- folds: all rows but one contiguous piece, for out-of-fold residuals, and for the validation loss where there
  are no validation records;
- all rows, for the refit after stability selection.

Out-of-bag and validation losses are taken in free run inside pieces of `horizon` rows, each started from its measured
error (`regime="one_step"` for the loss as the paper prints it). One-step losses cannot tell a good simulator from one
that repeats the last measured error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from aesi.errors import DataError
from aesi.numerics.blocks import (
    CountArray,
    Span,
    leave_out_weights,
    moving_block_weights,
    pieces,
    starts_mask,
)
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.numerics.weighted_grams import orthonormal, triangular_factors, weighted_grams
from aesi.records import HeldOutDrive, Split
from aesi.sparse.search.prepare import not_finite, prepared_series, variables
from aesi.sparse.search.rows import (
    balanced_weights,
    default_block,
    left_out_pieces,
    nearness_of_left_out,
    spans_of,
    temperatures,
)
from aesi.sparse.search.unseen import unseen_errors
from aesi.sparse.terms.basis import FUNCTIONS, values
from aesi.sparse.terms.library import Library, evaluate_terms
from aesi.sparse.terms.scaling import Outside, Scaling
from aesi.sparse.trained_region import TrainedRegion

Regime = Literal["free_run", "one_step"]


@dataclass(frozen=True)
class Options:
    """How a problem is set up.

    inputs : names of the inputs (default: those of the records).
    p_c, d, factors, special, mixed : extent of the library, see `Library.build`.
    resamples, block : bootstrap resamples, and rows in a block (default: 500, or a tenth of the rows where
    there are fewer than 5,000).
    best : share of resamples that enters the ensemble.  horizon : rows of a free run (default: the block).
    fold : rows of a left-out piece (default: records, each cut into `cuts`, or an eighth of the rows of a single one).
    regime : what the losses measure.  outside : what happens beyond the trained range.
    feedback : whether terms may hold the error at all.
    fade : whether a correction without such terms is shrunk towards the physics (fade.py).
    balance : let every record count alike, in fits and losses, whatever the size of its error. Otherwise one
    record near the end of discharge, where the error is largest, decides the model for all others.
    """

    inputs: tuple[str, ...] | None = None
    p_c: int = 5
    d: int = 5
    factors: int = 3
    special: bool = True
    mixed: bool = True
    resamples: int = 100
    block: int | None = None
    best: float = 0.1
    horizon: int | None = None
    fold: int | None = None
    cuts: int = 1
    regime: Regime = "free_run"
    outside: Outside = "clip"
    balance: bool = True
    feedback: bool = True
    fade: bool = False
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Problem:
    """Training rows k -> k + 1 of all records, numbered through, and what was computed from them.

    products : (n_products, n) the input parts of the terms; `which` (m,) tells the part of each term.
    error_functions : (12, n) the functions of the fed-back error.  inputs : (n, n_inputs) scaled.
    error, target : (n,) scaled e[k] and e[k + 1].  soc : (n,).  temperature_degc : (n,), NaN where it
    was not measured.  region : what a fit to all rows is fitted to.
    unseen_error, unseen_target : the same by physics that has not seen the row's fold (unseen.py).
    fold_targets : (n_folds, n) the target by the physics of each fold, which a fit without that fold learns.
    counts : (resamples, n) how often each resample holds a row.
    nearness : (n,) what is left of a correction at each row that was fitted without its fold (trained_region.py).
    row_weights : (n,) mean 1, what a row counts in fits and losses (`Options.balance`).
    factors : (resamples, any, m + 1), and fold_factors likewise.  full_factor : (any, m + 1).
    A factor is an F with F' F = [Theta y]' W [Theta y]; W is row_weights times counts, y the target (or a fold's).
    notes : what was left out of the library, and why, one sentence each.
    """

    options: Options
    split: Split
    library: Library
    scaling: Scaling
    dt_s: float
    spans: tuple[Span, ...]
    products: Array
    which: IntArray
    error_functions: Array
    error: Array
    inputs: Array
    target: Array
    unseen_error: Array
    unseen_target: Array
    fold_targets: Array
    soc: Array
    temperature_degc: Array
    region: TrainedRegion
    counts: CountArray
    row_weights: Array
    restart: BoolArray
    folds: tuple[Span, ...]
    nearness: Array
    factors: Array
    fold_factors: Array
    full_factor: Array
    notes: tuple[str, ...] = ()

    @classmethod
    def build(
        cls,
        split: Split,
        options: Options | None = None,
        library: Library | None = None,
        left_out: Sequence[HeldOutDrive] = (),
    ) -> Problem:
        """Set up a search over the training records of `split`; `split.test` is not looked at.

        left_out : the training records under physics that was fitted without each fold, where there is such a one:
        then what is learnt without a fold, and judged on it, is the error of that physics.
        Raises DataError where there is nothing to learn from: no records, records of different sampling, an
        error or all inputs constant, NaN, or fewer rows than library terms.
        """
        options = options or Options()
        train, valid, notes = prepared_series(split, options.inputs, library)
        inputs = train[0].input_names
        library = library or Library.build(
            inputs, options.p_c, options.d, options.factors, options.special, options.mixed
        )
        scaling = Scaling.of([variables(record) for record in train], options.outside)
        scaled = [scaling.apply(variables(record)[:-1]) for record in train]
        rows = np.vstack(scaled)
        target = np.concatenate([scaling.error_to_scaled(record.error_v[1:]) for record in train])
        n = len(target)
        if n <= len(library):
            raise DataError(
                f"a library of {len(library)} terms needs more than the {n} training samples there are; "
                "lower p_c and d, leave out mixed terms, or give more data."
            )
        spans = spans_of([len(block) for block in scaled])
        parts, which = library.input_products
        products = evaluate_terms(parts, rows)
        error_functions = np.stack(
            [values(q, np.ascontiguousarray(rows[:, 0])) for q in range(len(FUNCTIONS))]
        )
        block = _checked_block(options.block, spans)
        cut = _checked_pieces(left_out_pieces(spans, options.fold, options.cuts), options.fold)
        soc = np.concatenate([record.soc[:-1] for record in train])
        temperature = temperatures(train)
        region = TrainedRegion.of(rows[:, 1:], soc, temperature)
        weights = moving_block_weights(spans, block, options.resamples, np.random.default_rng(options.seed))
        error = np.concatenate([scaling.error_to_scaled(record.error_v[:-1]) for record in train])
        drives_left_out = options.fold is None and len(left_out) == len(cut)
        if not drives_left_out or options.feedback:  # pieces of a single record, or terms that hold the error
            left_out = ()
        unseen = unseen_errors(left_out, scaling, error, target, cut)
        columns = _columns(library, which, products, error_functions, (target, *unseen.targets))
        zero = float(scaling.error_to_scaled(np.array(0.0)))
        row_weights = balanced_weights(spans, target - zero) if options.balance else np.ones(n)
        columns *= np.sqrt(row_weights)[:, None]
        q_rows, r = orthonormal(columns)
        m = len(library)
        every = triangular_factors(weighted_grams(q_rows, np.vstack([weights, leave_out_weights(cut, n)])), r)
        return cls(
            options=options,
            split=replace(split, train=train, valid=valid),
            library=library,
            scaling=scaling,
            dt_s=train[0].dt_s,
            spans=spans,
            products=products,
            which=which,
            error_functions=error_functions,
            error=error,
            inputs=rows[:, 1:],
            target=target,
            unseen_error=unseen.error,
            unseen_target=unseen.target,
            fold_targets=unseen.targets if len(unseen.targets) else np.broadcast_to(target, (len(cut), n)),
            soc=soc,
            temperature_degc=temperature,
            region=region,
            counts=weights,
            row_weights=row_weights,
            restart=starts_mask(pieces(spans, options.horizon or block), n),
            folds=cut,
            nearness=nearness_of_left_out(rows[:, 1:], soc, temperature, cut),
            factors=every[: len(weights), :, : m + 1],
            fold_factors=_of_own_target(every[len(weights) :], m, len(unseen.targets)),
            full_factor=r[:, : m + 1],
            notes=notes,
        )

    @property
    def folds_are_drives(self) -> bool:
        """True where folds are whole records, or the parts that `Options.cuts` asks of each, not pieces of rows."""
        return self.options.fold is None and len(self.spans) > 1

    @cached_property
    def fold_drives(self) -> IntArray:
        """(n_folds,) the number of the training record that each fold is of."""
        ends = [b for _, b in self.spans]
        return np.searchsorted(ends, [a for a, _ in self.folds], side="right")

    @property
    def zero(self) -> float:
        """The scaled error at which the physics model is exact."""
        return float(self.scaling.error_to_scaled(np.array(0.0)))

    @property
    def block(self) -> int:
        """Rows of a bootstrap block."""
        return self.options.block or default_block(len(self.target))

    @cached_property
    def unseen(self) -> BoolArray:
        """(n, resamples) the out-of-bag rows of each resample."""
        return np.ascontiguousarray(self.counts.T == 0)

    @cached_property
    def piece_of_row(self) -> IntArray:
        """(n,) the piece, of about a block, on which out-of-bag errors are compared."""
        lengths = [b - a for a, b in pieces(self.spans, self.block)]
        return np.repeat(np.arange(len(lengths)), lengths)

    @cached_property
    def unseen_sizes(self) -> Array:
        """(pieces,) rows of each piece."""
        return np.bincount(self.piece_of_row).astype(float)

    @cached_property
    def unseen_rows(self) -> Array:
        """(pieces, resamples) how many rows of each piece are out of bag."""
        first = np.flatnonzero(np.diff(self.piece_of_row, prepend=-1))
        return np.add.reduceat(self.unseen, first, axis=0, dtype=float)

    def weights(self, resample: int) -> Array:
        """(n,) what each row counts in a resample."""
        return self.counts[resample] * self.row_weights

    def theta(self, which: IntArray) -> Array:
        """(n_terms, n) the given terms along the training rows."""
        return np.asarray(
            self.products[self.which[which]] * self.error_functions[self.library.feedbacks[which]]
        )


def _checked_pieces(cut: tuple[Span, ...], fold: int | None) -> tuple[Span, ...]:
    """What is left out in turn.  Raises DataError for pieces so long that there is but one."""
    if len(cut) < 2:
        raise DataError(
            f"pieces of {fold} rows to leave out in turn leave no other training row to fit; lower search.fold, or "
            "leave it out."
        )
    return cut


def _checked_block(asked: int | None, spans: Sequence[Span]) -> int:
    """Rows of a bootstrap block.  Raises DataError for one that no training record is longer than."""
    longest = max(stop - start for start, stop in spans)
    if asked is not None and asked >= longest:
        raise DataError(
            f"a bootstrap block of {asked} rows is no shorter than the longest training record ({longest} rows), so "
            "that resamples are alike; lower search.block, or leave it out."
        )
    return asked or default_block(spans[-1][1])


def _columns(
    library: Library, which: IntArray, products: Array, error_functions: Array, targets: Sequence[Array]
) -> Array:
    """(n, m + n_targets), stored by columns: the terms along the training rows, and what they are fitted to.

    Raises DataError for the first that is not a number.
    """
    m = len(library)
    columns = np.empty((products.shape[1], m + len(targets)), order="F")
    for j, (product, q) in enumerate(zip(which, library.feedbacks, strict=True)):
        columns[:, j] = products[product] * error_functions[q]
    for j, target in enumerate(targets, start=m):
        columns[:, j] = target
    if not np.isfinite(columns).all():
        raise DataError(not_finite(library, columns))
    return columns


def _of_own_target(factors: Array, m: int, targets: int) -> Array:
    """(n_folds, any, m + 1) factors of the m terms and each fold's own target.

    factors : (n_folds, any, m + 1 + targets), the common target before those of the folds, if any.
    """
    if not targets:
        return factors[:, :, : m + 1]
    return np.stack([factor[:, [*range(m), m + 1 + k]] for k, factor in enumerate(factors)])
