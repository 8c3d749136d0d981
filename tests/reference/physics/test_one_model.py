"""Where electrolyte and solids conduct perfectly the porous electrode is the single particle, with every effect.

The two models have other equations, other steps and other solvers, so that an effect is the same in both only where
each has its sign, its unit and its share of the surface.
"""

from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, impedance, simulate
from aesi.physics.cell.relations import Constant, scaled
from aesi.physics.effects import CATALOGUE

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
PERFECT = 1e5
"""Factor on conductivities; the diffusivity of the salt is as many times a usual one."""
SHARED = [effect for name, effect in CATALOGUE.items() if name != "reaction_nonuniformity"]
APART_V = 1e-5
"""0.007 mV are reached, with a diffusivity that varies."""
LAYERS_APART_V = 1e-4
"""0.04 mV, which steps of a second leave of double layers."""
SPECTRA_APART = 1e-6


@pytest.fixture(scope="module")
def perfect():
    cell = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    cell = cell.with_electrolyte(
        conductivity=scaled(cell.electrolyte.conductivity, PERFECT), diffusivity=Constant(PERFECT * 1e-10)
    )
    n, p = cell.negative, cell.positive
    cell = cell.with_negative(conductivity_s_m=PERFECT * n.conductivity_s_m)
    return cell.with_positive(conductivity_s_m=PERFECT * p.conductivity_s_m)


@pytest.mark.parametrize("effect", SHARED, ids=lambda effect: effect.id)
def test_both_models_are_one_where_nothing_but_the_particles_resists(perfect, effect):
    time = np.arange(0.0, 600.0)
    c_rate = np.interp(
        time, [0, 10, 150, 160, 300, 310, 450, 460], [0.0, 1.0, 1.0, 0.0, 0.0, -0.8, -0.8, 0.4]
    )
    current = perfect.nominal_capacity_ah * c_rate
    single, porous = (
        simulate(perfect, time, current, 0.6, [effect.activate()], model=model) for model in ("espm", "dfn")
    )
    most = LAYERS_APART_V if effect.id == "double_layer" else APART_V
    assert np.abs(single.voltage_v - porous.voltage_v).max() < most
    assert list(single.series) == list(porous.series)
    np.testing.assert_allclose(single.series["temperature_k"], porous.series["temperature_k"], atol=1e-4)


@pytest.mark.parametrize("effect", SHARED, ids=lambda effect: effect.id)
def test_both_spectra_are_one_where_nothing_but_the_particles_resists(perfect, effect):
    if effect.id == "lithium_plating":
        pytest.skip("has no linear answer at rest")
    frequency = np.geomspace(1e-3, 1e3, 4)
    single, porous = (
        impedance(perfect, frequency, 0.6, 10.0, [effect.activate()], model=model)
        for model in ("espm", "dfn")
    )
    assert (np.abs(single - porous) / np.abs(porous)).max() < SPECTRA_APART
