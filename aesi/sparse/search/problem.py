"""The data that all candidates of a search share, computed once: library, resamples, triangular factors.

Out-of-bag and validation losses are taken in free run inside pieces of `horizon` rows, each started from its measured
error (`regime="one_step"` for the loss as the paper prints it). One-step losses cannot tell a good simulator from one
that repeats the last measured error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from aesi.errors import DataError, InputError
from aesi.numerics.blocks import CountArray, Span, moving_block_weights, pieces, starts_mask
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import HeldOutDrive, Split
from aesi.records.checked import check_whole_number
from aesi.sparse.search.factors import Factors, factored
from aesi.sparse.search.prepare import prepared_series
from aesi.sparse.search.rows import (
    TrainingRows,
    balanced_weights,
    default_block,
    folds_are_drives,
    left_out_pieces,
    nearness_of_left_out,
    training_rows,
)
from aesi.sparse.search.unseen import refits_physics_per_fold, unseen_errors
from aesi.sparse.terms.library import Library

Regime = Literal["free_run", "one_step"]


@dataclass(frozen=True)
class Options:
    """Options of a problem.

    inputs : names of the inputs (default: those of the records).
    p_c, d, factors, special, mixed : extent of the library, see `Library.build`.
    resamples, block : number of bootstrap resamples, and rows of a block (default: 500, or a tenth of the rows where
    there are fewer than 5,000).
    best : share of resamples that enters the ensemble.  horizon : rows of a free run (default: the block).
    fold : rows of a left-out piece (default: records, each cut into `cuts`, or an eighth of the rows of a single one).
    regime : of the losses, free run or one step ahead.  feedback : whether terms may hold the error.
    fade : whether a correction without such terms is shrunk towards the physics (fade.py).
    balance : give every record the same weight in fits and losses, whatever its length and its error (very small errors
    excepted). Otherwise a record near the end of discharge, where the error is largest, dominates the model.
    seed : of the resamples.
    Raises InputError for a value that none of these can have.
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
    balance: bool = True
    feedback: bool = True
    fade: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("resamples", "block", "horizon", "fold", "cuts"):
            if (given := getattr(self, name)) is not None:
                check_whole_number(name, given, 1)
        if not 0.0 < self.best <= 1.0:
            raise InputError(f"best = {self.best}: give the share of resamples, above 0 and at most 1.")
        if self.regime not in get_args(Regime):
            raise InputError(f"regime = {self.regime!r}: choose from {', '.join(get_args(Regime))}.")
        if self.inputs is not None and len(set(self.inputs)) < len(self.inputs):
            raise InputError(f"inputs = {', '.join(self.inputs)}: give each name once.")


