"""The prior of the model error from what cases say of its size."""

import numpy as np
import pytest

from aesi.bench.solver_error import SIZES_V, log_likelihood, most_likely_prior


def said_of(size_v):
    """Log likelihood at SIZES_V of a case that tells a size to within 0.3 of its logarithm."""
    return -0.5 * (np.log(SIZES_V / size_v) / 0.3) ** 2


def test_the_prior_is_what_the_sizes_of_all_cases_were_drawn_from():
    drawn = 4e-5 * np.exp(0.8 * np.random.default_rng(0).normal(size=400))
    said = [said_of(size) for size in drawn]
    median_v, sd, nats = most_likely_prior(said)
    assert median_v == pytest.approx(4e-5, rel=0.15)
    assert sd == pytest.approx(0.8, rel=0.15)
    assert nats == pytest.approx(log_likelihood(np.array(said), median_v, sd))
    assert nats > log_likelihood(np.array(said), 2e-4, 0.7) + 100.0


def test_sizes_too_small_to_be_told_apart_are_not_taken_for_one_of_them():
    told = [said_of(5e-5) for _ in range(20)]
    flat = [np.where(SIZES_V < 1e-4, 0.0, -50.0) for _ in range(20)]
    assert most_likely_prior(told + flat)[0] == pytest.approx(
        5e-5, rel=0.5
    )  # sizes stand a factor of two apart
