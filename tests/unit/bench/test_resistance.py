"""The benchmark of resistances where no record was."""

from pathlib import Path

import numpy as np
import pytest

from aesi.bench.physics import resistance
from aesi.calibration.parameters import with_interfaces
from aesi.physics import Cell

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def test_a_cell_whose_records_are_not_here_says_so_and_counts_in_nothing(monkeypatch, tmp_path):
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    rows = list(resistance.run(str(CELLS), virtual=0))
    assert [row["cell"] for row in rows] == [cell for cell, _, _ in resistance.MEASURED]
    assert all("error" in row and "inside_pct" not in row for row in rows)


def test_figures_are_of_the_pulses_that_cell_and_model_can_give():
    ohm = np.array([[0.05, 0.10, np.nan], [0.20, 0.40, 0.80]])
    truth = np.array([[0.06, 0.20, 0.30], [0.20, np.nan, 0.80]])
    row = resistance._figures(ohm, 0.5 * ohm, 1.5 * ohm, truth)
    assert (row["pulses"], row["inside_cases"], row["inside_pct"]) == (4, 4, 75.0)
    assert row["width"] == 3.0
    assert row["off"] == pytest.approx(1.1)  # of 1.2, 2, 1 and 1
    assert resistance._figures(ohm[:, 2:] * np.nan, ohm[:, 2:], ohm[:, 2:], truth[:, 2:]) == {"pulses": 0}


def test_drawn_cells_differ_in_their_energies_and_keep_their_balance():
    start = with_interfaces(Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json"))
    one, two = (resistance._drawn(start, np.random.default_rng(seed)) for seed in (1, 2))
    assert one.negative.rate_ea_j_mol != two.negative.rate_ea_j_mol
    assert one.capacity_ah == pytest.approx(start.capacity_ah) == pytest.approx(two.capacity_ah)
