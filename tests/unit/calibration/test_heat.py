"""Heat capacity and conductance from the measured case temperature; the switch that uses them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.calibration.fit import calibrate
from aesi.calibration.heat import CaseRecord, case_records, fit_heat, with_fitted_heat
from aesi.calibration.model import Model
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions
from aesi.errors import CellError, ParameterError
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.physics.effects.self_heating import of_file
from aesi.records import Measurement

NMC = Cell.from_bpx(Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json")
TRUE_W_K, TRUE_FACTOR = 0.7, 1.3


def fit_of(cell: Cell, *records: Measurement, soc0: float = 0.9) -> Model:
    """A fit of the cell itself, before its first step."""
    return prepared_model(cell, records, Conditions(soc0=soc0, same_cell=True))[0]


def seen_by(cell: Cell, *records: Measurement) -> tuple[CaseRecord, ...]:
    """The temperatures of the records, and what the cell released."""
    model = fit_of(cell, *records)
    return case_records(model, np.zeros(model.layout.size))


@pytest.fixture(scope="module")
def warming() -> Measurement:
    time = np.arange(0.0, 3000.0, 2.0)
    current = np.where(time % 900 < 500, 60.0, -20.0)
    effect = CATALOGUE["self_heating"].activate(heat_transfer_w_k=TRUE_W_K, heat_capacity_factor=TRUE_FACTOR)
    run = simulate(NMC, time, current, 0.9, [effect], hold="backward")
    return Measurement(time, current, run.voltage_v, run.series["temperature_k"] - 273.15, "warming")


def test_the_heat_balance_behind_a_temperature_is_found(warming):
    found = fit_heat(NMC, seen_by(NMC, warming), NMC.heat_capacity_j_k)
    assert found.conductance_w_k == pytest.approx(TRUE_W_K, rel=0.15)
    assert found.heat_capacity_j_k == pytest.approx(TRUE_FACTOR * NMC.heat_capacity_j_k, rel=0.15)
    assert found.rmse_k < 0.3


def test_it_goes_into_the_file_and_comes_back(warming):
    cell, fit, _ = with_fitted_heat(NMC, seen_by(NMC, warming))
    again = Cell.from_bpx(cell.to_bpx())
    assert again.conductance_w_k == pytest.approx(TRUE_W_K, rel=0.15)
    assert again.heat_capacity_j_k == pytest.approx(cell.heat_capacity_j_k)
    assert fit.conductance_w_k == pytest.approx(cell.conductance_w_k)
    assert "W/K" in fit.sentence
    assert of_file(again).parameters["heat_transfer_w_k"] == pytest.approx(again.conductance_w_k)


def test_a_case_that_lags_its_winding_does_not_make_the_cell_heavier(warming):
    """What is conducted through the winding is told apart from what is stored, where the cell tells how it conducts."""
    cell = replace(NMC, thermal_conductivity_w_m_k=0.25)
    time = warming.time_s
    run = simulate(
        cell,
        time,
        warming.current_a,
        0.9,
        [of_file(replace(cell, heat_transfer_w_m2_k=20.0))],
        hold="backward",
    )
    winding, air = run.series["temperature_k"] - 273.15, 25.0
    outside = 20.0 * cell.surface_area_m2
    case = air + (winding - air) / (1.0 + outside * cell.winding_resistance_k_w)
    record = Measurement(time, warming.current_a, run.voltage_v, case, "case")
    found, as_one_lump = (
        fit_heat(one, seen_by(one, record), one.heat_capacity_j_k)
        for one in (cell, replace(cell, thermal_conductivity_w_m_k=None))
    )
    assert found.heat_capacity_j_k == pytest.approx(cell.heat_capacity_j_k, rel=0.15)
    assert found.conductance_w_k == pytest.approx(outside, rel=0.15)
    assert as_one_lump.heat_capacity_j_k > 1.2 * cell.heat_capacity_j_k


def test_the_error_of_a_temperature_was_told_of_the_descent_before_the_one_that_was_written():
    """Of two steps each: 0.04 K, where the file leaves 0.07."""
    cell = replace(NMC, thermal_conductivity_w_m_k=0.1, heat_transfer_w_m2_k=20.0)
    time = np.arange(0.0, 3000.0, 10.0)
    current = np.where(time % 900 < 500, 60.0, -20.0)
    run = simulate(
        replace(cell, contact_resistance_ohm=5e-4), time, current, 0.9, [of_file(cell)], hold="backward"
    )
    outside = 20.0 * cell.surface_area_m2
    case = 25.0 + (run.series["temperature_k"] - 298.15) / (1.0 + outside * cell.winding_resistance_k_w)
    record = Measurement(time, current, run.voltage_v, case, "case", hold="backward")
    start = replace(NMC, thermal_conductivity_w_m_k=1.0)
    found = calibrate(start, [record], Conditions(soc0=0.9, same_cell=True), evaluations=2)
    written = found.cell.heat_transfer_w_m2_k * found.cell.surface_area_m2
    seen = case_records(found.model, found.x)
    left = fit_heat(found.cell, seen, found.cell.heat_capacity_j_k, conductance_w_k=written)
    assert left.conductance_w_k == pytest.approx(written)
    assert left.rmse_k > 0.05
    assert any(f"of case within {left.rmse_k:.2f} K RMS" in note for note in found.notes)


def test_records_that_do_not_warm_leave_the_file_as_it_is(warming):
    flat = replace(warming, temperature_degc=np.full(len(warming), 25.0))
    cell, _, notes = with_fitted_heat(NMC, seen_by(NMC, flat))
    assert cell is NMC
    assert "no record has a measured temperature that changes by more than 2 K" in notes[0]
    assert "they stay as in the start file" in notes[0]


def test_that_heat_is_not_fitted_where_no_temperature_was_measured_was_said_nowhere(warming):
    bare = replace(warming, temperature_degc=None)
    cell, _, notes = with_fitted_heat(NMC, seen_by(NMC, bare))
    assert cell is NMC
    assert notes[0].endswith(
        "so that heat capacity and cooling are not fitted; they stay as in the start file."
    )


@pytest.mark.parametrize("measured", [True, False])
def test_a_file_without_a_volume_left_a_measured_temperature_without_a_word(warming, measured):
    lacking = replace(NMC, volume_m3=None, surface_area_m2=None)
    record = warming if measured else replace(warming, temperature_degc=None)
    cell, _, notes = with_fitted_heat(lacking, seen_by(lacking, record))
    assert cell is lacking
    assert "the start file has no 'Volume [m3]' and no 'External surface area [m2]'" in notes[0]
    assert ("temperature of warming tells no heat capacity" in notes[0]) == measured


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_what_a_cell_released_was_that_of_a_start_which_the_fit_had_left(direction):
    """Of a start that was 0.05 of charge off, a third of a charge at 1C seemed to release 1.08 times the heat on
    discharge, and 0.56 times on charge."""
    time = np.arange(0.0, 1200.0, 2.0)
    current = np.where(time < 60.0, 0.0, direction * NMC.capacity_ah)
    effect = CATALOGUE["self_heating"].activate(heat_transfer_w_k=TRUE_W_K, heat_capacity_factor=1.0)
    run = simulate(NMC, time, current, 0.45, [effect], hold="backward")
    kelvin = run.series["temperature_k"]
    record = Measurement(time, current, run.voltage_v, kelvin - 273.15, "moved", hold="backward")
    model = fit_of(NMC, record, soc0=0.5)
    x = np.zeros(model.layout.size)
    x[model.layout.soc(0)] = (0.45 - 0.5) / model.records[0].soc_sd
    (case,) = case_records(model, x)
    released_j = float(case.watts[1:] @ np.diff(case.time_s))
    lost_w = TRUE_W_K * (kelvin - NMC.ambient_temperature_k)
    balance_j = NMC.heat_capacity_j_k * (kelvin[-1] - kelvin[0]) + float(lost_w[1:] @ np.diff(time))
    assert released_j == pytest.approx(balance_j, rel=2e-3)


def in_a_chamber(degc) -> Measurement:
    """Five hours at C/10, after a minute of rest; what the thermocouple says is the chamber's doing alone."""
    time = np.arange(0.0, 18000.0, 20.0)
    current = np.where(time < 60.0, 0.0, 0.1 * NMC.capacity_ah)
    temperature = degc(time)
    run = simulate(NMC, time, current, 0.9, temperature_degc=temperature, hold="backward")
    return Measurement(time, current, run.voltage_v, temperature, "chamber")


