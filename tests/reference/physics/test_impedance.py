"""Impedance against PyBaMM's, and against the time-domain model's own response to a small sine."""

import copy
import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from aesi.errors import DataError, InputError
from aesi.physics import Cell, impedance, simulate
from aesi.physics.cell.relations import LookupTable
from aesi.physics.effects import CATALOGUE

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
NMC = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
SOC = 0.6
LAYER_F_M2 = 0.2
POROUS_SHARE = 0.005
"""Of |Z|, between two porous electrodes."""


def sine_response(cell, frequency_hz, soc, degc, effects, amplitude_a=0.1, cycles=4, rows=400, model="espm"):
    """First harmonic of the last cycle of a small sine, its drift taken out."""
    time = np.linspace(0.0, cycles / frequency_hz, rows * cycles + 1)
    angle = 2.0 * np.pi * frequency_hz * time
    run = simulate(cell, time, amplitude_a * np.sin(angle), soc, effects, degc, model=model)
    last = slice(rows * (cycles - 1), rows * cycles)
    table = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(time), time])[last]
    sine, cosine = np.linalg.lstsq(table, run.voltage_v[last], rcond=None)[0][:2]
    return -(sine + 1j * cosine) / amplitude_a


@pytest.mark.parametrize(
    "effects",
    [
        (),
        ("double_layer",),
        ("reaction_nonuniformity",),
        ("particle_size_distribution",),
        ("concentration_dependent_diffusivity",),
        ("series_resistance",),
        ("film_growth",),
        ("lithium_inventory_loss",),
        ("active_material_loss_negative",),
    ],
)
def test_a_small_sine_in_time_gives_the_same_impedance(effects):
    active = tuple(CATALOGUE[name].activate() for name in effects)
    frequency = np.array([0.003, 0.1, 3.0])
    ours = impedance(NMC, frequency, SOC, 10.0, active)
    in_time = np.array([sine_response(NMC, f, SOC, 10.0, active) for f in frequency])
    # Tables of potentials and kinetics that bend by a part in a thousand at this amplitude.
    assert np.abs(ours - in_time) == pytest.approx(0.0, abs=2e-3 * np.abs(ours).max())


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_rates_and_films_over_stoichiometry_and_double_layers_of_the_file_are_in_both(model):
    slow = LookupTable((0.0, 0.3, 1.0), (3.0, 0.4, 0.2))
    cell = NMC.with_negative(rate_factor=slow, double_layer_f_m2=2.0)
    film = LookupTable((0.0, 0.5, 1.0), (1e-3, 5e-3, 3e-2))
    cell = cell.with_positive(rate_factor=slow, double_layer_f_m2=0.5, film_ohm_m2=film, film_ea_j_mol=5e4)
    frequency = np.array([0.003, 0.1, 3.0])
    ours = impedance(cell, frequency, SOC, 10.0, model=model)
    assert np.abs(ours - impedance(NMC, frequency, SOC, 10.0, model=model)).max() > 0.05 * np.abs(ours).max()
    in_time = np.array([sine_response(cell, f, SOC, 10.0, (), model=model) for f in frequency])
    assert np.abs(ours - in_time) == pytest.approx(0.0, abs=3e-3 * np.abs(ours).max())


@pytest.mark.parametrize(
    "effects",
    [(), ("double_layer",), ("particle_size_distribution",), ("concentration_dependent_diffusivity",)],
)
def test_a_small_sine_through_a_porous_electrode_gives_its_impedance(effects):
    active = tuple(CATALOGUE[name].activate() for name in effects)
    frequency = np.array([0.003, 0.1])
    ours = impedance(NMC, frequency, SOC, 10.0, active, model="dfn")
    in_time = np.array([sine_response(NMC, f, SOC, 10.0, active, model="dfn") for f in frequency])
    assert np.abs(ours - in_time) == pytest.approx(0.0, abs=2e-3 * np.abs(ours).max())


@pytest.mark.filterwarnings("ignore")
def test_pybamms_porous_electrode_gives_the_same_impedance():
    import pybamm

    content = json.loads((CELLS / "nmc_30ah.bpx.json").read_text())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        values = pybamm.ParameterValues.create_from_bpx_obj(copy.deepcopy(content))
        theta_n, theta_p = NMC.stoichiometries(SOC)
        values.update(
            {
                "Initial concentration in negative electrode [mol.m-3]": theta_n * NMC.negative.c_max_mol_m3,
                "Initial concentration in positive electrode [mol.m-3]": theta_p * NMC.positive.c_max_mol_m3,
                "Negative electrode double-layer capacity [F.m-2]": LAYER_F_M2,
                "Positive electrode double-layer capacity [F.m-2]": LAYER_F_M2,
            },
            check_already_exists=False,
        )
        # The porous electrode: that program's own single particle differs from its own porous electrode by a fifth.
        model = pybamm.lithium_ion.DFN(options={"surface form": "differential"})
        points = {"x_n": 30, "x_s": 15, "x_p": 30, "r_n": 80, "r_p": 80}
        simulation = pybamm.EISSimulation(model, parameter_values=values, var_pts=points)
        frequency = np.geomspace(2e-3, 40.0, 9)
        solution = simulation.solve(frequency)
    theirs = np.asarray(getattr(solution, "impedance", solution)).ravel()
    effects = [CATALOGUE["double_layer"].activate(negative_f_m2=LAYER_F_M2, positive_f_m2=LAYER_F_M2)]
    for model, most in (("espm", 0.01), ("dfn", POROUS_SHARE)):
        ours = impedance(NMC, frequency, SOC, 25.0, effects, model=model)
        assert (np.abs(ours - theirs) / np.abs(theirs)).max() < most


def test_cold_slows_and_a_double_layer_shorts_the_kinetics():
    warm, cold = (abs(impedance(NMC, [0.1], SOC, degc)[0]) for degc in (25.0, -10.0))
    assert cold > 3.0 * warm
    layer = [CATALOGUE["double_layer"].activate()]
    low, high = (impedance(NMC, [f], SOC, 25.0, layer)[0].real for f in (1e-2, 1e4))
    assert high < 0.5 * low
    assert impedance(NMC, [1e4], SOC, 25.0)[0].real > 0.9 * impedance(NMC, [1.0], SOC, 25.0)[0].real


@pytest.mark.parametrize("frequency", [[0.0], [-1.0], [np.nan], [[1.0]]])
def test_frequencies_that_are_none_are_refused(frequency):
    with pytest.raises(DataError, match="frequency_hz"):
        impedance(NMC, frequency, SOC)


def test_a_state_beyond_the_electrodes_and_plating_are_refused():
    with pytest.raises(DataError, match="state of charge"):
        impedance(NMC, [1.0], 1.5)
    with pytest.raises(InputError, match="plating"):
        impedance(NMC, [1.0], SOC, 25.0, [CATALOGUE["lithium_plating"].activate()])
