"""Calibration data of the free-run bands of a model: the errors of its predictions on samples it was not fitted to.

This module does not read `Split.test`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.conformal import WHOLE_DRIVE, FreeRunBands, TooFewPieces
from aesi.conformal.parameter_spread import covariance_root, spread
from aesi.numerics.typing import Array, BoolArray
from aesi.numerics.visited import Visited
from aesi.pipeline.experiment.recalibrate import MEMORY_S, MODEL_ERROR_V
from aesi.pipeline.product.deviations import ENERGIES_J_MOL, PRIORS
from aesi.records import ErrorModel, ErrorSeries, FreeRun
from aesi.sparse import SparseModel
from aesi.sparse.bare import Bare

Unseen = tuple[ErrorModel, ErrorSeries, slice]
"""(model, error series of a record, rows of it that the model was not fitted to)."""
ALL_BUT_FIRST = slice(1, None)
"""All samples of a record but the first, whose voltage is given."""


@dataclass(frozen=True, eq=False)
class OutOfSampleErrors:
    """Errors of predictions on samples that their models have not seen. Lists have one entry of (n_i,) per record.

    dt_s : s, time step.  records : names; a record occurs once for each part of it that was left out.
    by_horizon : horizon, s (WHOLE_DRIVE: from the first sample) -> errors, V, measured minus predicted; NaN where the
    model was fitted to the sample or there is no prediction so early.
    current_a : A, discharge positive.  soc : state of charge, 0 to 1.
    inside : whether inputs and temperature are within the range that the model was trained on.
    excess : `FreeRun.excess`, distance from the trained rows.  spread : V, standard deviation of the prediction by the
    uncertainty that the fitted rows leave in the physical parameters (parameter_spread.py).
    seen : charges and temperatures of all training records.  root : root of the parameters' covariance by all training
    records; None without slopes.  reach : as by_horizon, the function `reach`, V.
    """

    dt_s: float
    records: list[str]
    by_horizon: dict[float, list[Array]]
    current_a: list[Array]
    soc: list[Array]
    inside: list[BoolArray]
    excess: list[Array | None]
    spread: list[Array]
    seen: Visited
    root: Array | None
    reach: dict[float, list[Array]]

    @classmethod
    def of(
        cls, pairs: Sequence[Unseen], train: Sequence[ErrorSeries], horizons_s: Sequence[float]
    ) -> OutOfSampleErrors:
        """The errors of the models of `pairs` on their unseen rows.

        train : the training records of all these models, left-out pieces included.  horizons_s : s.
        """
        runs = [model.free_run(series) for model, series, _ in pairs]
        by_horizon = {h: [error_ahead(model, series, h) for model, series, _ in pairs] for h in horizons_s}
        by_horizon[WHOLE_DRIVE] = [
            error_of_free_run(series, run) for (_, series, _), run in zip(pairs, runs, strict=True)
        ]
        for errors in by_horizon.values():
            for left, (_, _, rows) in zip(errors, pairs, strict=True):
                left[_others(len(left), rows)] = np.nan
        return cls(
            dt_s=pairs[0][1].dt_s,
            records=[series.name for _, series, _ in pairs],
            by_horizon=by_horizon,
            current_a=[series.current_a for _, series, _ in pairs],
            soc=[series.soc for _, series, _ in pairs],
            inside=[_inside(model, series, rows, train) for model, series, rows in pairs],
            excess=[run.excess for run in runs],
            spread=[_spread(train, series, _unfitted(model, rows, train)) for model, series, rows in pairs],
            seen=_seen(train, [np.ones(len(record), dtype=bool) for record in train]),
            root=_root(train, train[0].missed_v),
            reach={h: [reach(model, series, h) for model, series, _ in pairs] for h in by_horizon},
        )

    def bands(self, alpha: float, stretches: int | None = None) -> FreeRunBands:
        """Bands calibrated on these errors.

        alpha : nominal share of misses.  stretches : number of stretches whose errors over a whole drive are
        independent; by default the number of pieces.
        Raises FitError if there are too few pieces, or if all errors are zero.
        """
        return FreeRunBands.fit(
            self.by_horizon,
            self.dt_s,
            self.spread,
            alpha=alpha,
            inside=self.inside,
            excess=self.excess,
            seen=self.seen,
            root=self.root,
            energies_j_mol=None if self.root is None else ENERGIES_J_MOL,
            stretches=stretches,
            records=self.records,
        )


def bands_of_horizons(
    errors: OutOfSampleErrors, alpha: float, stretches: int | None = None
) -> tuple[FreeRunBands, tuple[str, ...]]:
    """(bands of the horizons that can be calibrated; a sentence on each horizon that cannot). The records may be too
    short for one horizon and long enough for others.

    alpha, stretches : as in `OutOfSampleErrors.bands`.
    Raises FitError if the band of the whole drive cannot be calibrated, or if all errors are zero.
    """
    told: list[str] = []
    while True:
        try:
            return errors.bands(alpha, stretches), tuple(told)
        except TooFewPieces as error:
            if error.horizon_s == WHOLE_DRIVE:
                raise
            told.append(str(error))
            others = {h: each for h, each in errors.by_horizon.items() if h != error.horizon_s}
            errors = replace(errors, by_horizon=others)


def error_ahead(model: ErrorModel, series: ErrorSeries, horizon_s: float) -> Array:
    """Error of predictions that start from the measured voltage `horizon_s` earlier, (n,) V, measured minus predicted;
    NaN at the beginning, where there is no measurement so much earlier."""
    steps = series.steps(horizon_s)
    left = series.error_v - model.k_step(series, steps)
    left[:steps] = np.nan
    return left


def reach(model: ErrorModel, series: ErrorSeries, horizon_s: float = WHOLE_DRIVE) -> Array:
    """Change of the predictions at a horizon, (n,) V, if the model extrapolated beyond its trained range instead of
    holding its inputs at the edge of the range; zero for models that hold no inputs."""
    if not isinstance(model, SparseModel):
        return np.zeros(len(series))
    return model.reach(series, None if horizon_s == WHOLE_DRIVE else series.steps(horizon_s))


def error_of_free_run(series: ErrorSeries, run: FreeRun) -> Array:
    """Error of a free run, (n,) V, measured minus predicted; NaN after a divergence."""
    left = series.error_v - run.error_v
    if run.diverged_at is not None:
        left[run.diverged_at :] = np.nan
    return left


def _inside(model: ErrorModel, series: ErrorSeries, rows: slice, train: Sequence[ErrorSeries]) -> BoolArray:
    """Whether each row is within the range of inputs and temperatures that the model was trained on, (n,).

    A model that was fitted without a piece shares the scaling of the whole training set, so that it does not know the
    range itself: it is that of the training rows outside the piece.
    For the physics, and for a correction that fades into it, inputs beyond the range count as inside, since these
    models behave there as they will in use. Temperatures beyond the range count as outside for every model: the band is
    widened there for what the fitted rows cannot determine (`FreeRunBands.thermal`), so that an error there does not
    measure the calibrated width.
    """
    # No model predicts the first sample of a record; it is left out together with the second.
    held = slice(0, rows.stop) if rows.start == 1 else rows
    others = [
        _others(len(record), held) if record.name == series.name else np.ones(len(record), dtype=bool)
        for record in train
    ]
    if not any(kept.any() for kept in others):  # the physics was fitted to no row
        return np.ones(len(series), dtype=bool)
    near = _seen(train, others).knows(series.degc_or_nan)
    faded = isinstance(model, SparseModel) and model.fade is not None
    if faded or isinstance(model, Bare):
        return near
    inputs = np.concatenate([record.inputs[kept] for record, kept in zip(train, others, strict=True)])
    return near & ((series.inputs >= inputs.min(axis=0)) & (series.inputs <= inputs.max(axis=0))).all(axis=1)


def _seen(train: Sequence[ErrorSeries], rows: Sequence[BoolArray]) -> Visited:
    """The charges and temperatures in the given rows of each record.  rows : (n_i,) each."""
    pairs = list(zip(train, rows, strict=True))
    return Visited.of(
        np.concatenate([record.soc[kept] for record, kept in pairs]),
        np.concatenate([record.degc_or_nan[kept] for record, kept in pairs]),
    )


def _root(
    train: Sequence[ErrorSeries],
    missed_v: float | None,
    left_out: ErrorSeries | None = None,
    rows: slice = ALL_BUT_FIRST,
) -> Array | None:
    """Root of the parameters' covariance by the training records; None without slopes.

    missed_v : V, model error that the fit to these rows assumed; None if there was no fit, for MODEL_ERROR_V.
    left_out, rows : a record and its rows that the fit did not see, if it is one of the training records.
    """
    slopes = []
    for record in train:
        if record.slopes_v is not None:
            held = left_out is not None and record.name == left_out.name
            slopes.append(record.slopes_v[_others(len(record), rows) if held else slice(None), : len(PRIORS)])
    error_v = MODEL_ERROR_V if missed_v is None else missed_v
    return covariance_root(slopes, train[0].dt_s / (MEMORY_S * error_v**2)) if slopes else None


def _spread(train: Sequence[ErrorSeries], series: ErrorSeries, rows: slice) -> Array:
    """Standard deviation of the voltage along a record by the uncertainty of the physical parameters, (n,) V, after a
    fit to all training rows but `rows`; 0 without slopes.

    The slopes are those of the physics that is served, which are in `train`.
    """
    root = _root(train, series.missed_v, series, rows)
    slopes = next((each.slopes_v for each in train if each.name == series.name), series.slopes_v)
    return np.zeros(len(series)) if root is None or slopes is None else spread(slopes[:, : len(root)], root)


def _unfitted(model: ErrorModel, rows: slice, train: Sequence[ErrorSeries]) -> slice:
    """The rows of a piece that count as not fitted by its physics, for the spread of the parameters.

    With a single training drive there is no other one to fit the physics to, so that its calibration errors are those
    of a fit to all its rows. In use the parameters are as uncertain as this fit leaves them, and so they have to be in
    the calibration: no row counts as left out. On virtual cells with wrongly declared rate constants, diffusivities and
    contacts (32 drives of 8 cells, one other drive each for training, known initial states), the bands of the declared
    model cover 98 % with a score of 130.5 mV, and those of the recalibrated one 85 % with 52.0 mV. If the calibration
    ignored what the drive determines, it would be 55 % with 222.3 mV and 70 % with 87.5 mV.
    """
    return slice(0, 0) if isinstance(model, Bare) and len(train) == 1 else rows


def _others(n: int, rows: slice) -> BoolArray:
    """(n,) True outside `rows`."""
    other = np.ones(n, dtype=bool)
    other[rows] = False
    return other
