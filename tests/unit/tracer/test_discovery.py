"""The whole loop on small synthetic records with a few effects, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import DataError, SimulationError
from aesi.physics import simulate
from aesi.physics.effect import Contribution, Effect
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import Case, case_model, discovery_content, found_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.case.checks import FOREIGN_CELL_V, check_same_cell
from aesi.tracer.discovery import inverse_problem


def test_an_ohmic_drop_is_found_with_its_size(cell, few, make):
    data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=2e-4),))
    found = discover(cell, [data], soc0=0.9, effects=few)
    assert found.verdict.word == "found"
    assert found.verdict.effects == ("series_resistance",)
    best = found.candidates[0]
    assert best.effect == "series_resistance"
    estimate = best.parameters["resistance_ohm"]
    assert estimate.low <= 2e-4 <= estimate.high
    test = next(f for f in found.files if f.part == "test")
    assert test.errors("after").rmse_v < 1.1e-3 < test.errors("before").rmse_v
    added = found.cell.contact_resistance_ohm - cell.contact_resistance_ohm
    assert added == pytest.approx(2e-4, rel=0.05)  # what a cell file can hold is written into the cell
    assert "series_resistance" in {active.id for active in found.held}
    assert any(words.startswith("series_resistance(") for words in found_model(found).held)
    assert "series_resistance(" in found.cell.description


def test_what_a_saved_model_had_was_told_as_fitted_beside_the_next_finding(cell, few, make):
    """The contacts that a first search had found were no more told, and a gain only as one of many parameters."""
    gain = CATALOGUE["current_sensor_gain"].activate(gain=1.02)
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=1e-4)
    given = HybridModel(
        cell,
        (offset, gain),
        held=("porosity(factor=1.01)",),
        beside=(repr(offset),),
        soh=0.9,
        fitted_to=(("first", "0"),),
    )
    data = make((gain,))
    found = discover(cell, [data], soc0=0.9, effects=few, given=given.effects)
    written = found_model(found, given)
    assert written.held[0] == "porosity(factor=1.01)"
    assert gain in written.effects
    assert not written.was_beside(repr(gain))
    assert written.was_beside(repr(offset))
    assert all(map(written.was_beside, written.held[1:]))
    assert written.soh == 0.9
    case = Case(given, (data,))
    assert case_model(case, found).fitted_to == (("first", "0"), (data.name, data.digest))


def test_a_cell_as_declared_lacks_nothing(cell, few, make):
    found = discover(cell, [make()], soc0=0.9, effects=few)
    assert found.verdict.word == "none"
    assert found.verdict.effects == ()
    assert found.verdict.confidence > 0.5
    assert found.after.yardstick.explained_v < 0.5e-3


def test_the_second_warning_that_a_model_repeats_began_with_a_small_letter(cell, few, make):
    found = discover(cell, [make()], soc0=0.9, effects=few)
    warned = replace(found, warnings=("the one is worse.", "the other too."))
    assert found_model(warned).finding == "The one is worse. The other too."


def test_where_nothing_is_named_own_parameters_that_hid_an_effect_are_taken_as_declared(cell, few, make):
    """The declared parameters, which are right here, are the more plausible anyway; that was no search with them."""
    asked = []
    discover(cell, [make()], soc0=0.9, effects=few, progress=asked.append)
    assert {one.trust for one in asked} == {"tight", "exact"}


def test_progress_tells_every_effect_that_was_tried(cell, few, make):
    tried = []
    discover(cell, [make()], soc0=0.9, effects=few, progress=tried.append)
    assert {name for one in tried for name in one.effects} == set(few)
    assert all(one.simulations > 0 and np.isfinite(one.gain_nats) for one in tried)


def test_an_edited_effect_is_fitted_again(cell, few, make, tmp_path):
    data, archive = make(), tmp_path / "fits.jsonl"
    first = discover(cell, [data], soc0=0.9, effects=few, archive=archive)
    again = discover(cell, [data], soc0=0.9, effects=few, archive=archive)
    resistance = few["series_resistance"]
    narrow = {"resistance_ohm": replace(resistance.parameters["resistance_ohm"], bounds=(0.0, 1e-3))}
    edited = {**few, "series_resistance": replace(resistance, parameters=narrow)}
    other = discover(cell, [data], soc0=0.9, effects=edited, archive=archive)
    assert again.simulations < other.simulations == pytest.approx(first.simulations, rel=0.2)


def test_a_wave_that_no_effect_makes_is_unknown(cell, few, make):
    data = make()
    wave = 8e-3 * np.sign(np.sin(data.time_s / 90.0 + np.sin(data.time_s / 310.0)))
    found = discover(cell, [replace(data, voltage_v=data.voltage_v + wave)], soc0=0.9, effects=few)
    assert found.verdict.word == "unknown"
    assert found.verdict.effects == ()
    assert found.verdict.structured_v == pytest.approx(8e-3, rel=0.3)
    # What the search chose is no part of the verdict, and is told all the same.
    content = discovery_content(found)
    assert content["chosen"] == list(found.chosen)
    choice = "the choice of the search, with which too much is left unexplained"
    rows = {row["effect"]: row for row in content["candidates"]}
    assert found.chosen
    assert all(set(rows[name]["hypothesis"]) >= set(found.chosen) for name in found.chosen)
    assert any(row["remark"] == choice for row in rows.values())


def test_an_unknown_without_an_effect_to_add_does_not_say_that_the_catalogue_was_tried(cell, few, make):
    data = make()
    wave = 8e-3 * np.sign(np.sin(data.time_s / 90.0 + np.sin(data.time_s / 310.0)))
    waved = replace(data, voltage_v=data.voltage_v + wave)
    found = discover(cell, [waved], soc0=0.9, effects=few, max_effects=0)
    assert (found.verdict.word, found.tried, found.candidates) == ("unknown", (), ())
    assert "with no effect added" in found.verdict.reason
    assert discover(cell, [waved], soc0=0.9, effects=few).tried == tuple(few)


def test_errors_of_a_model_that_ran_empty_were_told_without_a_word(cell, few):
    time = np.arange(0.0, 5200.0, 2.0)
    current = np.where(time < 60, 0.0, 22.5 + 8.0 * np.sign(np.sin(time / 50.0)))
    larger = cell.with_soh(1.1)
    voltage = simulate(larger, time, current, 0.97).voltage_v
    noisy = voltage + 1e-3 * np.random.default_rng(0).normal(size=len(time))
    data = Measurement(time, current, noisy, name="longer")
    found = discover(cell, [data], soc0=0.97, effects=few, max_effects=0)
    (note,) = (n for n in found.notes if "runs empty" in n)
    assert note.startswith(
        "longer: a particle's surface or the electrolyte runs empty or full in the declared model at "
    )
    at_s = next(f for f in found.files if f.part == "test").emptied_s["before"]
    assert f"{at_s:g} s" in note
    with pytest.raises(SimulationError, match=f"at {at_s:g} s"):
        simulate(cell, time, current, 0.97)


def test_the_same_seed_gives_the_same_answer_and_the_archive_spares_the_fits(cell, few, make, tmp_path):
    data = make((CATALOGUE["current_sensor_gain"].activate(gain=1.03),))
    archive = tmp_path / "fits.jsonl"
    first = discover(cell, [data], soc0=0.9, effects=few, archive=archive)
    again = discover(cell, [data], soc0=0.9, effects=few, archive=archive)
    assert again.verdict.effects == first.verdict.effects == ("current_sensor_gain",)
    assert again.candidates[0].score == pytest.approx(first.candidates[0].score, abs=0.5)
    assert again.simulations < first.simulations / 2
    torn = archive.read_text().rstrip()[:-40]  # killed while writing
    archive.write_text(torn)
    assert (
        discover(cell, [data], soc0=0.9, effects=few, archive=archive).verdict.effects
        == first.verdict.effects
    )


def test_test_files_choose_nothing(cell, few, make):
    effect = (CATALOGUE["series_resistance"].activate(resistance_ohm=2e-4),)
    data, test = make(effect), make(effect, seed=2)
    found = discover(cell, [data], [test], soc0=0.9, effects=few)
    spoiled = replace(test, voltage_v=test.voltage_v + 0.02 * np.sin(test.time_s / 50))
    other = discover(cell, [data], [spoiled], soc0=0.9, effects=few)
    assert other.verdict == found.verdict
    assert [c.score for c in other.candidates] == [c.score for c in found.candidates]
    assert {f.part for f in found.files} == {"fit", "test"}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda m: m.take(slice(0, 120)), "too little to decide"),
        (lambda m: replace(m.take(slice(400, 430)), time_s=200.0 * np.arange(30)), "give at least 24 rows"),
        (lambda m: replace(m, current_a=0.001 * m.current_a), "does not respond"),
        (lambda m: replace(m, voltage_v=m.voltage_v - 2.0), "outside the range"),
        (lambda m: replace(m, current_a=m.current_a + 300.0), "state of charge"),
        (lambda m: replace(m, voltage_v=m.voltage_v * 0.5 + 1.4), "another cell"),
    ],
)
def test_what_cannot_decide_is_refused_in_one_sentence(cell, few, make, change, sentence):
    with pytest.raises(DataError, match=sentence) as caught:
        discover(cell, [change(make())], soc0=0.9, effects=few)
    assert "\n" not in str(caught.value)


def test_a_cell_far_colder_than_its_file_is_not_taken_for_another_one(cell, make):
    cold = make((CATALOGUE["ambient_temperature"].activate(shift_k=-62.0),))
    names = ("series_resistance", "ambient_temperature")
    known, unknown = (
        inverse_problem(
            cell, [replace(cold, temperature_degc=degc)], 0.9, effects={n: CATALOGUE[n] for n in names}
        )
        for degc in (np.full(len(cold), 25.0), None)
    )
    for problem in (known, unknown):
        (record,) = problem.records
        run = problem.run(record.thin, 0.9, (), record.thin_hold)
        assert np.median(np.abs(record.thin.voltage_v - run.voltage_v)) > FOREIGN_CELL_V
        if problem is known:
            with pytest.raises(DataError, match="another cell"):
                check_same_cell(problem, record, run)
        else:
            check_same_cell(problem, record, run)


def test_a_run_that_ends_empty_was_told_by_a_time_that_all_rows_share(cell, make):
    drive = make()
    moved = replace(drive, time_s=drive.time_s + 1.7e9, voltage_v=drive.voltage_v - 2 * FOREIGN_CELL_V)
    problem = inverse_problem(cell, [moved], 0.9, effects={})
    (record,) = problem.records
    run = problem.run(record.thin, 0.9, (), record.thin_hold)
    depleted = np.where(np.arange(len(record.thin)) < 100, 0.0, 1.0)
    with pytest.raises(DataError, match=rf"runs empty or full at {record.thin.time_s[100]:.12g} s"):
        check_same_cell(problem, record, replace(run, series={**run.series, "depleted": depleted}))


def test_no_measurement_is_refused(cell, few):
    with pytest.raises(DataError, match="at least one"):
        discover(cell, [], effects=few)


def test_an_effect_that_cannot_be_simulated_is_left_out_and_said(cell, make):
    bare = replace(cell, density_kg_m3=None, specific_heat_j_kg_k=None, volume_m3=None, surface_area_m2=None)
    effects = {n: CATALOGUE[n] for n in ("series_resistance", "self_heating")}
    found = discover(bare, [make()], soc0=0.9, effects=effects)
    assert [c.effect for c in found.candidates] == ["series_resistance"]
    assert any(note.startswith("self_heating: not tried") for note in found.notes)


def test_what_a_refit_moved_is_told_with_its_tolerance(cell, few, make):
    slow = CATALOGUE["solid_diffusivity"].activate(negative_factor=1.0, positive_factor=0.4)
    found = discover(cell, [make((slow,))], soc0=0.9, effects={"solid_diffusivity": few["solid_diffusivity"]})
    own = {one.name: one for one in found.own["recalibrated"] if one.owner == "solid_diffusivity"}
    positive = own["positive_factor"]
    assert positive.declared == 1.0
    assert positive.value == pytest.approx(0.4, rel=0.1)
    spreads = CATALOGUE["solid_diffusivity"].parameters["positive_factor"].spread
    counted = [np.log(positive.value) / sd for sd in (spreads.tight, spreads.loose)]
    assert min(abs(positive.deviations - one) for one in counted) < 1e-6
    assert not positive.at_limit
    assert {one.name for one in found.own["recalibrated"] if one.owner == "soc0"} == {"made"}
    furthest = [abs(one.deviations) for one in found.own["recalibrated"]]
    assert furthest == sorted(furthest, reverse=True)


def test_a_radius_that_is_off_is_one_cause_and_not_a_diffusivity_and_a_rate(cell, make):
    three = ("particle_radius", "solid_diffusivity", "charge_transfer_kinetics")
    effects = {name: CATALOGUE[name] for name in three}
    coarse = CATALOGUE["particle_radius"].activate(negative_factor=1.0, positive_factor=1.7)
    found = discover(cell, [make((coarse,))], soc0=0.9, effects=effects)
    assert found.verdict.effects == ("particle_radius",)
    estimate = next(c for c in found.candidates if c.effect == "particle_radius").parameters[
        "positive_factor"
    ]
    assert estimate.low < 1.7 < estimate.high
    assert estimate.high - estimate.low < 0.3


def test_a_diffusivity_that_is_off_is_no_radius(cell, make):
    three = ("particle_radius", "solid_diffusivity", "charge_transfer_kinetics")
    effects = {name: CATALOGUE[name] for name in three}
    slow = CATALOGUE["solid_diffusivity"].activate(negative_factor=1.0, positive_factor=0.35)
    found = discover(cell, [make((slow,))], soc0=0.9, effects=effects)
    assert found.verdict.effects == ("solid_diffusivity",)


def test_a_candidate_that_the_test_part_cannot_be_simulated_with_has_no_error_there(
    cell, few, make, monkeypatch
):
    def fails(*arguments):
        raise SimulationError("there is no solution")

    monkeypatch.setattr("aesi.tracer.discovery.held_out_rmse_v", fails)
    found = discover(cell, [make()], soc0=0.9, effects=few)
    assert {c.test_rmse_v for c in found.candidates} == {None}
    assert {c["test_rmse_mv"] for c in discovery_content(found)["candidates"]} == {None}


def test_an_effect_without_parameters_never_acted_in_a_search(cell, few, make):
    def drop(trace):
        return Contribution(-2e-4 * trace.current_a)

    fixed = Effect("fixed_contact", "physics", "A contact of 0.2 mohm.", on_voltage=drop)
    data = make((fixed.activate(),))
    found = discover(
        cell, [data], soc0=0.9, effects={"fixed_contact": fixed, "ocv_hysteresis": few["ocv_hysteresis"]}
    )
    assert (found.verdict.word, found.verdict.effects) == ("found", ("fixed_contact",))
    assert found.written == {"fixed_contact": {}}


@pytest.mark.parametrize("name", ["soc0", "capacity_share"])
def test_an_effect_named_like_what_records_have_of_their_own_is_refused(cell, few, make, name):
    with pytest.raises(DataError, match=f"cannot have the id '{name}'"):
        discover(cell, [make()], soc0=0.9, effects={name: replace(few["series_resistance"], id=name)})
