"""Calibration recovers what was changed, and says what the data leave open."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.cell.relations import Constant
from aesi.physics.effect import Record
from aesi.pipeline.calibrate import to_json, to_text
from aesi.records import Measurement
from aesi.tracer.calibrate import calibrate
from aesi.tracer.cell_start import one_branch, sized, with_activation
from aesi.tracer.cycler_zero import ZERO, zero_noted
from aesi.tracer.records import prepare


def discharge(cell, soc0=1.0, rate=0.2):
    """From full until the lower voltage, as a cycler stops it, after ten minutes of rest; at C/5 if not said."""
    time = np.arange(0.0, 4_400.0 / rate, 20.0)
    current = np.where(time < 600, 0.0, rate * cell.nominal_capacity_ah)
    voltage = simulate(cell, time, current, soc0, on_depletion="clip").voltage_v
    stop = int(np.argmax(voltage < cell.lower_voltage_v)) or len(voltage)
    return Measurement(time[:stop], current[:stop], voltage[:stop], name="C5")


def step_ohm(cell, current_a=30.0):
    """What a step of the current drops at once, before anything has diffused."""
    voltage = simulate(cell, np.array([0.0, 1e-3, 2e-3]), np.array([0.0, 0.0, current_a]), 0.6).voltage_v
    return (voltage[1] - voltage[2]) / current_a


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
    # Ohm of contacts and of the electrolyte add up to one drop at moderate rates: their sum is what the data tell.
    assert step_ohm(truth) > 1.2 * step_ohm(cell)
    assert step_ohm(again) == pytest.approx(step_ohm(truth), rel=0.01)
    contacts = found.parameters["series_resistance.resistance_ohm"]
    assert contacts.low <= 4e-4 <= contacts.high
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


def pulsed(cell, factor=6.0):
    """Pulses at 10 Hz from full to nearly empty, the rests logged once in 30 s."""
    capacity = cell.nominal_capacity_ah
    one = np.concatenate([np.arange(0.1, 10.05, 0.1), np.arange(11.0, 40.5), np.arange(60.0, 1801.0, 30.0)])
    at = np.concatenate([[0.0], *(one + 1800.0 * k for k in range(9))])
    since = (at - 1e-6) % 1800.0
    load = np.where(since < 10.0, factor * capacity, np.where(since > 1330.0, 0.74 * capacity, 0.0))
    load[0] = 0.0
    voltage = simulate(cell, at, load, 1.0, hold="backward", on_depletion="clip").voltage_v
    return Measurement(at, load, voltage, name="pulses")


def test_a_start_that_runs_empty_on_the_pulses_finds_its_way(cell):
    """The symptom: 6C pulses ran the start parameters empty, and the fit never left tens of volts."""
    slow = Constant(4e-15)
    start = cell.with_negative(diffusivity=slow).with_positive(diffusivity=slow)
    data = [discharge(cell), pulsed(cell)]
    run = simulate(start, data[1].time_s, data[1].current_a, 1.0, hold="backward", on_depletion="clip")
    assert run.series["depleted"].any()
    found = calibrate(start, data)
    after = {f.name: f.after_v for f in found.files}
    assert after["pulses"] < 5e-3
    assert after["C5"] < 8e-3
    factor = found.parameters["solid_diffusivity.negative_factor"]
    assert factor.low < factor.value < factor.high
    again = simulate(found.cell, data[1].time_s, data[1].current_a, 1.0, hold="backward")
    assert np.sqrt(np.mean((again.voltage_v - data[1].voltage_v) ** 2)) < 8e-3, "one is where it was full"


def test_a_zero_of_the_cycler_in_the_slow_test_is_not_capacity(cell):
    offset = 1e-3 * cell.nominal_capacity_ah
    slow = discharge(cell, rate=0.1)
    read = replace(slow, current_a=slow.current_a + offset * (slow.current_a > 0))
    pulses = pulsed(cell)
    found = calibrate(cell, [read, pulses])
    assert found.cell.capacity_ah == pytest.approx(cell.capacity_ah, rel=0.005)
    records = [prepare(cell, data, 1.0, 0.0) for data in (read, pulses)]
    (note,) = zero_noted(cell, records, 4.0 * offset)
    assert note.startswith("C5: "), "pulses are no slow record"
    assert "too high (4.0 % of it)" in note
    assert zero_noted(cell, records, offset) == ()
    still = Record(slow.time_s, np.zeros(len(slow)), None)
    assert not ZERO.on_record(still, offset_a=0.1).current_a.any(), "no current flows at rest"


def test_of_a_discharge_and_a_charge_only_the_discharge_is_fitted(cell):
    c = cell.nominal_capacity_ah
    time = np.arange(0.0, 80_000.0, 60.0)
    down = np.select(
        [time < 600, time < 35_000, time < 38_000, time < 72_000], [0.0, 0.1 * c, 0.0, -0.1 * c], 0.0
    )
    data = Measurement(time, down, np.full(len(time), 3.7), name="both")
    kept, notes = one_branch(cell, data)
    assert kept.time_s[0] == 0.0
    assert kept.time_s[-1] == 37_980.0
    assert "both" in notes[0]
    assert "hysteresis" in notes[0]
    kept, _ = one_branch(cell, replace(data, current_a=-down))
    assert kept.time_s[0] <= 35_040.0, "the rest before the discharge stays"
    assert kept.current_a[0] == 0.0
    assert kept.time_s[-1] == time[-1]
    charge = data.between(38_000.0, 80_000.0)
    assert one_branch(cell, charge) == (charge, ()), "where there is nothing else, it is taken"
    drive = replace(data, current_a=np.where(np.arange(len(time)) % 5 == 0, -0.2 * c, 0.1 * c))
    assert one_branch(cell, drive) == (drive, ())
