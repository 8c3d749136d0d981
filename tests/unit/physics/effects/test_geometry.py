"""Radius, thickness and porosity: what each is the same as, and where it differs."""

from pathlib import Path

import numpy as np
import pytest

from aesi.errors import CellError
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import model_with

CELL = Cell.from_bpx(
    Path(__file__).resolve().parents[4] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
)
TIME = np.arange(0.0, 1200.0, 2.0)


def voltage(current_a, *effects):
    return simulate(CELL, TIME, current_a, 0.8, [CATALOGUE[n].activate(**v) for n, v in effects]).voltage_v


def factors(negative, positive=1.0):
    return {"negative_factor": negative, "positive_factor": positive}


PULSES = 10.0 * np.sign(np.sin(TIME / 95.0))
SLOW = np.full(len(TIME), 0.05)
FAST = np.full(len(TIME), 7.0)


def test_twice_the_radius_is_a_quarter_of_the_diffusivity_and_half_the_rate():
    coarse = voltage(PULSES, ("particle_radius", factors(2.0)))
    both = (("solid_diffusivity", factors(0.25)), ("charge_transfer_kinetics", factors(0.5)))
    assert coarse == pytest.approx(voltage(PULSES, *both), abs=1e-9)
    slow_diffusion = voltage(PULSES, ("solid_diffusivity", factors(0.25)))
    assert np.abs(coarse - slow_diffusion).max() > 2e-3  # what tells them apart
    assert model_with(CELL, [CATALOGUE["particle_radius"].activate(**factors(2.0))]).cell.capacity_ah == (
        pytest.approx(CELL.capacity_ah)
    )


def test_a_thinner_coating_is_lost_material_at_rest_and_a_shorter_way_under_load():
    thin = ("electrode_thickness", factors(0.8))
    lost = ("active_material_loss_negative", {"loss": 0.2, "lost_at_soc": 1.0})
    assert voltage(SLOW, thin) == pytest.approx(voltage(SLOW, lost), abs=1e-4)
    assert np.abs(voltage(FAST, thin) - voltage(FAST, lost)).max() > 2e-3
    shorter = model_with(CELL, [CATALOGUE["electrode_thickness"].activate(**factors(0.8))]).cell
    assert shorter.negative.thickness_m == pytest.approx(0.8 * CELL.negative.thickness_m)
    assert shorter.electrode_capacity_ah(shorter.negative) == pytest.approx(
        0.8 * CELL.electrode_capacity_ah(CELL.negative)
    )


def test_less_pore_space_conducts_worse_and_holds_less_salt():
    dense = voltage(FAST, ("porosity", factors(0.8, 0.8)))
    assert (dense < voltage(FAST)).all()
    transport = dict.fromkeys(("conductivity_factor", "diffusivity_factor"), 0.8**1.5)
    assert np.abs(dense - voltage(FAST, ("electrolyte_transport", transport))).max() > 1e-3
    assert voltage(SLOW, ("porosity", factors(0.8, 0.8))) == pytest.approx(voltage(SLOW), abs=2e-4)


def test_a_porosity_that_leaves_no_solid_is_refused():
    porous = CELL.with_positive(porosity=0.7)
    with pytest.raises(CellError, match="leaves no solid"):
        model_with(porous, [CATALOGUE["porosity"].activate(**factors(1.0, 1.6))])
