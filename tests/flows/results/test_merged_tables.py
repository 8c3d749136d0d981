"""Rows of several seeds as one: means, and the range of what tables show with it."""

import pytest

from flows.results.tables import merged


def run(mser: float, coverage: float, forest: float | None):
    by_method = {} if forest is None else {"spci_refitted": {"coverage_pct": forest}}
    return [
        {
            "name": "ESPM + AESI I",
            "free_run": {"test_mser_pct": mser, "test_rmse_mv": 2.0, "diverged": int(mser < 0)},
            "intervals": {"coverage_pct": coverage},
            "intervals_by_method": by_method,
        }
    ]


def test_means_stand_with_the_range_over_seeds():
    (row,) = merged([run(30.0, 90.0, 87.0), run(45.0, 91.0, 88.0), run(36.0, 90.5, None)])
    assert row["seeds"] == 3
    assert row["free_run"]["test_mser_pct"] == pytest.approx(37.0)
    assert row["free_run"]["spread"] == {"test_mser_pct": [30.0, 45.0]}
    assert row["intervals"]["spread"] == {"coverage_pct": [90.0, 91.0]}
    assert row["intervals_by_method"]["spci_refitted"]["spread"] == {"coverage_pct": [87.0, 88.0]}


def test_a_lone_run_stays_as_it_is():
    rows = run(30.0, 90.0, None)
    assert merged([rows]) == rows


def test_records_that_diverged_are_counted_over_the_seeds():
    (row,) = merged([run(30.0, 90.0, None), run(-45.0, 91.0, None), run(-36.0, 90.5, None)])
    assert row["free_run"]["diverged"] == 2