CHAMBERS = {
    "a ramp up": lambda t: 25.0 + 15.0 * np.clip((t - 3600.0) / 7200.0, 0.0, 1.0),
    "a ramp down": lambda t: 25.0 - 20.0 * np.clip((t - 3600.0) / 7200.0, 0.0, 1.0),
    "a swing": lambda t: 25.0 + 4.0 * np.sin(t / 4600.0),
    "a soak": lambda t: 25.0 * np.exp(-t / 1500.0),
    "noise": lambda t: 25.0 + np.random.default_rng(3).normal(size=len(t)),
}


@pytest.mark.parametrize("what", CHAMBERS)
def test_a_chamber_or_a_noisy_sensor_was_written_into_the_file_as_heat(what):
    """Twelve times the heat capacity of noise; of a swing 9e5 W/K, which left all 2.8 K of it."""
    cell, _, notes = with_fitted_heat(NMC, seen_by(NMC, in_a_chamber(CHAMBERS[what])))
    assert cell is NMC
    assert notes == (
        "heat: the losses of the cell do not explain the temperature of chamber; it is not used.",
    )


def test_a_record_in_a_chamber_does_not_take_part_in_what_another_tells_of_heat(warming):
    alone, of_alone, _ = with_fitted_heat(NMC, seen_by(NMC, warming))
    both, of_both, notes = with_fitted_heat(NMC, seen_by(NMC, warming, in_a_chamber(CHAMBERS["a ramp down"])))
    assert both.heat_capacity_j_k == pytest.approx(alone.heat_capacity_j_k, rel=1e-6)
    assert both.conductance_w_k == pytest.approx(alone.conductance_w_k, rel=1e-6)
    assert of_both.sentence == of_alone.sentence
    assert "temperature of chamber" in notes[0]


