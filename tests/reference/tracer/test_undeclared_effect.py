"""The example of the loop: PyBaMM's porous electrode heats itself, and the cell file says nothing of heat."""

from pathlib import Path

import numpy as np
import pytest

from aesi.numerics.metrics import rms
from aesi.physics import Cell
from aesi.pipeline.discovery.cases import case_of_experiment
from aesi.pipeline.experiment.config import read_experiment
from aesi.tracer import discover

EXPERIMENTS = Path(__file__).resolve().parents[3] / "experiments"
COOLING_W_M2_K = 10.0
"""Heat transfer of the virtual cell at magnitude 1, times its surface."""
FIRST_S = 2600.0
"""As much of the training drive as tells the effect in some seconds."""


def test_the_loop_names_the_heat_that_no_file_declares_and_its_size():
    case = case_of_experiment(read_experiment(EXPERIMENTS / "undeclared_effect.yaml"))
    assert all(record.temperature_degc is None for record in (*case.measurements, *case.tests))
    cell = Cell.from_bpx(case.cell)
    seen = [record.between(0.0, FIRST_S) for record in case.measurements]
    found = discover(cell, seen, case.tests, max_effects=1, model="espm")
    assert found.verdict.word == "found"
    assert found.verdict.effects == ("self_heating",)
    cooling = found.written["self_heating"]["heat_transfer_w_k"]
    assert cooling == pytest.approx(COOLING_W_M2_K * cell.surface_area_m2, rel=0.03)
    assert found.written["self_heating"]["heat_capacity_factor"] == pytest.approx(1.0, abs=0.05)
    tested = [one for one in found.files if one.part == "test"]
    before, after = (
        rms(np.concatenate([one.measured_v - one.voltages[state] for one in tested]))
        for state in ("before", "after")
    )
    assert after < 0.5 * before
