"""The physics models beside a correction: fitted to the training rows alone, and refitted without each drive."""

from dataclasses import replace

import numpy as np
import pytest
from small_experiment import BPX, NOISE_V, SOC0, experiment, write_record

from aesi.data.resample import to_even
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.experiment.fit import Fitted, build_problem
from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.experiment.judging.validation import validation_mser
from aesi.pipeline.experiment.load import load
from aesi.pipeline.experiment.physics_models import (
    DECLARED,
    PHYSICS_NAMES,
    RECALIBRATED,
    PhysicsModels,
    no_rows,
)
from aesi.pipeline.experiment.recalibrate import StateSource
from aesi.pipeline.product.deviations import PhysicsVariant
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement
from aesi.sparse import Candidate, Genome, evaluate
from aesi.sparse.bare import Bare
from aesi.sparse.search.fold_models import fold_samples


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    record = write_record(tmp_path_factory.mktemp("record"))
    small = experiment(record)
    return small.model_copy(update={"cell": small.cell.model_copy(update={"start": "recalibrated"})})


@pytest.fixture(scope="module")
def loaded(config):
    return load(config)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_one_fitted_resistor_is_all_that_this_cell_lacks(loaded):
    for series in (
        *loaded.split.test,
        *(each.series for each in (*loaded.left_out.parts, *loaded.left_out.drives)),
    ):
        assert rms(series.left_by(DECLARED)) > 20 * NOISE_V
        assert rms(series.left_by("ESPM, one resistor")) < 2.0 * NOISE_V
        assert rms(series.left_by(RECALIBRATED)) < 2.0 * NOISE_V
        np.testing.assert_array_equal(series.left_by(RECALIBRATED), series.error_v)


def test_a_series_knows_from_when_on_a_physics_model_ran_out():
    cell = Cell.from_bpx(BPX)
    whole = PhysicsVariant(cell, cell, ())
    models = PhysicsModels(dict.fromkeys((DECLARED, RECALIBRATED), whole), DECLARED)
    time_s = np.arange(1800.0)
    record = Measurement(time_s, np.full(1800, 30.0), np.full(1800, 3.5))
    series, empty = models.series(no_rows(record, 0.3), 1.0, "linear")
    assert empty
    run = whole.run_as_declared(record, 0.3, "linear")
    first = int(np.argmax(run.series["depleted"] > 0.0))
    assert series.ran_out_s == time_s[first] > 900.0
    np.testing.assert_array_equal(series.before_depletion, time_s < first)
    assert series.take(slice(0, first)).before_depletion.all()
    assert not series.take(slice(first, None)).before_depletion.any()
    full, empty = models.series(no_rows(record, 0.9), 1.0, "linear")
    assert (empty, full.ran_out_s) == (False, None)


@pytest.mark.parametrize("hold", ["backward", "linear"])
@pytest.mark.parametrize("spread", [0.0, 0.4])
def test_a_model_that_is_exact_erred_where_rows_are_denser_than_steps(hold, spread):
    cell, rng = Cell.from_bpx(BPX), np.random.default_rng(0)
    time_s = 0.1 * (np.arange(1201) + spread * rng.uniform(-1.0, 1.0, 1201))
    current_a = rng.normal(0.0, 30.0, 122)[np.ceil(time_s).astype(int)]
    run = simulate(cell, time_s, current_a, 0.6, hold=hold)
    rows = Measurement(time_s, current_a, run.voltage_v)
    even = to_even(rows, 1.0, hold)
    exact = PhysicsVariant(cell, cell, ())
    models = PhysicsModels({DECLARED: exact, RECALIBRATED: exact}, DECLARED)
    record = no_rows(even, 0.6, state_source=StateSource(rows, 0.6, False))
    series, _ = models.series(record, 1.0, hold)
    np.testing.assert_allclose(series.error_v, 0.0, atol=1e-9)
    np.testing.assert_allclose(series.left_by(RECALIBRATED), 0.0, atol=1e-9)
    np.testing.assert_allclose(series.model_v, even.voltage_v, atol=1e-9)
    # At the stamps it says something else, and a fit allows for that.
    at_stamps_v = exact.run_as_declared(even, 0.6, hold).voltage_v
    assert rms(even.voltage_v - at_stamps_v) > 1e-3
    np.testing.assert_allclose(record.with_resampling_change(exact, hold).voltage_v, at_stamps_v, atol=1e-9)


