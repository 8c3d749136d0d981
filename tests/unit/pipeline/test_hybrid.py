"""The saved product: data alone, the same predictions after a round trip, and stated behaviour off its path."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_experiment import SOC0, experiment, fitted

import aesi
from aesi.data.resample import to_even
from aesi.errors import DataError, InputError, SimulationError
from aesi.physics import initial_state
from aesi.physics.effects import CATALOGUE, activated
from aesi.physics.folded import folded
from aesi.pipeline.discovery.cases import case_of_files
from aesi.pipeline.experiment.load import load
from aesi.pipeline.export import export
from aesi.pipeline.impedance import impedance_file
from aesi.pipeline.product.error_series import error_series
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.product.model_folder import SCHEMA
from aesi.pipeline.simulation import ProfileRequest, predict_file, simulate_file
from aesi.pipeline.simulation_words import (
    Baseline,
    band_sentences,
    simulated_record_sentences,
    voltage_words,
)
from aesi.records import Run
from aesi.sparse import SparseModel
from aesi.sparse.fade import Fade
from aesi.sparse.terms.library import Library, Term
from aesi.sparse.terms.scaling import Scaling
from aesi.sparse.trained_region import TrainedRegion


@pytest.fixture(scope="module")
def data(record):
    return aesi.read_measurement(record)


@pytest.fixture(scope="module")
def model(record):
    loaded, _, models = fitted(record)
    one = next(each for each in models if each.model.name == "AESI I")
    return HybridModel(
        cell=loaded.cell,
        correction=one.model,
        intervals=one.intervals,
        bands=one.bands,
        dt_s=1.0,
        hold="backward",
        soc0=SOC0,
    )


def test_a_voltage_without_a_value_was_told_by_a_time_that_all_rows_share(model):
    time = 1.7e9 + np.arange(300.0)
    voltage = np.full(len(time), 3.7)
    voltage[200] = np.nan
    with pytest.raises(DataError, match=r"has no value at 1700000200 s \(row 201, counted from 1\)"):
        model.predict(time, np.zeros(len(time)), voltage_v=voltage)


def test_a_voltage_in_millivolts_was_taken_for_that_of_another_cell(model, data):
    said = r"the record, row 1, column voltage_v: \d+.* V is plainly in mV; give it in V"
    with pytest.raises(DataError, match=said):
        model.predict(data.time_s, data.current_a, voltage_v=1e3 * data.voltage_v)
    with pytest.raises(DataError, match="the rest voltage: 4100 V is plainly in mV"):
        aesi.simulate(model.cell, data.time_s, data.current_a, rest_voltage_v=4100.0)


def test_the_band_of_a_free_run_is_wider_by_what_the_start_is_uncertain_by(model, data):
    sure, unsure = (model.predict_record(data, SOC0, soc0_sd=sd) for sd in (0.0, 0.02))
    moved = [model.predict_record(data, SOC0 + off).physics_v - sure.physics_v for off in (-0.02, 0.02)]
    np.testing.assert_array_equal(sure.voltage_v, unsure.voltage_v)
    narrow, wide = ((each.upper_v - each.voltage_v)[-1] for each in (sure, unsure))
    start_v = np.abs(moved).max(axis=0)[-1]  # to whichever side is more
    assert wide == pytest.approx(np.hypot(narrow, 1.645 * start_v), rel=1e-3)
    assert wide > 1.2 * narrow
    with pytest.raises(InputError, match="soc0_sd = nan is no standard deviation"):
        model.predict_record(data, SOC0, soc0_sd=float("nan"))


def test_a_free_run_of_a_record_with_a_voltage_began_where_the_training_did(model, data):
    elsewhere = replace(data, voltage_v=model.predict(data.time_s, data.current_a, soc0=0.6).voltage_v)
    read = initial_state(model.cell, elsewhere, None, "backward")
    assert abs(read.soc - 0.6) < 0.02 < abs(read.soc - model.soc0)
    run, told = (
        model.predict_record(elsewhere),
        model.predict_record(elsewhere, read.soc, soc0_sd=read.read_sd),
    )
    for name in ("voltage_v", "lower_v", "upper_v", "soc"):
        np.testing.assert_array_equal(getattr(run, name), getattr(told, name))
    unmeasured = replace(data, voltage_v=np.full(len(data), np.nan))
    assert model.predict_record(unmeasured).soc[0] == pytest.approx(model.soc0)


def test_a_free_run_without_a_measurement_began_as_if_the_error_were_measured_to_be_zero(model, data):
    correction = replace(model.correction, memory=0.999)  # what it begins with lasts
    lasting = replace(model, correction=correction)
    under_load = data.take(slice(100, None))  # at rest the correction says nothing
    drive = under_load.time_s, under_load.current_a, SOC0
    free = lasting.predict(*drive)
    given = free.voltage_v - free.physics_v
    # By the inputs alone, from the first row on: an error that is measured to be that moves nothing.
    told = lasting.predict(*drive, error0_v=float(given[0]))
    np.testing.assert_allclose(told.voltage_v, free.voltage_v, atol=1e-12)
    from_zero = lasting.predict(*drive, error0_v=0.0)
    assert np.abs(from_zero.voltage_v - free.voltage_v).max() > 5e-3
    # The first row has the band of a whole drive, as where a measurement lies long before.
    width, known = (each.upper_v - each.lower_v for each in (free, told))
    assert width[0] > 1.1 * known[0]
    np.testing.assert_allclose(width[700:], known[700:], rtol=1e-9)
    with pytest.raises(InputError, match="error0_v = nan is no voltage"):
        lasting.predict(*drive, error0_v=float("nan"))


def test_a_free_run_of_a_record_begins_with_its_first_voltage_and_sees_no_other(model, data):
    record = replace(data, voltage_v=data.voltage_v + 0.004)
    run = model.predict_record(record, SOC0)
    assert run.voltage_v[0] == pytest.approx(record.voltage_v[0])
    alone = replace(record, voltage_v=np.r_[record.voltage_v[0], np.full(len(data) - 1, np.nan)])
    np.testing.assert_array_equal(model.predict_record(alone, SOC0).voltage_v, run.voltage_v)
    between = record.take(slice(0, None, 5))  # brought to the model's step and back
    alone = replace(between, voltage_v=np.r_[between.voltage_v[0], np.full(len(between) - 1, np.nan)])
    run = model.predict_record(between, SOC0)
    np.testing.assert_array_equal(model.predict_record(alone, SOC0).voltage_v, run.voltage_v)
    assert np.isfinite(run.voltage_v).all()


def test_the_folder_holds_no_pickle_and_predicts_the_same(model, data, tmp_path):
    folder = model.save(tmp_path / "model")
    assert {path.suffix for path in folder.iterdir()} == {".json", ".npz"}
    again = aesi.HybridModel.load(folder)
    for voltage_v in (None, data.voltage_v):
        first = model.predict(data.time_s, data.current_a, SOC0, voltage_v)
        second = again.predict(data.time_s, data.current_a, SOC0, voltage_v)
        np.testing.assert_allclose(second.voltage_v, first.voltage_v, atol=1e-12)
        np.testing.assert_allclose(second.lower_v, first.lower_v, atol=1e-12)
        np.testing.assert_allclose(second.upper_v, first.upper_v, atol=1e-12)


def test_both_regimes_beat_the_physics_and_carry_bands(model, data):
    for voltage_v in (None, data.voltage_v):
        prediction = model.predict(data.time_s, data.current_a, SOC0, voltage_v)
        left = np.sqrt(np.mean((data.voltage_v - prediction.voltage_v) ** 2))
        bare = np.sqrt(np.mean((data.voltage_v - prediction.physics_v) ** 2))
        assert left < 0.1 * bare
        assert (prediction.upper_v > prediction.lower_v)[1:].all()
        inside = (data.voltage_v >= prediction.lower_v) & (data.voltage_v <= prediction.upper_v)
        assert inside[1:].mean() > 0.8


def test_a_start_that_is_given_wrongly_was_taken_as_exact_without_a_word(model, data, tmp_path):
    def covered(soc0, soc0_sd):
        said = model.predict(data.time_s, data.current_a, soc0, error0_v=0.0, soc0_sd=soc0_sd)
        return np.mean((data.voltage_v >= said.lower_v) & (data.voltage_v <= said.upper_v))

    for off in (-0.02, 0.02):
        assert covered(SOC0 + off, 0.0) < 0.3
        assert covered(SOC0 + off, 0.02) > 0.8

    folder, current = model.save(tmp_path / "model"), tmp_path / "drive.csv"
    pd.DataFrame({"time_s": data.time_s, "current_a": data.current_a}).to_csv(current, index=False)

    def told(measured=False, **asked):
        said = []
        predict_file(folder, current, tmp_path / "out.csv", ProfileRequest(**asked), measured, said.extend)
        return [sentence for sentence in said if "--soc0-sd" in sentence]

    moved = [model.predict(data.time_s, data.current_a, SOC0 + off).physics_v for off in (-0.01, 0.0, 0.01)]
    worth_mv = 1e3 * np.sqrt(np.mean(np.max(np.abs(np.array(moved) - moved[1]), axis=0) ** 2))
    for asked in ({"soc0": SOC0}, {}):  # given now, or when the model was made
        (sentence,) = told(**asked)
        assert sentence.startswith(
            f"drive: the band takes the initial state of charge of {SOC0:g} as exact; "
        )
        assert (
            f"an error of 0.01 in it changes the voltage by {worth_mv:.1f} mV RMS along this record"
            in sentence
        )
    assert not told(soc0=SOC0, soc0_sd=0.01)
    for wrong in ({"soc0_sd": 0.01}, {"soc0": SOC0, "soc0_sd": 0.01, "measured": True}):
        with pytest.raises(InputError, match="give it with --soc0 and without --measured"):
            told(**wrong)


def test_another_sampling_is_brought_to_the_models_own_and_back(model, data):
    rows = np.r_[0:1000:2, 1000 : len(data) : 5]
    time_s, current_a = data.time_s[rows], data.current_a[rows]
    prediction = model.predict(time_s, current_a, SOC0)
    own = aesi.simulate(model.cell, time_s, current_a, SOC0, model.effects, hold=model.hold)
    np.testing.assert_allclose(prediction.physics_v, own.voltage_v, atol=1e-12)
    even = to_even(aesi.Measurement(time_s, current_a, data.voltage_v[rows]), model.dt_s, model.hold)
    stepped = model.predict(even.time_s, even.current_a, SOC0)
    correction = np.interp(time_s, even.time_s, stepped.voltage_v - stepped.physics_v)
    assert np.abs(correction).max() > 1e-3
    np.testing.assert_allclose(prediction.voltage_v - prediction.physics_v, correction, atol=1e-12)


def test_the_band_of_physics_alone_counted_rows_of_any_length_as_steps(model, record):
    _, _, models = fitted(record)
    bands = next(each.bands for each in models if each.model.name == "ESPM")
    physics = replace(model, correction=None, intervals=None, bands=bands)
    time_s, often_s = np.arange(0.0, 61.0), np.linspace(0.0, 60.0, 601)
    whole, often = (physics.predict(t, np.full(len(t), 20.0), SOC0) for t in (time_s, often_s))
    np.testing.assert_allclose(
        (often.upper_v - often.lower_v)[::10], whole.upper_v - whole.lower_v, rtol=0.01
    )
    np.testing.assert_allclose(often.voltage_v, often.physics_v, atol=1e-12)


def test_saved_physics_alone_has_its_intervals_one_step_ahead(model, record, data, tmp_path):
    _, _, models = fitted(record)
    bare = next(each for each in models if each.model.name == "ESPM")
    saved = replace(model, correction=None, intervals=bare.intervals, bands=bare.bands).save(
        tmp_path / "model"
    )
    physics = HybridModel.load(saved)
    ahead = physics.predict(data.time_s, data.current_a, SOC0, data.voltage_v)
    np.testing.assert_array_equal(ahead.voltage_v, ahead.physics_v)
    assert ahead.nominal == pytest.approx(1.0 - bare.intervals.alpha)
    residual = data.voltage_v - ahead.physics_v
    residual[0] = np.nan
    band = bare.intervals.intervals(residual, data.current_a)
    np.testing.assert_allclose(ahead.lower_v[1:] - ahead.physics_v[1:], band.lower_v[1:], atol=1e-12)
    np.testing.assert_allclose(ahead.upper_v[1:] - ahead.physics_v[1:], band.upper_v[1:], atol=1e-12)
    apart = data.take(slice(0, None, 2))
    with pytest.raises(DataError, match="one step of the model is 1 s"):
        physics.predict_record(apart, SOC0, one_step=True)


def test_a_model_that_cannot_be_written_leaves_the_one_that_is_there(model, tmp_path):
    folder = model.save(tmp_path / "model")
    with pytest.raises(TypeError):
        replace(model, finding=b"bytes").save(folder)
    assert HybridModel.load(folder).soc0 == model.soc0
    replace(model, soc0=np.float32(0.5), dt_s=np.int64(1)).save(folder)
    loaded = HybridModel.load(folder)
    assert (loaded.soc0, loaded.dt_s) == (0.5, 1.0)


def linear_drive(model, dt_s, every_s=1.0, seconds=900.0):
    """Time, current and voltage of the model's own physics on a drive that runs straight between points `every_s`."""
    rng = np.random.default_rng(0)
    points_s = np.arange(0.0, seconds + every_s, every_s)
    time_s = np.arange(0.0, seconds, dt_s)
    current_a = np.interp(time_s, points_s, rng.normal(0.0, 3.0, len(points_s)))
    return time_s, current_a, aesi.simulate(model.cell, time_s, current_a, SOC0, hold="linear").voltage_v


