"""Measures of fit."""

import numpy as np
import pytest

from aesi.numerics.metrics import pearson


@pytest.mark.parametrize("rows", [3, 6, 7, 11])
def test_two_constant_series_correlated_by_the_round_off_of_their_means(rows):
    assert pearson(np.full(rows, 0.1), np.full(rows, 0.1)) == 0.0
    assert pearson(np.full(rows, 0.1), np.arange(rows)) == 0.0
    assert pearson(np.arange(rows), np.full(rows, 0.1)) == 0.0


def test_a_correlation_is_that_of_the_textbook():
    truth, prediction = np.array([1.0, 2.0, 3.0, 5.0]), np.array([2.0, 1.0, 4.0, 6.0])
    assert pearson(truth, prediction) == pytest.approx(np.corrcoef(truth, prediction)[0, 1])
    assert pearson(truth, np.array([1.0, 2.0, np.nan, 5.0])) == 0.0
