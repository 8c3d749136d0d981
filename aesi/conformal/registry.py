"""The methods that are known by name."""

from __future__ import annotations

import numpy as np

from aesi.conformal.online.method import EnbPI, Method, SplitConformal
from aesi.conformal.online.spci import SPCI
from aesi.conformal.refitted import NAME as REFITTED
from aesi.conformal.refitted import RefittedForest
from aesi.conformal.regressors.boosted import BoostedQuantiles
from aesi.conformal.regressors.forest import ForestQuantiles
from aesi.conformal.regressors.linear import LinearQuantiles
from aesi.conformal.regressors.model import FitTask, QuantileModel
from aesi.conformal.regressors.normalised import NormalisedQuantiles
from aesi.numerics.trees.boosting import Growth

RATE = 0.05
"""Rate of the adaptive step: fast enough to hold 85 % in every bin of current and charge on a measured drive, slow
enough to stay within 5 % of the best score possible where that is known; `tests/statistical/` asserts both."""
FOREST_ROWS = 10_000
"""Rows that each tree of a forest sees, at most. A convention; it bounds the time of a fit."""


def published_forest(task: FitTask) -> QuantileModel:
    """The forest of SPCI as published, on the raw window: ten trees of depth two."""
    share = min(1.0, FOREST_ROWS / len(task.rows))
    return ForestQuantiles.fit(task, n_estimators=10, max_depth=2, max_samples=share)


def feature_forest(task: FitTask) -> QuantileModel:
    """A deeper forest on normalised features."""
    share = min(1.0, FOREST_ROWS / len(task.rows))
    return NormalisedQuantiles.fit(
        task,
        lambda inner: ForestQuantiles.fit(
            inner, n_estimators=40, min_samples_leaf=40, max_features=1 / 3, max_samples=share
        ),
    )


def boosted(task: FitTask) -> QuantileModel:
    """Boosted quantiles on normalised features."""

    def inner(rest: FitTask) -> QuantileModel:
        # The loss in volts weighs busy rows by their scale, the normalised loss all alike; its root lies between.
        scale = np.exp(rest.rows[:, rest.n_history])
        return BoostedQuantiles.fit(rest, np.sqrt(scale / scale.mean()), Growth())

    return NormalisedQuantiles.fit(task, inner)


DEFAULT_METHOD = "spci_boosted"
"""Least Winkler score of the methods, given the current: 2.7 mV on the measured NMC drive, spci_linear 3.2, and 11.9 to
19.2 instead of 13.9 to 21.9 on the HG2 and the Panasonic, by `aesi run` as docs/theory/conformal.md tells. Calibrate
and predict with `current_a`."""

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        SplitConformal(),
        SplitConformal("aci", RATE),
        EnbPI(),
        SPCI(name="spci_forest", fitter=published_forest, view="lags", use_current=False, rows_a_column=3),
        SPCI(name="spci_forest_features", rate=RATE, fitter=feature_forest),
        SPCI(name="spci_linear", rate=RATE, fitter=LinearQuantiles.fit),
        SPCI(name="spci_boosted", rate=RATE, fitter=boosted, n_betas=1),
    )
}

COMPARED: dict[str, Method | RefittedForest] = {**METHODS, REFITTED: RefittedForest()}
"""What the tables of a run may show: the methods, and the paper's forest refitted as it goes, replayed only."""
