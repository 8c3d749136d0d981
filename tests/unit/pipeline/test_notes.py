"""What several records have in common is said once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import model_with, simulate
from aesi.pipeline import notes
from aesi.pipeline.notes import (
    beyond_fitted_sentences,
    dry_collector_sentences,
    fitted_record_sentences,
    missing_energy_sentences,
    other_model_sentences,
    temperature_range_sentences,
    temperature_sentence,
    together,
)
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import LABORATORY, Measurement

NMC = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


def test_records_with_the_same_note_share_it():
    notes = [
        "a: resampled to 1 s",
        "b: resampled to 1 s",
        "b: 3 rows dropped: no voltage",
        "a: resampled to 1 s",
    ]
    assert together(notes) == ("a, b: resampled to 1 s", "b: 3 rows dropped: no voltage")


def test_records_of_one_name_in_several_folders_had_each_its_own_line():
    names = ("train drive", "test drive")
    assert together([f"{name}: no temperature column" for name in names], names) == (
        "train drive, test drive: no temperature column",
    )


def test_records_that_start_full_were_told_in_one_sentence_that_ran_on():
    starts = [f"{name} rests at {v:.3f} V: a full charge." for name, v in (("C20", 4.194), ("1C", 4.193))]
    assert together([*starts, starts[0], "a, b: x", "c: x"]) == (*starts, "a, b, c: x")


def test_a_note_about_nothing_in_particular_stays_as_it_is():
    assert together(["The data could not be had.", "a: x"]) == ("a: x", "The data could not be had.")
    assert together([]) == ()


def test_a_cold_record_of_a_cell_without_activation_energies_was_simulated_in_silence():
    cell = Cell.from_bpx(NMC)
    silent = cell.with_electrolyte(diffusivity_ea_j_mol=0.0)
    cold = np.full(3, 10.0)
    assert missing_energy_sentences(cell, [cold]) == ()
    assert missing_energy_sentences(silent, [None, np.full(3, 27.0)]) == ()
    (sentence,) = missing_energy_sentences(silent, [None, cold])
    assert sentence == (
        "the cell's file declares no activation energy for electrolyte diffusivity: their values at 25 degC are "
        "used at temperatures up to 15 K away."
    )


def test_what_is_colder_or_warmer_than_all_that_a_file_was_fitted_to_is_said():
    fitted = replace(Cell.from_bpx(NMC), fitted_at_k=(("pulses", 265.25), ("drive", 299.0)))
    assert beyond_fitted_sentences(fitted, [np.array([-20.0, 5.0, 12.0]), 25.0, 30.0]) == ()
    assert beyond_fitted_sentences(fitted, [None]) == ()  # the file's own 25 degC
    assert beyond_fitted_sentences(fitted, [np.full(3, -18.0), 25.0]) == (
        "-18.0 degC in the mean is 10 K colder than any record that the cell's file was fitted to (pulses, -7.9 degC): "
        "what the model says there is extrapolated.",
    )
    (sentence,) = temperature_range_sentences(
        fitted, [None], [CATALOGUE["ambient_temperature"].activate(shift_k=15.0)]
    )
    assert sentence.startswith("40.0 degC in the mean is 14 K warmer than any record ")
    assert (
        beyond_fitted_sentences(Cell.from_bpx(NMC), [-30.0]) == ()
    )  # published: nobody says what it was fitted to


def test_two_effects_that_change_the_temperature_were_one():
    cell, record = Cell.from_bpx(NMC), Measurement(np.arange(3.0), np.zeros(3), np.full(3, 3.7), name="rest")
    both = [CATALOGUE[name].activate() for name in ("self_heating", "ambient_temperature")]
    assert "self_heating and ambient_temperature change it; " in temperature_sentence(cell, record, both)
    assert "and self_heating changes it; " in temperature_sentence(cell, record, both[:1])


@pytest.mark.parametrize(
    ("source", "end"),
    [
        (
            "drive.csv",
            "declares; for another one add a column temperature_degc, or give --column temperature_degc=40.",
        ),
        ("", "declares; for another one give its temperature_degc."),
        (LABORATORY, "as the cell's file declares."),
    ],
    ids=["file", "memory", "virtual"],
)
def test_a_record_that_is_no_file_was_to_be_given_a_column_by_an_option(source, end):
    """An experiment of virtual records refuses data.columns, which was the advice."""
    record = Measurement(np.arange(3.0), np.zeros(3), np.full(3, 3.7), source=source)
    assert temperature_sentence(Cell.from_bpx(NMC), record, ()).endswith(end)


def test_a_shift_of_the_temperature_was_no_temperature_that_energies_are_missing_for():
    silent = Cell.from_bpx(NMC).with_electrolyte(diffusivity_ea_j_mol=0.0)
    shifted = [CATALOGUE["ambient_temperature"].activate(shift_k=-20.0)]
    (sentence,) = temperature_range_sentences(silent, [None], shifted)
    assert sentence.endswith("their values at 25 degC are used at temperatures up to 20 K away.")
    assert (
        temperature_range_sentences(silent, [np.full(3, 25.0)], shifted) == ()
    )  # a measured temperature is as it is


def test_what_is_said_of_temperatures_activated_the_effects_once_for_each_sentence(monkeypatch):
    asked = []
    monkeypatch.setattr(notes, "model_with", lambda *given: asked.append(given) or model_with(*given))
    silent = Cell.from_bpx(NMC).with_electrolyte(diffusivity_ea_j_mol=0.0)
    fitted = replace(silent, fitted_at_k=(("drive", 299.0),))
    both = temperature_range_sentences(
        fitted, [None], [CATALOGUE["ambient_temperature"].activate(shift_k=-20.0)]
    )
    assert len(both) == 2
    assert len(asked) == 1


def test_a_model_that_was_found_with_the_single_particle_was_simulated_with_the_other_without_a_word():
    cell = Cell.from_bpx(NMC)
    found = HybridModel(cell, (CATALOGUE["series_resistance"].activate(),))
    (sentence,) = other_model_sentences(found, "dfn")
    assert sentence.startswith(
        "what the saved model adds to its cell was found with the single particle (espm), and the porous electrode "
        "(dfn) is simulated, as asked"
    )
    fitted = HybridModel(replace(cell, fitted_with="dfn"), model="dfn")
    (sentence,) = other_model_sentences(fitted, "espm")
    assert sentence.startswith("the cell's file was fitted with the porous electrode (dfn)")
    for as_it_is in ((found, None), (found, "espm"), (HybridModel(cell), "dfn")):
        assert other_model_sentences(*as_it_is) == ()


def test_what_a_fit_took_out_of_the_current_of_a_slow_cycle_was_told_by_its_report_alone():
    """C/20 from full to empty and back, on a cycler that reads a fiftieth of it too much."""
    cell = replace(Cell.from_bpx(NMC), capacity_shares=(("c20", 0.974),))
    hours = np.arange(0.0, 44.0, 1 / 30)
    rate, offset = cell.capacity_ah / 20, cell.capacity_ah / 1000
    true = np.select([hours < 1, hours < 20, hours < 21, hours < 40], [0, rate, 0, -rate], 0.0)
    run = simulate(cell, 3600 * hours, true, 1.0, hold="backward")
    read = true + offset * (true != 0)
    cycle = Measurement(
        3600 * hours, read, run.voltage_v, np.full(len(hours), 25.0), name="c20", hold="backward"
    )
    first, zero = fitted_record_sentences(cell, cycle, None)
    assert first.endswith("in which the cell had 0.974 of its capacity (--soh 0.974 takes it).")
    assert zero.startswith("c20: nearly full at both ends")
    assert float(zero.rpartition("offset_a=")[2].removesuffix(" does.")) == pytest.approx(offset, rel=0.1)
    taken = CATALOGUE["current_sensor_offset"].activate(offset_a=offset)
    assert fitted_record_sentences(cell, cycle, None, (taken,)) == (first,)
    assert fitted_record_sentences(cell, replace(cycle, voltage_v=np.full(len(hours), np.nan)), None) == (
        first,
    )
    assert fitted_record_sentences(cell, replace(cycle, name="another"), None) == ()


def test_a_collector_without_salt_is_told_with_when_and_which_model_sees_it():
    cell = Cell.from_bpx(NMC)
    time = np.arange(120.0)
    dry, wet = (simulate(cell, time, np.full(120, 90.0), 1.0, (), degc) for degc in (-20.0, 25.0))
    (told,) = dry_collector_sentences("cold", dry, "espm")
    assert "cold: the salt" in told
    assert "from 47 s on" in told
    assert "`aesi simulate --model dfn`" in told  # in `aesi predict`, --model is another option
    assert dry_collector_sentences("warm", wet, "espm") == dry_collector_sentences("cold", dry, "dfn") == ()
