"""Prediction bands of a free run by horizon, the time since the last measured voltage: CV+ over pieces of drives.

Errors of a free run are autocorrelated over minutes, so the exchangeable unit is a piece of a drive and not a sample.
The errors of piece i are normalised, |error| / s_i, by a scale that depends on current, leverage and
distance from the fitted states of charge (`local_scale`) and is fitted to the other pieces. The half-width k h at a
sample solves

    sum_i n_i [share of the normalised errors r of piece i with s_i r <= h]   =   (1 - alpha) sum_i n_i        (1)
    k = t(1 - alpha / 2; m - 1) / z(1 - alpha / 2),     m the number of independent pieces                 (2)

where s_i is taken at that sample: with one scale for all pieces, h is the 1 - alpha quantile of |error|. An atypical
piece counts with the scale that the other pieces predict for it, so it cannot widen the band that it is judged by.
Barber, Candès, Ramdas & Tibshirani, Ann. Statist. 49 (2021) 486, doi:10.1214/20-AOS1965.

A quantile estimated from few pieces is exceeded too often by the next one. (2) widens the band as Student's t does for
a normal error of unknown variance. Pieces that were cut from one left-out stretch of a drive err alike over a whole
drive, so where it is said how many stretches there are, m is their number. At short horizons the errors within a piece
are independent over much shorter times: every FORGOTTEN horizons of a piece count as one.

Only rows inside the range that their model was trained on are counted: a model fitted without the first piece of a
drive extrapolates there, the final model does not. Outside the trained range the inputs are held at its edge, and the
band is wider by as much as the prediction would move if the model were extrapolated (`SparseModel.reach`).

Parts of a drive lie closer to what their models were fitted to than a drive that comes next. Where whole drives can be
left out too, and are enough to tell how much one differs from the next (MIN_PIECES), the band over a whole drive is the
wider one, at each sample, of those calibrated on parts and on drives, which are the same rows and as many stretches.
Over the development splits of `aesi bench splits` (16 candidates) the bands of AESI I cover 91.4 % and 77.9 % of the
worst drive of the LG M50T at a Winkler score of 22.1 mV, and 96.8 and 77.7 % at 57.0 mV of the NMC drive; with each
piece for a stretch, and two drives for enough, 87.9 and 70.9 % at 22.3 mV, and 95.3 and 71.9 % at 55.5 mV. With parts
alone the LG M50T's were covered to 66.7 and 48.3 %. Both put into one calibration cover 64.5 and 47.3 % there: pieces
far from all others then set the scale of the near ones.

Coverage is about 1 - alpha on average over pieces exchangeable with those of the calibration. With few pieces the
coverage of a single drive scatters by many points about that; `HorizonBand.by_piece`, the coverage of each left-out
piece, shows by how many. Outside the trained range nothing is guaranteed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.conformal.horizon_band import HorizonBand, calibrated_band
from aesi.conformal.intervals import Intervals
from aesi.conformal.local_scale import covariates
from aesi.conformal.seen import gap as gap_of
from aesi.conformal.seen import growth
from aesi.errors import InputError
from aesi.numerics.typing import Array, BoolArray, SavedState
from aesi.numerics.visited import Visited
from aesi.records import ErrorSeries, FreeRun

SCHEMA = "aesi.free_run_bands/6"


@dataclass(frozen=True, eq=False)
class FreeRunBands:
    """Bands at miss rate `alpha` for each calibrated horizon, shortest first; seen : what the model was fitted to,
    None where nothing is known of it.  drives : the whole drive's band by drives left out whole, where there is one."""

    alpha: float
    horizons: tuple[HorizonBand, ...]
    seen: Visited | None = None
    drives: HorizonBand | None = None

    def __repr__(self) -> str:
        return f"FreeRunBands({100 * (1 - self.alpha):.0f} %, {len(self.horizons)} horizons)"

    @classmethod
    def fit(
        cls,
        errors_by_horizon: Mapping[float, Sequence[Array]],
        dt_s: float,
        current_a: Sequence[Array],
        alpha: float = 0.1,
        inside: Sequence[BoolArray] | None = None,
        excess: Sequence[Array | None] | None = None,
        gap: Sequence[Array | None] | None = None,
        seen: Visited | None = None,
        stretches: int | None = None,
    ) -> FreeRunBands:
        """Calibrate on out-of-sample prediction errors: of records, or pieces, that the model was not fitted to.

        errors_by_horizon : horizon in s (WHOLE_DRIVE: from the start of the record) -> one (n_i,) array a
        continuous record, V, measured minus predicted at that sample from a measurement `horizon` earlier;
        NaN where there is no such prediction.  dt_s : s.
        current_a : one (n_i,) array a record, A.
        inside : one (n_i,) array a record, True inside the trained range of the model that predicted; None for
        everywhere.
        excess : one (n_i,) array a record, `FreeRun.excess` of that model; None where it keeps no leverage.
        gap : one (n_i,) array a record, of that model (seen.py).  seen : of the model that the bands are for.
        stretches : how many stretches of the records err independently over a whole drive; by default their pieces.

        Raises InputError for arrays that do not match, FitError for too few pieces or errors all zero.
        """
        if not errors_by_horizon:
            raise InputError("no horizon to calibrate; give errors for at least one.")
        beyond, apart = excess or [None] * len(current_a), gap or [None] * len(current_a)
        columns = [covariates(i, dt_s, x, g) for i, x, g in zip(current_a, beyond, apart, strict=True)]
        usable = inside or [np.ones(len(c), dtype=bool) for c in columns]
        bands = [
            calibrated_band(horizon, errors_by_horizon[horizon], columns, usable, alpha, dt_s, stretches)
            for horizon in sorted(errors_by_horizon)
        ]
        return cls(alpha, tuple(bands), seen)

    def at(
        self,
        horizon_s: float,
        dt_s: float,
        current_a: Array,
        soc: Array,
        excess: Array | None = None,
        reach_v: Array | float = 0.0,
        temperature_degc: Array | None = None,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to predictions made `horizon_s` ahead; between two calibrated horizons
        the half-width is interpolated in the logarithm of time.  reach_v : (n,) what to add to it, how far the
        prediction would move if the model went on beyond its trained range."""
        columns = covariates(current_a, dt_s, excess, self._gap(soc))
        return self._around(np.full(len(soc), horizon_s), columns, reach_v, temperature_degc)

    def along(
        self,
        dt_s: float,
        current_a: Array,
        soc: Array,
        excess: Array | None = None,
        reach_v: Array | float = 0.0,
        temperature_degc: Array | None = None,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to a free run of n samples from a measurement at its first sample.

        Below the shortest horizon its band holds; from ten times the longest finite one on, that of the
        whole drive.  reach_v : as for `at`.
        """
        elapsed = dt_s * np.arange(len(soc), dtype=np.float64)
        columns = covariates(current_a, dt_s, excess, self._gap(soc))
        return self._around(elapsed, columns, reach_v, temperature_degc)

    def intervals(
        self, series: ErrorSeries, free: FreeRun, reach_v: Array | float = 0.0, horizon_s: float | None = None
    ) -> Intervals:
        """The band along a free run of a record, or of predictions `horizon_s` ahead, with their own `reach_v`;
        `warm` is False outside the trained range, where the band is not calibrated."""
        where = (
            series.dt_s,
            series.current_a,
            series.soc,
            free.excess,
            reach_v,
            series.temperature_degc,
        )
        low, high = self.along(*where) if horizon_s is None else self.at(horizon_s, *where)
        return Intervals(low, high, ~free.outside)

    def to_dict(self) -> SavedState:
        """Plain values and numpy arrays only."""
        return {
            "schema": SCHEMA,
            "alpha": self.alpha,
            "horizons": [band.to_state() for band in self.horizons],
            "seen": None if self.seen is None else self.seen.to_state(),
            "drives": None if self.drives is None else self.drives.to_state(),
        }

    @classmethod
    def from_dict(cls, state: SavedState) -> FreeRunBands:
        """Inverse of `to_dict`; arrays may come back as lists. Raises InputError for another schema."""
        if state.get("schema") != SCHEMA:
            raise InputError(
                f"bands have schema {state.get('schema')!r}, this version reads {SCHEMA!r}; run the experiment again."
            )
        alpha = float(state["alpha"])
        seen = None if state["seen"] is None else Visited.from_state(state["seen"])
        drives = None if state["drives"] is None else HorizonBand.from_state(state["drives"], alpha)
        return cls(
            alpha, tuple(HorizonBand.from_state(item, alpha) for item in state["horizons"]), seen, drives
        )

    def no_narrower_than(self, drives: FreeRunBands) -> FreeRunBands:
        """The same, over a whole drive no narrower than the given ones there."""
        return replace(self, drives=drives.horizons[-1])

    def _gap(self, soc: Array) -> Array | None:
        return None if self.seen is None else gap_of(self.seen, soc)

    def _around(
        self, elapsed_s: Array, columns: Array, reach_v: Array | float, temperature_degc: Array | None
    ) -> tuple[Array, Array]:
        halves = np.array([band.half_width(columns) for band in self.horizons])
        if self.drives is not None and self.horizons[-1].horizon_s == self.drives.horizon_s:
            halves[-1] = np.maximum(halves[-1], self.drives.half_width(columns))
        half = _between(halves, [band.horizon_s for band in self.horizons], elapsed_s) + reach_v
        if self.seen is not None:
            half = half * growth(self.seen, temperature_degc)
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
