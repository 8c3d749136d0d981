"""Fits from several starts: the best end is taken, and a note says how far the others are from it."""

import numpy as np
import pytest

from aesi.calibration import calibrate
from aesi.calibration.result import Interval, ends_sentences


def interval(value):
    return Interval(value, value - 0.1, value + 0.1, "factor", "")


def test_the_best_of_several_ends_is_taken_and_the_others_are_told(start, records):
    once = calibrate(start, records[:1], evaluations=3)
    several = calibrate(start, records[:1], evaluations=3, starts=2, seed=1)
    again = calibrate(start, records[:1], evaluations=3, starts=2, seed=1)
    cost = [float(np.sum(found.model.residual(found.x) ** 2)) for found in (once, several)]
    assert cost[1] <= cost[0]
    assert np.array_equal(several.x, again.x)
    assert not [note for note in once.notes if "drawn start" in note]
    assert len([note for note in several.notes if "repeated from 1 drawn start:" in note]) == 1


def test_parameters_beyond_their_intervals_at_another_end_are_named():
    here = {"rate": interval(1.0), "radius": interval(2.0)}
    near, far = {**here, "rate": interval(1.05)}, {**here, "radius": interval(2.5)}
    assert ends_sentences([3.0], [here], 0) == ()
    (agree,) = ends_sentences([3.0, 3.5], [here, near], 0)
    assert (
        "1 drawn start: the best end, from the start file, is taken; the others are 0.5 nats less likely"
        in agree
    )
    assert "All parameters there lie within their 95 % intervals." in agree
    (differ,) = ends_sentences([3.0, 3.5, 9.0], [here, near, far], 2)
    assert (
        "from a drawn start, is taken; the others are 0.5, 6.0 (from the start file) nats less likely"
        in differ
    )
    assert "There 1 of 2 parameters lie outside their 95 % intervals (radius)" in differ


def test_drawn_starts_that_fail_were_dropped_without_a_word():
    here = {"rate": interval(1.0)}
    assert ends_sentences([3.0], [here], 0, 2) == (
        "2 of 2 drawn starts cannot be simulated on these records and gave no end.",
    )
    assert ends_sentences([3.0], [here], 0, 1)[0].startswith("1 of 1 drawn start cannot")
    *_, lost = ends_sentences([3.0, 3.5], [here, here], 0, 1)
    assert lost == "1 of 2 drawn starts cannot be simulated on these records and gave no end."


@pytest.mark.parametrize("starts", [0, -1])
def test_a_number_of_starts_below_one_is_refused(start, records, starts):
    import aesi
    from aesi.errors import InputError

    with pytest.raises(InputError, match=f"starts = {starts} is not a whole number from 1"):
        aesi.calibrate(start, records[0], starts=starts)