def test_a_current_that_runs_straight_came_early_where_a_record_was_brought_to_another_step(model):
    straight = replace(model, hold="linear")
    time_s, current_a, _ = linear_drive(model, 1.0, every_s=2.0)
    kept = np.delete(np.arange(len(time_s)), slice(31, 200, 6))  # rows on a straight line between the others
    whole = straight.predict(time_s, current_a, SOC0)
    brought = straight.predict(time_s[kept], current_a[kept], SOC0)
    np.testing.assert_allclose(brought.voltage_v, whole.voltage_v[kept], atol=2e-5)


def test_one_step_of_rows_further_apart_than_a_step_saw_the_row_that_it_predicts(model, tmp_path):
    time_s, current_a, voltage_v = linear_drive(model, 2.0)
    with pytest.raises(DataError, match="its rows are 2 s apart, and one step of the model is 1 s"):
        model.predict(time_s, current_a, SOC0, voltage_v)
    model.predict(time_s, current_a, SOC0)  # a free run is none of its rows

    folder = model.save(tmp_path / "model")
    rows = {"time_s": time_s, "current_a": current_a, "voltage_v": voltage_v}
    pd.DataFrame(rows).to_csv(tmp_path / "sparse.csv", index=False)
    with pytest.raises(DataError, match="sparse: its rows are 2 s apart"):
        predict_file(folder, tmp_path / "sparse.csv", tmp_path / "out.csv", measured=True)


@pytest.mark.parametrize("every_s", [0.3, 0.76, 1.1, 1.49])
def test_one_step_of_rows_near_a_step_apart_saw_the_row_that_it_predicts(model, every_s):
    time_s, current_a, voltage_v = linear_drive(model, every_s, seconds=200.0)
    before = model.predict(time_s, current_a, SOC0, voltage_v)
    for row in range(60, 70):
        moved = voltage_v.copy()
        moved[row] += 0.01
        after = model.predict(time_s, current_a, SOC0, moved)
        for name in ("voltage_v", "lower_v", "upper_v"):
            was, now = (getattr(each, name)[: row + 1] for each in (before, after))
            np.testing.assert_allclose(now, was, atol=1e-12)
        assert np.abs(after.voltage_v - before.voltage_v).max() > 1e-5  # but later ones do


