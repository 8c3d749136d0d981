"""`aesi bench drift`: bands that need no step stay, and drift costs coverage where it is."""

import pytest

from aesi.bench.intervals.drift import run


@pytest.fixture(scope="module")
def lines():
    return {line["drift"]: line for line in run(records=8, n=2000)}


def test_calibrated_bands_without_drift_are_nearly_the_best(lines):
    assert lines["none"]["coverage_pct"] == pytest.approx(90.5, abs=1.0)  # 0.95 alpha is aimed at
    assert 1.0 < lines["none"]["score_ratio"] < 1.05


def test_drift_at_one_current_shows_in_the_range_that_is_covered_least(lines):
    assert lines["hardest"]["worst_range_coverage_pct"] < lines["none"]["worst_range_coverage_pct"] - 1.0
    assert lines["hardest"]["coverage_pct"] > 88.0
