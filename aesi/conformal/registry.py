"""What is known by name: methods, and the kinds of band and regressor that a saved file may hold."""

from __future__ import annotations

import numpy as np

from aesi.conformal.band import Band
from aesi.conformal.forest import ForestQuantiles
from aesi.conformal.linear import LinearQuantiles
from aesi.conformal.marginal import FixedBand, RollingBand
from aesi.conformal.method import SPCI, EnbPI, Method, SplitConformal
from aesi.conformal.regression import QuantileModel, RegressionBand
from aesi.numerics.typing import Array

BANDS: dict[str, type[Band]] = {band.kind: band for band in (FixedBand, RollingBand, RegressionBand)}
MODELS: dict[str, type[QuantileModel]] = {model.kind: model for model in (LinearQuantiles, ForestQuantiles)}


def _linear(
    rows: Array, targets: Array, weights: Array, levels: Array, rng: np.random.Generator
) -> QuantileModel:
    return LinearQuantiles.fit(rows, targets, weights, levels)


def _forest(
    rows: Array, targets: Array, weights: Array, levels: Array, rng: np.random.Generator
) -> QuantileModel:
    return ForestQuantiles.fit(
        rows, targets, levels, rng, n_estimators=10, max_depth=2, max_samples=min(1.0, 10_000 / len(rows))
    )


def _deep(
    rows: Array, targets: Array, weights: Array, levels: Array, rng: np.random.Generator
) -> QuantileModel:
    return ForestQuantiles.fit(
        rows,
        targets,
        levels,
        rng,
        n_estimators=50,
        min_samples_leaf=50,
        max_samples=min(1.0, 10_000 / len(rows)),
    )


METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        SplitConformal(),
        EnbPI(),
        SPCI("spci_forest", fitter=_forest, view="lags"),
        SPCI("spci_forest_features", fitter=_deep),
        SPCI("spci_linear", fitter=_linear),
    )
}
