"""The same checks over every model of the voltage error."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "unit" / "sparse"))

from sparse_records import make_record

from aesi.errors import DataError
from aesi.records import Split
from aesi.sparse import Candidate, Genome, Options, Problem, evaluate
from aesi.sparse.bare import Bare
from aesi.sparse.baselines import BASELINES, Tuning

NAMES = ("AESI I", "AESI II", "ESPM", *BASELINES)


@pytest.fixture(scope="module")
def models():
    train = (make_record(700, seed=1), make_record(500, seed=2, name="second"))
    problem = Problem.build(Split(train, (), ()), Options(p_c=1, d=2, mixed=False, resamples=10, block=60))
    candidate = evaluate(problem, Genome.whole(problem.library, 1e-2, 1e-3, 0.5, 1, 2, feedback=False))
    assert isinstance(candidate, Candidate)
    found = {"AESI I": candidate.bagging, "AESI II": candidate.stability, "ESPM": Bare()}
    return found | {name: fit(problem, Tuning(candidates=20)) for name, fit in BASELINES.items()}


@pytest.mark.parametrize("name", NAMES)
def test_shapes_starts_and_purity(models, name):
    model, series = models[name], make_record(120, seed=4)
    before = series.digest
    run = model.free_run(series)
    assert model.name == name
    assert run.error_v.shape == run.outside.shape == (120,)
    for prediction in (run.error_v, model.one_step(series), model.k_step(series, 10)):
        assert prediction.shape == (120,)
        assert np.isfinite(prediction).all()
    assert model.one_step(series)[0] == series.error_v[0]
    np.testing.assert_allclose(model.one_step(series), model.k_step(series, 1), atol=1e-12)
    np.testing.assert_array_equal(run.error_v, model.free_run(series).error_v)
    assert series.digest == before


@pytest.mark.parametrize("name", [name for name in NAMES if name != "ESPM"])
def test_a_free_run_starts_where_it_is_told(models, name):
    assert models[name].free_run(make_record(50), 0.003).error_v[0] == 0.003


@pytest.mark.parametrize("name", NAMES)
def test_a_free_run_without_any_measured_error_is_finite(models, name):
    series = make_record(80, seed=5)
    blind = replace(series, error_v=np.full(80, np.nan))
    assert np.isfinite(models[name].free_run(blind).error_v).all()
    assert np.isfinite(models[name].free_run(blind, 0.0).error_v).all()


@pytest.mark.parametrize("name", [name for name in NAMES if name != "ESPM"])
def test_a_record_of_another_step_is_refused(models, name):
    series = make_record(50)
    with pytest.raises(DataError, match="sampled every 10 s, but the model steps 1 s"):
        models[name].free_run(replace(series, dt_s=10.0))


@pytest.mark.parametrize("name", NAMES)
def test_a_free_run_does_not_see_the_measurement(models, name):
    series = make_record(80, seed=5)
    blind = replace(series, error_v=np.append(series.error_v[:1], np.full(79, 9.0)))
    np.testing.assert_array_equal(models[name].free_run(series).error_v, models[name].free_run(blind).error_v)


@pytest.mark.parametrize("name", ["AESI I", "AESI II", *(name for name in BASELINES if name != "constant")])
def test_fitted_models_beat_the_bare_one(models, name):
    series = make_record(300, seed=6)
    left = series.error_v - models[name].free_run(series).error_v
    assert np.mean(left**2) < 0.2 * np.mean(series.error_v**2)
