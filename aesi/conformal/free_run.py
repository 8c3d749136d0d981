"""Bands for predictions without measured voltage, by how long ago the last measurement was.

Errors of such predictions depend on each other for minutes, so samples are not what is counted: pieces are.
The half-width is a scale s, which current and state of charge predict (`local_scale`), times a factor. The
factor is the 1 - alpha quantile of |error| / s over all pieces, each scored with the scale of the others: a
new piece, whose errors entered neither, is treated as they were.

Only rows inside the range that their model was trained on are counted. A model fitted without the first piece
of a drive extrapolates there; the final model, asked inside its range, does not, and outside of it says so.

What this promises: 1 - alpha on average over pieces that are exchangeable with those of the calibration. With
few pieces the share covered on one drive scatters by many points about that average; the coverage of each
left-out piece (`HorizonBand.by_piece`) shows by how many. The exact finite-sample bound would take at least
1 / alpha - 1 pieces and the widest of them. Outside the trained range there is no promise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aesi.conformal.band import State
from aesi.conformal.intervals import Intervals
from aesi.conformal.local_scale import LocalScale, covariates
from aesi.errors import FitError, InputError
from aesi.numerics.typing import Array, BoolArray
from aesi.records import ErrorSeries, FreeRun

SCHEMA = "aesi.free_run_bands/2"
WHOLE_DRIVE = math.inf
"""The horizon of a prediction from the start of a record to its end."""
N_PIECES = 8
"""Records longer than this share of all are cut, so that a scale can be scored on what it has not seen."""
MIN_PIECES = 3
MIN_ROWS = 30
"""Rows from which a piece counts."""


@dataclass(frozen=True, eq=False)
class HorizonBand:
    """One horizon: half-width = factor * scale.

    by_piece : share of each calibration piece that the factor covers with the scale of the other pieces.
    extrapolated : whether rows outside the trained range had to be counted, for want of others.
    """

    horizon_s: float
    factor: float
    scale: LocalScale
    by_piece: tuple[float, ...]
    extrapolated: bool = False

    def half_width(self, columns: Array) -> Array:
        """(n,) V; columns : (n, p) of `local_scale.covariates`."""
        return np.asarray(self.factor * self.scale(columns))


@dataclass(frozen=True, eq=False)
class FreeRunBands:
    """Bands at miss rate `alpha` for each calibrated horizon, shortest first."""

    alpha: float
    horizons: tuple[HorizonBand, ...]

    @classmethod
    def fit(
        cls,
        errors_by_horizon: Mapping[float, Sequence[Array]],
        dt_s: float,
        current_a: Sequence[Array],
        soc: Sequence[Array],
        alpha: float = 0.1,
        inside: Sequence[BoolArray] | None = None,
    ) -> FreeRunBands:
        """Calibrate on honest prediction errors: of records, or pieces, that the model was not fitted to.

        errors_by_horizon : horizon in s (WHOLE_DRIVE: from the start of the record) -> one (n_i,) array a
        continuous record, V, measured minus predicted at that sample from a measurement `horizon` earlier;
        NaN where there is no such prediction.  dt_s : s.
        current_a, soc : one (n_i,) array a record, A and 1.
        inside : one (n_i,) array a record, where the model that was asked had been trained on such inputs;
        None for everywhere.

        Raises InputError for arrays that do not match, FitError for too few pieces or errors all zero.
        """
        if not errors_by_horizon:
            raise InputError("no horizon to calibrate; give errors for at least one.")
        columns = [covariates(i, s, dt_s) for i, s in zip(current_a, soc, strict=True)]
        usable = inside or [np.ones(len(c), dtype=bool) for c in columns]
        bands = [
            _calibrate(horizon, errors_by_horizon[horizon], columns, usable, alpha)
            for horizon in sorted(errors_by_horizon)
        ]
        return cls(alpha, tuple(bands))

    def at(self, horizon_s: float, dt_s: float, current_a: Array, soc: Array) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to predictions made `horizon_s` ahead; between two calibrated horizons
        the half-width is interpolated in the logarithm of time."""
        return self._around(np.full(len(soc), horizon_s), dt_s, current_a, soc)

    def along(self, dt_s: float, current_a: Array, soc: Array) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to a free run of n samples from a measurement at its first sample.

        Below the shortest horizon its band holds; from ten times the longest finite one on, that of the
        whole drive.
        """
        return self._around(dt_s * np.arange(len(soc), dtype=np.float64), dt_s, current_a, soc)

    def intervals(self, series: ErrorSeries, free: FreeRun, horizon_s: float | None = None) -> Intervals:
        """The band along a free run of a record, or of predictions `horizon_s` ahead; `warm` is False outside
        the trained range, where the band is not calibrated."""
        where = (series.dt_s, series.current_a, series.soc)
        low, high = self.along(*where) if horizon_s is None else self.at(horizon_s, *where)
        return Intervals(low, high, ~free.outside)

    def to_dict(self) -> State:
        """Plain values and numpy arrays only; the whole drive's horizon is None."""
        return {
            "schema": SCHEMA,
            "alpha": self.alpha,
            "horizons": [
                {
                    "horizon_s": band.horizon_s if math.isfinite(band.horizon_s) else None,
                    "factor": band.factor,
                    "scale": band.scale.to_state(),
                    "by_piece": list(band.by_piece),
                    "extrapolated": band.extrapolated,
                }
                for band in self.horizons
            ],
        }

    @classmethod
    def from_dict(cls, state: State) -> FreeRunBands:
        """Inverse of `to_dict`. Raises InputError for another schema."""
        if state.get("schema") != SCHEMA:
            raise InputError(f"bands have schema {state.get('schema')!r}, this version reads {SCHEMA!r}.")
        bands = [
            HorizonBand(
                WHOLE_DRIVE if item["horizon_s"] is None else float(item["horizon_s"]),
                float(item["factor"]),
                LocalScale.from_state(item["scale"]),
                tuple(float(share) for share in item["by_piece"]),
                bool(item["extrapolated"]),
            )
            for item in state["horizons"]
        ]
        return cls(float(state["alpha"]), tuple(bands))

    def _around(self, elapsed_s: Array, dt_s: float, current_a: Array, soc: Array) -> tuple[Array, Array]:
        columns = covariates(current_a, soc, dt_s)
        halves = np.array([band.half_width(columns) for band in self.horizons])
        half = _between(halves, [band.horizon_s for band in self.horizons], elapsed_s)
        return -half, half


