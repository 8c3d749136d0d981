import numpy as np
import pytest

from aesi.errors import DataError, ParameterError
from aesi.sparse import STRidge
from aesi.sparse.stridge import triangle


def test_coefficients_of_a_case_worked_by_hand():
    # Orthogonal columns of squared length 2: ridge divides x'y by 2 + lambda1; then 0.05 falls below 0.1.
    theta = np.array([[1.0, 1.0], [1.0, -1.0]])
    y = theta @ [3.0, 0.05]
    np.testing.assert_allclose(STRidge(0.5, 0.1).fit(theta, y), [2 * 3.0 / 2.5, 0.0], rtol=1e-14)


def test_weights_are_repeated_rows(rng):
    theta, y = rng.normal(size=(40, 5)), rng.normal(size=40)
    times = rng.integers(0, 4, 40)
    repeated = np.repeat(np.arange(40), times)
    solver = STRidge(1e-3, 0.05)
    np.testing.assert_allclose(
        solver.fit(theta, y, times.astype(float)), solver.fit(theta[repeated], y[repeated]), atol=1e-13
    )


def test_a_triangular_factor_poses_the_same_problem(rng):
    theta, y = rng.normal(size=(200, 12)), rng.normal(size=200)
    factor = triangle(np.column_stack([theta, y]))
    solver = STRidge(1e-2, 0.05)
    np.testing.assert_allclose(solver.fit_factor(factor), solver.fit(theta, y), atol=1e-14)


def test_thresholding_all_leaves_nothing(rng):
    assert not STRidge(1e-3, 1e6).fit(rng.normal(size=(20, 3)), rng.normal(size=20)).any()


def test_duplicated_columns_without_ridge_share_the_coefficient(rng):
    x = rng.normal(size=50)
    coefficients = STRidge(0.0, 0.0).fit(np.column_stack([x, x]), 2 * x)
    np.testing.assert_allclose(coefficients.sum(), 2.0, rtol=1e-9)
    assert np.abs(coefficients).max() < 10


@pytest.mark.parametrize("of_others", [(-1.0, 0.0, 0.0), (0.3, 0.7, 0.1), (0.0, 1.0, 1.0)])
def test_a_term_that_is_a_sum_of_others_gave_coefficients_of_1e13(rng, of_others):
    theta = rng.normal(size=(500, 3))
    y = theta @ [1.0, 2.0, -1.0] + 0.1 * rng.normal(size=500)
    more = np.column_stack([theta, theta @ of_others])
    coefficients = STRidge(0.0, 0.0).fit(more, y)
    # The term adds nothing, so that the least squares predict the same; they were off by a hundredth.
    np.testing.assert_allclose(more @ coefficients, theta @ STRidge(0.0, 0.0).fit(theta, y), atol=1e-12)
    assert np.abs(coefficients).max() < 10


def test_fewer_rows_than_terms_is_solved_by_the_ridge(rng):
    theta, y = rng.normal(size=(5, 9)), rng.normal(size=5)
    expected = np.linalg.solve(theta.T @ theta + 0.1 * np.eye(9), theta.T @ y)
    np.testing.assert_allclose(STRidge(0.1, 0.0).fit(theta, y), expected, rtol=1e-10)


@pytest.mark.parametrize(
    ("lambda1", "lambda2", "times"),
    [(-1, 0, 1), (0, -1, 1), (0, 0, 0), (float("nan"), 0, 1), (np.inf, 0, 1), (0, np.inf, 1)],
)
def test_inadmissible_settings_are_named(lambda1, lambda2, times):
    with pytest.raises(ParameterError, match="must not be negative"):
        STRidge(lambda1, lambda2, times)


@pytest.mark.parametrize(
    ("theta", "y", "words"),
    [
        (np.ones((4, 2)), np.ones(3), r"shapes \(4, 2\) and \(3,\)"),
        (np.ones(4), np.ones(4), r"shapes \(4,\) and \(4,\)"),
        (np.ones((0, 2)), np.ones(0), "n at least 1"),
        (np.array([[1.0], [np.nan]]), np.ones(2), "not finite"),
        (np.ones((5, 0)), np.ones(5), "n at least 1 and m too"),
        (np.ones((2, 1)) * 1j, np.ones(2), "theta holds complex numbers"),
    ],
)
def test_what_no_problem_can_be_posed_with_is_refused(theta, y, words):
    with pytest.raises(DataError, match=words):
        STRidge(1e-3, 1e-2).fit(theta, y)


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        (np.ones(3), r"weights have the shape \(3,\), and theta has 4 rows"),
        (np.ones(1), r"weights have the shape \(1,\)"),
        (np.ones((4, 1)), r"weights have the shape \(4, 1\)"),
        ([1.0, np.nan, 1.0, 1.0], r"weights is nan in row 2, counted from 1; give finite weights from 0 on"),
        ([1.0, 1.0, -2.0, 1.0], r"weights is -2 in row 3"),
        ([np.inf, 1.0, 1.0, 1.0], r"weights is inf in row 1"),
    ],
)
def test_weights_of_no_row_or_of_no_size_ended_in_lapack_or_were_spread_over_all(weights, words):
    with pytest.raises(DataError, match=words):
        STRidge(1e-3, 1e-2).fit(np.eye(4), np.ones(4), weights)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (("1e-3", 0.0), "lambda1 = '1e-3' is not a number"),
        ((1e-3, None), "lambda2 = None is not a number"),
        ((1e-3, 0.0, 2.5), "max_iter = 2.5 is not a whole number"),
    ],
)
def test_a_setting_that_is_no_number_ended_in_a_type_error(settings, words):
    with pytest.raises(ParameterError, match=words):
        STRidge(*settings)
