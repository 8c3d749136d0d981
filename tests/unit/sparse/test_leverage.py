"""Leverage of a regression: how far a sample lies from the fitted rows."""

import json

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.sparse import Genome, SparseModel, evaluate
from aesi.sparse.leverage import Leverage
from aesi.sparse.search.fold_models import fold_models, with_leverage


def test_against_a_line_through_points():
    # The leverage of a straight line is 1/n + (x - mean)^2 / sum (x - mean)^2.
    x = np.linspace(-1.0, 1.0, 21)
    theta = np.stack([np.ones(21), x])
    leverage = Leverage.of(theta.T, 0.0, theta)
    far = np.stack([np.ones(3), [0.0, 2.0, 10.0]])
    height = np.sqrt(1 / 21 + np.array([0.0, 2.0, 10.0]) ** 2 / np.sum(x**2))
    typical = np.quantile(np.sqrt(1 / 21 + x**2 / np.sum(x**2)), 0.75)
    np.testing.assert_allclose(leverage.excess(far), np.maximum(height / typical - 1, 0), rtol=1e-6)
    assert leverage.excess(far)[0] == 0.0
    np.testing.assert_array_less((leverage.excess(theta) > 0).mean(), 0.3)


def test_it_sees_a_corner_that_the_ranges_of_the_inputs_hide():
    rng = np.random.default_rng(0)
    x = rng.uniform(-1.0, 1.0, 500)
    theta = np.stack([x, x + 0.05 * rng.standard_normal(500)])
    leverage = Leverage.of(theta.T, 1e-3, theta)
    along, across = leverage.excess(np.array([[0.9, 0.9], [0.9, -0.9]]))
    assert across > 10 * (1 + along)


def test_collinear_terms_without_a_ridge_stay_finite():
    theta = np.stack([np.linspace(0.1, 1, 30)] * 2)
    assert np.isfinite(Leverage.of(theta.T, 0.0, theta).excess(np.array([[0.5], [-0.5]]))).all()


def test_a_term_that_is_zero_at_rest_left_pulses_without_a_finite_excess():
    """The rests of pulses of either sign are the middle of the current's range: T1(I) is 0 in nine rows of ten."""
    theta = np.zeros((1, 1000))
    theta[0, ::10] = np.where(np.arange(100) % 2, 1.0, -1.0)
    leverage = Leverage.of(theta.T, 1.0, theta)
    np.testing.assert_allclose(
        leverage.excess(np.array([[0.0, 1.0, -1.0, 3.0]])), [0.0, 0.0, 0.0, 2.0], atol=1e-12
    )
    assert Leverage.from_dict(leverage.to_dict(), 1).upper_quartile == leverage.upper_quartile


def test_a_model_tells_the_excess_and_keeps_it_through_json(problem, split):
    genome = Genome.whole(problem.library, 1e-2, 2e-2, 0.5, 2, 2, feedback=False)
    candidate = evaluate(problem, genome)
    model = with_leverage(candidate.bagging, problem, genome.lambda1)
    assert candidate.bagging.free_run(split.test[0]).excess is None
    excess = model.free_run(split.train[0]).excess
    assert 0.6 < np.mean(excess == 0) < 0.9  # the upper quartile, over both training records
    assert set(model.to_dict()["leverage"]) == {"root", "upper_quartile"}
    text = json.dumps(model.to_dict(), default=lambda a: a.tolist())
    again = SparseModel.from_dict(json.loads(text))
    np.testing.assert_array_equal(again.free_run(split.train[0]).excess, excess)
    with pytest.raises(DataError, match=r"sparse_model/1.*sparse_model/7.*run the experiment again"):
        SparseModel.from_dict(model.to_dict() | {"schema": "aesi.sparse_model/1"})


def test_a_correction_of_a_schema_alone_ended_in_a_key(problem):
    genome = Genome.whole(problem.library, 1e-2, 2e-2, 0.5, 2, 2, feedback=False)
    state = with_leverage(evaluate(problem, genome).bagging, problem, genome.lambda1).to_dict()
    for content in ({"schema": state["schema"]}, [], None):
        with pytest.raises(DataError, match=r"saved sparse model cannot be read back: .*; save the model"):
            SparseModel.from_dict(content)
    for key in state.keys() - {"schema", "term_names"}:
        with pytest.raises(DataError, match=f"it lacks '{key}'"):
            SparseModel.from_dict({name: value for name, value in state.items() if name != key})


def test_left_out_pieces_lie_farther_off_than_fitted_ones(problem):
    genome = Genome.whole(problem.library, 1e-2, 2e-2, 0.5, 2, 2, feedback=False)
    found = list(fold_models(problem, evaluate(problem, genome)))
    means = [float(np.mean(m.free_run(r).excess[s])) for m, r, s in found]
    whole = with_leverage(evaluate(problem, genome).bagging, problem, genome.lambda1)
    inside = [float(np.mean(whole.free_run(r).excess[s])) for _, r, s in found]
    assert np.mean(means) > np.mean(inside)
