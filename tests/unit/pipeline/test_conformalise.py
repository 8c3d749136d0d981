"""What intervals and bands are calibrated on: residuals of the model that is served, and of models without its rows."""

from __future__ import annotations

import numpy as np
import pytest
from small_experiment import experiment, write_record

from aesi.pipeline.experiment.fit import build_problem, final_models
from aesi.pipeline.experiment.intervals import conformalise as intervals
from aesi.pipeline.experiment.load import load
from aesi.sparse import ENSEMBLES, Candidate, Genome, evaluate
from aesi.sparse.bare import Bare


@pytest.fixture(scope="module")
def faded(tmp_path_factory):
    """An experiment with validation records whose corrections fade: its problem, a candidate, the configuration."""
    small = experiment(write_record(tmp_path_factory.mktemp("record")))
    repeats = small.data.repeats.model_copy(update={"valid_share": 0.25})
    config = small.model_copy(
        update={
            "data": small.data.model_copy(update={"repeats": repeats}),
            "library": small.library.model_copy(update={"feedback": False, "fade": True}),
        }
    )
    problem = build_problem(load(config), config)
    chosen = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    assert isinstance(chosen, Candidate)
    assert problem.split.valid
    assert chosen.bagging.fade.amplitude > 0.5
    return problem, chosen, config


def test_a_faded_model_was_calibrated_on_what_it_said_before_its_leverage_was_known(faded, monkeypatch):
    problem, chosen, config = faded
    calibrated = {}
    bands = intervals._bands

    def watched(unseen, *rest):
        calibrated[unseen[0][0].name] = list(unseen)
        return bands(unseen, *rest)

    monkeypatch.setattr(intervals, "_bands", watched)
    models = intervals.conformalise(final_models(problem, chosen, config).fitted, problem, chosen, config)
    names = {series.name for series in problem.split.valid}
    for one in (each for each in models if each.model.name in ENSEMBLES):
        on_validation = [
            (model, series) for model, series, _ in calibrated[one.model.name] if series.name in names
        ]
        assert len(on_validation) == len(names)
        for model, series in on_validation:
            assert model is one.model
            # The leverage does something there, or the order would not matter.
            unfaded = chosen.ensembles[ENSEMBLES.index(one.model.name)]
            assert np.ptp(model.free_run(series).error_v - unfaded.free_run(series).error_v) > 1e-4


def test_the_first_sample_of_a_drive_calibrated_intervals_of_physics_as_predicted_exactly(faded):
    problem, _, config = faded

    class Given:
        def fit(self, residuals, *rest, current_a):
            return residuals

    (residual_v,) = intervals._intervals([(Bare(), problem.split.train[0], slice(0, 50))], config, Given())
    np.testing.assert_array_equal(np.isfinite(residual_v), np.arange(50) > 0)


def test_minutes_of_fits_and_of_calibration_passed_without_a_word(faded):
    problem, chosen, config = faded
    config = config.model_copy(update={"models": ("ESPM", "AESI I", "DMD with control")})
    begun = []
    fits = final_models(problem, chosen, config, begins=begun.append)
    assert begun == ["DMD with control"]  # no other model has a fit of its own
    final_models(problem, chosen, config, lambda name, fit: fits.fitted[-1], begun.append)
    assert begun == ["DMD with control"]  # taken from an earlier run
    intervals.conformalise(fits.fitted[:2], problem, chosen, config, begins=begun.append)
    assert begun[1:] == ["ESPM", "AESI I"]
