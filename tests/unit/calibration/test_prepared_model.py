"""The model that a fit starts from: what is read of the records is read of that very cell."""

from pathlib import Path

import numpy as np
import pytest

from aesi.calibration import Conditions
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Prior
from aesi.physics import initial_state, simulate
from aesi.physics.cell import Cell
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.mark.parametrize("priors", [{}, {"contact.resistance": Prior(0.012, 0.002)}])
def test_a_start_under_load_was_read_of_a_cell_without_the_films_of_the_fit(priors):
    cell = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    time = np.arange(2000.0)
    current = np.repeat(np.random.default_rng(2).normal(3.0, 3.0, 20), 100)
    record = Measurement(time, current, simulate(cell, time, current, 0.8).voltage_v).between(505.0, 2000.0)
    model, _ = prepared_model(cell, [record], Conditions(priors=priors))
    begins = model.cell_at(np.zeros(model.layout.size))
    of_begin, of_file = (initial_state(one, record, hold=record.hold_taken) for one in (begins, cell))
    assert of_begin.basis == model.records[0].start.basis == "load"
    assert model.records[0].start.soc == pytest.approx(of_begin.soc, abs=1e-4)
    assert of_begin.soc > of_file.soc + 0.01  # a cell of more resistance has a higher voltage at rest
