"""Bands for predictions without measured voltage, by how long ago the last measurement was.

Errors of such predictions depend on each other for minutes, so samples are not what is counted: the records
are cut into blocks, and the band is the conformal quantile over blocks (`grouped_conformal_quantile`). For a
sample of a new block that is exchangeable with the calibration blocks, it covers with at least 1 - alpha.
Blocks of one drive are exchangeable only as far as the drive is stationary: the guarantee is approximate
there, and void outside the currents and states of charge that were calibrated.

The band is symmetric about the prediction. With current and state of charge it is scaled by the size of
error they predict (`local_scale`), the scale of a block being fitted without that block's fold.
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
from aesi.numerics.quantiles import grouped_conformal_quantile
from aesi.numerics.typing import Array, IntArray
from aesi.records import ErrorSeries, FreeRun

SCHEMA = "aesi.free_run_bands/1"
WHOLE_DRIVE = math.inf
"""The horizon of a prediction from the start of a record to its end."""
BLOCK_S = 60.0
MIN_BLOCKS = 20
"""Blocks of the whole drive are ten times BLOCK_S, or shorter where that would leave fewer than this."""
N_FOLDS = 5


@dataclass(frozen=True, eq=False)
class HorizonBand:
    """One horizon. half_v : V, the half-width without covariates.  factor, scale : with them, half-width =
    factor * scale; None where calibrated without.  n_blocks : blocks that were counted."""

    horizon_s: float
    half_v: float
    n_blocks: int
    factor: float | None = None
    scale: LocalScale | None = None

    def half_width(self, columns: Array | None, n: int) -> Array:
        """(n,) V; columns : (n, p) of `local_scale.covariates`, or None."""
        if columns is None or self.scale is None or self.factor is None:
            return np.full(n, self.half_v)
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
        alpha: float = 0.1,
        current_a: Sequence[Array] | None = None,
        soc: Sequence[Array] | None = None,
        block_s: float | None = None,
    ) -> FreeRunBands:
        """Calibrate on honest prediction errors: of records, or folds, that the model was not fitted to.

        errors_by_horizon : horizon in s (WHOLE_DRIVE: from the start of the record) -> one (n_i,) array a
        continuous record, V, measured minus predicted at that sample from a measurement `horizon` earlier;
        NaN where there is no such prediction.  dt_s : s.
        current_a, soc : one (n_i,) array a record, A and 1, for locally scaled bands.
        block_s : s, length of the blocks; default twice the horizon but at least a minute; for the whole
        drive ten minutes, or as much as leaves MIN_BLOCKS blocks.

        Raises InputError for arrays that do not match, FitError for too few blocks or errors all zero.
        """
        if not errors_by_horizon:
            raise InputError("no horizon to calibrate; give errors for at least one.")
        columns = None
        if current_a is not None and soc is not None:
            columns = [covariates(i, s, dt_s) for i, s in zip(current_a, soc, strict=True)]
        bands = [
            _calibrate(horizon, errors_by_horizon[horizon], columns, dt_s, alpha, block_s)
            for horizon in sorted(errors_by_horizon)
        ]
        return cls(alpha, tuple(bands))

    def at(
        self,
        horizon_s: float,
        n: int,
        dt_s: float,
        current_a: Array | None = None,
        soc: Array | None = None,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to predictions made `horizon_s` ahead; between two calibrated horizons
        the half-width is interpolated in the logarithm of time."""
        return _symmetric(
            self._half_widths(np.full(n, horizon_s, dtype=np.float64), _columns(current_a, soc, dt_s))
        )

    def along(
        self, n: int, dt_s: float, current_a: Array | None = None, soc: Array | None = None
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to a free run of n samples from a measurement at its first sample.

        Below the shortest horizon its band holds; from ten times the longest finite one on, that of the
        whole drive.
        """
        return _symmetric(
            self._half_widths(dt_s * np.arange(n, dtype=np.float64), _columns(current_a, soc, dt_s))
        )

    def intervals(self, series: ErrorSeries, free: FreeRun) -> Intervals:
        """The band along a free run of a record; `warm` is False outside the trained range, where the band is
        not calibrated."""
        low, high = self.along(len(series), series.dt_s, series.current_a, series.soc)
        return Intervals(low, high, ~free.outside)

    def to_dict(self) -> State:
        """Plain values and numpy arrays only; the whole drive's horizon is None."""
        return {
            "schema": SCHEMA,
            "alpha": self.alpha,
            "horizons": [
                {
                    "horizon_s": band.horizon_s if math.isfinite(band.horizon_s) else None,
                    "half_v": band.half_v,
                    "n_blocks": band.n_blocks,
                    "factor": band.factor,
                    "scale": None if band.scale is None else band.scale.to_state(),
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
                float(item["half_v"]),
                int(item["n_blocks"]),
                None if item["factor"] is None else float(item["factor"]),
                None if item["scale"] is None else LocalScale.from_state(item["scale"]),
            )
            for item in state["horizons"]
        ]
        return cls(float(state["alpha"]), tuple(bands))

    def _half_widths(self, elapsed_s: Array, columns: Array | None) -> Array:
        n = len(elapsed_s)
        halves = np.array([band.half_width(columns, n) for band in self.horizons])
        finite = [band.horizon_s for band in self.horizons if math.isfinite(band.horizon_s)]
        if not finite:
            return np.asarray(halves[0])
        # Position of each sample on the list of horizons: in log time between two of them; past the last
        # finite one, ten times its length takes it to the whole drive.
        knots = np.log([*finite, *([10 * finite[-1]] if len(finite) < len(halves) else [])])
        place = np.interp(np.log(np.maximum(elapsed_s, finite[0])), knots, np.arange(len(knots)))
        below = np.minimum(place.astype(int), len(knots) - 1)
        above = np.minimum(below + 1, len(knots) - 1)
        share, row = place - below, np.arange(n)
        return np.asarray((1 - share) * halves[below, row] + share * halves[above, row])


def _calibrate(
    horizon: float,
    errors: Sequence[Array],
    columns: Sequence[Array] | None,
    dt_s: float,
    alpha: float,
    block_s: float | None,
) -> HorizonBand:
    if columns is not None and [len(e) for e in errors] != [len(c) for c in columns]:
        raise InputError(
            f"errors at {horizon:g} s and covariates differ in length; give one row a sample of both."
        )
    length = max(1, round((block_s or _block_s(horizon, errors, dt_s)) / dt_s))
    blocks = [rows for i, e in enumerate(errors) for rows in _blocks(i, e, length)]
    sizes = [np.abs(errors[i][rows]) for i, rows in blocks]
    half = grouped_conformal_quantile(sizes, alpha)
    if not half > 0:
        raise FitError(f"the errors at {horizon:g} s are zero; calibrate on predictions of measured voltage.")
    if columns is None:
        return HorizonBand(horizon, half, len(blocks))
    tables = [columns[i][rows] for i, rows in blocks]
    scores = _scaled_scores(sizes, tables)
    scale = LocalScale.fit(np.concatenate(tables), np.concatenate(sizes))
    return HorizonBand(horizon, half, len(blocks), grouped_conformal_quantile(scores, alpha), scale)


def _block_s(horizon: float, errors: Sequence[Array], dt_s: float) -> float:
    if math.isfinite(horizon):
        return max(BLOCK_S, 2 * horizon)
    total = dt_s * sum(int(np.isfinite(e).sum()) for e in errors)
    return min(10 * BLOCK_S, total / MIN_BLOCKS)


def _blocks(record: int, errors: Array, length: int) -> list[tuple[int, IntArray]]:
    """(record, row numbers) of each block that holds a finite error; a short rest joins the last block."""
    rows = np.flatnonzero(np.isfinite(errors)).astype(np.int64)
    count = max(1, len(rows) // length)
    return [(record, part) for part in np.array_split(rows, count) if part.size]


def _scaled_scores(sizes: list[Array], tables: list[Array]) -> list[Array]:
    """|error| over the local scale, which is fitted on the other folds; contiguous blocks share a fold."""
    n = len(sizes)
    fold = np.arange(n) * N_FOLDS // n
    scores: list[Array] = []
    for own in range(N_FOLDS):
        others = [j for j in range(n) if fold[j] != own]
        scale = LocalScale.fit(
            np.concatenate([tables[j] for j in others]), np.concatenate([sizes[j] for j in others])
        )
        scores += [sizes[j] / scale(tables[j]) for j in range(n) if fold[j] == own]
    return scores


def _columns(current_a: Array | None, soc: Array | None, dt_s: float) -> Array | None:
    return None if current_a is None or soc is None else covariates(current_a, soc, dt_s)


def _symmetric(half: Array) -> tuple[Array, Array]:
    return -half, half
