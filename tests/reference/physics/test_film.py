"""Films on the particles against closed forms: the drop of a constant current, the arc of an impedance."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K, ZERO_CELSIUS_K
from aesi.errors import CellError
from aesi.physics import Cell, impedance, simulate
from aesi.physics.cell.relations import Constant, LookupTable

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
NMC = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
FILM_OHM_M2, ENERGY_J_MOL, LAYER_F_M2 = 0.02, 50e3, 0.3
SOC = 0.6


def surface_m2(electrode):
    return electrode.area_per_volume_1_m * electrode.thickness_m * NMC.total_area_m2


def colder(degc):
    """Factor on a resistance, by hand: exp(E/R (1/T - 1/T_ref))."""
    rise = 1.0 / (degc + ZERO_CELSIUS_K) - 1.0 / NMC.reference_temperature_k
    return np.exp(ENERGY_J_MOL / GAS_CONSTANT_J_MOL_K * rise)


@pytest.mark.parametrize("degc", [25.0, 0.0])
@pytest.mark.parametrize(("model", "share"), [("espm", 1e-9), ("dfn", 0.02)])
def test_a_film_drops_current_times_resistance_over_the_true_surface(model, share, degc):
    time = np.arange(0.0, 60.0)
    current = np.full(60, 10.0)
    filmed = NMC.with_positive(film_ohm_m2=Constant(FILM_OHM_M2), film_ea_j_mol=ENERGY_J_MOL)
    bare = simulate(NMC, time, current, SOC, (), degc, model=model).voltage_v
    drop = bare - simulate(filmed, time, current, SOC, (), degc, model=model).voltage_v
    expected = 10.0 * FILM_OHM_M2 * colder(degc) / surface_m2(NMC.positive)
    # The porous electrode spreads the reaction more evenly under a film: it gives a little of the drop back.
    assert drop == pytest.approx(expected, rel=share)


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_no_film_is_the_model_without_one(model):
    time = np.arange(0.0, 600.0)
    current = np.where(time % 120.0 < 60.0, 30.0, -10.0)
    bare = simulate(NMC, time, current, SOC, model=model).voltage_v
    thin = LookupTable((0.0, 1.0), (1e-12, 1e-12))
    filmed = NMC.with_negative(film_ohm_m2=thin).with_positive(film_ohm_m2=thin)
    assert simulate(filmed, time, current, SOC, model=model).voltage_v == pytest.approx(bare, abs=1e-8)


def test_the_arc_is_of_kinetics_and_film_beside_the_double_layer():
    # Diffusion so fast that the surface stays where it was: what is left of the electrode is one arc.
    fast = NMC.with_negative(diffusivity=Constant(1e-9))
    n, degc = fast.negative, 10.0
    film = LookupTable((0.0, 1.0), (0.0, 2.0 * FILM_OHM_M2))
    filmed = fast.with_negative(film_ohm_m2=film, film_ea_j_mol=ENERGY_J_MOL, double_layer_f_m2=LAYER_F_M2)
    frequency = np.geomspace(1.0, 1e3, 13)
    omega = 2.0 * np.pi * frequency
    x = n.theta_min + SOC * (n.theta_max - n.theta_min)
    kelvin = degc + ZERO_CELSIUS_K
    rise = 1.0 / fast.reference_temperature_k - 1.0 / kelvin
    rate = n.rate_constant * np.exp(n.rate_ea_j_mol / GAS_CONSTANT_J_MOL_K * rise)
    kinetics = GAS_CONSTANT_J_MOL_K * kelvin / FARADAY_C_MOL**2 / rate / np.sqrt(x * (1.0 - x))
    both = kinetics + 2.0 * FILM_OHM_M2 * x * colder(degc)
    arc = both / (1.0 + 1j * omega * both * LAYER_F_M2)
    found = impedance(filmed, frequency, SOC, degc) - impedance(fast, frequency, SOC, degc)
    # What fills the particle at 1 Hz is 1e-4 of the film.
    assert found * surface_m2(n) == pytest.approx(arc - kinetics, abs=1e-3 * FILM_OHM_M2)


def test_a_file_keeps_its_films_and_refuses_a_negative_one():
    film = LookupTable((0.0, 0.5, 1.0), (1e-3, 2e-3, 0.1))
    cell = NMC.with_positive(film_ohm_m2=film, film_ea_j_mol=ENERGY_J_MOL)
    assert replace(Cell.from_bpx(cell.to_bpx()), name=cell.name) == cell
    with pytest.raises(CellError, match="film resistance of the positive electrode"):
        simulate(NMC.with_positive(film_ohm_m2=Constant(-1.0)), np.arange(3.0), np.ones(3), SOC)
