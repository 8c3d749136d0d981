"""A temperature that the voltage of a record contradicts."""

import numpy as np
import pytest

from aesi.physics.start.temperature import CLEAR_V, other_temperature

COLUMN_DEGC = np.zeros(5)


def error_of(true_degc, slope_v=4e-3, floor_v=0.01):
    """What a declared cell leaves of a record that was taken at one temperature."""
    return lambda degc: float(floor_v + slope_v * abs(np.mean(degc) - true_degc))


def test_a_dead_column_is_told_with_the_temperature_that_the_record_shows():
    found = other_temperature(COLUMN_DEGC, 25.0, error_of(25.0))
    assert (found.degc, found.there_degc) == (0.0, 25.0)
    assert (found.left_v, found.there_v) == pytest.approx((0.11, 0.01))
    assert (
        "error of the declared model is 110.0 mV at 0 degC, which it is taken at, and 10.0 mV at 25 degC"
        in (found.sentence("drive"))
    )
    assert "it is the same in all rows: stated" in found.sentence("drive")
    warming = other_temperature(np.linspace(-1.0, 1.0, 5), 25.0, error_of(25.0)).sentence("drive")
    assert "its sensor is at fault" in warming
    for told in (found.sentence("drive"), warming):
        assert "--column temperature_degc= leaves it out" in told


def test_of_a_temperature_that_was_given_the_column_was_to_be_left_out():
    found = other_temperature(COLUMN_DEGC, 25.0, error_of(25.0))
    told = found.sentence("drive", given=True)
    assert "correct --temperature FILE=DEGC" in told
    assert "column" not in told
    assert "unit" not in told


@pytest.mark.parametrize(
    ("error_v", "why"),
    [
        (error_of(1.0), "the column is right"),
        (error_of(25.0, slope_v=0.7e-3), "the error is one that models of measured cells have"),
        (error_of(25.0, floor_v=0.06), "the cell follows the record at no temperature"),
        (error_of(-5.0, slope_v=9e-3), "the temperature that is closer is no other one"),
        (lambda degc: None, "the cell cannot be simulated"),
        (lambda degc: np.nan, "nothing is known of the cell at any temperature"),
        (
            lambda degc: 0.1 if degc[0] == 0.0 else np.nan,
            "nothing is known of the cell at another temperature",
        ),
        (lambda degc: 0.01 if degc[0] else np.nan, "nothing is known of the cell at that of the column"),
    ],
)
def test_a_column_is_not_doubted_without_clear_evidence(error_v, why):
    assert other_temperature(COLUMN_DEGC, 25.0, error_v) is None, why


def test_a_small_error_is_not_asked_about():
    asked = []

    def error_v(degc):
        asked.append(float(degc[0]))
        return CLEAR_V

    assert other_temperature(COLUMN_DEGC, 25.0, error_v) is None
    assert asked == [0.0]


@pytest.mark.parametrize("unknown_degc", [-20.0, 20.0, 50.0])
def test_a_temperature_at_which_nothing_is_known_was_taken_for_the_closest(unknown_degc):
    error_v = error_of(30.0)
    found = other_temperature(
        COLUMN_DEGC, 25.0, lambda degc: np.nan if degc[0] == unknown_degc else error_v(degc)
    )
    assert found.there_degc == 30.0
