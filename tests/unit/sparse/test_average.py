"""The mean of several candidates against the mean of what they predict."""

import numpy as np
import pytest

from aesi.sparse import Genome, evaluate
from aesi.sparse.search.fold_models import fold_models, with_leverage
from aesi.sparse.search.pick.average import averaged, mean_model


def candidates(problem, feedback=False):
    space = {"tau": 0.5, "d": 2, "feedback": feedback}
    genes = ((1e-3, 1e-3, 1), (10.0, 1e-2, 2), (1e-1, 5e-3, 2))
    return [
        evaluate(problem, Genome.whole(problem.library, ridge, threshold, p_c=p_c, **space))
        for ridge, threshold, p_c in genes
    ]


def test_without_feedback_the_mean_predicts_the_mean(problem, split):
    each = candidates(problem)
    mean = averaged(each)
    series = split.test[0]
    for number, model in enumerate(mean.ensembles):
        parts = [one.ensembles[number] for one in each]
        assert set(model.terms) == {term for part in parts for term in part.terms}
        # When the first error has died away, free runs are what the inputs give.
        free = np.mean([part.free_run(series).error_v for part in parts], axis=0)
        np.testing.assert_allclose(model.free_run(series).error_v[200:], free[200:], atol=1e-6)
    assert mean.genomes == tuple(one.genome for one in each)
    assert mean.ridge == pytest.approx(10.0 ** (-1.0))


def test_one_candidate_is_its_own_mean(problem):
    (one, *_) = candidates(problem)
    assert averaged([one]) is one
    assert one.genomes == (one.genome,)
    assert one.ridge == pytest.approx(one.genome.lambda1)


def test_maps_with_feedback_average_over_one_step(feedback_problem):
    each = [one.bagging for one in candidates(feedback_problem, feedback=True)]
    series = feedback_problem.split.train[0]
    mean = mean_model(each)
    assert mean.has_feedback
    assert mean.memory == 0.0
    steps = np.mean([one.one_step(series) for one in each], axis=0)
    np.testing.assert_allclose(mean.one_step(series), steps, atol=1e-9)


def test_fits_without_a_piece_are_averaged_as_the_model_is(problem):
    each = candidates(problem)
    pieces = [list(fold_models(problem, one)) for one in each]
    for number, (model, record, rows) in enumerate(fold_models(problem, averaged(each))):
        parts = [one[number][0] for one in pieces]
        free = np.mean([part.free_run(record).error_v for part in parts], axis=0)[rows][200:]
        np.testing.assert_allclose(model.free_run(record).error_v[rows][200:], free, atol=1e-6)
        assert model.leverage is not None
    served = with_leverage(averaged(each).bagging, problem, averaged(each).ridge)
    assert served.free_run(problem.split.train[0]).excess is not None
