"""Coverage and width of free-run bands on virtual cells, through the benchmark that shows the designs."""

import numpy as np
import pytest
from scipy import stats

from aesi.bench.intervals.bands import run

pytestmark = pytest.mark.slow

CELLS = 24
PACKAGE, CONSTANT = "scaled", "one width"
BLIND = "scaled, without leverage", "scaled, without spread"
HELD = "scaled, without reach"
REPEATS, SCHEDULES, BEYOND = 0, 1, 2
"""Rows of the layouts: test drives lie between training drives, differ from them as they do from each other, and leave
their range."""


@pytest.fixture(scope="module")
def lines(request):
    cell = request.config.rootpath / "experiments" / "cells" / "nmc_30ah.bpx.json"
    return list(run(cell=str(cell), virtual=CELLS, seed=5))


def figures(lines, method, key):
    """(layouts, horizons) of one design; the last row is that of all layouts."""
    return np.array([line[key] for line in lines if line["method"] == method]).reshape(4, -1)


def test_coverage_is_near_nominal_where_left_out_drives_are_as_far_away_as_the_test(lines):
    coverage = figures(lines, PACKAGE, "coverage_pct")
    slack = 3 * figures(lines, PACKAGE, "coverage_se_pct")
    assert (abs(coverage[SCHEDULES] - 90.0) < slack[SCHEDULES]).all()
    # Test repeats lie between two training repeats, whole left-out ones do not: there the band may be too wide.
    assert (coverage > 90.0 - slack).all()


def price(stretches):
    """Score of the band of a normal error whose size is known from so many values alone, over that of the known size.

    The half-width is t s, s**2 (m - 1) chi-squared for an error of size 1. A band cannot be better on average that
    knows no more than its stretches, and one whose shape is no better than a constant is not worse.
    """
    m = stretches
    t, z = stats.t.ppf(0.95, m - 1), stats.norm.ppf(0.95)
    u = stats.chi2(m - 1).ppf((np.arange(10_000) + 0.5) / 10_000)
    return winkler(t * np.sqrt(u / (m - 1))).mean() / winkler(z)


def winkler(half):
    """Mean interval score, at 90 %, of a half-width for a standard normal error."""
    return 2 * half + 40 * (stats.norm.pdf(half) - half * stats.norm.sf(half))


def test_the_price_is_that_of_the_factor_by_which_few_stretches_widen_a_band():
    # By hand: S(1.645) = 4.126. A thousand stretches know the size.
    assert winkler(stats.norm.ppf(0.95)) == pytest.approx(4.126, abs=2e-3)
    assert price(1000) == pytest.approx(1.0, abs=2e-3)
    assert price(6) == pytest.approx(1.16, abs=5e-3)


def test_where_test_drives_are_as_far_away_as_left_out_ones_the_band_costs_what_few_stretches_cost(lines):
    # 1 is the best constant width, which only the test data could tell. Twelve drives, and one that validates.
    assert (figures(lines, PACKAGE, "score_ratio")[SCHEDULES] < price(13)).all()


def test_the_scale_pays_in_every_layout_and_each_of_its_terms_over_all(lines):
    # Where left-out drives lie further away than the test (repeats), they err more, and no band that is calibrated on
    # them can know by how much. One width from the same errors pays the same, so that is what a band has to beat.
    ours, constant = (figures(lines, name, "interval_score_mv") for name in (PACKAGE, CONSTANT))
    assert (ours < constant).all()
    for name in BLIND:
        assert (ours[-1, 1:] < figures(lines, name, "interval_score_mv")[-1, 1:]).all()


def test_the_reach_pays_beyond_the_trained_range_and_costs_nothing_inside(lines):
    for key in ("coverage_pct", "interval_score_mv", "width_mv"):
        ours, held = (figures(lines, name, key)[REPEATS] for name in (PACKAGE, HELD))
        np.testing.assert_allclose(ours, held, rtol=1e-3)
    # A held input is at fault at once; over a longer horizon the spread of the physics widens the band there by itself.
    ours, held = (figures(lines, name, "interval_score_mv")[BEYOND] for name in (PACKAGE, HELD))
    assert ours[0] < held[0]
    ours, held = (figures(lines, name, "coverage_pct")[BEYOND] for name in (PACKAGE, HELD))
    assert (ours > held).all()