def test_the_first_row_had_the_band_of_one_step_though_nothing_was_measured_before_it(model, data):
    prediction = model.predict(data.time_s, data.current_a, SOC0, data.voltage_v)
    assert np.isnan(prediction.lower_v[0])
    assert prediction.voltage_v[0] == prediction.physics_v[0]
    assert np.isfinite(prediction.lower_v[1:]).all()


def test_a_band_one_step_ahead_said_nothing_of_rows_that_it_is_not_of(model, data, tmp_path):
    folder = model.save(tmp_path / "model")

    def told(time_s, current_a, voltage_v):
        rows = {"time_s": time_s, "current_a": current_a, "voltage_v": voltage_v}
        pd.DataFrame(rows).to_csv(tmp_path / "drive.csv", index=False)
        said = []
        asked = ProfileRequest(soc0=SOC0)
        predict_file(folder, tmp_path / "drive.csv", tmp_path / "out.csv", asked, True, said.extend)
        return " ".join(said)

    as_trained = told(data.time_s, data.current_a, data.voltage_v)
    assert "after the one before" not in as_trained

    kept = np.delete(np.arange(len(data)), [50, 150])
    with_gap = told(data.time_s[kept], data.current_a[kept], data.voltage_v[kept])
    assert "more than a step of 1 s after the one before" in with_gap

    drifting_v = data.voltage_v + 0.02  # all of it one way: the band follows, the point does not
    assert "lies outside its own band" in told(data.time_s, data.current_a, drifting_v)


def test_one_step_finds_its_start_from_the_rest_voltage(model, data):
    prediction = model.predict(data.time_s, data.current_a, voltage_v=data.voltage_v)
    assert prediction.soc[0] == pytest.approx(SOC0, abs=5e-3)


def test_inputs_beyond_the_trained_range_are_flagged_and_the_band_is_wider_there(model, data, monkeypatch):
    prediction = model.predict(data.time_s, 1.5 * data.current_a, SOC0)
    beyond = np.abs(1.5 * data.current_a) > np.abs(data.current_a).max()
    assert prediction.outside[beyond].all()
    monkeypatch.setattr(SparseModel, "reach", lambda self, series, **_: np.zeros(len(series)))
    held = model.predict(data.time_s, 1.5 * data.current_a, SOC0)
    wider = prediction.upper_v - held.upper_v
    np.testing.assert_allclose(held.lower_v - prediction.lower_v, wider, atol=1e-12)
    assert wider.min() == 0.0
    assert np.mean(wider[beyond]) > 2 * np.mean(wider[~beyond])


@pytest.fixture(scope="module")
def fading(model, data):
    """The model, as if it had been trained on its record at 24 degC and fades elsewhere."""
    even = error_series(
        data, aesi.simulate(model.cell, data.time_s, data.current_a, SOC0, hold="backward"), 1.0
    )
    variables = model.correction._variables(even)
    scaled = model.correction.scaling.apply(variables)[:, 1:]
    region = TrainedRegion.of(scaled, even.soc, np.full(len(even), 24.0))
    return replace(model, correction=replace(model.correction, fade=Fade(1.0, region), leverage=None))


def test_a_record_without_a_temperature_counted_as_of_the_trained_one(fading, data):
    region = fading.correction.fade.region
    cold = replace(region, visited=replace(region.visited, temperature_degc=(0.0, 0.0)))
    at_zero = replace(fading, correction=replace(fading.correction, fade=Fade(1.0, cold)))
    assert data.temperature_degc is None  # the physics takes it at the 25 degC of the cell's file
    stated = replace(data, temperature_degc=np.full(len(data), 25.0))
    runs = [at_zero.predict_record(one, SOC0) for one in (data, stated)]
    assert all(run.outside.all() for run in runs)
    np.testing.assert_allclose(runs[0].weight, runs[1].weight)
    assert runs[0].weight.max() < 0.01
    np.testing.assert_allclose(runs[0].temperature_degc, 25.0)


def test_a_cold_record_had_no_correction_and_nothing_said_so(fading, data, tmp_path):
    folder = fading.save(tmp_path / "model")
    rows = {"time_s": data.time_s, "current_a": data.current_a, "voltage_v": data.voltage_v}

    def predicted(degc, measured=False):
        pd.DataFrame(rows | {"temperature_degc": degc}).to_csv(tmp_path / "drive.csv", index=False)
        said = []
        asked = ProfileRequest(soc0=SOC0)
        predict_file(folder, tmp_path / "drive.csv", tmp_path / "out.csv", asked, measured, said.extend)
        return pd.read_csv(tmp_path / "out.csv"), " ".join(said)

    table, said = predicted(0.0)
    assert "100 % of the rows lie outside the range the correction was trained on" in said
    assert (
        "at 0.0 degC, 24 K below what it was trained at, none of the correction is applied: this is the physics"
        in said
    )
    assert table["outside"].all()
    assert table["weight"].max() < 1e-3
    np.testing.assert_allclose(
        table["voltage_v"][1:], table["physics_v"][1:], atol=1e-4
    )  # the first is measured
    assert (
        "none of the correction is applied: this is the physics model and its last measured error."
        in predicted(0.0, True)[1]
    )

    table, said = predicted(18.0)
    assert table["outside"].all()
    assert 0.2 < table["weight"].mean() < 0.7
    share = f"{100 * table['weight'].mean():.2g} %"
    fades = f"the correction fades towards the physics, to {share} of its size on average"
    assert f"at 18.0 degC, 6 K below what it was trained at, {fades}" in said

    table, said = predicted(23.0)
    assert table["outside"].all()
    assert "at 23.0 degC, 1 K below what it was trained at, the correction fades" in said

    table, said = predicted(24.0)
    assert table["outside"].mean() < 0.05  # simulated a kelvin colder than it was trained
    assert table["weight"].mean() > 0.995
    assert "of the correction" not in said


def test_a_correction_that_is_applied_nowhere_was_said_to_fade_to_a_share_of_its_size(fading, data, tmp_path):
    region = fading.correction.fade.region
    folder = replace(fading, correction=replace(fading.correction, fade=Fade(0.0, region))).save(
        tmp_path / "m"
    )
    table = pd.DataFrame({"time_s": data.time_s, "current_a": data.current_a, "voltage_v": data.voltage_v})
    table.to_csv(tmp_path / "drive.csv", index=False)
    said = []
    asked = ProfileRequest(soc0=SOC0)
    predict_file(folder, tmp_path / "drive.csv", tmp_path / "out.csv", asked, say_notes=said.extend)
    alone = "improved no left-out training drive, so that it is applied nowhere: this is the physics model"
    assert any(f"{alone} and the error of the first measured voltage, which decays." in note for note in said)
    assert not any("fades" in note for note in said)
    assert (pd.read_csv(tmp_path / "out.csv")["weight"] == 0.0).all()

    table.drop(columns="voltage_v").to_csv(tmp_path / "drive.csv", index=False)
    said = []
    predict_file(folder, tmp_path / "drive.csv", tmp_path / "out.csv", asked, say_notes=said.extend)
    assert any(f"{alone}." in note for note in said)
    out = pd.read_csv(tmp_path / "out.csv")
    np.testing.assert_array_equal(out["voltage_v"], out["physics_v"])


def test_a_model_that_does_not_fade_keeps_all_and_one_without_a_correction_has_none_to_keep(model, data):
    assert (model.predict(data.time_s, data.current_a, SOC0).weight == 1.0).all()
    physics = HybridModel(model.cell)
    for voltage_v in (None, data.voltage_v):
        assert np.isnan(physics.predict(data.time_s, data.current_a, SOC0, voltage_v).weight).all()


def test_a_missing_voltage_is_refused_with_its_row(model, data):
    voltage_v = data.voltage_v.copy()
    voltage_v[7] = np.nan
    with pytest.raises(DataError, match=r"no value at 7 s \(row 8, counted from 1\)"):
        model.predict(data.time_s, data.current_a, SOC0, voltage_v)


