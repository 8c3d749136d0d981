"""What the fitted rows leave open of a parameter is left open of the voltage, as far as the voltage follows it."""

import numpy as np
import pytest

from aesi.conformal.parameter_spread import covariance_root, spread


def test_a_parameter_that_no_row_tells_of_stays_as_open_as_it_was() -> None:
    fitted = np.column_stack([np.full(100, 5e-3), np.zeros(100)])
    root = covariance_root([fitted], weight=1e4)
    # A hundred rows of (5 mV / 10 mV)**2: a variance of 1 / (1 + 25) is left of the first, all of the second.
    elsewhere = np.array([[5e-3, 0.0], [0.0, 5e-3], [3e-3, 4e-3]])
    left = 1 / np.sqrt(26)
    expected = [5e-3 * left, 5e-3, np.hypot(3e-3 * left, 4e-3)]
    np.testing.assert_allclose(spread(elsewhere, root), expected)


def test_what_two_parameters_are_worth_together_is_known_where_their_sum_was_seen() -> None:
    together = np.full((400, 2), 5e-3)
    root = covariance_root([together[:200], together[200:]], weight=1e4)
    same, against = spread(np.array([[5e-3, 5e-3], [5e-3, -5e-3]]), root)
    assert same == pytest.approx(5e-3 * np.sqrt(2 / 201))
    assert against == pytest.approx(5e-3 * np.sqrt(2.0))
