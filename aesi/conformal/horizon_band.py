"""The band at one horizon: equations (1) and (2) of `aesi.conformal.free_run`, calibrated over pieces of drives."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.special import ndtri, stdtrit

from aesi.conformal.local_scale import LocalScale
from aesi.errors import FitError, InputError
from aesi.numerics.files.restored import LEAST_POSITIVE, saved_array, saved_number
from aesi.numerics.typing import Array, BoolArray, IntArray, SavedState

WHOLE_DRIVE = math.inf
"""The horizon of a prediction from the start of a record to its end."""
N_PIECES = 8
"""Number of pieces in all: a record with at least 1.5 times an eighth of the usable rows is cut into pieces of about an
eighth, so that each piece can be scored by a scale fitted to the others. Over the development splits in `aesi bench
splits` the bands of AESI I score 46.1 mV on the NMC drive with 8 and 16, 47.7 mV with 4, and cover 96.3 % of the LG
M50T's with 4 and 8, 66.9 % with 16."""
MIN_PIECES = 3
"""Fewest pieces of a band: fewer do not show how much pieces differ. Where the rows inside the trained range give
fewer, all rows are used and the band is marked `extrapolated`; where all rows give fewer, there is no band. With 6 no
figure of `aesi bench bands --set layouts='["one"]' --set virtual=2` changes, since none of its bands comes near it."""
MIN_ROWS = 30
"""Fewest rows of a piece. With 10 or 100 no figure of those splits changes."""
CORRELATED_HORIZONS = 100
"""Errors this many horizons apart count as independent; nearer ones as correlated. A convention."""
N_LEVELS = 101
"""Quantiles that stand for the scores of a piece: coverage is kept to about one per cent."""
HALVINGS = 14
"""Bisection steps for the half-width: its bracket shrinks to less than a ten-thousandth."""


@dataclass(frozen=True, eq=False)
class HorizonBand:
    """The band at one horizon, by (1) and (2).

    horizon_s : s.  scales : one per piece, fitted to the others.  scores : (n_pieces, n_levels) quantiles of |error| /
    scale of each piece, at even levels from 0 to 1.  counts : (n_pieces,) rows of each piece.  widening : k.
    by_piece : share of each piece's rows whose score lies within the 1 - alpha quantile of all scores.
    extrapolated : whether rows outside the trained range were used, for lack of others.
    """

    horizon_s: float
    alpha: float
    scales: tuple[LocalScale, ...]
    scores: Array
    counts: Array
    widening: float
    by_piece: tuple[float, ...]
    extrapolated: bool

    def half_width(self, columns: Array) -> Array:
        """(n,) V; columns : (n, p) of `local_scale.covariates`."""
        scales = np.array([scale(columns) for scale in self.scales])
        levels = np.linspace(0, 1, self.scores.shape[1])
        quantiles = np.array([np.interp(1 - self.alpha, levels, scores) for scores in self.scores])
        # The quantile of a mixture lies between the quantiles of its parts.
        low, high = (quantiles[:, None] * scales).min(axis=0), (quantiles[:, None] * scales).max(axis=0)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            rows_within = sum(
                count * np.interp(middle / scale, scores, levels)
                for count, scale, scores in zip(self.counts, scales, self.scores, strict=True)
            )
            enough = rows_within >= (1 - self.alpha) * self.counts.sum()
            low, high = np.where(enough, low, middle), np.where(enough, middle, high)
        return self.widening * high

    def to_state(self) -> SavedState:
        """Plain values and numpy arrays only; the whole drive's horizon is None."""
        return {
            "horizon_s": self.horizon_s if math.isfinite(self.horizon_s) else None,
            "scales": [scale.to_state() for scale in self.scales],
            "scores": self.scores,
            "counts": self.counts,
            "widening": self.widening,
            "by_piece": list(self.by_piece),
            "extrapolated": self.extrapolated,
        }

    @classmethod
    def from_state(cls, state: SavedState, alpha: float) -> Self:
        """Inverse of `to_state`.  Raises ValueError for anything else."""
        horizon_s, scales = state["horizon_s"], tuple(map(LocalScale.from_state, state["scales"]))
        if len(scales) < MIN_PIECES:
            raise ValueError(f"a band has {len(scales)} scales, and at least {MIN_PIECES} pieces make one")
        return cls(
            WHOLE_DRIVE if horizon_s is None else saved_number(horizon_s, "horizon_s", LEAST_POSITIVE),
            alpha,
            scales,
            saved_array(state["scores"], "scores", (len(scales), N_LEVELS), 0.0),
            saved_array(state["counts"], "counts", (len(scales),), 1.0),
            saved_number(state["widening"], "widening", LEAST_POSITIVE),
            tuple(saved_array(state["by_piece"], "by_piece", (len(scales),), 0.0, 1.0).tolist()),
            bool(state["extrapolated"]),
        )


@dataclass(frozen=True, eq=False)
class _Piece:
    """sizes : (n,) V, |error|.  columns : (n, p).  record, rows : of which record, (n,) which of its rows.
    array : number of the array of errors that it was cut from."""

    sizes: Array
    columns: Array
    record: str | int
    rows: IntArray
    array: int

    def shares_rows_with(self, other: _Piece) -> bool:
        """Whether a row is in both pieces, even if predicted by different models; True for the piece itself."""
        return self.record == other.record and np.intersect1d(self.rows, other.rows).size > 0