def test_a_first_voltage_that_no_such_cell_has_started_a_prediction_without_a_word(model, data):
    voltage_v = data.voltage_v.copy()
    voltage_v[0] = 1.5
    with pytest.raises(DataError, match=r"1.500 V at 0 s \(row 1, counted from 1\) is outside the range of"):
        model.predict(data.time_s, data.current_a, SOC0, voltage_v)


def test_a_simulation_or_a_discovery_of_a_hybrid_left_its_correction_out_without_a_word(
    model, record, tmp_path
):
    folder, said = model.save(tmp_path / "model"), []
    simulate_file(folder, record, tmp_path / "out.csv", say_notes=said.extend)
    assert any("learnt correction is no part of a simulation" in note for note in said)
    assert any("learnt correction is left out" in note for note in case_of_files(folder, [record]).notes)
    bare = HybridModel(model.cell).save(tmp_path / "bare")
    assert not any("correction" in note for note in case_of_files(bare, [record]).notes)


def test_self_heating_that_a_measured_temperature_leaves_idle_was_told_as_simulated(model, data, tmp_path):
    folder = HybridModel(model.cell).save(tmp_path / "physics")
    record, asked = tmp_path / "drive.csv", ProfileRequest(self_heating=True)
    said = {}
    for measured in (True, False):
        degc = {"temperature_degc": np.full(len(data), 25.0)} if measured else {}
        columns = {"time_s": data.time_s, "current_a": data.current_a, "voltage_v": data.voltage_v}
        pd.DataFrame(columns | degc).to_csv(record, index=False)
        notes = []
        simulate_file(folder, record, tmp_path / "out.csv", asked, say_notes=notes.extend)
        said[measured] = " ".join(notes)
    assert "self_heating has nothing to add" in said[True]
    assert "with self_heating(" not in said[True]
    assert "with self_heating(" in said[False]


def test_the_temperature_that_a_simulation_wrote_was_the_windings_and_heated_it_once_more(tmp_path):
    """Read again as its case's, it made 36 of 33 degC after 3C, and 29 mV of the same cell."""
    cell = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_18650hg2.bpx.json"
    assert aesi.Cell.from_bpx(cell).winding_resistance_k_w > 0.1
    profile, once, twice = (tmp_path / f"{name}.csv" for name in ("profile", "once", "twice"))
    time = np.arange(0.0, 600.0)
    pd.DataFrame({"time_s": time, "current_a": np.where(time < 10, 0.0, 8.0)}).to_csv(profile, index=False)
    first = simulate_file(cell, profile, once, ProfileRequest(soc0=0.95, hold="backward", self_heating=True))
    winding = first.series["temperature_k"]
    assert winding[-1] > winding[0] + 5.0
    again = simulate_file(cell, once, twice, ProfileRequest(soc0=0.95, hold="backward"))
    np.testing.assert_allclose(again.series["temperature_k"], winding, atol=0.02)
    np.testing.assert_allclose(again.voltage_v, first.voltage_v, atol=2e-4)


@pytest.mark.parametrize("use", [simulate_file, predict_file])
@pytest.mark.parametrize(("column_degc", "told"), [(0.0, True), (25.0, False), (None, False)])
def test_a_dead_temperature_was_simulated_at_without_a_word(model, data, tmp_path, use, column_degc, told):
    physics, record, said = HybridModel(model.cell, hold="linear"), tmp_path / "drive.csv", []
    run = aesi.simulate(model.cell, data.time_s, data.current_a, SOC0, temperature_degc=25.0)
    columns = {"time_s": data.time_s, "current_a": data.current_a, "voltage_v": run.voltage_v}
    degc = {} if column_degc is None else {"temperature_degc": column_degc}
    pd.DataFrame(columns | degc).to_csv(record, index=False)
    asked = ProfileRequest(soc0=SOC0)
    use(physics.save(tmp_path / "physics"), record, tmp_path / "out.csv", asked, say_notes=said.extend)
    found = [note for note in said if "its voltage contradicts its temperature" in note]
    assert bool(found) == told
    assert not found or found[0].startswith("drive: its voltage contradicts its temperature. The error of ")


@pytest.mark.parametrize("measured", [False, True], ids=["free run", "one step ahead"])
@pytest.mark.parametrize(("column_degc", "told"), [(-20.0, ["from 47 s on"]), (25.0, [])])
def test_a_collector_that_runs_dry_was_predicted_without_a_word(model, tmp_path, column_degc, told, measured):
    time, said = np.arange(120.0), []
    run = aesi.simulate(model.cell, time, np.full(120, 90.0), 1.0, temperature_degc=column_degc)
    columns = {"time_s": time, "current_a": run.current_a, "voltage_v": run.voltage_v}
    pd.DataFrame(columns | {"temperature_degc": column_degc}).to_csv(tmp_path / "pulse.csv", index=False)
    folder = HybridModel(model.cell, hold="linear").save(tmp_path / "physics")
    asked = ProfileRequest(soc0=1.0)
    predict_file(folder, tmp_path / "pulse.csv", tmp_path / "out.csv", asked, measured, said.extend)
    dry = [note for note in said if "the salt at a collector is used up" in note]
    assert [words in note for note, words in zip(dry, told, strict=True)] == [True] * len(told)


def test_physics_with_effects_alone_is_a_model_too(model, data, tmp_path):
    effect = CATALOGUE["series_resistance"].activate(resistance_ohm=1.5e-3)
    folder = HybridModel(model.cell, (effect,), hold="backward").save(tmp_path / "physics")
    again = HybridModel.load(folder)
    assert again.effects == (effect,)
    prediction = again.predict(data.time_s, data.current_a, SOC0)
    assert np.sqrt(np.mean((data.voltage_v - prediction.voltage_v) ** 2)) < 1.1e-3
    assert np.isnan(prediction.lower_v).all()
    with pytest.raises(DataError, match="needs soc0"):
        again.predict(data.time_s, data.current_a)


def test_a_saved_model_was_simulated_with_another_hold_than_it_was_predicted_with(model, data, tmp_path):
    folder = replace(model, correction=None, intervals=None, bands=None).save(tmp_path / "model")
    for name, hold in (("own", None), ("asked", "linear")):
        said = {}
        for todo in (simulate_file, predict_file):
            said[todo] = []
            data.to_frame().to_csv(tmp_path / "drive.csv", index=False)
            asked = ProfileRequest(SOC0, hold)
            todo(
                folder,
                tmp_path / "drive.csv",
                tmp_path / f"{todo.__name__}.csv",
                asked,
                say_notes=said[todo].extend,
            )
        simulated, predicted = (
            pd.read_csv(tmp_path / f"{todo.__name__}.csv").voltage_v for todo in (simulate_file, predict_file)
        )
        np.testing.assert_allclose(simulated, predicted, atol=1e-8)
        words = "as declared" if name == "asked" else "since the row before, as the saved model was made"
        assert all(any(words in note for note in notes) for notes in said.values())


def test_one_record_was_read_otherwise_by_a_model_that_a_discovery_had_written_than_by_its_cell(
    model, tmp_path
):
    """Rows of a second in pulses of a minute and one at the end of a rest of ten: a logger's."""
    cell, pulse = model.cell, np.arange(1.0, 61.0)
    time_s = np.concatenate([[0.0], *(660.0 * k + np.append(600.0, 600.0 + pulse) for k in range(4))])
    current_a = np.concatenate([[0.0], *[np.append(0.0, np.full(60, cell.nominal_capacity_ah))] * 4])
    voltage_v = aesi.simulate(cell, time_s, current_a, SOC0, hold="backward").voltage_v
    pulses = aesi.Measurement(time_s, current_a, voltage_v, name="pulses")
    pulses.to_frame().to_csv(tmp_path / "pulses.csv", index=False)
    folder = HybridModel(cell, hold=None).save(tmp_path / "model")
    for todo, source in (
        (simulate_file, folder / "cell.bpx.json"),
        (simulate_file, folder),
        (predict_file, folder),
    ):
        said, out = [], tmp_path / "out.csv"
        todo(source, tmp_path / "pulses.csv", out, ProfileRequest(SOC0), say_notes=said.extend)
        np.testing.assert_allclose(pd.read_csv(out).voltage_v, voltage_v, atol=1e-6)
        assert any("constant since the row before, as loggers write" in note for note in said)
    saved = HybridModel.load(folder)
    for stepping in (
        saved,
        replace(model, hold=None, correction=None, intervals=None),
    ):  # its bands are of even rows
        prediction = stepping.predict_record(pulses, SOC0)
        np.testing.assert_allclose(prediction.physics_v, voltage_v, atol=1e-6)
    straight = aesi.simulate(cell, time_s, current_a, SOC0, hold="linear").voltage_v
    lone = saved.predict(time_s, current_a, SOC0)  # a profile without a voltage, which no logger wrote
    np.testing.assert_allclose(lone.voltage_v, straight, atol=1e-6)
    declared = replace(saved, hold="backward").predict_record(pulses.held("linear"), SOC0)
    np.testing.assert_allclose(declared.voltage_v, straight, atol=1e-6)


