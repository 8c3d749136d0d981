"""Prediction bands of a free run by horizon, the time since the last measured voltage: CV+ over pieces of drives.

Errors of a free run are autocorrelated over minutes, so the exchangeable unit is a piece of a drive and not a sample.
The errors of piece i are normalised, |error| / s_i, by a scale that follows the uncertainty of physics and correction
given the fitted rows (`local_scale`). s_i is fitted to the pieces that share no row with piece i. The half-width
k h at a sample solves

    sum_i n_i [share of the normalised errors r of piece i with s_i r <= h]   =   (1 - alpha) sum_i n_i        (1)
    k = t(1 - alpha / 2; m - 1) / z(1 - alpha / 2),     m the number of independent pieces                 (2)

where s_i is taken at that sample: with one scale for all pieces, h is the 1 - alpha quantile of |error|. An atypical
piece counts with the scale that the other pieces predict for it, so it cannot widen the band that it is judged by.
Barber, Candès, Ramdas & Tibshirani, Ann. Statist. 49 (2021) 486, doi:10.1214/20-AOS1965.

A quantile estimated from few pieces is exceeded too often by the next one. (2) widens the band as Student's t does for
a normal error of unknown variance. Pieces that were cut from one left-out stretch of a drive have similar errors over a
whole drive, so where the number of stretches is given, m is that of those that calibrate. (If all five that are given
counted where the rows of two lie outside the range, the bands would cover 83 % of drives with a constant normal error
instead of 90.) Halves of a repeat that are left out separately count as two. If the error of a drive were constant, the
bands of three drives would then cover 85 % instead of 90. On measured drives it is not: over the development splits of
`aesi bench splits` that train on three parts of the NMC drive the bands of the declared model cover 92.7 % and score
93.7 mV, and 97.1 % and 112.3 mV with the number of drives for m. At short horizons the errors within a piece are
independent over much shorter times: every CORRELATED_HORIZONS horizons of a piece count as one.

Only rows inside the range that their model was trained on are counted: a model fitted without the first piece of a
drive extrapolates there, the final model does not. Outside the trained range the inputs are held at its edge, and the
band is wider by as much as the prediction would move if the model were extrapolated (`SparseModel.reach`).

Pieces have no information on temperatures that no fitted row had. Rows at such temperatures are left out of the
calibration of every model, unless too few pieces remain. The uncertainty of the activation energies there is added to
the calibrated width as an independent error (parameter_spread.py). So is the uncertainty of the initial state of charge
of a record, where it was read from a voltage: the pieces of a drive start where the rows before them end.

Parts of a drive are closer to the training data of their models than the next drive is, and whole drives may be further
away. Both are left out and used together, since the scale accounts for the distance.

Coverage is about 1 - alpha on average over pieces exchangeable with those of the calibration. With few pieces the
coverage of a single drive scatters by many points about that; `HorizonBand.by_piece`, the coverage of each left-out
piece, shows by how many. Outside the trained range nothing is guaranteed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from aesi.conformal.horizon_band import WHOLE_DRIVE, HorizonBand, calibrated_band
from aesi.conformal.intervals import Intervals
from aesi.conformal.local_scale import covariates
from aesi.conformal.parameter_spread import spread, thermal_spread
from aesi.errors import InputError
from aesi.numerics.files.restored import reading_back, saved_array
from aesi.numerics.quantiles import check_miss_rate
from aesi.numerics.typing import Array, BoolArray, SavedState
from aesi.numerics.visited import Visited
from aesi.records import ErrorSeries, FreeRun
from aesi.records.checked import checked_dt, is_finite_number

SCHEMA = "aesi.free_run_bands/8"


@dataclass(frozen=True, eq=False)
class FreeRunBands:
    """Bands at miss rate `alpha` for each calibrated horizon, shortest first.

    seen : states of charge and temperatures of the fitted rows.  root : (k, k) root of the posterior covariance of the
    first k parameters of which a record has slopes.  energies_j_mol : standard deviation of the activation energy of
    each parameter, J/mol (parameter_spread.py). Each is None where it is not known.
    """

    alpha: float
    horizons: tuple[HorizonBand, ...]
    seen: Visited | None = None
    root: Array | None = None
    energies_j_mol: Array | None = None

    def __repr__(self) -> str:
        return f"FreeRunBands({100 * (1 - self.alpha):g} %, {len(self.horizons)} horizons)"

    @classmethod
    def fit(
        cls,
        errors_by_horizon: Mapping[float, Sequence[Array]],
        dt_s: float,
        spread_v: Sequence[Array] | None = None,
        alpha: float = 0.1,
        inside: Sequence[BoolArray] | None = None,
        excess: Sequence[Array | None] | None = None,
        seen: Visited | None = None,
        root: Array | None = None,
        energies_j_mol: Array | None = None,
        stretches: int | None = None,
        records: Sequence[str] | None = None,
    ) -> FreeRunBands:
        """The bands calibrated on out-of-sample prediction errors: of records, or pieces, not in the model's fit.

        errors_by_horizon : horizon in s (WHOLE_DRIVE: from the start of the record) -> one (n_i,) array per continuous
        record, V, measured minus predicted at each sample from a measurement `horizon` earlier; NaN where there is no
        such prediction.  dt_s : sampling interval, s.  alpha : miss rate, in (0, 1).
        spread_v : one (n_i,) array per record, V, spread of the physics of a fit without that record.
        inside : one (n_i,) array per record, True inside the trained range of the model that predicted; None for
        everywhere.
        excess : one (n_i,) array per record, `FreeRun.excess` of that model; None where it has no leverage.
        seen, root, energies_j_mol : of the model that the bands are for.
        stretches : number of stretches with independent errors over a whole drive, of which those count that calibrate
        the band; None takes the number of pieces.
        records : name of the record of each array, where several arrays are of one record (with the same row numbers):
        no piece is scored by a scale that was fitted to its own rows. None where each array is a record of its own.

        Raises InputError for an inadmissible alpha, horizon or step, and for arrays that do not match; FitError for too
        few pieces, for a piece that shares rows with all others, and for errors that are all zero.
        """
        check_miss_rate(alpha)
        dt_s = checked_dt(dt_s)
        if not errors_by_horizon:
            raise InputError("no horizon to calibrate; give errors for at least one.")
        for horizon_s in errors_by_horizon:
            _check_horizon(horizon_s)
        lengths = [len(each) for each in next(iter(errors_by_horizon.values()))]
        _check_lengths(lengths, spread_v=spread_v, inside=inside, excess=excess)
        if records is not None and len(records) != len(lengths):
            raise InputError(
                f"{len(records)} names of records for the errors of {len(lengths)}; give one a record."
            )
        spreads = [np.zeros(n) for n in lengths] if spread_v is None else spread_v
        excesses = [None] * len(lengths) if excess is None else excess
        columns = [covariates(p, x) for p, x in zip(spreads, excesses, strict=True)]
        usable = [np.ones(n, dtype=bool) for n in lengths] if inside is None else inside
        bands = [
            calibrated_band(
                horizon, errors_by_horizon[horizon], columns, usable, alpha, dt_s, stretches, records
            )
            for horizon in sorted(errors_by_horizon)
        ]
        return cls(alpha, tuple(bands), seen, root, energies_j_mol)

    def at(
        self,
        horizon_s: float,
        spread_v: Array,
        excess: Array | None = None,
        reach_v: Array | float = 0.0,
        open_v: Array | float = 0.0,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to predictions made `horizon_s` (s) ahead; between two calibrated horizons
        the half-width is interpolated in the logarithm of time.

        spread_v : (n,) V, from `spread`.  reach_v : (n,) V, added to the half-width: change of the prediction if the
        model were extrapolated beyond its trained range.  open_v : (n,) V, standard deviation of errors that the pieces
        do not contain, such as `thermal`.
        Raises InputError for a horizon that is not positive.
        """
        _check_horizon(horizon_s)
        elapsed = np.full(len(spread_v), horizon_s)
        return self._bounds(elapsed, spread_v, excess, reach_v, open_v)

    def along(
        self,
        dt_s: float,
        spread_v: Array,
        excess: Array | None = None,
        reach_v: Array | float = 0.0,
        open_v: Array | float = 0.0,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V relative to a free run of n samples, every `dt_s` (s), from a measurement at its first.

        Times below the shortest horizon have its band; times from ten times the longest finite horizon on have that of
        the whole drive.  spread_v, reach_v, open_v : as for `at`.
        Raises InputError for a step that is not positive.
        """
        elapsed = checked_dt(dt_s) * np.arange(len(spread_v), dtype=np.float64)
        return self._bounds(elapsed, spread_v, excess, reach_v, open_v)

    def spread(self, series: ErrorSeries) -> Array:
        """(n,) V, standard deviation of the physics along a record given the fitted rows; 0 where that is not known.

        Raises InputError for a record without the necessary slopes."""
        if self.root is None:
            return np.zeros(len(series))
        return spread(_slopes(series, len(self.root)), self.root)

    def thermal(self, series: ErrorSeries) -> Array:
        """(n,) V, standard deviation of the physics along a record by its distance from the fitted temperatures; 0
        where that is not known, or the temperature was not measured.

        Raises InputError for a record without the necessary slopes."""
        if self.energies_j_mol is None or self.seen is None:
            return np.zeros(len(series))
        slopes = _slopes(series, len(self.energies_j_mol))
        return thermal_spread(slopes, self.energies_j_mol, self.seen.per_energy(series.temperature_degc))

    def intervals(
        self, series: ErrorSeries, free: FreeRun, reach_v: Array | float = 0.0, horizon_s: float | None = None
    ) -> Intervals:
        """The band along a free run of a record, or of predictions `horizon_s` ahead, with their own `reach_v`;
        `warm` is False outside the trained range, of temperature too, where the band is not calibrated."""
        start_v = 0.0 if series.start_v is None else series.start_v
        open_v = np.hypot(self.thermal(series), start_v)
        uncertainties = self.spread(series), free.excess, reach_v, open_v
        low, high = (
            self.along(series.dt_s, *uncertainties)
            if horizon_s is None
            else self.at(horizon_s, *uncertainties)
        )
        temperature_known = True if self.seen is None else self.seen.knows(series.degc_or_nan)
        return Intervals(low, high, ~free.outside & temperature_known)

    def to_dict(self) -> SavedState:
        """Plain values and numpy arrays only."""
        return {
            "schema": SCHEMA,
            "alpha": self.alpha,
            "horizons": [band.to_state() for band in self.horizons],
            "seen": None if self.seen is None else self.seen.to_state(),
            "root": self.root,
            "energies_j_mol": self.energies_j_mol,
        }

    @classmethod
    def from_dict(cls, state: SavedState) -> FreeRunBands:
        """Inverse of `to_dict`; arrays may come back as lists. Raises InputError for anything else."""
        with reading_back("bands of a free run"):
            if state.get("schema") != SCHEMA:
                raise InputError(
                    f"bands have schema {state.get('schema')!r}, this version reads {SCHEMA!r}; run the experiment "
                    "again."
                )
            alpha, seen, root, energies = (state[key] for key in ("alpha", "seen", "root", "energies_j_mol"))
            check_miss_rate(alpha)
            bands = tuple(HorizonBand.from_state(item, float(alpha)) for item in state["horizons"])
            horizons_s = [band.horizon_s for band in bands]
            if not bands or horizons_s != sorted(set(horizons_s)):
                raise ValueError(f"its horizons are {horizons_s} s, and not one or more that increase")
            return cls(
                float(alpha),
                bands,
                None if seen is None else Visited.from_state(seen),
                None if root is None else saved_array(root, "root", (len(root), len(root))),
                None if energies is None else saved_array(energies, "energies_j_mol", (None,), 0.0),
            )

    def _bounds(
        self,
        elapsed_s: Array,
        spread_v: Array,
        excess: Array | None,
        reach_v: Array | float,
        open_v: Array | float,
    ) -> tuple[Array, Array]:
        """(low, high), (n,) V, at times elapsed_s (n,) since the last measured voltage; see `at`."""
        columns = covariates(spread_v, excess)
        half_widths = np.array([band.half_width(columns) for band in self.horizons])
        # A recent measurement reduces the independent error in the same ratio as the calibrated width.
        independent_v, whole_drive_v = ndtri(1 - self.alpha / 2) * open_v, half_widths[-1]
        share = np.hypot(1.0, independent_v / np.where(whole_drive_v > 0.0, whole_drive_v, 1.0))
        half_widths = np.where(whole_drive_v > 0.0, half_widths * share, np.hypot(half_widths, independent_v))
        half_width = (
            _interpolated_half_widths(half_widths, [band.horizon_s for band in self.horizons], elapsed_s)
            + reach_v
        )
        return -half_width, half_width


def _check_horizon(horizon_s: object) -> None:
    """Raises InputError for what is no time ahead, s; WHOLE_DRIVE is one."""
    if horizon_s != WHOLE_DRIVE and not (is_finite_number(horizon_s) and horizon_s > 0.0):
        raise InputError(
            f"a horizon of {horizon_s} s is no time ahead; give a positive number of seconds, or WHOLE_DRIVE."
        )


def _check_lengths(lengths: Sequence[int], **arguments: Sequence[Array | BoolArray | None] | None) -> None:
    """Raises InputError where an argument, given by its name, has not one array a record of these lengths."""
    for name, arrays in arguments.items():
        if arrays is None:
            continue
        rows = [n if array is None else len(array) for n, array in zip(lengths, arrays, strict=False)]
        if len(arrays) != len(lengths) or rows != list(lengths):
            raise InputError(
                f"the errors and {name} differ in length; give one array a record, one row a sample."
            )


def _slopes(series: ErrorSeries, count: int) -> Array:
    """(n, count) V, of the first parameters that the record has slopes of."""
    if series.slopes_v is None or series.slopes_v.shape[1] < count:
        raise InputError(
            f"{series.name}: the band asks for {count} slopes of the physics; run the experiment again."
        )
    return series.slopes_v[:, :count]


def _interpolated_half_widths(half_widths: Array, horizons: Sequence[float], elapsed_s: Array) -> Array:
    """(n,) V, half-widths (n_horizons, n) interpolated at each sample's own time since the measurement (n,) s."""
    finite = [horizon for horizon in horizons if math.isfinite(horizon)]
    if not finite:
        return np.asarray(half_widths[0])
    # Position of each sample on the list of horizons: in log time between two of them; past the last finite
    # one, ten times its length takes it to the whole drive.
    knots = np.log([*finite, *([10 * finite[-1]] if len(finite) < len(half_widths) else [])])
    position = np.interp(np.log(np.maximum(elapsed_s, finite[0])), knots, np.arange(len(knots)))
    below = np.minimum(position.astype(int), len(knots) - 1)
    above = np.minimum(below + 1, len(knots) - 1)
    share, row = position - below, np.arange(len(elapsed_s))
    return np.asarray((1 - share) * half_widths[below, row] + share * half_widths[above, row])
