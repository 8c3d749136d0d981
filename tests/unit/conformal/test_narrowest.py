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