@pytest.mark.parametrize("soc0", [None, 0.2])
def test_a_start_that_was_read_is_the_first_to_check_where_a_record_runs_empty(model, tmp_path, soc0):
    folder = replace(model, correction=None, intervals=None, bands=None).save(tmp_path / "model")
    time = np.arange(0.0, 1400.0, 10.0)
    current = np.where(time < 300.0, 0.0, model.cell.nominal_capacity_ah)
    rest_v = float(model.cell.rest_voltage_v(0.2)[0])
    frame = pd.DataFrame(
        {"time_s": time, "current_a": current, "voltage_v": np.where(time < 300.0, rest_v, 3.3)}
    )
    frame.to_csv(tmp_path / "record.csv", index=False)
    asked = ProfileRequest(soc0)
    for todo in (simulate_file, predict_file):
        said: list[str] = []
        with pytest.raises(SimulationError, match="the surface of the"):
            todo(folder, tmp_path / "record.csv", tmp_path / "out.csv", asked, say_notes=said.extend)
        assert any("was read from its voltage, 0.2" in note for note in said) == (soc0 is None)


@pytest.mark.parametrize("damage", ["missing", "schema", "list", "no parts", "arrays", "part"])
def test_a_damaged_folder_is_named(model, tmp_path, damage):
    folder = model.save(tmp_path / "model")
    if damage == "missing":
        (folder / "model.json").unlink()
    elif damage == "schema":
        (folder / "model.json").write_text(json.dumps({"schema": "another/9"}))
    elif damage == "list":
        (folder / "model.json").write_text("[]")
    elif damage == "no parts":
        (folder / "model.json").write_text(json.dumps({"schema": SCHEMA}))
    elif damage == "arrays":
        (folder / "arrays.npz").write_bytes(b"PK not a zip")
    else:
        (folder / "correction.json").unlink()
    with pytest.raises(InputError, match=str(folder)):
        HybridModel.load(folder)


@pytest.mark.parametrize(
    ("file", "changes", "sentence"),
    [
        ("model.json", {"dt_s": "one"}, "dt_s = 'one' has to be a positive number of seconds"),
        ("model.json", {"dt_s": -1.0}, "dt_s = -1.0 has to be a positive number of seconds"),
        ("model.json", {"hold": "forward"}, "hold = 'forward' is not known; give 'linear' or 'backward'"),
        ("model.json", {"soc0": 90}, "soc0 = 90 is not a state of charge"),
        ("model.json", {"model": "spm"}, "model = 'spm' is not known"),
        ("model.json", {"hold": None}, "model.json lacks 'hold'; save the model again"),
        ("model.json", {"parts": 3}, "model.json has no list of parts"),
        ("effects.json", [{"id": "series_resistance"}], "effects.json lacks 'effect'"),
        ("effects.json", ["series_resistance"], "effects.json is not as it was saved"),
        (
            "effects.json",
            [{"effect": "series_resistance", "parameters": {"resistance_ohm": 9999}}],
            "effects.json: series_resistance: resistance_ohm = 9999 ohm is outside",
        ),
        (
            "correction.json",
            {"terms": "array:correction.terms"},
            "arrays.npz lacks 'correction.terms', which correction.json names",
        ),
        ("correction.json", [], "correction.json: the saved sparse model cannot be read back"),
        ("intervals.json", [], "intervals.json: the saved intervals cannot be read back"),
        ("bands.json", None, "bands.json: the saved bands of a free run cannot be read back"),
        ("effects.json", {}, "effects.json is not as it was saved"),
    ],
)
def test_a_damaged_file_of_a_model_was_told_without_its_name_or_as_a_bug(
    model, tmp_path, file, changes, sentence
):
    path = model.save(tmp_path / "model") / file
    if file == "model.json":
        whole = json.loads(path.read_text()) | changes
        changes = {key: value for key, value in whole.items() if value is not None}
    path.write_text(json.dumps(changes))
    with pytest.raises(InputError, match=sentence) as caught:
        HybridModel.load(tmp_path / "model")
    assert str(tmp_path / "model") in str(caught.value)


@pytest.mark.parametrize(
    ("file", "key", "damaged", "sentence"),
    [
        ("correction.json", "coefficients", lambda them: them[:-1], "coefficients has the shape"),
        ("correction.json", "coefficients", lambda them: ["nan"] * len(them), "holds what is no number"),
        ("correction.json", "terms", lambda _: [], "it has no terms"),
        ("correction.json", "terms", lambda them: [[[99, 1]], *them[1:]], "is no product of functions"),
        ("correction.json", "memory", lambda _: None, "memory holds what is no number"),
        ("correction.json", "scaling", lambda it: it | {"low": it["high"]}, "a variable has no range"),
        ("correction.json", "dt_s", lambda _: -1.0, "dt_s = -1.0 has to be a positive number of seconds"),
        ("bands.json", "horizons", lambda _: [], "one or more that increase"),
        ("bands.json", "alpha", lambda _: 5, "alpha = 5 is not a share of misses"),
        ("intervals.json", "alpha", lambda _: 5, "alpha = 5 is not a share of misses"),
        ("intervals.json", "window", lambda _: 3, "window = 3 samples is too short a history"),
        ("intervals.json", "marginal_v", lambda them: them[::-1], "marginal_v falls from"),
        ("intervals.json", "scale", lambda it: it | {"log_ratio": [0.0] * 99}, "log_ratio has the shape"),
    ],
)
def test_a_damaged_part_was_loaded_and_ended_in_an_index_or_in_no_numbers(
    model, tmp_path, file, key, damaged, sentence
):
    path = model.save(tmp_path / "model") / file
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {key: damaged(content[key])}))
    with pytest.raises(InputError, match=sentence) as caught:
        HybridModel.load(tmp_path / "model")
    assert str(caught.value).startswith(str(path))
    assert str(caught.value).count("\n") == 0


def test_a_correction_of_another_step_asked_for_a_record_that_nobody_could_give(model, tmp_path):
    path = model.save(tmp_path / "model") / "correction.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"dt_s": 2.0}))
    with pytest.raises(InputError, match=r"model\.json: dt_s = 1 s, but the correction steps by 2 s"):
        HybridModel.load(tmp_path / "model")


def test_a_cell_whose_name_begins_as_a_reference_to_an_array_could_not_be_loaded(model, data, tmp_path):
    named = replace(model, cell=replace(model.cell, name="array:of cells"))
    again = HybridModel.load(named.save(tmp_path / "model"))
    assert again.cell.name == "array:of cells"
    told, was = (each.predict(data.time_s, data.current_a, SOC0) for each in (again, model))
    np.testing.assert_allclose(told.upper_v, was.upper_v, atol=1e-12)