def _between(halves: Array, horizons: Sequence[float], elapsed_s: Array) -> Array:
    """(n,) of (n_horizons, n), interpolated at each sample's own time since the measurement."""
    finite = [horizon for horizon in horizons if math.isfinite(horizon)]
    if not finite:
        return np.asarray(halves[0])
    # Position of each sample on the list of horizons: in log time between two of them; past the last finite
    # one, ten times its length takes it to the whole drive.
    knots = np.log([*finite, *([10 * finite[-1]] if len(finite) < len(halves) else [])])
    place = np.interp(np.log(np.maximum(elapsed_s, finite[0])), knots, np.arange(len(knots)))
    below = np.minimum(place.astype(int), len(knots) - 1)
    above = np.minimum(below + 1, len(knots) - 1)
    share, row = place - below, np.arange(len(elapsed_s))
    return np.asarray((1 - share) * halves[below, row] + share * halves[above, row])


@dataclass(frozen=True, eq=False)
class _Piece:
    """sizes : (n,) V, |error|.  columns : (n, p)."""

    sizes: Array
    columns: Array


def _calibrate(
    horizon: float,
    errors: Sequence[Array],
    columns: Sequence[Array],
    inside: Sequence[BoolArray],
    alpha: float,
) -> HorizonBand:
    if not [len(e) for e in errors] == [len(c) for c in columns] == [len(i) for i in inside]:
        raise InputError(
            f"errors at {horizon:g} s and covariates differ in length; give one row a sample of each."
        )
    pieces = _pieces(errors, columns, inside)
    extrapolated = len(pieces) < MIN_PIECES
    if extrapolated:
        pieces = _pieces(errors, columns, [np.ones(len(e), dtype=bool) for e in errors])
    if len(pieces) < MIN_PIECES:
        raise FitError(
            f"{len(pieces)} pieces of {MIN_ROWS} or more predictions {horizon:g} s ahead cannot calibrate a band: "
            f"at least {MIN_PIECES} are needed; give longer records."
        )
    if not any(piece.sizes.any() for piece in pieces):
        raise FitError(f"the errors at {horizon:g} s are zero; calibrate on predictions of measured voltage.")
    scores = [
        piece.sizes / _scale([other for other in pieces if other is not piece], alpha)(piece.columns)
        for piece in pieces
    ]
    factor = float(np.quantile(np.concatenate(scores), 1 - alpha, method="higher"))
    by_piece = tuple(float(np.mean(score <= factor)) for score in scores)
    return HorizonBand(horizon, factor, _scale(pieces, alpha), by_piece, extrapolated)


def _scale(pieces: Sequence[_Piece], alpha: float) -> LocalScale:
    return LocalScale.fit(
        np.concatenate([piece.columns for piece in pieces]),
        np.concatenate([piece.sizes for piece in pieces]),
        alpha,
    )


def _pieces(errors: Sequence[Array], columns: Sequence[Array], inside: Sequence[BoolArray]) -> list[_Piece]:
    """The usable rows of each record, long records cut; what is too short to count is left out."""
    usable = [np.flatnonzero(np.isfinite(e) & i) for e, i in zip(errors, inside, strict=True)]
    longest = max(MIN_ROWS, -(-sum(rows.size for rows in usable) // N_PIECES))
    return [
        _Piece(np.abs(e[part]), c[part])
        for e, c, rows in zip(errors, columns, usable, strict=True)
        for part in np.array_split(rows, max(1, round(rows.size / longest)))
        if part.size >= MIN_ROWS
    ]
