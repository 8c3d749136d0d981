import json

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import DataError
from aesi.records import ErrorSeries
from aesi.sparse import Library, SparseModel, with_inputs
from aesi.sparse.terms.library import Term
from aesi.sparse.terms.scaling import Scaling


def linear(feedback: float, gain: float, memory: float = 0.0) -> SparseModel:
    """In scaled variables e'[k + 1] = feedback e'[k] + gain I'[k]; scaling is the identity."""
    terms = (Term(((0, 1),)), Term(((1, 1),))) if feedback else (Term(((1, 1),)),)
    coefficients = np.array([feedback, gain] if feedback else [gain])
    scaling = Scaling(np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    return SparseModel("test", Library(("e", "I"), terms), coefficients, scaling, 1.0, memory)


def record(error, current) -> ErrorSeries:
    n = len(error)
    return ErrorSeries(
        "r", 1.0, np.arange(n, dtype=float), np.array(error, dtype=float),
        np.array(current, dtype=float)[:, None], np.zeros(n), np.zeros(n), ("I",)
    )  # fmt: skip


def test_a_free_run_feeds_back_as_worked_by_hand():
    run = linear(0.5, 0.1).free_run(record([0.8, 9, 9, 9], [1, 0, -1, 0]))
    np.testing.assert_allclose(run.error_v, [0.8, 0.5, 0.25, 0.025])
    assert run.diverged_at is None


def test_one_step_uses_the_measured_error():
    series = record([0.8, 0.4, -0.2, 0.0], [1, 0, -1, 0])
    np.testing.assert_allclose(linear(0.5, 0.1).one_step(series), [0.8, 0.5, 0.2, -0.2])
    np.testing.assert_allclose(linear(0.0, 0.1, 0.5).one_step(series), [0.8, 0.45, 0.15, -0.2])


def test_k_steps_lie_between_one_step_and_free_run():
    series = make_record(80)
    for model in (linear(0.7, 0.05), linear(0.0, 0.05, 0.9)):
        np.testing.assert_allclose(model.k_step(series, 1), model.one_step(series), atol=1e-15)
        np.testing.assert_allclose(model.k_step(series, 200), model.free_run(series).error_v, atol=1e-15)
        by_hand = model.free_run(series.take(slice(10, 16))).error_v[-1]
        if model.memory == 0:
            assert model.k_step(series, 5)[15] == pytest.approx(by_hand, abs=1e-15)


@pytest.mark.parametrize("steps", [0, 2.5])
def test_a_prediction_ahead_is_a_whole_number_of_steps(steps):
    with pytest.raises(DataError, match=f"a prediction {steps} steps ahead is none; give a whole number"):
        linear(0.5, 0.1).k_step(make_record(20), steps)


def test_five_steps_ahead_a_measured_error_is_remembered_as_worked_by_hand():
    error, current = np.random.default_rng(0).uniform(-0.9, 0.9, (2, 20))
    by_inputs = 0.05 * current  # the prediction of the sample after each
    ahead = by_inputs[14] + 0.9**5 * (error[10] - by_inputs[9])
    assert linear(0.0, 0.05, 0.9).k_step(record(error, current), 5)[15] == pytest.approx(ahead, abs=1e-15)


def test_divergence_is_found_and_held():
    run = linear(15.0, 0.0).free_run(record([0.01] + [0] * 20, [0.0] * 21))
    # 0.01, 0.15, 2.25, which is fed back as 1, and 15, beyond ten.
    assert run.diverged_at == 3
    assert run.error_v[-1] == pytest.approx(0.01 * 15.0**2)
    assert run.outside[2]


@pytest.mark.parametrize("feedback", [0.0, 5.0])
def test_a_divergence_at_the_first_step_holds_the_error_that_the_run_began_with(feedback):
    run = linear(feedback, 20.0).free_run(record([0.7, 0, 0, 0], [1.0, 1.0, 0.0, 0.0]))
    assert run.diverged_at == 1
    np.testing.assert_allclose(run.error_v, 0.7)


@pytest.mark.parametrize("first", [15.0, -300.0])
def test_a_first_error_far_beyond_the_trained_range_dies_away(first):
    model, series = linear(0.0, 0.1, 0.9), record([first] + [0.0] * 200, [0.5] * 201)
    run = model.free_run(series)
    assert run.diverged_at is None
    np.testing.assert_allclose(
        run.error_v[:3], [first, 0.05 + 0.9 * (first - 0.05), 0.05 + 0.81 * (first - 0.05)]
    )
    assert run.error_v[-1] == pytest.approx(0.05, abs=1e-6)
    np.testing.assert_allclose(run.error_v, model.k_step(series, 200), atol=1e-9)


def test_clipping_bounds_an_unstable_map():
    run = linear(1.5, 0.0).free_run(record([0.9] + [0] * 50, [0.0] * 51))
    assert run.diverged_at is None
    assert run.error_v[-1] == pytest.approx(1.5)
    assert run.outside[-1]


def test_inputs_outside_the_trained_range_are_held_and_flagged():
    run = linear(0.0, 1.0).free_run(record([0, 0, 0, 0], [0.5, 3.0, -7.0, 0.0]))
    np.testing.assert_allclose(run.error_v, [0.0, 0.5, 1.0, -1.0])
    assert run.outside.tolist() == [False, True, True, False]


def test_a_model_read_back_from_json_runs_the_same():
    model = linear(0.5, 0.1)
    again = SparseModel.from_dict(json.loads(json.dumps(model.to_dict())))
    series = make_record(50)
    np.testing.assert_array_equal(again.free_run(series).error_v, model.free_run(series).error_v)
    assert again.terms == ("T1(e)", "T1(I)")
    with pytest.raises(DataError, match="not a sparse model"):
        SparseModel.from_dict({"schema": "other"})
    extrapolating = model.to_dict()["scaling"] | {"outside": "extrapolate"}
    with pytest.raises(DataError, match="outside = 'extrapolate' is not known"):
        SparseModel.from_dict(model.to_dict() | {"scaling": extrapolating})


def test_another_sampling_is_refused():
    series = make_record(30)
    with pytest.raises(DataError, match="the model steps 1 s"):
        linear(0.5, 0.1).free_run(ErrorSeries(**{**series.__dict__, "dt_s": 0.1}))


def test_inputs_are_derived_by_name():
    series = with_inputs(make_record(40), ("I_next", "soc", "I_5s"))
    current = make_record(40).current_a
    np.testing.assert_array_equal(series.inputs[:, 0], np.append(current[1:], current[-1]))
    keep = np.exp(-1 / 5)
    assert series.inputs[1, 2] == pytest.approx(keep * current[0] + (1 - keep) * current[1])
    with pytest.raises(DataError, match="no input 'voltage'"):
        with_inputs(make_record(40), ("voltage",))


def test_reach_is_what_holding_at_the_edge_leaves_out():
    # e[k + 1] = 0.5 I[k], held at I = 1; at 3 A the slope would take it one volt farther.
    model, series = linear(0.0, 0.5), record([0.0] * 5, [0.5, 3.0, -3.0, 1.0, 1.0])
    np.testing.assert_allclose(model.reach(series), [0.0, 0.0, 1.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(model.reach(series, 1), [0.0, 0.0, 1.0, 1.0, 0.0], atol=1e-12)


def test_reach_carries_on_with_the_feedback_and_ends_with_the_horizon():
    model, series = linear(0.5, 0.2), record([0.0] * 6, [0.5, 3.0, 0.0, 0.0, 0.0, 0.0])
    # 0.2 times the 2 A beyond, halved at each step; a prediction two steps ahead has forgotten it after two.
    np.testing.assert_allclose(model.reach(series), [0.0, 0.0, 0.4, 0.2, 0.1, 0.05], atol=1e-12)
    np.testing.assert_allclose(model.reach(series, 2), [0.0, 0.0, 0.4, 0.2, 0.0, 0.0], atol=1e-12)


def test_nothing_is_to_be_reached_inside_the_range():
    assert not linear(0.5, 0.2).reach(record([0.0] * 3, [1.0, -1.0, 0.5])).any()


@pytest.mark.parametrize("errors_v", [(-0.03, 0.01), (-0.01, 0.03)])
def test_no_error_is_zero_when_scaled_whichever_way_errors_were_larger(errors_v):
    block = np.column_stack([errors_v, (0.0, 5.0)])
    scaling = Scaling.of([block])
    assert scaling.error_to_scaled(np.zeros(1)) == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(scaling.error_to_scaled(np.array([-0.03, 0.03])), [-1.0, 1.0])
    np.testing.assert_allclose(scaling.apply(block)[:, 1], [-1.0, 1.0])
    assert not scaling.is_outside(block).any()
