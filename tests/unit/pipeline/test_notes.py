"""What several records have in common is said once."""

from pathlib import Path

import numpy as np

from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.notes import temperature_sentence, together, without_energies
from aesi.records import Measurement

NMC = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


def test_records_with_the_same_note_share_it():
    notes = [
        "a: resampled to 1 s",
        "b: resampled to 1 s",
        "b: 3 rows dropped: no voltage",
        "a: resampled to 1 s",
    ]
    assert together(notes) == ("a, b: resampled to 1 s", "b: 3 rows dropped: no voltage")


def test_a_note_about_nothing_in_particular_stays_as_it_is():
    assert together(["The data could not be had.", "a: x"]) == ("a: x", "The data could not be had.")
    assert together([]) == ()


def test_a_cold_record_of_a_cell_without_activation_energies_was_simulated_in_silence():
    cell = Cell.from_bpx(NMC)
    silent = cell.with_electrolyte(diffusivity_ea_j_mol=0.0)
    cold = np.full(3, 10.0)
    assert without_energies(cell, [cold]) == ()
    assert without_energies(silent, [None, np.full(3, 27.0)]) == ()
    (sentence,) = without_energies(silent, [None, cold])
    assert sentence == (
        "the cell's file declares no activation energy for electrolyte diffusivity: taken as at 25 degC, which is "
        "up to 15 K off."
    )


def test_two_effects_that_change_the_temperature_were_one():
    cell, record = Cell.from_bpx(NMC), Measurement(np.arange(3.0), np.zeros(3), np.full(3, 3.7), name="rest")
    both = [CATALOGUE[name].activate() for name in ("self_heating", "ambient_temperature")]
    assert temperature_sentence(cell, record, both).endswith(
        "self_heating and ambient_temperature change it."
    )
    assert temperature_sentence(cell, record, both[:1]).endswith("and self_heating changes it.")
