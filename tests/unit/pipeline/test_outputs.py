"""What a run saves: a model with its own bands, or none."""

import numpy as np
import pytest
from small_experiment import SOC0, build_problem, conformalise, experiment, final_models, fitted, write_record

from aesi.data import read_measurement
from aesi.errors import FitError
from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.experiment.outputs import Result, hybrid, notes


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    return write_record(tmp_path_factory.mktemp("record"))


def result(record, *models):
    """A run that compares these models, on the cell as declared."""
    config = experiment(record, models=list(models))
    loaded, chosen, _ = fitted(record)
    problem = build_problem(loaded, config)
    judged = conformalise(
        final_models(problem, chosen, config).fitted, problem, chosen, config, loaded.left_out
    )
    return Result(config, loaded, problem, chosen, [], judged, evaluate_models(judged, loaded.split), "", 0.0)


def covered(model, record):
    """Share of the measured voltage that the band of a free run holds."""
    data = read_measurement(record)
    predicted = model.predict_record(data, SOC0)
    return np.mean((data.voltage_v >= predicted.lower_v) & (data.voltage_v <= predicted.upper_v))


def test_physics_was_saved_with_the_bands_of_other_physics(record):
    one = result(record, "ESPM", "ESPM recalibrated")
    assert one.best == "ESPM recalibrated"
    model = hybrid(one)
    assert model.bands is None
    assert model.intervals is None
    (told,) = [note for note in notes(one) if "saved model" in note]
    assert (
        told == "The saved model is the ESPM alone, without bands: ESPM recalibrated cannot be kept with it."
    )


def test_physics_that_is_saved_keeps_its_bands(record):
    one = result(record, "ESPM recalibrated", "ESPM")
    assert not [note for note in notes(one) if "saved model" in note]
    assert covered(hybrid(one), record) > 0.8


def test_the_ensemble_of_a_run_is_the_one_that_it_names_best(record):
    chosen = fitted(record)[1]
    assert result(record, "ESPM", "AESI I", "AESI II").ensemble is chosen.better
    assert result(record, "AESI II", "ESPM").ensemble is chosen.stability
    assert result(record, "AESI I").ensemble is chosen.bagging
    assert result(record, "ESPM").ensemble is None


def test_models_of_which_none_can_be_fitted_are_an_error(record):
    library = {"inputs": ["I"], "p_c": [0, 0], "d": [1, 1], "special": True, "fade": False}
    config = experiment(record, library=library, models=["DMD with control"])
    problem = build_problem(fitted(record)[0], config)
    with pytest.raises(FitError, match=r"DMD with control could not be fitted.*raise p_c and d"):
        final_models(problem, fitted(record)[1], config)
