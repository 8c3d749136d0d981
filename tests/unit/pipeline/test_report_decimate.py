"""The envelope that stands in for a long series."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from aesi.pipeline.report.arrays.decimate import envelope


def test_short_series_are_left_alone():
    assert envelope(np.arange(10.0), 10).tolist() == list(range(10))


@given(n=st.integers(1, 3000), limit=st.integers(4, 500), seed=st.integers(0, 99))
def test_extremes_and_ends_survive_within_the_limit(n, limit, seed):
    y = np.random.default_rng(seed).standard_normal(n)
    rows = envelope(y, limit)
    assert len(rows) <= max(limit, 4)
    assert np.all(np.diff(rows) > 0)
    assert {0, n - 1} <= set(rows.tolist())
    assert y[rows].max() == y.max()
    assert y[rows].min() == y.min()


def test_a_single_spike_is_not_lost():
    y = np.zeros(100_000)
    y[54_321] = 1.0
    assert 54_321 in envelope(y, 400)


@pytest.mark.parametrize(("keep", "pick"), [("min", np.min), ("max", np.max)])
def test_one_sided_envelopes_bound_every_bucket(keep, pick):
    y = np.random.default_rng(0).standard_normal(10_000)
    rows = envelope(y, 202, keep)
    buckets = y.reshape(100, 100)
    inner = set(y[rows].tolist())
    assert {float(pick(b)) for b in buckets} <= inner


def test_missing_values_do_not_hide_the_rest():
    y = np.concatenate([np.full(500, np.nan), np.arange(500.0)])
    rows = envelope(y, 100)
    assert np.nanmax(y[rows]) == 499.0
