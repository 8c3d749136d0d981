"""Split conformal prediction and EnbPI's rolling quantiles against MAPIE."""

import warnings

import numpy as np
import pytest

from aesi.conformal import METHODS
from aesi.conformal.online.method import EnbPI

WINDOW = 100


@pytest.fixture(scope="module")
def zero():
    from sklearn.dummy import DummyRegressor

    return DummyRegressor(strategy="constant", constant=0.0).fit(np.zeros((2, 1)), np.zeros(2))


def test_split_conformal_bounds_are_those_of_mapie(zero, rng: np.random.Generator) -> None:
    from mapie.conformity_scores import AbsoluteConformityScore
    from mapie.regression import SplitConformalRegressor

    residuals = rng.standard_normal(999)
    peer = SplitConformalRegressor(
        zero, confidence_level=0.9, conformity_score=AbsoluteConformityScore(sym=False), prefit=True
    ).conformalize(np.zeros((999, 1)), residuals)
    _, bounds = peer.predict_interval(np.zeros((1, 1)))
    ours = METHODS["split"].fit([residuals]).intervals(np.zeros(1))
    ordered = np.sort(residuals)
    # The ranks are the same to one order statistic: MAPIE takes the lower tail's from below.
    for bound, peer_bound in ((ours.lower_v[0], bounds[0, 0, 0]), (ours.upper_v[0], bounds[0, 1, 0])):
        assert abs(np.searchsorted(ordered, bound) - np.searchsorted(ordered, peer_bound)) <= 1


def test_rolling_bounds_are_those_of_mapie(zero, rng: np.random.Generator) -> None:
    from mapie.regression import TimeSeriesRegressor

    past, future = rng.standard_normal(500), 3 * rng.standard_normal(80)
    with warnings.catch_warnings(action="ignore"):  # it warns of its own changes at every step
        peer = TimeSeriesRegressor(zero, method="enbpi", cv="prefit").fit(
            np.zeros((WINDOW, 1)), past[-WINDOW:]
        )
        bounds = []
        for error in future:
            _, interval = peer.predict(np.zeros((1, 1)), confidence_level=0.9)
            bounds.append(interval[0, :, 0])
            peer.update(np.zeros((1, 1)), np.array([error]))
    record = np.concatenate([past, future])
    ours = EnbPI(n_betas=1).fit([past], window=WINDOW).intervals(record)
    for k, (low, high) in enumerate(bounds, start=500):
        ordered = np.sort(record[k - WINDOW : k])
        # Ours interpolates between two ranks, MAPIE takes the next: at most one rank apart, and a rounding.
        assert abs(np.searchsorted(ordered, ours.lower_v[k]) - np.searchsorted(ordered, low)) <= 1
        assert abs(np.searchsorted(ordered, ours.upper_v[k]) - np.searchsorted(ordered, high)) <= 1
