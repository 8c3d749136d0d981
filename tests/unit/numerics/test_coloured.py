"""The coloured-noise filter against a dense covariance matrix, and the recovery of its parameters."""

import numpy as np
import pytest

from aesi.numerics.noise.coloured import ColouredNoise, fit_noise, log_likelihood, whiten


def dense(time_s, noise):
    gaps = np.abs(time_s[:, None] - time_s[None, :])
    return noise.slow**2 * np.exp(-gaps / noise.tau_s) + noise.white**2 * np.eye(len(time_s))


def test_likelihood_is_that_of_the_dense_gaussian(rng):
    time = np.cumsum(rng.uniform(0.2, 3.0, 60))
    noise = ColouredNoise(white=0.8, slow=1.7, tau_s=9.0)
    y = rng.normal(size=60)
    covariance = dense(time, noise)
    _, log_det = np.linalg.slogdet(covariance)
    expected = -0.5 * (y @ np.linalg.solve(covariance, y) + log_det + 60 * np.log(2 * np.pi))
    assert log_likelihood(y, time, noise) == pytest.approx(expected, abs=1e-9)


def test_whitening_is_linear_and_keeps_inner_products_of_the_inverse_covariance(rng):
    time = np.arange(50.0)
    noise = ColouredNoise(0.5, 2.0, 20.0)
    table = rng.normal(size=(50, 3))
    whitened, _ = whiten(table, time, noise)
    expected = table.T @ np.linalg.solve(dense(time, noise), table)
    assert whitened.T @ whitened == pytest.approx(expected, rel=1e-9)


def test_parameters_of_a_long_series_are_recovered(rng):
    n, phi = 6000, np.exp(-1 / 50.0)
    slow = np.zeros(n)
    for k in range(1, n):
        slow[k] = phi * slow[k - 1] + np.sqrt(1 - phi**2) * rng.normal()
    found = fit_noise(slow + rng.normal(size=n), np.arange(n, dtype=float), white_floor=0.5)
    assert found.white == pytest.approx(1.0, rel=0.05)
    assert found.slow == pytest.approx(1.0, rel=0.25)
    assert 25 < found.tau_s < 100


def test_white_noise_leaves_no_slow_part(rng):
    found = fit_noise(rng.normal(size=4000), np.arange(4000.0), white_floor=0.9)
    assert found.white == pytest.approx(1.0, rel=0.04)
    assert found.slow < 0.2
