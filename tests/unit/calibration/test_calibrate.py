"""Calibration over temperatures: recovery, the temperature as an input, intervals, what stays open."""

import os
import re
import warnings
from copy import copy
from dataclasses import replace
from datetime import date
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.calibration import calibrate
from aesi.calibration.fit_sentences import moved_start_sentences
from aesi.calibration.model import ERROR_V, REPEATS
from aesi.calibration.parameters import FitParameter, free_parameters, with_priors
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions, Prior
from aesi.calibration.result import at_bounds, information_weights, intervals
from aesi.calibration.start import full_discharge_numbers, scaled_to_discharge, size_assumed
from aesi.calibration.uncertainty.health import HEALTH_WORDS, health_intervals, health_of
from aesi.calibration.uncertainty.posterior import PosteriorSamples, sample_posterior
from aesi.errors import DataError, InputError
from aesi.numerics.metrics import rms
from aesi.physics import simulate
from aesi.pipeline.calibrate import calibration_content, check_records
from aesi.records import Measurement


@pytest.fixture(scope="module")
def found(start, records):
    return calibrate(start, records)


def test_the_records_of_both_temperatures_are_followed(found):
    assert [e.name for e in found.errors] == ["at_25", "at_0"]
    assert all(e.after_v < 2e-3 < 0.2 * e.before_v for e in found.errors)


def test_a_temperature_between_those_that_were_fitted_is_predicted(found, truth, records):
    data = records[0]
    true, ours, before = (
        simulate(cell, data.time_s, data.current_a, 1.0, (), 12.0, "backward").voltage_v
        for cell in (truth, found.cell, found.declared)
    )
    off, off_before = (float(np.sqrt(np.mean((v - true) ** 2))) for v in (ours, before))
    assert off < 0.25 * off_before


def test_every_parameter_has_an_interval_and_a_source(found):
    assert {"negative.rate_energy", "positive.diffusivity_energy", "positive.film_energy"} <= set(
        found.parameters
    )
    for interval in found.parameters.values():
        assert interval.low <= interval.value <= interval.high
        assert interval.source


def test_the_energies_that_a_fit_starts_from_were_told_as_others(start, records):
    """Typical ones of 35 kJ/mol were told of kinetics where the fit began at 55, and nothing where these took the place
    of those that the file declares. A record at one temperature is fitted with others."""
    bare = start.with_negative(rate_ea_j_mol=0.0, diffusivity_ea_j_mol=0.0)
    cases = {
        "both": (records, Conditions()),
        "one": (records[:1], Conditions()),
        "own": (records[:1], Conditions(same_cell=True)),
        "given": (records, Conditions(priors={"negative.rate_energy": Prior(40e3, 5e3)})),
    }
    told = {}
    for name, (some, conditions) in cases.items():
        model, notes = prepared_model(bare, some, conditions)
        told[name] = " ".join(note for note in notes if "activation energ" in note and "declared" in note)
        begins = model.cell_at(np.zeros(model.layout.size))
        rate = begins.negative.rate_ea_j_mol / 1e3
        assert (f"negative rate {rate:g}" in told[name]) == (name != "given")
        moved = name in ("both", "given")
        assert begins.negative.film_ea_j_mol == (50e3 if moved else 40e3)
        assert begins.negative.diffusivity_ea_j_mol == (30e3 if moved else 45e3)
    assert "negative rate 55 +/- 12 kJ/mol" in told["both"]
    assert "positive rate 55 +/- 12 kJ/mol (declared: 17.8)" in told["both"]
    assert "negative rate 45 kJ/mol" in told["one"]
    assert "positive rate 45 kJ/mol (declared: 17.8)" in told["one"]
    assert "positive rate" not in told["own"]
    assert "negative rate" not in told["given"]


def test_a_calibration_is_short_in_words_and_a_table_of_its_parameters(found):
    assert len(repr(found)) < 200
    assert "at_25" in repr(found)
    table = found.to_frame()
    assert table.loc["negative.rate", "low"] < table.loc["negative.rate", "value"]
    assert list(table.columns) == ["value", "low", "high", "unit", "source"]


def test_a_calibration_draws_the_error_of_each_record(found):
    declared, calibrated = found.plot().data
    assert list(declared.x) == ["at_25", "at_0"]
    assert all(after < before for before, after in zip(declared.y, calibrated.y, strict=True))