def test_an_error_to_start_from_moved_nothing_of_physics_alone_but_its_band(model, data):
    physics = replace(model, correction=None)
    with pytest.raises(
        InputError, match=r"error0_v = 0\.05 V is where a correction starts, and this model has none"
    ):
        physics.predict(data.time_s, data.current_a, SOC0, error0_v=0.05)
    one_step = data.time_s, data.current_a, SOC0, data.voltage_v
    physics.predict(*one_step, error0_v=0.05)  # ignored there, as documented
    with pytest.raises(InputError, match="error0_v = True is no voltage"):
        model.predict(data.time_s, data.current_a, SOC0, error0_v=True)


def test_a_record_of_other_sampling_is_loaded_at_the_experiments_step(record):
    config = experiment(record)
    coarse = config.model_copy(update={"data": config.data.model_copy(update={"dt_s": 2.0})})
    loaded = load(coarse)
    assert loaded.split.train[0].dt_s == 2.0
    assert any("Resampled" in note for note in loaded.notes)


def test_a_profile_alone_was_said_to_start_as_given(model, data, tmp_path):
    data.to_frame()[["time_s", "current_a"]].to_csv(tmp_path / "profile.csv", index=False)
    folder, said = model.save(tmp_path / "model"), []
    predict_file(folder, tmp_path / "profile.csv", tmp_path / "out.csv", say_notes=said.extend)
    assert f"profile starts at the saved model's state of charge of {SOC0:g}; --soc0 takes another." in said
    assert any(note.endswith("or give --column temperature_degc=40.") for note in said)


def test_the_uncertainty_of_a_start_that_is_not_given_was_advised_by_itself(model, data, tmp_path):
    data.to_frame()[["time_s", "current_a"]].to_csv(tmp_path / "profile.csv", index=False)
    files, said = (model.save(tmp_path / "model"), tmp_path / "profile.csv", tmp_path / "out.csv"), []
    predict_file(*files, say_notes=said.extend)
    assert any("as exact" in note and "--soc0-sd, beside --soc0, widens the band" in note for note in said)
    with pytest.raises(InputError, match="give it with --soc0"):  # what followed the advice of old
        predict_file(*files, ProfileRequest(soc0_sd=0.02))
    predict_file(*files, ProfileRequest(soc0=SOC0, soc0_sd=0.02))


def test_the_temperature_that_a_prediction_is_made_at_is_said(model, data, tmp_path):
    folder, frame = (
        model.save(tmp_path / "model"),
        data.to_frame().drop(columns="temperature_degc", errors="ignore"),
    )
    for name, columns in (("without", {}), ("with_it", {"temperature_degc": 11.0})):
        frame.assign(**columns).to_csv(tmp_path / f"{name}.csv", index=False)
        said = []
        predict_file(folder, tmp_path / f"{name}.csv", tmp_path / "out.csv", say_notes=said.extend)
        words = "at 11 degC in every row, as stated" if columns else "no temperature column; taken at 25 degC"
        assert any(note.startswith(f"{name}: {words}") for note in said)


def test_a_folder_of_runs_is_asked_about_its_newest_model(model, tmp_path):
    written = model.save(tmp_path / "runs" / "a" / "model")
    for named in (tmp_path / "runs", tmp_path / "runs" / "a"):
        with pytest.raises(InputError, match=f"holds no model.json, .*; did you mean {written}\\?"):
            HybridModel.load(named)
    with pytest.raises(InputError, match=r"written by `aesi run` or `aesi discover`\.$"):
        HybridModel.load(tmp_path)


def test_a_file_given_for_a_model_is_told_as_one(tmp_path):
    (tmp_path / "cell.json").write_text("{}")
    with pytest.raises(
        InputError, match=r"cell.json is a file, not the folder of a model; a model folder is"
    ):
        HybridModel.load(tmp_path / "cell.json")


def test_a_folder_that_is_no_model_was_told_without_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        InputError, match=r"the folder \. holds no model\.json, so it is no model; a model folder is"
    ):
        HybridModel.load(".")


def test_a_file_in_the_place_of_a_model_is_not_written_over(model, tmp_path):
    (tmp_path / "there").write_text("kept")
    for place in (tmp_path / "there", tmp_path / "there" / "below"):
        with pytest.raises(InputError, match="a file of that name is there"):
            model.save(place)


def test_a_record_shorter_than_a_step_of_the_correction_is_refused(model):
    with pytest.raises(DataError, match=r"lasts 0.5 s, and the model steps by 1 s"):
        model.predict([0.0, 0.25, 0.5], [0.0, 1.0, 1.0], SOC0)


def test_effects_and_their_defaults_were_simulated_without_a_word(model, record, tmp_path):
    said: list[str] = []
    bare = HybridModel(model.cell).save(tmp_path / "bare")
    simulate_file(
        bare,
        record,
        tmp_path / "o.csv",
        effects=activated([("series_resistance", {})]),
        say_notes=said.extend,
    )
    assert any(note.endswith(": with series_resistance(resistance_ohm=0.001).") for note in said)


def test_effects_of_no_size_were_listed_among_those_that_act(model, record, tmp_path):
    still = [
        CATALOGUE["series_resistance"].activate(resistance_ohm=0.0),
        CATALOGUE["voltage_sensor_offset"].activate(offset_v=0.0),
    ]
    gain = CATALOGUE["current_sensor_gain"].activate(gain=1.02)
    acting = ": with current_sensor_gain(gain=1.02)"
    idle = "without effect, since of no size: series_resistance(resistance_ohm=0), voltage_sensor_offset(offset_v=0)."
    for effects, beside, words in (
        ((gain, *still), (), f"{acting}; {idle}"),
        ((gain, *still), tuple(map(repr, still)), f"{acting}."),
        (still, (), f": {idle}"),
        (still, tuple(map(repr, still)), ""),
    ):
        said: list[str] = []
        folder = HybridModel(model.cell, tuple(effects), beside=beside).save(tmp_path / "model")
        predict_file(folder, record, tmp_path / "o.csv", say_notes=said.extend)
        told = [note for note in said if "series_resistance" in note or "current_sensor_gain" in note]
        assert told == ([f"{record.stem}{words}"] if words else [])
    inside = folded(model.cell, [gain, *still])
    assert (inside.held, inside.left, inside.cell) == ((), (gain,), model.cell)


def test_what_a_discovery_had_written_into_the_cell_was_simulated_without_a_word(model, record, tmp_path):
    effects = (CATALOGUE["series_resistance"].activate(resistance_ohm=2e-3),)
    inside = folded(model.cell, effects)
    found = HybridModel(inside.cell, inside.left, held=tuple(map(repr, inside.held)))
    said: list[str] = []
    simulate_file(found.save(tmp_path / "found"), record, tmp_path / "o.csv", say_notes=said.extend)
    words = ": the saved model includes series_resistance(resistance_ohm=0.002)."
    assert any(note.endswith(words) for note in said)
    assert "changed by series_resistance(resistance_ohm=0.002)" in repr(HybridModel.load(tmp_path / "found"))


def test_what_was_fitted_beside_a_finding_was_told_with_its_values_as_if_found(model, record, tmp_path):
    """`voltage_sensor_offset(offset_v=-6.574e-05)` stood first, before 8 mohm of contacts."""
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=-6.6e-5)
    held = ("series_resistance(resistance_ohm=0.008)", "solid_diffusivity(negative_factor=1.01)")
    beside = ("voltage_sensor_offset", "solid_diffusivity")
    found = HybridModel(model.cell, (offset,), held=held, beside=beside)
    said: list[str] = []
    simulate_file(found.save(tmp_path / "found"), record, tmp_path / "o.csv", say_notes=said.extend)
    assert any(
        note.endswith(
            ": the saved model includes series_resistance(resistance_ohm=0.008); and other parameters that were fitted "
            "together: voltage_sensor_offset, solid_diffusivity."
        )
        for note in said
    )
    recalibrated = HybridModel(model.cell, (offset,), beside=("voltage_sensor_offset",))
    simulate_file(recalibrated.save(tmp_path / "refit"), record, tmp_path / "o.csv", say_notes=said.extend)
    words = ": the saved model includes parameters that were fitted together: voltage_sensor_offset."
    assert any(note.endswith(words) for note in said)
    lost = export(tmp_path / "found", tmp_path / "o.json").left
    assert lost == ("voltage_sensor_offset, fitted beside what was found: BPX has no field for that.",)
    alone = HybridModel(model.cell, (offset,)).save(tmp_path / "alone")
    assert export(alone, tmp_path / "o.json").left == (
        "voltage_sensor_offset (offset_v -6.6e-05 V): BPX has no field for it.",
    )


