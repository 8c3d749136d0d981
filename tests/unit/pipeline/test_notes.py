"""What several records have in common is said once."""

from pathlib import Path

import numpy as np

from aesi.physics import Cell
from aesi.pipeline.notes import together, without_energies

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
