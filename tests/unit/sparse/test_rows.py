"""What each training row counts: every record the same, unless the physics is all but exact there."""

import numpy as np
import pytest

from aesi.sparse.search.rows import LEAST_SHARE, balanced_weights, spans_of


def counts(sizes, errors_v):
    """What each record adds to the weighted sum of squares."""
    spans = spans_of(sizes)
    bare = np.concatenate([np.full(n, e) for n, e in zip(sizes, errors_v, strict=True)])
    weights = balanced_weights(spans, bare)
    assert weights.mean() == pytest.approx(1.0)
    return [float(np.sum(weights[a:b] * bare[a:b] ** 2)) for a, b in spans]


@pytest.mark.parametrize("sizes", [(20_000, 500), (36_000, 300), (100, 100)])
def test_a_record_counted_less_for_being_short(sizes):
    long, short = counts(sizes, (0.01, 0.01))
    assert short == pytest.approx(long)
    long, short = counts(sizes, (0.01, 0.03))
    assert short == pytest.approx(long)


def test_a_record_on_which_the_physics_is_all_but_exact_counts_less():
    exact, other = counts((1000, 1000), (0.001, 0.01))
    share = 0.001**2 / (LEAST_SHARE * 0.5 * (0.001**2 + 0.01**2))
    assert exact / other == pytest.approx(share)


def test_a_record_of_no_rows_leaves_the_others_as_they_are():
    one, none, other = counts((1000, 0, 500), (0.01, 0.01, 0.02))
    assert none == 0.0
    assert one == pytest.approx(other)