def test_an_effect_beside_the_models_own_of_that_name_was_told_alone(model, record, tmp_path):
    """A gain of 1.04 that was found and one of 1.02 that was asked for act together, and 1.02 was told."""
    gain = CATALOGUE["current_sensor_gain"]
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=-6.6e-5)
    effects = (offset, gain.activate(gain=1.04))
    found = HybridModel(model.cell, effects, beside=(repr(offset),)).save(tmp_path / "found")
    asked = activated(
        [("current_sensor_gain", {"gain": 1.02}), ("voltage_sensor_offset", {"offset_v": 0.01})]
    )
    said: list[str] = []
    simulate_file(found, record, tmp_path / "o.csv", effects=asked, say_notes=said.extend)
    words = (
        ": with current_sensor_gain(gain=1.04), current_sensor_gain(gain=1.02), voltage_sensor_offset(offset_v=0.01); "
        "and other parameters that were fitted together: voltage_sensor_offset."
    )
    assert any(note.endswith(words) for note in said)


def test_a_model_that_was_made_at_a_state_of_health_was_taken_at_a_share_of_it_without_a_word(
    model, tmp_path
):
    """--soh 0.95 of a model that was found with --soh 0.95 left 0.9025 of the file's capacity."""
    profile, made = tmp_path / "profile.csv", HybridModel(model.cell).with_soh(0.95)
    pd.DataFrame({"time_s": [0.0, 60.0], "current_a": [1.0, 1.0]}).to_csv(profile, index=False)
    saved, at = (
        made.save(tmp_path / "made"),
        "the saved model's cell has 0.950 of its file's capacity, at which it was",
    )
    for soh, words in ((None, f"{at} made."), (0.9, f"{at} made, and is taken at 0.900 of that, as asked.")):
        told: list[list[str]] = [[], []]
        asked = ProfileRequest(soc0=0.5, soh=soh)
        simulate_file(saved, profile, tmp_path / "o.csv", asked, say_notes=told[0].extend)
        impedance_file(saved, 0.5, "0.1:1:3", tmp_path / "z.csv", soh=soh, say_notes=told[1].extend)
        assert all(words in said for said in told)
        new: list[str] = []
        simulate_file(
            HybridModel(model.cell).save(tmp_path / "new"),
            profile,
            tmp_path / "o.csv",
            asked,
            say_notes=new.extend,
        )
        assert not [note for note in new if "saved model's cell" in note]
    assert HybridModel.load(saved).with_soh(0.9).soh == pytest.approx(0.855)


def test_a_temperature_that_was_found_was_told_to_be_in_a_record_of_another(model, data, tmp_path):
    shift = CATALOGUE["ambient_temperature"].activate(shift_k=-17.0)
    found = HybridModel(folded(model.cell, [shift]).cell, held=(repr(shift),)).save(tmp_path / "found")
    record = tmp_path / "measured.csv"
    replace(data, temperature_degc=np.full(len(data), 20.0)).to_frame().to_csv(record, index=False)
    said: list[str] = []
    simulate_file(found, record, tmp_path / "o.csv", say_notes=said.extend)
    assert not [note for note in said if "ambient_temperature" in note]


def test_an_impedance_was_not_at_the_temperature_that_was_found_without_a_word(model, tmp_path):
    shift = CATALOGUE["ambient_temperature"].activate(shift_k=-17.0)
    found = HybridModel(folded(model.cell, [shift]).cell, held=(repr(shift),)).save(tmp_path / "found")
    said: list[str] = []
    impedance_file(found, 0.5, "0.1:1:3", tmp_path / "z.csv", say_notes=said.extend)
    assert "ambient_temperature: not in the impedance, which is at the temperature that is given." in said


def test_an_unknown_target_of_an_export_ended_in_a_key_error(model, tmp_path):
    with pytest.raises(InputError, match="to = 'foo' is not known; give 'bpx' or 'pybamm'"):
        export(model.save(tmp_path / "alone"), tmp_path / "o.json", to="foo")


def test_what_a_model_was_found_to_be_worth_was_told_by_its_report_alone(model, record, tmp_path):
    found = replace(model, finding="it does not help; use the ESPM alone.")
    for use in (predict_file, simulate_file):
        said: list[str] = []
        use(found.save(tmp_path / "model"), record, tmp_path / "o.csv", say_notes=said.extend)
        assert ("when this model was made: it does not help; use the ESPM alone." in said) == (
            use is predict_file
        )


def test_what_a_model_without_a_correction_was_found_to_be_worth_is_told_of_its_simulation(
    model, record, tmp_path
):
    found = replace(model, correction=None, finding="use it.")
    said: list[str] = []
    simulate_file(found.save(tmp_path / "model"), record, tmp_path / "o.csv", say_notes=said.extend)
    assert "when this model was made: use it." in said


def test_round_off_at_a_full_charge_was_told_as_rows_beyond_it(model, data):
    voltage = np.full(len(data), 3.9)
    for above, said in ((1e-12, False), (0.01, True)):
        told = simulated_record_sentences(model.cell, data, voltage, np.linspace(1.0 + above, 0.9, len(data)))
        assert any("a state of charge outside 0 to 1" in note for note in told) == said


def test_a_correction_that_harms_a_record_was_told_by_its_csv_alone(model, data):
    soc = np.linspace(0.9, 0.5, len(data))
    near, far = (data.voltage_v + sign * 1e-3 * size for sign, size in ((1, 2.0), (-1, 3.0)))
    for ours, alone, end in (
        (near, far, "at most 2.0 mV; the physics alone 3.00 mV RMSE."),
        (
            far,
            near,
            "at most 3.0 mV; the physics alone 2.00 mV RMSE: without the correction the error on this record is lower.",
        ),
        (near, near, "at most 2.0 mV; the physics alone 2.00 mV RMSE."),
        (near, None, "at most 2.0 mV."),
    ):
        baseline = None if alone is None else Baseline("the physics alone", alone, "without the correction")
        assert simulated_record_sentences(model.cell, data, ours, soc, baseline)[1].endswith(end)


def test_a_prediction_is_told_beside_the_physics_alone_where_the_two_know_the_same(model, record, tmp_path):
    folder = model.save(tmp_path / "model")
    for measured in (False, True):
        said: list[str] = []
        predict_file(folder, record, tmp_path / "o.csv", measured=measured, say_notes=said.extend)
        assert any("; the physics alone " in note for note in said) != measured


@pytest.mark.parametrize("corrected", [True, False])
def test_one_step_ahead_was_told_without_persistence(model, record, tmp_path, corrected):
    given = model if corrected else replace(model, correction=None)
    said: list[str] = []
    predict_file(
        given.save(tmp_path / "model"), record, tmp_path / "o.csv", measured=True, say_notes=said.extend
    )
    frame, measured_v = pd.read_csv(tmp_path / "o.csv"), pd.read_csv(record)["voltage_v"]
    error_mv = 1e3 * (measured_v - frame["physics_v"])
    repeated = np.sqrt(np.mean(error_mv.diff()[1:] ** 2))
    [line] = [note for note in said if "against the measured voltage" in note]
    assert f"; persistence (the last measured error again) {repeated:.2f} mV RMSE" in line


