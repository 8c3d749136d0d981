"""How far ahead a prediction is made, in whole steps of the record: what is called 10 s ahead is 10 s ahead."""

from __future__ import annotations

from math import isclose

from aesi.errors import InputError

HORIZONS_S = (1.0, 10.0, 60.0)
"""Horizons of the tables, s: a sample, a manoeuvre, a minute."""


def in_whole_steps(dt_s: float) -> tuple[float, ...]:
    """Those of HORIZONS_S that are whole numbers of steps of dt_s, in s."""
    return tuple(horizon for horizon in HORIZONS_S if divides(dt_s, horizon))


def divides(dt_s: float, horizon_s: float) -> bool:
    """Whether a horizon is a whole number of steps of dt_s, both in s, and at least one."""
    steps = round(horizon_s / dt_s)
    return steps >= 1 and isclose(steps * dt_s, horizon_s)


def steps_ahead(horizon_s: float, dt_s: float) -> int:
    """Steps of dt_s, in s, that make the horizon.  Raises InputError where they do not."""
    if not divides(dt_s, horizon_s):
        raise InputError(
            f"{horizon_s:g} s ahead is no whole number of steps of {dt_s:g} s; give a multiple of the step."
        )
    return round(horizon_s / dt_s)
