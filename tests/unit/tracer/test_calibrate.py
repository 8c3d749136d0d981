"""Calibration recovers what was changed, and says what the data leave open."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.pipeline.calibrate import to_json, to_text
from aesi.records import Measurement
from aesi.tracer.calibrate import calibrate, sized, with_activation


def discharge(cell, soc0=1.0):
    """C/5 from full until the lower voltage, as a cycler stops it, after ten minutes of rest."""
    time = np.arange(0.0, 22_000.0, 20.0)
    current = np.where(time < 600, 0.0, 0.2 * cell.nominal_capacity_ah)
    voltage = simulate(cell, time, current, soc0, on_depletion="clip").voltage_v
    stop = int(np.argmax(voltage < cell.lower_voltage_v)) or len(voltage)
    return Measurement(time[:stop], current[:stop], voltage[:stop], name="C5")


def test_a_smaller_cell_with_a_contact_resistance_is_met(cell, make):
    small = replace(cell, electrode_area_m2=0.9 * cell.electrode_area_m2)
    truth = replace(small, contact_resistance_ohm=4e-4)
    drive = make()
    voltage = simulate(truth, drive.time_s, drive.current_a, 0.9).voltage_v
    rng = np.random.default_rng(0)
    drive = replace(drive, voltage_v=voltage + 1e-3 * rng.normal(size=len(drive)))
    found = calibrate(cell, [discharge(truth), drive])
    assert found.cell.capacity_ah == pytest.approx(truth.capacity_ah, rel=0.02)
    after = {f.name: f.after_v for f in found.files}
    assert after["made"] < 2e-3
    assert after["C5"] < 5e-3
    assert all(f.after_v < f.before_v for f in found.files)
    again = Cell.from_bpx(found.cell.to_bpx())
    v = simulate(
        again, drive.time_s, drive.current_a, None, rest_voltage_v=float(drive.voltage_v[:50].mean())
    )
    assert np.sqrt(np.mean((v.voltage_v - drive.voltage_v) ** 2)) < 4e-3
    # ohm of contacts and of the electrolyte add up to one drop at moderate rates
    assert any("electrolyte" in s or "resistance" in s for s in found.undetermined) or (
        found.parameters["series_resistance.resistance_ohm"].value == pytest.approx(4e-4, rel=0.5)
    )
    text = to_text(to_json(found))
    assert "series_resistance.resistance_ohm" in text


def test_the_area_follows_a_full_discharge_and_nothing_else(cell, make):
    small = replace(cell, electrode_area_m2=0.8 * cell.electrode_area_m2)
    scaled, notes = sized(cell, [discharge(small)])
    assert scaled.capacity_ah == pytest.approx(small.capacity_ah, rel=0.03)
    assert "full discharge" in notes[0]
    same, notes = sized(cell, [make()])
    assert same is cell
    assert "believed" in notes[0]


def test_activation_energies_are_filled_only_where_none_is_declared(cell):
    assert with_activation(cell) == (cell, ())
    cold = cell.with_negative(diffusivity_ea_j_mol=0.0)
    warm, notes = with_activation(cold)
    assert warm.negative.diffusivity_ea_j_mol == 30e3
    assert warm.positive == cell.positive
    assert "negative diffusivity 30 kJ/mol" in notes[0]