def calibrated_band(
    horizon: float,
    errors: Sequence[Array],
    columns: Sequence[Array],
    inside: Sequence[BoolArray],
    alpha: float,
    dt_s: float,
    stretches: int | None,
    records: Sequence[str] | None,
) -> HorizonBand:
    """The band at one horizon (s), calibrated at miss rate `alpha` on records sampled every dt_s (s).

    errors : one (n_i,) array per record, V, NaN where there is no prediction.  columns : one (n_i, p) per record, see
    `local_scale.covariates`.  inside : one (n_i,) per record, True inside the trained range of the model that
    predicted.  stretches : number of stretches with independent errors over a whole drive, of which those count, at
    least MIN_PIECES, that have a piece; None, or too small a number, takes the number of pieces.
    records : name of the record of each array, where several are of one record (a part of a drive and the whole).
    Raises InputError where lengths differ; FitError for too few pieces, for a piece that shares rows with all others,
    and for errors that are all zero.
    """
    if not [len(e) for e in errors] == [len(c) for c in columns] == [len(i) for i in inside]:
        raise InputError(
            f"errors {_ahead(horizon)} and covariates differ in length; give one row a sample of each."
        )
    names: Sequence[str | int] = range(len(errors)) if records is None else records
    pieces = _pieces(errors, columns, inside, names)
    extrapolated = len(pieces) < MIN_PIECES
    if extrapolated:
        pieces = _pieces(errors, columns, [np.ones(len(e), dtype=bool) for e in errors], names)
    _check_pieces(pieces, horizon)
    scales = [_scale(_apart_from(piece, pieces, horizon), alpha) for piece in pieces]
    scores = [piece.sizes / scale(piece.columns) for piece, scale in zip(pieces, scales, strict=True)]
    counts = np.array([float(score.size) for score in scores])
    independent = float(np.maximum(1, counts * dt_s // (CORRELATED_HORIZONS * horizon)).sum())
    if stretches is not None and stretches >= MIN_PIECES and horizon == WHOLE_DRIVE:
        independent = max(MIN_PIECES, min(stretches, _arrays_apart(pieces)))
    pooled_quantile = np.quantile(np.concatenate(scores), 1 - alpha, method="higher")
    return HorizonBand(
        horizon,
        alpha,
        tuple(scales),
        np.array([np.quantile(score, np.linspace(0, 1, N_LEVELS)) for score in scores]),
        counts,
        _widening(independent, alpha),
        tuple(float(np.mean(score <= pooled_quantile)) for score in scores),
        extrapolated,
    )


class TooFewPieces(FitError):
    """Records are too few or too short for the band of a horizon (horizon_s), which says nothing of the others."""

    def __init__(self, pieces: int, horizon_s: float) -> None:
        advice = "longer records" if horizon_s == WHOLE_DRIVE else "longer records, or a shorter horizon"
        super().__init__(
            f"{pieces} pieces of {MIN_ROWS} or more predictions {_ahead(horizon_s)} cannot calibrate a band: at "
            f"least {MIN_PIECES} are needed; give {advice}."
        )
        self.horizon_s = horizon_s


def _ahead(horizon_s: float) -> str:
    """How a sentence calls a horizon."""
    return "over a whole drive" if horizon_s == WHOLE_DRIVE else f"{horizon_s:g} s ahead"


def _check_pieces(pieces: Sequence[_Piece], horizon: float) -> None:
    """Raises TooFewPieces, or FitError where their errors are all zero."""
    if len(pieces) < MIN_PIECES:
        raise TooFewPieces(len(pieces), horizon)
    if not any(piece.sizes.any() for piece in pieces):
        raise FitError(
            f"the errors {_ahead(horizon)} are zero; calibrate on predictions of measured voltage."
        )


def _apart_from(piece: _Piece, pieces: Sequence[_Piece], horizon: float) -> list[_Piece]:
    """The pieces that share no row with this one.  Raises FitError where there is none."""
    others = [other for other in pieces if not other.shares_rows_with(piece)]
    if not others:
        raise FitError(
            f"no piece is left that shares no row with one of {piece.record}, so that nothing can scale its errors "
            f"{_ahead(horizon)}; give errors of another record, or of other rows."
        )
    return others


def _widening(independent: float, alpha: float) -> float:
    """k of (2)."""
    return float(stdtrit(independent - 1, 1 - alpha / 2) / ndtri(1 - alpha / 2))


def _arrays_apart(pieces: Sequence[_Piece]) -> int:
    """Largest number of arrays with pieces that share no row; a part of a drive and the whole of it are one."""
    of_array: dict[int, list[_Piece]] = {}
    for piece in pieces:
        of_array.setdefault(piece.array, []).append(piece)
    spans = [(each[0].record, int(each[0].rows[0]), int(each[-1].rows[-1])) for each in of_array.values()]
    count, taken_to = 0, dict[str | int, int]()
    for record, first, last in sorted(spans, key=lambda span: span[-1]):  # the most are those that end first
        if first > taken_to.get(record, -1):
            count, taken_to[record] = count + 1, last
    return count


def _scale(pieces: Sequence[_Piece], alpha: float) -> LocalScale:
    return LocalScale.fit(
        np.concatenate([piece.columns for piece in pieces]),
        np.concatenate([piece.sizes for piece in pieces]),
        alpha,
    )


def _pieces(
    errors: Sequence[Array],
    columns: Sequence[Array],
    inside: Sequence[BoolArray],
    records: Sequence[str | int],
) -> list[_Piece]:
    """The usable rows of each record, long records cut into pieces; pieces of too few rows are left out."""
    usable = [np.flatnonzero(np.isfinite(e) & i) for e, i in zip(errors, inside, strict=True)]
    longest = max(MIN_ROWS, -(-sum(rows.size for rows in usable) // N_PIECES))
    return [
        _Piece(np.abs(e[part]), c[part], record, part, array)
        for array, (e, c, rows, record) in enumerate(zip(errors, columns, usable, records, strict=True))
        for part in np.array_split(rows, max(1, round(rows.size / longest)))
        if part.size >= MIN_ROWS
    ]
