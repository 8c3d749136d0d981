"""Of a recalibration is kept what carries over to drives that it has not seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_experiment import BPX, experiment, write_record

from aesi.pipeline.experiment.left_out import carried_over, slope_on
from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.physics_models import DECLARED, FREE, RECALIBRATED, PhysicsModels
from aesi.pipeline.experiment.recalibrate import MODEL_ERROR_V
from aesi.pipeline.product.deviations import PRIORS, PhysicsVariant


def test_one_part_on_which_physics_runs_off_does_not_decide():
    assert carried_over(np.array([1.1, 1.3, 0.9, 1.2])) == 1.0
    assert carried_over(np.array([0.7, 0.6, 0.8, 0.01])) == pytest.approx(0.65)
    assert carried_over(np.array([-1.4, 0.2, 0.9, -0.6])) == 0.0
    assert carried_over(np.array([np.nan, 0.4])) == 0.4
    assert carried_over(np.array([])) == 1.0


@pytest.fixture(scope="module")
def loaded(tmp_path_factory):
    small = experiment(write_record(tmp_path_factory.mktemp("record")))
    return load(small.model_copy(update={"cell": small.cell.model_copy(update={"start": "recalibrated"})}))


def test_a_recalibration_that_every_part_bears_out_is_kept_whole(loaded):
    assert loaded.left_out.parts
    for part in loaded.left_out.parts:
        error = part.series.left_by(DECLARED)[part.rows]
        assert slope_on(error, error - part.series.left_by(RECALIBRATED)[part.rows]) == pytest.approx(
            1.0, abs=0.05
        )


def test_where_the_declared_cell_is_corrected_the_physics_beside_it_had_seen_what_was_left_out(
    loaded, tmp_path
):
    beside = load(experiment(write_record(tmp_path)))
    assert beside.config.cell.start == "declared"
    pieces, others = ((*one.left_out.parts, *one.left_out.drives) for one in (beside, loaded))
    for piece, other in zip(pieces, others, strict=True):
        np.testing.assert_array_equal(piece.series.error_v, piece.series.left_by(DECLARED))
        for name in FREE:
            unseen = piece.series.left_by(name)
            np.testing.assert_array_equal(unseen, other.series.left_by(name))
            assert not np.array_equal(unseen, beside.split.train[piece.place].left_by(name))
    # and the physics that is shown on the test is the one that is corrected elsewhere
    for one, other in zip(beside.split.test, loaded.split.test, strict=True):
        np.testing.assert_array_equal(one.left_by(RECALIBRATED), other.left_by(RECALIBRATED))


@pytest.mark.parametrize(
    ("start", "models", "told"),
    [
        ("recalibrated", ["ESPM"], 1),
        ("declared", ["ESPM", "ESPM recalibrated"], 1),
        ("declared", ["ESPM"], 0),
    ],
)
def test_intervals_about_physics_that_has_seen_the_only_drive_were_given_without_a_word(
    tmp_path, start, models, told
):
    record = str(write_record(tmp_path))
    data = {"kind": "files", "record": record, "repeats": {"period_s": 600, "train": [1], "test": [2]}}
    one = load(experiment(Path(record), data=data, models=models, cell={"bpx": str(BPX), "start": start}))
    assert sum("One drive trains" in note for note in one.notes) == told


@pytest.mark.parametrize(
    ("share", "told"),
    [
        (0.0, "None of the recalibration is kept, so that the recalibrated model is the declared one"),
        (0.31, "Of each change of the recalibration 31 % is kept"),
        (1.0, None),
    ],
)
def test_a_recalibrated_model_that_is_the_declared_one_was_shown_beside_it_without_a_word(
    tmp_path, monkeypatch, share, told
):
    monkeypatch.setattr("aesi.pipeline.experiment.left_out.carried_over", lambda slopes: share)
    small = experiment(write_record(tmp_path), models=["ESPM"])
    recalibrated = small.cell.model_copy(update={"start": "recalibrated"})
    notes = load(small.model_copy(update={"cell": recalibrated})).notes
    assert [told in note for note in notes].count(True) == 1 if told else not any("kept" in n for n in notes)
    if share == 0.0:  # no model of this experiment is recalibrated
        assert not any("kept" in note for note in load(small).notes)


def test_the_error_that_a_fit_allowed_for_goes_with_its_physics(loaded):
    records = [*loaded.split.train, *loaded.split.test, *(part.series for part in loaded.left_out.parts)]
    assert {series.missed_v for series in records} == {MODEL_ERROR_V}
    cell = loaded.cell
    missed = PhysicsVariant(cell, cell, deviations=(1.0,) * len(PRIORS), missed_v=0.03)
    models = PhysicsModels({DECLARED: PhysicsVariant(cell, cell), RECALIBRATED: missed}, RECALIBRATED)
    assert models.with_recalibration_share(0.5).chosen.missed_v == 0.03


def test_the_slope_is_that_of_the_declared_error_on_what_the_recalibration_takes_off():
    error = np.array([4.0, -2.0, 1.0])
    assert slope_on(error, 0.5 * error) == pytest.approx(2.0)
    assert slope_on(error, np.array([1.0, 2.0, 0.0])) == 0.0
    assert np.isnan(slope_on(error, np.zeros(3)))


def test_the_records_are_simulated_once_for_each_piece_that_is_left_out(tmp_path, monkeypatch):
    small = experiment(write_record(tmp_path))
    recalibrated = small.cell.model_copy(update={"start": "recalibrated"})
    counted = []
    whole = PhysicsModels.series
    monkeypatch.setattr(PhysicsModels, "series", lambda *given: counted.append(1) or whole(*given))
    left_out = load(small.model_copy(update={"cell": recalibrated})).left_out
    assert len(counted) == 1 + len(left_out.parts) + len(left_out.drives)


def test_minutes_of_fits_to_long_records_passed_without_a_word(tmp_path):
    begun = []
    loaded = load(experiment(write_record(tmp_path)), begins=begun.append)
    refits = len(loaded.left_out.parts) + len(loaded.left_out.drives)
    assert begun == [
        "records",
        "initial states of the records",
        "physics fitted to the training records",
        f"physics refitted {refits} times without a part of the training drives",
        "errors of the physics and their slopes",
    ]
