"""Distances to the nearest visited place."""

import numpy as np

from aesi.numerics.visited import RESOLUTION, distance_to_visited, visited


def test_distances_are_those_to_the_nearest_row():
    rng = np.random.default_rng(0)
    charge, soc = np.sort(rng.uniform(0.2, 0.8, 40)), rng.uniform(0.0, 1.0, 300)
    nearest = np.abs(soc[:, None] - charge).min(axis=1)
    np.testing.assert_allclose(distance_to_visited(soc, charge), np.maximum(nearest - RESOLUTION / 2, 0.0))
    np.testing.assert_allclose(
        distance_to_visited(soc, charge[:1]), np.maximum(np.abs(soc - charge[0]) - RESOLUTION / 2, 0)
    )


def test_places_are_kept_once():
    np.testing.assert_allclose(visited(np.array([0.5, 0.5001, 0.3, 0.4999])), [0.3, 0.5])
