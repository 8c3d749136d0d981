"""Where on an axis rows lie, thinned to what matters, and how far from there another place is."""

from __future__ import annotations

import numpy as np

from aesi.numerics.typing import Array

RESOLUTION = 0.005
"""Of a state of charge: no model of an error tells places apart that are closer."""


def visited(places: Array) -> Array:
    """(k,) the places (n,), rounded to RESOLUTION, sorted, each once."""
    return np.asarray(RESOLUTION * np.unique(np.round(places / RESOLUTION)))


def distance_to_visited(places: Array, known: Array) -> Array:
    """(n,) from each place to the nearest of `known` (k,), sorted; 0 within the resolution, inf where none is known."""
    if not len(known):
        return np.full(len(places), np.inf)
    last = len(known) - 1
    place = np.clip(np.searchsorted(known, places), 1, max(last, 1))
    below, above = np.abs(places - known[place - 1]), np.abs(places - known[np.minimum(place, last)])
    return np.asarray(np.maximum(np.minimum(below, above) - RESOLUTION / 2, 0.0))
