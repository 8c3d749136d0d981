"""Distances to the nearest visited place."""

import numpy as np

from aesi.numerics.visited import RESOLUTION, Visited


def test_distances_are_those_to_the_nearest_row():
    rng = np.random.default_rng(0)
    charge, soc = np.sort(rng.uniform(0.2, 0.8, 40)), rng.uniform(0.0, 1.0, 300)
    nearest = np.abs(soc[:, None] - charge).min(axis=1)
    np.testing.assert_allclose(Visited(charge).distance(soc), np.maximum(nearest - RESOLUTION / 2, 0.0))
    np.testing.assert_allclose(
        Visited(charge[:1]).distance(soc), np.maximum(np.abs(soc - charge[0]) - RESOLUTION / 2, 0)
    )
    assert np.isinf(Visited(np.empty(0)).distance(soc)).all()


def test_places_are_kept_once_and_temperatures_that_were_measured():
    rows = Visited.of(np.array([0.5, 0.5001, 0.3, 0.4999]), np.array([np.nan, 24.0, 26.0, 25.0]))
    np.testing.assert_allclose(rows.charge, [0.3, 0.5])
    assert rows.temperature_degc == (24.0, 26.0)
    assert Visited.of(np.array([0.5]), np.array([np.nan])).temperature_degc is None
    assert Visited.of(np.array([0.5])).temperature_degc is None


def test_how_far_a_temperature_lies_above_or_below_the_visited_ones():
    seen = Visited.of(np.array([0.5, 0.6]), np.array([20.0, 24.0]))
    beyond = seen.beyond_k(np.array([18.0, 20.0, 22.0, 27.0, np.nan]))
    np.testing.assert_allclose(beyond, [-2.0, 0.0, 0.0, 3.0, 0.0])
    known = seen.knows(np.array([18.0, 20.0, 22.0, 27.0, np.nan]))
    np.testing.assert_array_equal(known, [False, True, True, False, True])
    assert not Visited.of(np.array([0.5])).beyond_k(np.array([18.0])).any()


def test_the_mean_of_one_temperature_was_taken_for_another_one_by_its_rounding():
    seen = Visited.of(np.array([0.5]), np.array([25.1]))
    means = np.array([np.full(rows, 25.1).sum() / rows for rows in range(1, 12)])
    assert (means != 25.1).any()
    assert seen.knows(means).all()
