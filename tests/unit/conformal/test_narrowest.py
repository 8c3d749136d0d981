"""The search for beta on a distribution whose narrowest band is known."""

import numpy as np
import pytest

from aesi.conformal.online.method import EnbPI


def test_skewed_residuals_get_the_narrowest_band_not_equal_tails() -> None:
    # Exponential residuals: the band from beta to 0.9 + beta is ln((1 - beta) / (0.1 - beta)) wide. That is 2.94 at
    # equal tails (beta = 0.05), and 2.40 at the least of five betas, 0.01; 2.30 is the limit at beta = 0.
    past, record = np.random.default_rng(0).exponential(size=(2, 6000))
    widths = {}
    for n_betas in (1, 5):
        intervals = EnbPI(n_betas=n_betas).fit([past], window=4000).intervals(record)
        widths[n_betas] = np.median(intervals.width_v[4000:])
        assert np.mean(intervals.covers(record)[4000:]) == pytest.approx(0.9, abs=0.02)
    # 4,000 samples: the upper quantiles have standard deviations of 0.05 and 0.03.
    assert widths[1] == pytest.approx(np.log(0.95 / 0.05), abs=0.2)
    assert widths[5] == pytest.approx(np.log(0.99 / 0.09), abs=0.15)


@pytest.mark.parametrize("n_betas", [1, 5])
def test_the_first_bands_of_a_record_do_not_take_extremes_for_ranks_that_few_residuals_lack(
    n_betas: int,
) -> None:
    # Of the five pairs at alpha = 0.1, 19 residuals have the ranks of one alone, 20 * 0.05 = 1 and 20 * 0.95 = 19.
    past, record = np.random.default_rng(1).standard_normal((2, 300))
    intervals = EnbPI(n_betas=n_betas).fit([past]).intervals(record)
    assert not intervals.warm[:19].any()
    assert intervals.warm[19:].all()
    assert intervals.lower_v[19] == record[:19].min()
    assert intervals.upper_v[19] == pytest.approx(record[:19].max(), abs=1e-9)


def test_bands_begin_with_the_first_pair_that_has_its_ranks() -> None:
    # Of two betas, 0.025 and 0.075, each is a fortieth from an end: 39 residuals.
    past, record = np.random.default_rng(1).standard_normal((2, 100))
    warm = EnbPI(n_betas=2).fit([past]).intervals(record).warm
    np.testing.assert_array_equal(warm, np.arange(100) >= 39)
