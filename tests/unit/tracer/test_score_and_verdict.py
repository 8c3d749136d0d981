"""Held-out residuals against brute force, and the rules of the verdict."""

import numpy as np
import pytest

from aesi.bench.scoring import is_right
from aesi.tracer.explain import explain
from aesi.tracer.fit import fit_hypothesis
from aesi.tracer.outcome import rmse_difference
from aesi.tracer.problem import Problem
from aesi.tracer.records import prepare_all
from aesi.tracer.score import blocks_of, held_out_residual, held_out_rmse_v, refitted_rmse_v
from aesi.tracer.tell_apart import experiment
from aesi.tracer.verdict import tolerance_v


def test_held_out_residual_is_that_of_a_refit_without_the_block(cell, few, make):
    problem = Problem(cell, prepare_all(cell, [make()], 0.9, 0.0), few)
    fit = fit_hypothesis(problem, ("series_resistance",))
    quick = held_out_residual(problem, fit)
    rows = blocks_of(problem)[3]
    whitened, _ = problem.whiten(np.column_stack([fit.residual_v, fit.jacobian]), fit.noise)
    prior = np.diag([1.0 if k.sd is not None else 12.0 / np.ptp(k.working_bounds) ** 2 for k in fit.knobs])
    bounds = np.array([k.working_bounds for k in fit.knobs])
    free = (fit.x > bounds[:, 0]) & (fit.x < bounds[:, 1])
    keep = np.ones(len(quick), dtype=bool)
    keep[rows] = False
    s, e = whitened[keep][:, 1:][:, free], whitened[keep][:, 0]
    pull = whitened[:, 1:][:, free].T @ whitened[:, 0]  # what holds the optimum of all rows in place
    step = np.linalg.solve(s.T @ s + prior[np.ix_(free, free)], s.T @ e - pull)
    expected = fit.residual_v[rows] - fit.jacobian[rows][:, free] @ step
    assert quick[rows] == pytest.approx(expected, abs=1e-7)


def test_blocks_partition_the_rows(cell, few, make):
    problem = Problem(cell, prepare_all(cell, [make(), make(seed=2, n=900)], 0.9, 0.3), few)
    rows = np.concatenate(blocks_of(problem))
    assert np.array_equal(np.sort(rows), np.arange(sum(r.n_fit for r in problem.records)))


def test_tolerance_grows_with_each_of_its_reasons():
    plain = tolerance_v(1e-3, 0.0, 0.0)
    assert tolerance_v(1e-3, 0.05, 0.0) > plain
    assert tolerance_v(1e-3, 0.0, 0.02) > plain
    assert tolerance_v(2e-3, 0.0, 0.0) == pytest.approx(2 * plain)


def test_a_residual_of_the_current_points_to_the_current(cell, make):
    from aesi.physics import simulate

    data = make()
    run = simulate(cell, data.time_s, data.current_a, 0.9)
    noise = 1e-4 * np.random.default_rng(0).normal(size=len(data))
    found = explain([run], [3e-4 * data.current_a + noise])
    assert found["current"] > 0.95
    assert found["time"] < 0.2


def test_noise_explains_nothing(cell, make, rng):
    from aesi.physics import simulate

    data = make()
    run = simulate(cell, data.time_s, data.current_a, 0.9)
    assert max(explain([run], [1e-3 * rng.normal(size=len(data))]).values()) < 0.01


def test_bootstrap_interval_holds_the_difference(rng):
    first, second = 3e-3 * rng.normal(size=5000), 1e-3 * rng.normal(size=5000)
    value, low, high = rmse_difference(first, second, np.arange(5000.0), rng)
    assert low < value < high
    assert value == pytest.approx(2e-3, rel=0.05)


@pytest.mark.parametrize(
    ("label", "also", "verdict", "effects", "groups", "right"),
    [
        ("none", (), "none", [], [], True),
        ("none", ("reaction_nonuniformity",), "found", ["reaction_nonuniformity"], [], True),
        ("none", (), "found", ["series_resistance"], [], False),
        ("unknown", (), "unknown", ["series_resistance"], [], True),
        ("a", (), "found", ["b"], [["b", "a"]], True),
        ("a", (), "found", ["b"], [["b", "a", "c", "d"]], False),
        ("a+b", (), "found", ["b", "a"], [], True),
        ("a+b", (), "found", ["a"], [], False),
        ("a", (), "found", ["a", "b"], [], False),
        ("a", (), "unknown", ["a"], [], False),
    ],
)
def test_what_counts_as_right(label, also, verdict, effects, groups, right):
    content = {"verdict": verdict, "effects": effects, "indistinguishable": groups}
    assert is_right(label, also, content) is right


def test_look_alikes_come_with_an_experiment():
    kinds = {"leakage_current": "physics", "current_sensor_offset": "instrument"}
    assert "rest of some days" in experiment(list(kinds), kinds)
    assert experiment(["mine", "yours"], {}) == "data at other rates, temperatures and states of charge"


def test_refits_agree_with_the_linear_estimate_where_the_model_is_linear(cell, few, make):
    data = make((few["series_resistance"].activate(resistance_ohm=2e-4),))
    problem = Problem(cell, prepare_all(cell, [data], 0.9, 0.0), few)
    fit = fit_hypothesis(problem, ("series_resistance",))
    assert refitted_rmse_v(problem, fit) == pytest.approx(held_out_rmse_v(problem, fit), rel=0.02)
    bare = fit_hypothesis(problem, ())
    assert refitted_rmse_v(problem, bare) > 1.5 * refitted_rmse_v(problem, fit)
