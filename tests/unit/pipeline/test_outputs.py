"""What a run saves: a model with its own bands, or none."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from small_experiment import (
    BPX,
    SOC0,
    build_problem,
    conformalise,
    evaluate,
    experiment,
    final_models,
    fitted,
    load,
    write_record,
)

from aesi.data import read_measurement
from aesi.data.reading import Reading
from aesi.errors import FitError
from aesi.physics import Cell, initial_state
from aesi.physics.effects import CATALOGUE
from aesi.physics.folded import folded
from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.experiment.outputs import Result, hybrid, notes, write_outputs
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.simulation import ProfileRequest, predict_file, simulate_file
from aesi.pipeline.written import MODEL
from aesi.sparse import Genome


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


def test_the_words_for_what_a_found_model_holds_were_lost_in_a_run_that_started_from_it(record, tmp_path):
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=1e-5)
    inside = folded(Cell.from_bpx(BPX), [CATALOGUE["series_resistance"].activate(resistance_ohm=1.5e-3)])
    words = {"held": tuple(map(repr, inside.held)), "beside": (repr(offset),)}
    folder = HybridModel(inside.cell, (offset,), soc0=SOC0, **words).save(tmp_path / "found" / "model")
    config = experiment(record, models=["ESPM"])
    config = config.model_copy(update={"cell": config.cell.model_copy(update={"bpx": str(folder)})})
    loaded, chosen, _ = fitted(record)
    loaded = replace(load(config), split=loaded.split, left_out=loaded.left_out)
    problem = build_problem(loaded, config)
    judged = conformalise(final_models(problem, chosen, config).fitted, problem, chosen, config)
    one = Result(config, loaded, problem, chosen, [], judged, evaluate_models(judged, loaded.split), "", 0.0)
    assert {name: getattr(hybrid(one), name) for name in words} == words


def test_the_records_that_a_model_was_trained_on_were_nowhere_in_its_folder(record, tmp_path):
    hybrid(result(record, "AESI I")).save(tmp_path / "model")
    assert HybridModel.load(tmp_path / "model").fitted_to == (("drive", read_measurement(record).digest),)
    copied, other = tmp_path / "copied.csv", write_record(tmp_path, seed=1)
    copied.write_bytes(record.read_bytes())
    unseen = tmp_path / "unseen.csv"
    unseen.write_bytes(other.read_bytes())
    whole = (
        "the saved model was fitted to this very record, or to a part of it: its error there is not that of"
    )
    named = (
        "the saved model was fitted to a record of this name with other rows or columns; if both are of one"
    )
    for file, words in ((copied, whole), (other, named), (unseen, "")):
        said = []
        predict_file(tmp_path / "model", file, tmp_path / "o.csv", say_notes=said.extend)
        told = [note for note in said if "the saved model was fitted to" in note]
        assert len(told) == bool(words)
        assert all(note.startswith(f"{file.stem}: {words}") for note in told)
    said, stated = [], Reading({"temperature_degc": "25"})  # of the very rows, at another temperature
    predict_file(
        tmp_path / "model", record, tmp_path / "o.csv", ProfileRequest(reading=stated), say_notes=said.extend
    )
    assert any(note.startswith(f"drive: {named}") for note in said)
    table = pd.read_csv(record).drop(columns="voltage_v")  # without a voltage nothing is judged
    table.to_csv(tmp_path / "drive.csv", index=False)
    said = []
    predict_file(tmp_path / "model", tmp_path / "drive.csv", tmp_path / "o.csv", say_notes=said.extend)
    assert not any("the saved model was fitted to" in note for note in said)


def test_physics_was_saved_with_the_bands_of_other_physics(record):
    one = result(record, "ESPM", "ESPM recalibrated")
    assert one.best == "ESPM recalibrated"
    model = hybrid(one)
    assert model.cell is one.loaded.cells["ESPM recalibrated"] is not one.loaded.cell
    assert model.bands is None
    assert model.intervals is None
    (told,) = [note for note in notes(one) if "saved model" in note]
    assert told == (
        "The saved model is the ESPM recalibrated alone, without bands: bands of physics are kept for the ESPM alone "
        "(cell.start)."
    )


def test_a_model_that_cannot_be_kept_leaves_the_physics_that_it_corrects(record):
    one = result(record, "ESPM", "gradient boosting")
    assert hybrid(one).cell is one.loaded.cell
    (told,) = [note for note in notes(one) if "saved model" in note]
    assert (
        told == "The saved model is the ESPM alone, without bands: gradient boosting cannot be kept with it."
    )


def test_a_saved_model_told_the_finding_of_the_one_that_could_not_be_kept(record, tmp_path):
    for models, about_it in (
        (("ESPM", "gradient boosting"), False),
        (("ESPM", "ESPM recalibrated"), True),
        (("ESPM recalibrated", "ESPM"), True),
    ):
        summary = write_outputs(tmp_path, result(record, *models))
        assert HybridModel.load(tmp_path / MODEL).finding == (summary["finding"] if about_it else "")


def test_candidates_that_failed_were_told_nowhere(record):
    one = replace(result(record, "ESPM"), failed={"a bug": 3, "too slow": 1, "b": 1, "c": 1})
    assert one.evaluated == 6
    assert "6 of 6 candidates failed: 3 x a bug; 1 x too slow; 1 x b; 1 x something else." in notes(one)
    assert not [note for note in notes(result(record, "ESPM")) if "failed" in note]


def test_physics_that_is_saved_keeps_its_bands(record):
    one = result(record, "ESPM recalibrated", "ESPM")
    assert not [note for note in notes(one) if "saved model" in note]
    assert covered(hybrid(one), record) > 0.8


@pytest.fixture(scope="module")
def of_files(tmp_path_factory):
    """A run that recalibrates on two records and is judged by a third, all of which begin at rest; and that one."""
    folder = tmp_path_factory.mktemp("files")
    one, two, three = (write_record(folder, f"{name}.csv", seed) for seed, name in enumerate("abc"))
    config = experiment(
        one,
        data={"kind": "files", "train": [str(one), str(two)], "test": [str(three)], "hold": "backward"},
        cell={"bpx": str(BPX), "start": "recalibrated"},
        models=["ESPM", "AESI I"],
    )
    loaded = load(config)
    problem = build_problem(loaded, config)
    chosen = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    judged = conformalise(
        final_models(problem, chosen, config).fitted, problem, chosen, config, loaded.left_out
    )
    evaluation = evaluate_models(judged, loaded.split)
    return Result(config, loaded, problem, chosen, [], judged, evaluation, "", 0.0), three


def test_a_saved_model_started_elsewhere_than_the_run_that_judged_it(of_files, tmp_path):
    one, test = of_files
    folder = hybrid(one).save(tmp_path / "model")
    (figures,) = (row for row in one.evaluation.rows if row["name"] == "AESI I")
    data, out = read_measurement(test), tmp_path / "out.csv"
    predict_file(folder, test, out)
    predicted = pd.read_csv(out)
    left = data.voltage_v - predicted.voltage_v
    assert 1e3 * np.sqrt(np.mean(left**2)) == pytest.approx(figures["free_run"]["test_rmse_mv"], rel=1e-6)
    inside = (data.voltage_v >= predicted.lower_v) & (data.voltage_v <= predicted.upper_v)
    assert 100 * inside[1:].mean() == pytest.approx(figures["free_run_intervals"]["coverage_pct"], abs=0.1)
    # A simulation by the saved model is of the same physics from the same start.
    simulate_file(folder, test, tmp_path / "alone.csv")
    (series,) = one.loaded.split.test
    np.testing.assert_allclose(pd.read_csv(tmp_path / "alone.csv").voltage_v, series.model_v, atol=1e-7)
    np.testing.assert_allclose(predicted.physics_v, series.model_v, atol=1e-7)
    assert [note for note in one.loaded.notes if note.startswith("c ") and f"{series.soc[0]:.4f}" in note]


def test_records_that_were_fitted_to_start_where_the_fit_has_them(of_files):
    one, _ = of_files
    seen, again = one.loaded.split.train[0], one.loaded.left_out.parts[0].series
    declared = initial_state(Cell.from_bpx(BPX), read_measurement(one.config.data.train[0])).soc
    assert seen.soc[0] == pytest.approx(declared, abs=1e-3)
    # Left out, it starts where physics that has not seen it reads it to, as a test does.
    assert again.name == seen.name
    assert again.soc[0] != seen.soc[0]


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
