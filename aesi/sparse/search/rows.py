"""Training rows, numbered over all records: their spans, left-out pieces and weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from aesi.errors import DataError
from aesi.numerics.blocks import Span, pieces
from aesi.numerics.typing import Array, IntArray
from aesi.records import ErrorSeries
from aesi.sparse.search.prepare import variables
from aesi.sparse.terms.basis import FUNCTIONS, values
from aesi.sparse.terms.library import Library, evaluate_terms
from aesi.sparse.terms.scaling import Scaling
from aesi.sparse.trained_region import TrainedRegion


@dataclass(frozen=True, eq=False)
class TrainingRows:
    """Training rows k -> k + 1 of all records, and the library along them.

    spans : row range of each record.
    products : (n_products, n) distinct input parts of the terms.  product_of_term : (m,) number of each term's.
    error_functions : (12, n) the functions of the fed-back error.  inputs : (n, n_inputs) scaled.
    error, target : (n,) scaled e[k] and e[k + 1].  soc : (n,).  temperature_degc : (n,) degC, NaN where it
    was not measured.  region : range of all rows.
    """

    library: Library
    scaling: Scaling
    spans: tuple[Span, ...]
    products: Array
    product_of_term: IntArray
    error_functions: Array
    error: Array
    inputs: Array
    target: Array
    soc: Array
    temperature_degc: Array
    region: TrainedRegion

    def theta(self, which: IntArray) -> Array:
        """(n_terms, n) the given terms along the training rows."""
        return np.asarray(
            self.products[self.product_of_term[which]] * self.error_functions[self.library.feedbacks[which]]
        )


def training_rows(train: Sequence[ErrorSeries], library: Library) -> TrainingRows:
    """Training rows of records that have the inputs of the library.  Raises DataError for fewer rows than terms."""
    scaling = Scaling.of([variables(record) for record in train])
    scaled = [scaling.apply(variables(record)[:-1]) for record in train]
    rows = np.vstack(scaled)
    if len(rows) <= len(library):
        raise DataError(
            f"a library of {len(library)} terms needs more than the {len(rows)} training samples there are; "
            "lower p_c and d, leave out mixed terms, or give more data."
        )
    parts, product_of_term = library.input_products
    soc = np.concatenate([record.soc[:-1] for record in train])
    temperature_degc = np.concatenate([record.degc_or_nan[:-1] for record in train])
    return TrainingRows(
        library,
        scaling,
        spans=spans_of([len(block) for block in scaled]),
        products=evaluate_terms(parts, rows),
        product_of_term=product_of_term,
        error_functions=np.stack(
            [values(q, np.ascontiguousarray(rows[:, 0])) for q in range(len(FUNCTIONS))]
        ),
        error=np.concatenate([scaling.error_to_scaled(record.error_v[:-1]) for record in train]),
        inputs=rows[:, 1:],
        target=np.concatenate([scaling.error_to_scaled(record.error_v[1:]) for record in train]),
        soc=soc,
        temperature_degc=temperature_degc,
        region=TrainedRegion.of(rows[:, 1:], soc, temperature_degc),
    )


def spans_of(lengths: Sequence[int]) -> tuple[Span, ...]:
    """Row ranges of records of these lengths, in sequence."""
    edges = np.concatenate([[0], np.cumsum(lengths)])
    return tuple((int(a), int(b)) for a, b in pairwise(edges))


def default_block(n: int) -> int:
    """Default number of rows of a block: the paper's 500, or a tenth of fewer than 5,000 rows."""
    return min(500, max(10, n // 10))


def folds_are_drives(spans: Sequence[Span], fold: int | None) -> bool:
    """True where folds are whole records or their `Options.cuts` parts, not pieces of `fold` rows."""
    return fold is None and len(spans) > 1


def left_out_pieces(spans: Sequence[Span], fold: int | None, cuts: int) -> tuple[Span, ...]:
    """Pieces of about `fold` rows; for None, records cut into `cuts` each, or eighths of a single record."""
    if folds_are_drives(spans, fold):
        return tuple(piece for a, b in spans for piece in cut_evenly(a, b, cuts))
    return tuple(pieces(spans, fold or max(10, spans[-1][1] // 8)))


def cut_evenly(a: int, b: int, cuts: int) -> list[Span]:
    """The rows a to b - 1 in consecutive pieces."""
    edges = np.linspace(a, b, cuts + 1).round().astype(int)
    return [(int(p), int(q)) for p, q in pairwise(edges)]


def nearness_of_left_out(inputs: Array, soc: Array, temperature_degc: Array, folds: Sequence[Span]) -> Array:
    """(n,) nearness (trained_region.py) of each row to the rows of the other folds."""
    parts = []
    for a, b in folds:
        fold = np.s_[a:b]
        region_of_others = TrainedRegion.of(
            np.delete(inputs, fold, axis=0), np.delete(soc, fold), np.delete(temperature_degc, fold)
        )
        parts.append(region_of_others.nearness(inputs[fold], soc[fold], temperature_degc[fold]))
    return np.concatenate(parts)


LEAST_SHARE = 0.1
"""Least mean squared error of a record in the weights, as a share of the mean over records: a record on which the
physics is nearly exact must not dominate the fit."""


def balanced_weights(spans: Sequence[Span], bare: Array) -> Array:
    """(n,) weights of the rows, mean 1, with which the bare error (n,) of every record adds the same sum of squares."""
    sizes = np.array([b - a for a, b in spans])
    rows = np.maximum(sizes, 1)  # a record of a single sample has no row to judge
    mean_squares = np.array([np.sum(bare[a:b] ** 2) for a, b in spans]) / rows
    record_weights = 1.0 / np.maximum(mean_squares, LEAST_SHARE * mean_squares.mean())
    weights: Array = np.repeat(record_weights / rows, sizes)
    return weights / weights.mean()