def test_the_state_of_health_holds_the_true_one_within_its_intervals(found, truth):
    intervals, true, ours = health_intervals(found), health_of(truth), health_of(found.cell)
    assert set(intervals) == set(HEALTH_WORDS)
    for name, (low, high) in intervals.items():
        assert low < getattr(ours, name) < high
    low, high = intervals["resistance_mohm"]
    assert low < true.resistance_mohm < high
    low, high = intervals["capacity_ah"]
    assert high - low < 0.5 * true.capacity_ah


def test_what_ended_on_its_upper_bound_was_taken_for_known_in_the_state_of_health(found):
    at = [free.name for free in found.model.free].index("negative.full_stoichiometry")
    width = []
    for inside in (0.0, 0.1):
        x = found.x.copy()
        x[at] = found.model.high[at] - inside
        low, high = health_intervals(replace(found, x=x))["inventory_ah"]
        width.append(high - low)
    assert width[0] == pytest.approx(width[1], rel=1e-2)


def test_the_size_of_a_cell_is_said_to_be_the_files_where_no_record_is_a_full_discharge(found, records):
    whole = Measurement([0.0, 1800.0, 3600.0], [5.0, 5.0, 5.0], [4.15, 3.6, 2.6], name="whole")
    assert "size of the cell is taken from the start file, 5.15 Ah" in found.size_assumed
    assert found.size_assumed in found.notes
    assert found.size_assumed not in calibration_content(found)["notes"]  # the report has it first
    assert size_assumed(found.declared, [*records, whole]) == ""


def test_a_simulation_of_a_record_starts_where_the_calibration_says(found, records):
    data = records[0]
    run = simulate(found.cell, data.time_s, data.current_a, found.starts["at_25"], (), 25.0, "linear")
    assert rms(run.voltage_v - data.voltage_v) == pytest.approx(found.errors[0].simulated_v, rel=1e-6)


def test_a_given_start_that_is_another_state_of_charge_in_the_written_cell_is_told():
    given, read = (SimpleNamespace(basis=basis, soc=0.85) for basis in ("given", "rest"))
    records = [
        SimpleNamespace(name=name, start=start) for name, start in (("a", given), ("b", given), ("c", read))
    ]
    told = moved_start_sentences(SimpleNamespace(records=records), {"a": 0.8572, "b": 0.8503, "c": 0.8572})
    assert told == (
        "a starts at a state of charge of 0.8572 of the written cell, in which empty is the rest at its lower cut-off: "
        "by the start file it is the 0.85 that was given.",
    )


def test_the_mean_temperatures_of_one_record_were_said_to_span_nothing(start, records):
    _, notes = prepared_model(start, records[:1], Conditions())
    assert any(note.startswith("a single record does not tell how the cell answers") for note in notes)
    _, notes = prepared_model(start, [records[0], replace(records[0], name="again")], Conditions())
    assert any("temperatures of the records are 0.0 K apart, less than 8 K" in note for note in notes)


def test_what_the_records_leave_open_is_named_with_its_weights(found):
    assert found.undetermined
    for combination in found.undetermined:
        assert 0.0 < combination.narrowed <= 1.0
        assert all(name in found.parameters for name, _ in combination.weights)
        assert combination.weights[0][0] in combination.sentence


def test_the_temperature_column_alone_changes_the_answer(start, records, found):
    warmer = [replace(r, temperature_degc=r.temperature_degc + 10.0) for r in records]
    other = calibrate(start, warmer, evaluations=8)
    here, there = (c.parameters["negative.rate"].value for c in (found, other))
    assert abs(np.log(here / there)) > 0.1


def test_what_is_known_of_a_parameter_from_elsewhere_takes_the_place_of_its_prior(start, records, found):
    known = {"contact.resistance": Prior(0.011, 1e-5), "negative.rate": Prior(2.0, 1e-3)}
    fit = calibrate(start, records, Conditions(priors=known), evaluations=8)
    told = fit.parameters
    assert told["contact.resistance"].value == pytest.approx(0.011, abs=4e-5)
    assert told["negative.rate"].value == pytest.approx(2.0, rel=4e-3)
    assert told["contact.resistance"].source == "given: 0.011, standard deviation 1e-05"
    assert told["positive.rate"].source == found.parameters["positive.rate"].source
    assert told["negative.rate"].source == "given: 2, standard deviation of its natural logarithm 0.001"
    free = found.parameters["contact.resistance"]
    assert free.high - free.low > 10 * (told["contact.resistance"].high - told["contact.resistance"].low)


