"""Cell files of published sets against PyBaMM's own sets: capacity, rest voltage, and a 1C discharge."""

import json
from pathlib import Path

import numpy as np
import pytest

from aesi.data.laboratory.published import SETS, bpx_of

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.mark.parametrize("published", SETS, ids=lambda one: one.name)
def test_the_shipped_file_is_what_the_command_writes(published):
    assert json.loads((CELLS / published.file).read_text()) == bpx_of(published)


@pytest.mark.parametrize("published", SETS, ids=lambda one: one.name)
def test_a_1c_discharge_is_that_of_the_set(published):
    import pybamm

    file = pybamm.ParameterValues.create_from_bpx(str(CELLS / published.file), target_soc=0.9)
    own = pybamm.ParameterValues(published.name)
    own.update({"Ambient temperature [K]": 298.15, "Initial temperature [K]": 298.15})
    current = 1.0 * float(own["Nominal cell capacity [A.h]"])
    time = np.linspace(0, 1800, 91)
    voltage = []
    for values, amperes in ((file, current * published.pairs), (own, current)):
        values["Current function [A]"] = amperes
        values["Lower voltage cut-off [V]"] = 1.5
        simulation = pybamm.Simulation(pybamm.lithium_ion.SPMe(), parameter_values=values)
        initial = {} if values is file else {"initial_soc": 0.9}
        voltage.append(simulation.solve(time, **initial)["Voltage [V]"](time))
    # What differs: 298 K against 298.15 K as the reference of the LFP set, and rounded polynomials.
    assert np.sqrt(np.mean((voltage[0] - voltage[1]) ** 2)) < 1e-3