def test_the_first_row_counted_as_one_step_ahead_although_nothing_before_it_was_measured(
    model, data, tmp_path
):
    begun = replace(data, voltage_v=data.voltage_v - np.where(np.arange(len(data)) == 0, 0.2, 0.0))
    file, said = tmp_path / "begun.csv", list[str]()
    pd.DataFrame({"time_s": begun.time_s, "current_a": begun.current_a, "voltage_v": begun.voltage_v}).to_csv(
        file, index=False
    )
    asked = ProfileRequest(soc0=0.9)
    predict_file(
        model.save(tmp_path / "model"), file, tmp_path / "o.csv", asked, measured=True, say_notes=said.extend
    )
    frame = pd.read_csv(tmp_path / "o.csv")
    ahead_mv = 1e3 * (begun.voltage_v - frame["voltage_v"])[1:]
    [line] = [note for note in said if "against the measured voltage" in note]
    assert f" {np.sqrt(np.mean(ahead_mv**2)):.2f} mV RMSE, {np.mean(ahead_mv):+.2f} mV in the mean" in line


def test_a_voltage_of_no_cell_was_told_without_when_it_left_the_limits(model, data):
    voltage, low_v = np.full(len(data), 3.9), model.cell.lower_voltage_v
    voltage[10], voltage[12] = low_v - 0.1, -1.49
    *_, last = simulated_record_sentences(model.cell, data, voltage, np.linspace(0.9, 0.5, len(data)))
    assert (
        f"below {low_v:g} V first at {data.time_s[10]:g} s, down to -1.490 V at {data.time_s[12]:g} s."
        in last
    )
    assert "above" not in last
    voltage[20] = 5.0
    *_, last = simulated_record_sentences(model.cell, data, voltage, np.linspace(0.9, 0.5, len(data)))
    assert last.endswith(f"V first at {data.time_s[20]:g} s, up to 5.000 V at {data.time_s[20]:g} s.")


def test_a_full_cell_at_rest_was_told_as_above_its_limit_by_microvolts(model, data):
    voltage = np.full(len(data), 3.9)
    for beyond_v, said in ((1e-8, False), (4e-4, False), (1e-3, True)):
        voltage[0], voltage[-1] = model.cell.upper_voltage_v + beyond_v, model.cell.lower_voltage_v - beyond_v
        told = simulated_record_sentences(model.cell, data, voltage, np.linspace(1.0, 0.5, len(data)))
        assert any("a voltage outside" in note for note in told) == said


def test_by_how_much_a_record_emptied_or_overfilled_a_cell_was_not_told(model, data):
    voltage = np.full(len(data), 3.9)
    for soc, words in (
        (
            np.linspace(0.5, -0.036, len(data)),
            "asks for more charge than the cell has, by 3.6 % of its capacity.",
        ),
        (np.linspace(0.5, 1.04, len(data)), "brings more charge than the cell can hold, by 4.0 %."),
        (np.linspace(1.02, 0.5, len(data)), "starts with more charge than the cell can hold, by 2.0 %."),
        (
            np.linspace(-0.01, 0.9, len(data)),
            "starts with less charge than an empty cell, by 1.0 % of its capacity.",
        ),
    ):
        assert any(
            note.endswith(f": the record {words}")
            for note in simulated_record_sentences(model.cell, data, voltage, soc)
        )


def test_a_charge_from_empty_was_told_to_start_at_minus_zero(model, data):
    first, *_ = simulated_record_sentences(
        model.cell, data, np.full(len(data), 3.9), np.linspace(-1e-9, 0.9, len(data))
    )
    assert first.endswith(": state of charge 0.000 at the start, 0.900 at the end.")


def test_the_voltages_of_no_cell_were_in_the_range_of_a_run_that_ran_out():
    voltage, time = np.array([4.0, 3.0, -17.7, 2.0]), np.arange(0.0, 40.0, 10.0)
    run = Run(time, np.ones(4), voltage, {"depleted": np.array([0.0, 0.0, 1.0, 1.0])})
    words = "3.000 to 4.000 V until it ran out at 20 s, -17.700 to 2.000 V beyond, of no cell"
    assert voltage_words(run) == words
    assert voltage_words(replace(run, series={})) == "-17.700 to 4.000 V"
    at_once = replace(run, series={"depleted": np.ones(4)})
    assert voltage_words(at_once) == "no row before it ran out at 0 s, -17.700 to 4.000 V beyond, of no cell"


def test_a_record_that_the_file_was_fitted_to_was_simulated_as_if_its_cell_were_whole(
    model, record, tmp_path
):
    cell = replace(model.cell, capacity_shares=((record.stem, 0.974), ("other", 0.9)))
    HybridModel(cell).save(tmp_path / "model")
    words = f"{record.stem}: the cell's file was fitted to a record of this name"
    for soh, end in (
        (None, ", in which the cell had 0.974 of its capacity (--soh 0.974 takes it)."),
        (0.95, "."),
    ):
        for use in (predict_file, simulate_file):
            said: list[str] = []
            use(
                tmp_path / "model", record, tmp_path / "o.csv", ProfileRequest(soh=soh), say_notes=said.extend
            )
            assert words + end in said
    shutil.copy(record, tmp_path / "another.csv")
    said = []
    simulate_file(tmp_path / "model", tmp_path / "another.csv", tmp_path / "o.csv", say_notes=said.extend)
    assert not any("fitted to a record" in note for note in said)


@pytest.mark.parametrize("banded", [True, False])
def test_the_band_of_physics_alone_was_called_empty(model, record, tmp_path, banded):
    _, _, models = fitted(record)
    bands = next(each.bands for each in models if each.model.name == "ESPM") if banded else None
    said: list[str] = []
    physics = replace(model, correction=None, intervals=None, bands=bands).save(tmp_path / "model")
    predict_file(physics, record, tmp_path / "o.csv", say_notes=said.extend)
    assert pd.read_csv(tmp_path / "o.csv")["lower_v"].notna().all() == banded
    (told,) = [note for note in said if "no learnt correction" in note]
    assert told.endswith("lower_v and upper_v are empty.") != banded


def test_an_uncertain_start_is_refused_for_a_model_without_bands(model, record, tmp_path):
    without = replace(model, bands=None).save(tmp_path / "model")
    asked = ProfileRequest(soc0=SOC0, soc0_sd=0.01)
    with pytest.raises(
        InputError, match=r"widens the band of a free run, and .*model has none; leave it out\."
    ):
        predict_file(without, record, tmp_path / "o.csv", asked)
    assert not (tmp_path / "o.csv").exists()


def test_a_record_that_the_band_holds_less_of_than_of_any_left_out_piece_is_told(model, data):
    least = min(model.bands.horizons[-1].by_piece)

    def told(record):
        prediction = model.predict_record(record, SOC0)
        inside = (record.voltage_v >= prediction.lower_v) & (record.voltage_v <= prediction.upper_v)
        notes = band_sentences(record, prediction, model, measured=False)
        return float(np.mean(inside)), [note for note in notes if "left-out pieces" in note]

    inside, notes = told(data)
    assert inside >= least
    assert notes == []
    far = replace(data, voltage_v=data.voltage_v + np.linspace(0.0, 0.1, len(data)))
    inside, (note,) = told(far)
    assert 0.0 < inside < least
    pieces = len(model.bands.horizons[-1].by_piece)
    assert (
        f"any of the {pieces} left-out pieces of the training records ({100 * least:.1f} % or more)" in note
    )


def test_a_correction_that_diverges_is_told_with_the_time(model, data):
    unstable = SparseModel(
        "AESI I",
        Library(("e", "I"), (Term(((0, 1),)),)),
        np.array([12.0]),
        Scaling(np.array([-0.01, -50.0]), np.array([0.01, 50.0])),
        1.0,
    )
    alone = replace(model, correction=unstable, bands=None, intervals=None)
    prediction = alone.predict_record(data, SOC0, error0_v=5e-5)
    at = int(np.searchsorted(prediction.time_s, prediction.diverged_s))
    held_v = (prediction.voltage_v - prediction.physics_v)[at - 1 :]
    np.testing.assert_allclose(held_v, 5e-5 * 12.0 ** (at - 1))
    assert 0.1 / 12.0 < held_v[0] <= 0.1
    sentence = band_sentences(data, prediction, alone, measured=False)[1]
    assert f"diverges at {at} s and is held at its last value" in sentence
    assert model.predict_record(data, SOC0).diverged_s is None