def test_a_prior_that_the_records_contradict_is_told(start, records, found):
    far = calibrate(
        start, records, Conditions(priors={"contact.resistance": Prior(0.1, 0.01)}), evaluations=8
    )
    value = far.parameters["contact.resistance"].value
    assert value < 0.08
    told = [note for note in far.notes if "what was given" in note]
    assert len(told) == 1
    assert f"contact.resistance ends at {value:.4g} ohm" in told[0]
    assert "standard deviations below what was given (0.1): the records contradict it" in told[0]
    assert not any("what was given" in note for note in found.notes)


@pytest.mark.parametrize(
    ("name", "prior", "sentence"),
    [
        (
            "contacts",
            (0.01, 1e-3),
            "there is no such parameter in this fit; did you mean 'contact.resistance'? There are negative.capacity, ",
        ),
        (
            "contact.resistance",
            (-0.01, 1e-3),
            "-0.01 with a standard deviation of 0.001 is not possible; the value, in ohm, is from 0",
        ),
        ("contact.resistance", (0.01, 0.0), "the deviation above 0."),
        ("contact.resistance", (13.4, 0.5), "the value, in ohm, is from 0 to 0."),
        ("negative.rate", (np.inf, 0.1), "the value, in factor, is above 0"),
        (
            "negative.rate",
            (0.0, 0.1),
            "the value, in factor, is above 0, the deviation of its natural logarithm above 0",
        ),
        ("negative.full_stoichiometry", (0.97, 0.01), "the value, in 1, is from 0 to 0.95"),
    ],
)
def test_a_prior_that_no_parameter_can_have_is_told(start, records, name, prior, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        prepared_model(start, records, Conditions(priors={name: Prior(*prior)}))


def test_a_record_without_the_column_takes_the_temperature_that_is_given_for_it(start, records, found):
    bare = [replace(r, temperature_degc=None) for r in records]
    given = prepared_model(start, bare, Conditions(temperatures_degc={"at_25": 25.0, "at_0": 0.0}))[0]
    measured = prepared_model(start, records, Conditions())[0]
    x = np.linspace(-0.2, 0.2, given.layout.size)
    assert given.residual(x) == pytest.approx(measured.residual(x), abs=1e-9)
    without = prepared_model(start, bare, Conditions())
    assert len(without[0].free) < len(given.free)  # nothing tells energies
    assert any("declares; its own can be given (--temperature FILE=DEGC)." in note for note in without[1])


def test_a_temperature_that_never_moves_was_taken_for_one_of_the_case_and_told_how_a_winding_conducts(
    start, records
):
    """Stated as 25 degC, a record of a cell at 25 degC gave a salt that diffuses an eighth too slowly."""
    stated = records[0]
    moving = replace(stated, temperature_degc=stated.temperature_degc + np.linspace(0.0, 1.0, len(stated)))
    for record, told in ((stated, False), (moving, True)):
        model, _ = prepared_model(start, [record], Conditions())
        assert ("thermal.conductivity" in {one.name for one in model.free}) == told
        assert (model.cell.thermal_conductivity_w_m_k is not None) == told


def test_a_temperature_that_cannot_be_used_is_refused(start, records):
    with pytest.raises(DataError, match="no such record"):
        calibrate(start, records, Conditions(temperatures_degc={"elsewhere": 5.0}))
    with pytest.raises(DataError, match="measured temperature of its own"):
        calibrate(start, records, Conditions(temperatures_degc={"at_0": 5.0}))


def test_the_slopes_do_not_depend_on_the_number_of_threads(start, records, monkeypatch):
    model = prepared_model(start, records, Conditions())[0]
    x = 0.1 * np.sin(np.arange(model.layout.size))
    found, counts = [], []
    for threads in (1, 5):
        monkeypatch.setattr(os, "cpu_count", lambda threads=threads: threads)
        before = model.simulations
        found.append(model.jacobian(x))
        counts.append(model.simulations - before)
    assert np.array_equal(*found)
    assert counts[0] == counts[1] > len(records) * len(model.free)


def test_the_slopes_are_those_of_the_residual(start, records):
    model = prepared_model(start, records, Conditions())[0]
    x = 0.1 * np.sin(np.arange(model.layout.size))
    jacobian = model.jacobian(x)
    for j in range(model.layout.size):
        step = np.zeros_like(x)
        step[j] = 1e-4
        slope = (model.residual(x + step) - model.residual(x - step)) / 2e-4
        assert np.abs(jacobian[:, j] - slope).max() < 0.05 * np.abs(slope).max(), j
        assert np.linalg.norm(jacobian[:, j] - slope) < 0.02 * np.linalg.norm(slope), j


@pytest.mark.slow
def test_the_posterior_says_how_far_the_linear_intervals_were_off(found):
    pytest.importorskip("emcee")
    posterior = sample_posterior(found, 12, seed=1)
    assert set(posterior.intervals) == set(found.parameters)
    assert "times as wide as the linear ones" in posterior.sentence
    assert "too short" in posterior.sentence


def test_a_posterior_kept_to_itself_that_it_takes_losses_between_days_to_be_linear():
    posterior = PosteriorSamples(np.zeros((1, 1)), {}, {"negative.rate": 1.1}, 5.0)
    assert "losses" not in posterior.sentence
    assert (
        "losses between dated records are taken to be linear"
        in replace(posterior, linearised_losses=True).sentence
    )


def test_a_posterior_of_too_few_samples_is_refused(found):
    pytest.importorskip("emcee")
    with pytest.raises(InputError, match="--posterior 2: at least 4 samples"):
        sample_posterior(found, 2)


@pytest.mark.slow
def test_a_chain_whose_walkers_stand_still_warned_of_a_division(found):
    pytest.importorskip("emcee")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "too short" in sample_posterior(found, 4, seed=1).sentence


def test_a_record_that_the_declared_cell_runs_empty_on_was_told_with_an_error_of_half_a_volt(start):
    time = np.arange(0.0, 5200.0, 2.0)
    current = np.where(time < 60, 0.0, 0.75 * start.nominal_capacity_ah)
    voltage = simulate(start.with_soh(1.12), time, current, 1.0, (), None, "backward").voltage_v
    longer = Measurement(time, current, voltage, name="longer", hold="backward")
    found = calibrate(start, [longer], Conditions(soc0=1.0), evaluations=1)
    (note,) = (n for n in found.notes if "runs empty" in n)
    assert note.startswith("longer: ")
    assert "in the declared cell at" in note
    (error,) = found.errors
    assert f"in the file as simulated at {error.ran_out_s:g} s" in note
    assert error.until_v < error.simulated_v


def test_the_declared_cell_was_judged_on_a_record_of_another_day_with_a_loss_that_nobody_declared(
    start, records
):
    later, earlier = records
    plain = calibrate(start, records, evaluations=1)
    days = {later.name: date(2024, 1, 1), earlier.name: date(2023, 1, 1)}
    dated = calibrate(start, records, Conditions(dates=days, as_of=date(2023, 1, 1)), evaluations=1)
    assert dated.errors[0].before_v == plain.errors[0].before_v
    assert dict(dated.cell.tested_on) == days
    assert plain.cell.tested_on == ()


def test_a_cell_calibrated_in_python_did_not_say_which_model_it_was_fitted_with(found, start, records):
    assert found.cell.fitted_with == "espm"
    assert dict(found.cell.capacity_shares) == found.capacities
    assert dict(found.cell.fitted_at_k) == {"at_25": 298.15, "at_0": 273.15}
    other = calibrate(replace(start, fitted_with="dfn"), records[:1], evaluations=1)
    assert other.cell.fitted_with == "espm"


def test_a_file_that_is_worse_than_the_start_file_as_it_is_simulated_was_not_warned_of(found):
    first = found.errors[0]
    worse = replace(first, before_v=20e-3, after_v=10e-3, simulated_v=40e-3)
    (warning,) = replace(found, errors=(worse,)).warnings
    assert warning.startswith(
        f"{first.name}: the RMSE is 40.00 mV with the written file and 20.00 mV with the start file"
    )
    ran_out = replace(worse, ran_out_s=740.0, until_v=5e-3)
    (warning,) = replace(found, errors=(ran_out,)).warnings
    assert "40.00 mV with the written file (5.00 mV until it runs out at 740 s) and 20.00 mV" in warning
    assert replace(found, errors=(replace(worse, simulated_v=20e-3),)).warnings == ()


def test_a_record_of_the_start_file_itself_was_warned_of_for_a_fiftieth_of_its_noise(found):
    def warned(after_v):
        errors = (replace(found.errors[0], before_v=1.02e-3, after_v=after_v, simulated_v=after_v),)
        return replace(found, errors=errors).warnings

    assert warned(1.04e-3) == ()
    assert warned(1.20e-3)[0].startswith(
        f"{found.errors[0].name}: the fit errs by 1.20 mV there, the start file by 1.02"
    )


@pytest.mark.parametrize(("noise_v", "counts_in_full"), [(1e-3, True), (30e-3, False)])
def test_a_record_of_little_noise_counted_for_more_in_its_intervals_than_in_the_fit(noise_v, counts_in_full):
    error = noise_v * np.random.default_rng(0).standard_normal(400)
    model = SimpleNamespace(
        records=[SimpleNamespace(trusted=np.ones(400, dtype=bool))],
        errors_of=lambda cell, x: [error],
        weights=[np.full(400, 1.0 / (ERROR_V * REPEATS**0.5))],
        spectra=SimpleNamespace(information_weights=lambda cell: np.zeros(0)),
        cell_at=lambda x: None,
        layout=SimpleNamespace(size=3),
    )
    weights = information_weights(model, np.zeros(3))
    assert (weights[:400] == 1.0).all() == counts_in_full
    assert (weights <= 1.0).all()


def test_a_double_layer_that_no_cell_has_was_written_without_a_word(found):
    free = list(found.model.free)
    at = [one.name for one in free].index("negative.double_layer")
    x = found.x.copy()
    x[at] = 3.5
    absurd = replace(found, x=x)
    (warning,) = set(absurd.warnings) - set(found.warnings)
    assert warning.startswith(
        "negative.double_layer = 66.7 F/m2 (3.5 standard deviations above 1): the records contra"
    )
    assert "for something that the model lacks; search for missing effects with aesi discover" in warning
    free[at] = replace(free[at], given=True)  # a note says so
    told = copy(found.model)
    told.free = tuple(free)
    assert set(replace(absurd, model=told).warnings) == set(found.warnings)


def test_a_resistance_of_zero_was_written_as_what_round_off_left(found):
    at = [free.name for free in found.model.free].index("contact.resistance")
    x = found.x.copy()
    x[at] = found.model.free[at].bounds[0] * (1.0 - 1e-15)
    told = intervals(found.model, x, found.covariance)["contact.resistance"]
    assert told.value == 0.0
    assert told.low == 0.0 < told.high


def test_a_parameter_on_a_lower_bound_was_passed_over_where_its_kind_may_be_zero():
    energy = FitParameter("negative.rate_energy", 55e3, 12e3, "J/mol", "", low=0.0)
    full = FitParameter("negative.full_stoichiometry", 0.9, 0.015, "1", "", low=0.0)
    contact = FitParameter("contact.resistance", 0.01, 0.007, "ohm", "", low=0.0)
    low, high = np.transpose([one.bounds for one in (energy, full, contact)])
    model = SimpleNamespace(free=(energy, full, contact), low=low, high=high)
    assert at_bounds(model, low) == (energy.name, full.name)


def test_a_start_given_against_the_voltage_bent_the_file_with_no_more_than_a_note(start, records):
    alone = calibrate(start, records[:1], Conditions(soc0=0.8), evaluations=1)
    (warning,) = (words for words in alone.warnings if "--soc0" in words)
    assert warning.startswith("at_25 starts at a state of charge of 0.8, as given; its first voltage (4.")
    assert re.search(r"rather says 1.000 \+/- 0.\d+: the fit distorts the cell's parameters", warning)
    assert not any("starts at a state of charge" in note for note in alone.notes)  # it is told once

    believed = calibrate(start, records[:1], Conditions(soc0=0.98), evaluations=1)
    assert not any("--soc0" in words for words in believed.warnings)
    of_several = calibrate(start, records, Conditions(soc0=0.8), evaluations=1)  # they start where they say
    assert not any("--soc0" in words for words in of_several.warnings)


def test_a_state_of_charge_given_of_a_record_that_begins_with_a_charge_was_taken_where_its_discharge_begins(
    start,
):
    charged = start.capacity_ah
    phases = ((600, 0.0), (4.5 * 3600, -charged / 5.0), (3600, 0.0), (1.6 * 3600, charged / 2.0), (1800, 0.0))
    current = np.concatenate([np.full(int(seconds / 10.0), amperes) for seconds, amperes in phases])
    time = 10.0 * np.arange(len(current))
    record = Measurement(time, current, simulate(start, time, current, 0.08, (), None, "backward").voltage_v)
    model, notes = prepared_model(start, [record], Conditions(soc0=0.08))
    (fitted,) = model.records
    assert fitted.rows.time_s[0] > 15_000.0
    assert fitted.start.basis == "rest"
    assert fitted.start.soc == pytest.approx(0.98, abs=0.01)  # 0.08 and 4.5 h at C/5
    assert any("given is that of its first row, which is not fitted" in note for note in notes)


def test_a_pulse_that_touched_the_lower_limit_half_way_was_taken_for_a_full_discharge(start):
    time = np.arange(0.0, 6000.0, 2.0)
    pulse = (time >= 600.0) & (time < 620.0)
    current = np.where(time < 600.0, 0.0, np.where(pulse, 4.0, 0.33) * start.nominal_capacity_ah)
    voltage = np.where(pulse, 2.6, 3.9 - 4e-5 * time)
    voltage[:300] = 4.2
    cold = Measurement(time, current, voltage, name="cold", hold="backward")
    assert scaled_to_discharge(start, [cold])[0] == start
    whole = replace(cold, voltage_v=np.where(pulse, 2.9, np.linspace(4.2, 2.55, len(time))))
    assert scaled_to_discharge(start, [whole])[0].capacity_ah == pytest.approx(
        whole.discharged_ah("backward")[-1]
    )


@pytest.mark.parametrize("hold", ["linear", "backward", None])
def test_the_charge_of_a_full_discharge_was_held_since_the_row_before_whatever_was_declared(start, hold):
    time = np.arange(0.0, 19.0 * 3600.0, 600.0)
    current = np.where(time > 0.0, start.nominal_capacity_ah / 20.0, 0.0)
    voltage = np.linspace(start.upper_voltage_v, start.lower_voltage_v, len(time))
    slow = Measurement(time, current, voltage, name="slow", hold=hold)
    taken = slow.discharged_ah(hold or "backward")[-1]
    assert scaled_to_discharge(start, [slow])[0].capacity_ah == pytest.approx(taken, rel=1e-9)


def test_a_large_cell_from_the_file_of_a_small_one_kept_its_contact_resistance(start):
    """15 mohm of a cell of 2.9 Ah, of one of ten times its size: 0.45 V at 1C, and none of it could be taken out."""
    small = replace(start, contact_resistance_ohm=0.015)
    factor = 10.0
    time = np.arange(0.0, 19.0 * 3600.0, 600.0)
    current = np.full(len(time), factor * start.nominal_capacity_ah / 20.0)
    voltage = np.linspace(start.upper_voltage_v, start.lower_voltage_v, len(time))
    found = scaled_to_discharge(small, [Measurement(time, current, voltage, name="large", hold="backward")])[
        0
    ]
    grown = found.electrode_area_m2 / small.electrode_area_m2
    assert grown == pytest.approx(factor, rel=0.1)
    assert found.contact_resistance_ohm == pytest.approx(0.015 / grown)
    contact = next(one for one in free_parameters(found, 0.0) if one.name == "contact.resistance")
    assert contact.value(contact.bounds[0]) == pytest.approx(0.0, abs=1e-9)


def test_a_long_fit_said_nothing_until_its_end(start, records):
    told = []
    calibrate(start, records[:1], evaluations=3, on_step=lambda steps, left: told.append((steps, left)))
    assert [steps for steps, _ in told] == list(range(len(told)))
    assert told[0][1] == 1.0
    assert told[-1][1] < told[0][1]


def cycled(cell, before_ah):
    """A charge of `before_ah` from empty to full, a rest at full, and a discharge of the cell's nominal capacity."""
    full_ah, rate = cell.nominal_capacity_ah, 0.2 * cell.nominal_capacity_ah
    phases = ((before_ah / rate, -rate), (0.5, 0.0), (full_ah / rate, rate), (0.5, 0.0))
    current = np.concatenate([np.full(round(360 * hours), amperes) for hours, amperes in phases])
    time = 10.0 * np.arange(len(current))
    taken_ah = np.cumsum(current) * 10.0 / 3600.0
    voltage = 4.2 - 1.65 * (taken_ah + before_ah) / full_ah - 0.02 * np.sign(current)
    return Measurement(time, current, voltage, name="cycled", hold="backward")


def test_the_full_discharge_after_a_charge_told_no_size(start):
    cell = replace(start, nominal_capacity_ah=1.1 * start.nominal_capacity_ah)
    record = cycled(cell, cell.nominal_capacity_ah)
    assert record.voltage_v[0] < 3.0  # so that its first row is not full
    assert scaled_to_discharge(start, [record])[0].capacity_ah == pytest.approx(
        cell.nominal_capacity_ah, rel=1e-3
    )


def test_a_charge_before_the_full_discharge_was_taken_off_its_size(start):
    record = cycled(start, 0.05 * start.nominal_capacity_ah)  # begins near full, and is charged first
    assert record.voltage_v[0] > start.upper_voltage_v - 0.15
    assert scaled_to_discharge(start, [record])[0].capacity_ah == pytest.approx(
        start.nominal_capacity_ah, rel=1e-3
    )


def test_of_several_cycles_each_discharge_is_one(start):
    one = cycled(start, start.nominal_capacity_ah)
    twice = Measurement(
        10.0 * np.arange(2 * len(one)), np.tile(one.current_a, 2), np.tile(one.voltage_v, 2), name="twice"
    )
    assert scaled_to_discharge(start, [twice])[0].capacity_ah == pytest.approx(
        start.nominal_capacity_ah, rel=1e-3
    )
    assert full_discharge_numbers(
        start, [twice, replace(one, current_a=1e-3 * one.current_a, name="kA")]
    ) == (0,)


def test_a_file_that_is_fuller_than_most_cells_started_from_another_one(start):
    positive = replace(start.positive, theta_min=0.004)
    full = {p.name: p for p in free_parameters(replace(start, positive=positive), 0.0)}[
        "positive.full_stoichiometry"
    ]
    assert full.value(0.0) == 0.004
    assert full.value(1e-3) > 0.004


def test_a_record_without_a_current_is_refused_by_its_name(start, records):
    rest = replace(records[0], current_a=np.zeros(len(records[0])), name="rest")
    with pytest.raises(DataError, match="rest: the current is 0 A in all"):
        calibrate(start, [records[0], rest])


def test_no_evaluations_ended_in_an_error_of_the_solver(start, records):
    with pytest.raises(InputError, match="evaluations = 0 is not a whole number from 1"):
        calibrate(start, records[:1], evaluations=0)


def test_a_record_of_one_row_was_calibrated_with(start, records):
    with pytest.raises(
        DataError, match=r"at_25 has too few rows \(1\) to be fitted; a record needs at least 2"
    ):
        calibrate(start, [records[0].take(slice(100, 101))])


def test_an_unknown_voltage_was_taken_for_a_start_that_cannot_be_simulated(start, records):
    voltage = records[0].voltage_v.copy()
    voltage[7] = np.nan
    with pytest.raises(DataError, match="at_25: voltage_v is nan in row 8"):
        calibrate(start, [replace(records[0], voltage_v=voltage)])


def test_a_record_without_rows_ended_in_an_index_error():
    with pytest.raises(DataError, match="empty lasts 0 s, in which neither diffusion"):
        check_records([Measurement([], [], [], name="empty")], None)


def test_an_infinite_prior_was_taken(start):
    free = [FitParameter("contact.resistance", 0.01, 0.01, "ohm", "", low=0.0)]
    with pytest.raises(
        InputError, match=r"the prior of contact\.resistance: inf with a standard deviation of 1 is not"
    ):
        with_priors(free, {"contact.resistance": (np.inf, 1.0)})
