"""Training rows, numbered through over all records: which belong together, which are left out, what each counts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from aesi.numerics.blocks import Span, pieces
from aesi.numerics.typing import Array
from aesi.records import ErrorSeries
from aesi.sparse.trained_region import TrainedRegion


def spans_of(lengths: Sequence[int]) -> tuple[Span, ...]:
    """Row ranges of records of these lengths, put one after the other."""
    edges = np.concatenate([[0], np.cumsum(lengths)])
    return tuple((int(a), int(b)) for a, b in pairwise(edges))


def default_block(n: int) -> int:
    """Rows of a block where none is asked for: the paper's 500, or a tenth of fewer than 5,000 rows."""
    return min(500, max(10, n // 10))


def left_out_pieces(spans: Sequence[Span], fold: int | None, cuts: int) -> tuple[Span, ...]:
    """Pieces of about `fold` rows; where none is asked for, records cut into `cuts`, or eighths of a single one."""
    if fold is None and len(spans) > 1:
        return tuple(piece for a, b in spans for piece in cut_evenly(a, b, cuts))
    return tuple(pieces(spans, fold or max(10, spans[-1][1] // 8)))


def cut_evenly(a: int, b: int, cuts: int) -> list[Span]:
    """The rows a to b - 1 in consecutive pieces."""
    edges = np.linspace(a, b, cuts + 1).round().astype(int)
    return [(int(p), int(q)) for p, q in pairwise(edges)]


def temperatures(records: Sequence[ErrorSeries]) -> Array:
    """(n,) degC at each training row, NaN where it was not measured."""
    return np.concatenate(
        [
            np.full(len(r) - 1, np.nan) if r.temperature_degc is None else r.temperature_degc[:-1]
            for r in records
        ]
    )


def nearness_of_left_out(inputs: Array, soc: Array, temperature_degc: Array, folds: Sequence[Span]) -> Array:
    """(n,) what is left at each row (trained_region.py) of a correction fitted to the rows of the other folds."""
    parts = []
    for a, b in folds:
        fold = np.s_[a:b]
        others = TrainedRegion.of(
            np.delete(inputs, fold, axis=0), np.delete(soc, fold), np.delete(temperature_degc, fold)
        )
        parts.append(others.nearness(inputs[fold], soc[fold], temperature_degc[fold]))
    return np.concatenate(parts)


LEAST_SHARE = 0.1
"""A record whose bare error is smaller than this share of the mean counts as if it were this large: a record on
which the physics is all but exact should not rule the fit."""


def balanced_weights(spans: Sequence[Span], bare: Array) -> Array:
    """(n,) mean 1: a weight a row, by which every record's bare error (n,) adds the same to a sum of squares."""
    squares = np.array([np.sum(bare[a:b] ** 2) for a, b in spans])
    sizes = np.array([b - a for a, b in spans])
    each = 1.0 / np.maximum(squares, LEAST_SHARE * squares.mean())
    weights: Array = np.repeat(each, sizes)
    return weights / weights.mean()