@dataclass(frozen=True, eq=False)
class Problem(TrainingRows, Factors):
    """The training rows, folds and resamples of a search, with their factors.

    unseen_error, unseen_target : (n,) scaled e[k] and e[k + 1] by physics fitted without the row's fold (unseen.py).
    fold_targets : (n_folds, n) target of a fit without each fold, by the physics of that fold.
    counts : (resamples, n) number of times that each resample holds a row.
    row_weights : (n,) weight of each row in fits and losses, mean 1 (`Options.balance`).
    restart : (n,) True where a free run of the losses starts.
    folds : row ranges that are left out in turn.
    nearness : (n,) weight at each row of a correction that was fitted without its fold (trained_region.py).
    notes : a sentence on each input that was left out of the library.
    """

    options: Options
    split: Split
    dt_s: float
    unseen_error: Array
    unseen_target: Array
    fold_targets: Array
    counts: CountArray
    row_weights: Array
    restart: BoolArray
    folds: tuple[Span, ...]
    nearness: Array
    notes: tuple[str, ...] = ()

    @classmethod
    def build(
        cls,
        split: Split,
        options: Options | None = None,
        library: Library | None = None,
        left_out: Sequence[HeldOutDrive] = (),
    ) -> Problem:
        """The problem of a search over the training records of `split`; `split.test` is not used.

        left_out : the training records with physics fitted without each fold, or empty. A fit without a fold then
        learns the error of that physics, and is judged by it on the fold.
        Raises DataError for no records, records of different sampling, a constant error or only constant inputs, NaN,
        or fewer rows than library terms; and where `left_out` does not match the folds.
        """
        options = options or Options()
        train, valid, notes = prepared_series(split, options.inputs, library)
        library = library or Library.build(
            train[0].input_names, options.p_c, options.d, options.factors, options.special, options.mixed
        )
        rows = training_rows(train, library)
        n = len(rows.target)
        block = _checked_block(options.block, rows.spans)
        folds = _checked_pieces(left_out_pieces(rows.spans, options.fold, options.cuts), options.fold)
        drives = folds_are_drives(rows.spans, options.fold)
        if not refits_physics_per_fold(drives, options.feedback, len(left_out), len(folds)):
            left_out = ()
        left_out_errors = unseen_errors(left_out, rows.scaling, rows.error, rows.target, folds)
        row_weights = balanced_weights(rows.spans, rows.target) if options.balance else np.ones(n)
        counts = moving_block_weights(
            rows.spans, block, options.resamples, np.random.default_rng(options.seed)
        )
        return cls(
            **vars(rows),
            **vars(factored(rows, left_out_errors.targets, row_weights, counts, folds)),
            options=options,
            split=replace(split, train=train, valid=valid),
            dt_s=train[0].dt_s,
            unseen_error=left_out_errors.error,
            unseen_target=left_out_errors.target,
            fold_targets=left_out_errors.targets
            if len(left_out_errors.targets)
            else np.broadcast_to(rows.target, (len(folds), n)),
            counts=counts,
            row_weights=row_weights,
            restart=starts_mask(pieces(rows.spans, options.horizon or block), n),
            folds=folds,
            nearness=nearness_of_left_out(rows.inputs, rows.soc, rows.temperature_degc, folds),
            notes=notes,
        )

    @property
    def folds_are_drives(self) -> bool:
        """See `rows.folds_are_drives`."""
        return folds_are_drives(self.spans, self.options.fold)

    @cached_property
    def fold_drives(self) -> IntArray:
        """(n_folds,) number of the training record of each fold."""
        ends = [b for _, b in self.spans]
        return np.searchsorted(ends, [a for a, _ in self.folds], side="right")

    @property
    def block(self) -> int:
        """Rows of a bootstrap block."""
        return self.options.block or default_block(len(self.target))

    @cached_property
    def out_of_bag_rows(self) -> BoolArray:
        """(n, resamples) the out-of-bag rows of each resample."""
        return np.ascontiguousarray(self.counts.T == 0)

    @cached_property
    def piece_of_row(self) -> IntArray:
        """(n,) the piece, of about a block, on which out-of-bag errors are compared."""
        lengths = [b - a for a, b in pieces(self.spans, self.block)]
        return np.repeat(np.arange(len(lengths)), lengths)

    @cached_property
    def piece_sizes(self) -> Array:
        """(pieces,) rows of each piece."""
        return np.bincount(self.piece_of_row).astype(float)

    @cached_property
    def out_of_bag_counts(self) -> Array:
        """(pieces, resamples) how many rows of each piece are out of bag."""
        first = np.flatnonzero(np.diff(self.piece_of_row, prepend=-1))
        return np.add.reduceat(self.out_of_bag_rows, first, axis=0, dtype=float)

    def weights(self, resample: int) -> Array:
        """(n,) weight of each row in a resample."""
        return self.counts[resample] * self.row_weights


def _checked_pieces(cut: tuple[Span, ...], fold: int | None) -> tuple[Span, ...]:
    """What is left out in turn.  Raises DataError for pieces so long, or a record so short, that there is but one, and
    for more pieces than rows."""
    if any(stop <= start for start, stop in cut):
        raise DataError("a training record has fewer rows than the parts that it is cut into; lower cuts.")
    if len(cut) < 2 and fold is None:
        rows = sum(stop - start for start, stop in cut)
        raise DataError(
            f"{rows} rows of one training record are too few to leave a part of them out in turn; give a longer "
            "record, or several."
        )
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