def test_a_file_without_thermal_data_is_told_what_it_lacks():
    with pytest.raises(CellError, match="Specific heat"):
        of_file(replace(NMC, specific_heat_j_kg_k=None))


@pytest.mark.parametrize("model", ["espm", "dfn"])
def test_a_file_of_a_cell_that_gives_off_no_heat_was_refused(model):
    """Without a way out the heat stays: two pulses of opposite signs and a rest end as warm as the pulses left it."""
    time = np.arange(0.0, 900.0, 2.0)
    current = np.select([time < 200, time < 400], [30.0, -30.0], 0.0)
    tight = of_file(replace(NMC, heat_transfer_w_m2_k=0.0))
    kelvin = simulate(NMC, time, current, 0.6, [tight], model=model).series["temperature_k"]
    assert tight.parameters["heat_transfer_w_k"] == 0.0
    assert kelvin[210] > kelvin[0] + 0.5
    assert np.diff(kelvin[250:]).min() > -1e-9  # through 1 mW/K, the bound, it would lose 9e-6 K a row


def test_no_other_value_below_a_lower_bound_that_stands_for_zero_is_taken():
    with pytest.raises(ParameterError, match=r"heat_transfer_w_k = 0\.0001"):
        CATALOGUE["self_heating"].activate(heat_transfer_w_k=1e-4)
    with pytest.raises(ParameterError, match="heat_capacity_factor = 0 "):
        CATALOGUE["self_heating"].activate(heat_capacity_factor=0.0)


def test_what_a_drive_loses_within_the_rows_that_it_is_thinned_to_was_lost():
    """At 10 Hz with a new current every half second a fit to rows of a second found 0.52 of the heat capacity."""
    rng = np.random.default_rng(2)
    time = np.arange(0.0, 2400.0, 0.1)
    current = np.repeat(rng.normal(15.0, 60.0, len(time) // 5), 5)
    effect = CATALOGUE["self_heating"].activate(heat_transfer_w_k=TRUE_W_K, heat_capacity_factor=TRUE_FACTOR)
    run = simulate(NMC, time, current, 0.9, [effect], hold="backward")
    drive = Measurement(time, current, run.voltage_v, run.series["temperature_k"] - 273.15, "drive")
    seen = seen_by(NMC, drive)
    assert len(seen[0].time_s) < 0.2 * len(time)
    found = fit_heat(NMC, seen, NMC.heat_capacity_j_k)
    assert found.heat_capacity_j_k == pytest.approx(TRUE_FACTOR * NMC.heat_capacity_j_k, rel=0.02)
    assert found.conductance_w_k == pytest.approx(TRUE_W_K, rel=0.05)