def test_the_saved_cell_is_the_one_that_is_corrected(loaded):
    assert loaded.cell.contact_resistance_ohm == pytest.approx(1.5e-3, rel=0.15)


def test_halves_of_training_repeats_are_left_out_under_physics_of_their_own(loaded, config):
    problem = build_problem(loaded, config)
    assert len(loaded.left_out.parts) == 2 * len(loaded.split.train)
    for left, (a, b) in zip(loaded.left_out.parts, problem.folds, strict=True):
        seen, judged = fold_samples(problem, a, b)
        assert left.series.name == seen.name
        # The first sample is predicted by no row. Of all others, none that is judged was seen by the physics.
        assert left.rows == slice(0 if judged.start == 1 else judged.start, judged.stop)
        np.testing.assert_array_equal(left.series.left_by(DECLARED), seen.left_by(DECLARED))
        assert not np.array_equal(left.series.error_v, seen.error_v)


def test_whole_repeats_are_left_out_too(loaded):
    assert [(left.place, left.rows) for left in loaded.left_out.drives] == [
        (k, slice(0, 600)) for k in range(3)
    ]
    for left, part in zip(loaded.left_out.drives, loaded.left_out.parts[::2], strict=True):
        assert not np.array_equal(left.series.error_v, part.series.error_v)


def test_every_table_tells_both_reductions(loaded, config):
    rows = evaluate_models([Fitted(Bare(name), 0, 0.0) for name in PHYSICS_NAMES], loaded.split).rows
    figures = {row["name"]: row["free_run"] for row in rows}
    assert figures[DECLARED]["test_mser_pct"] == pytest.approx(0.0, abs=1e-9)
    assert figures[RECALIBRATED]["test_mser_pct"] > 99.0
    assert figures[RECALIBRATED]["test_mser_recalibrated_pct"] == pytest.approx(0.0, abs=1e-9)
    assert figures[DECLARED]["test_mser_recalibrated_pct"] < -1000.0


def test_validation_comes_from_drives_that_chose_nothing(loaded, config):
    problem = build_problem(loaded, config)
    candidate = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    assert isinstance(candidate, Candidate)
    figures = validation_mser(loaded, problem, [candidate])
    assert figures[DECLARED] == pytest.approx(0.0, abs=1e-9)
    assert 99.0 < figures[RECALIBRATED] <= 100.0
    assert set(figures) == {*PHYSICS_NAMES, "AESI I", "AESI II"}


def test_a_left_out_piece_without_an_error_has_no_say_in_the_validation_figure(loaded, config):
    problem = build_problem(loaded, config)
    candidate = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    assert isinstance(candidate, Candidate)

    def exact(out):
        series = out.series
        zero = np.zeros(len(series))
        same = dict.fromkeys(series.physics, series.model_v)
        return replace(out, series=replace(series, error_v=zero, physics=same))

    def figures(**pieces):
        left_out = replace(loaded.left_out, **pieces)
        with np.errstate(divide="raise", invalid="raise"):
            return validation_mser(replace(loaded, left_out=left_out), problem, [candidate])

    parts, drives = loaded.left_out.parts, loaded.left_out.drives
    assert figures(drives=(*drives[:-1], exact(drives[-1]))) == figures(drives=drives[:-1])
    assert figures(parts=tuple(map(exact, parts)), drives=tuple(map(exact, drives))) == {}


def test_a_found_model_may_be_named_as_the_cell(config):
    content = config.model_dump(mode="json") | {"cell": "found/model"}
    assert type(config).model_validate({**content, "base": config.base}).cell.bpx == "found/model"


@pytest.mark.parametrize("start", ["declared", "recalibrated"])
def test_a_correction_starts_from_the_effects_of_a_found_model(config, tmp_path, start):
    found = CATALOGUE["series_resistance"].activate(resistance_ohm=1.5e-3)
    folder = HybridModel(Cell.from_bpx(BPX), (found,), soc0=SOC0).save(tmp_path / "found" / "model")
    cell = {"bpx": str(folder), "soc0": SOC0, "start": start}
    loaded = load(config.model_copy(update={"cell": type(config.cell).model_validate(cell)}))
    assert loaded.effects == (found,)
    for series in (*loaded.split.train, *loaded.split.test):
        assert rms(series.left_by(DECLARED)) < 1.2 * NOISE_V  # that contact is all the file lacked
        assert rms(series.error_v) < 1.2 * NOISE_V
    assert loaded.cell.contact_resistance_ohm == pytest.approx(0.0, abs=2e-4)
