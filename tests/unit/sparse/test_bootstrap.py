from itertools import pairwise

import numpy as np
import pytest

from aesi.numerics.blocks import coverage, leave_out_weights, moving_block_weights, pieces
from aesi.numerics.weighted_grams import orthonormal, triangular_factors, weighted_grams
from aesi.sparse.search.rows import spans_of


def test_a_resample_has_as_many_rows_as_the_data(rng):
    weights = moving_block_weights([(0, 300), (300, 1000)], 70, 50, rng)
    assert (weights.sum(axis=1) == 1000).all()


def test_blocks_do_not_run_over_the_end_of_a_record(rng):
    # A block over the border would put the same weight on both sides; ends of records are where runs end.
    weights = moving_block_weights([(0, 100), (100, 200)], 100, 200, rng)
    assert (weights[:, :100] == weights[:, :1]).all()
    assert (weights[:, 100:] == weights[:, 100:101]).all()


@pytest.mark.parametrize("lengths", [(3600, 400), (2000, 80, 80), (900, 450, 330)])
def test_the_rows_of_a_record_are_drawn_as_often_whatever_its_length(lengths, rng):
    # The last block is cut, which the shortest records feel least: their mean is above 1 by a few per cent.
    weights = moving_block_weights(spans_of(lengths), 300, 4000, rng)
    by_record = [weights[:, a:b].mean() for a, b in spans_of(lengths)]
    assert by_record == pytest.approx([1.0] * len(lengths), rel=0.12)


def test_coverage_of_the_papers_figure_2(rng):
    # 1 - (1 - B / n)^(n / B) is 63.3 % at B = 500, n = 88,200; the paper reports 63.6 % of a random selection.
    # One resample scatters by 1.8 points, the mean of 300 by 0.1.
    share = coverage(moving_block_weights([(0, 88_200)], 500, 300, rng))
    assert share.mean() == pytest.approx(0.635, abs=0.004)
    assert abs(share.mean() - 0.636) < share.std()


def test_pieces_cover_every_row_once():
    cut = pieces([(0, 250), (250, 1000)], 100)
    assert cut[0][0] == 0
    assert cut[-1][1] == 1000
    assert all(b == c for (_, b), (c, _) in pairwise(cut))
    weights = leave_out_weights(cut, 1000)
    assert (weights == 0).sum(axis=0).tolist() == [1] * 1000


def test_weighted_grams_equal_the_direct_sum(rng):
    rows = rng.normal(size=(1013, 70))  # neither whole cells nor whole columns
    weights = moving_block_weights([(0, 400), (400, 1013)], 37, 6, rng)
    for gram, weight in zip(weighted_grams(rows, weights), weights, strict=True):
        direct = rows.T @ (weight[:, None] * rows)
        np.testing.assert_allclose(gram, direct, atol=1e-12 * np.abs(direct).max())


def test_factors_reproduce_the_weighted_problem(rng):
    matrix = rng.normal(size=(500, 12))
    weights = moving_block_weights([(0, 500)], 50, 4, rng)
    q, r = orthonormal(np.asfortranarray(matrix.copy()))
    for factor, weight in zip(triangular_factors(weighted_grams(q, weights), r), weights, strict=True):
        assert not np.tril(factor, -1).any()
        np.testing.assert_allclose(factor.T @ factor, matrix.T @ (weight[:, None] * matrix), atol=1e-10)


def test_a_resample_that_misses_a_direction_still_has_a_factor(rng):
    matrix = rng.normal(size=(100, 4))
    matrix[:50, 3] = 0.0
    q, r = orthonormal(np.asfortranarray(matrix.copy()))
    weight = np.r_[np.ones(50), np.zeros(50)][None].astype(np.uint16)
    factor = triangular_factors(weighted_grams(q, weight), r)[0]
    np.testing.assert_allclose(factor.T @ factor, matrix[:50].T @ matrix[:50], atol=1e-10)
