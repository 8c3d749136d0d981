"""SINDy-C is tuned by the weights and the constraints of the search that it is compared with."""

import numpy as np
import pytest

from aesi.records import Failed
from aesi.sparse import FitnessWeights, Genome
from aesi.sparse.baselines import Judge, sindy_c, tuned_sindy_c
from aesi.sparse.baselines.sindy_c import evaluate_sindy_c
from aesi.sparse.search.evolution import fittest
from aesi.sparse.search.genome_space import GenomeSpace


def rows(problem, judge):
    told = []
    tuned_sindy_c(problem, 0, 8, 4, judge=judge, on_candidate=told.append)
    return told


def test_sindy_c_was_tuned_by_other_weights_than_the_search(problem):
    alone = rows(problem, Judge(FitnessWeights(oob=1.0, valid=0.0, sparse=0.0)))
    assert len(alone) == 8
    for row in alone:
        if "failed" not in row:
            assert row["fitness"] == pytest.approx(1.0 - row["loss_left_out"])
    other = rows(problem, Judge(FitnessWeights(oob=0.0, valid=1.0, sparse=0.0)))
    assert other[0]["fitness"] == pytest.approx(1.0 - other[0]["loss_valid"])


def test_a_row_that_failed_held_its_genome_in_another_shape(problem, monkeypatch):
    outcomes = iter([Failed("no term survives")])

    def evaluate(problem, genome, weights):
        return next(outcomes, None) or evaluate_sindy_c(problem, genome, weights)

    monkeypatch.setattr(sindy_c, "evaluate_sindy_c", evaluate)
    first, second, *_ = rows(problem, Judge())
    assert set(first) == {"genome", "failed"}
    assert first["genome"].keys() == second["genome"].keys()


def test_a_candidate_below_the_correlations_ranks_below_all_that_keep_to_them(problem):
    told = rows(problem, Judge(pearson_train=2.0))
    assert not any(row.get("admitted") for row in told)

    class One:
        def __init__(self, genome, fitness):
            self.genome, self.fitness = genome, fitness

    given = iter([9.0, 1.0, 2.0, 8.0])

    best = fittest(
        GenomeSpace.of(problem.library),
        lambda genome: One(genome, next(given)),
        4,
        2,
        np.random.default_rng(0),
        lambda one: one.fitness < 5,
    )
    assert best.fitness == 2.0
    assert isinstance(best.genome, Genome)


def test_plain_starts_are_different_genomes_within_the_ranges():
    space = GenomeSpace(50, lambda1=(1e-13, 0.1), p_c=(3, 5), d=(3, 5))
    starts = space.plain_starts()
    assert {(one.p_c, one.d) for one in starts} == {(3, 3), (5, 5)}
    assert {one.lambda1 for one in starts} == {0.1}
    assert len(set(starts)) == len(starts) == 4
