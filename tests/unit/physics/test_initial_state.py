"""One rule for the state of charge at the first row: given, full charge, rest, load."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import CellError, DataError, InputError
from aesi.physics import Cell, initial_state, simulate
from aesi.physics.cell.relations import Expression, LookupTable
from aesi.physics.effect import Effect, Record, as_cell_saw
from aesi.physics.effects import CATALOGUE
from aesi.physics.folded import folded
from aesi.physics.record_checks import SOC_MARGIN
from aesi.physics.rest.open_circuit import GOOD_READING_V, READING_V, OpenCircuit
from aesi.physics.start.charge import check_charge, start_bounds, truncated_by_charge
from aesi.physics.start.state import InitialState
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
LG_M50 = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


def record(time_s, current_a, voltage_v, temperature_degc=None) -> Measurement:
    return Measurement(
        np.asarray(time_s, float),
        np.asarray(current_a, float),
        np.asarray(voltage_v, float),
        temperature_degc,
    )


def resting(voltage_v: float, rows: int = 20, temperature_degc=None) -> Measurement:
    temperature = None if temperature_degc is None else np.full(rows, temperature_degc)
    return record(np.arange(rows), np.zeros(rows), np.full(rows, voltage_v), temperature)


def cut_from_a_drive(at: int) -> tuple[Measurement, float]:
    """A record that begins in the middle of a drive, and its true state of charge there."""
    time = np.arange(3000.0)
    current = np.repeat(np.random.default_rng(5).normal(2.5, 4.0, 100), 30)
    run = simulate(LG_M50, time, current, soc0=0.9, hold="backward")
    return record(time[at:] - time[at], current[at:], run.voltage_v[at:]), float(run.series["soc"][at])


@settings(max_examples=40, deadline=None)
@given(st.floats(0.02, 0.95))
def test_a_rest_gives_its_state_of_charge_within_the_uncertainty_it_claims(soc):
    found = initial_state(LG_M50, resting(float(LG_M50.rest_voltage_v(soc)[0])))
    assert found.basis == "rest"
    assert abs(found.soc - soc) < found.sd


def test_a_record_that_stays_within_a_millivolt_of_a_whole_one_was_written_in_steps_of_a_volt():
    noise_v = 1e-4 * np.random.default_rng(0).standard_normal(600)
    found = initial_state(LG_M50, record(np.arange(600.0), np.zeros(600), np.round(4.0 + noise_v, 5)))
    assert "written in steps" not in found.sentence
    assert found.sd < 0.02  # with a step of 1 V it was 0.295


@pytest.mark.parametrize("soc", [0.3, 0.55, 0.8])
def test_a_rest_voltage_is_known_to_the_step_that_it_is_written_in(soc):
    time = np.arange(600.0)
    current = np.where(time < 120.0, 0.0, 2.5)
    voltage_v = simulate(LG_M50, time, current, soc0=soc).voltage_v
    coarse, fine = (
        initial_state(LG_M50, record(time, current, np.round(voltage_v, digits))) for digits in (1, 4)
    )
    assert abs(coarse.soc - soc) < 2.0 * coarse.sd
    assert coarse.sd > 2.0 * fine.sd
    assert "V, written in steps of 0.1 V" in coarse.sentence
    assert "written in steps" not in fine.sentence


@pytest.mark.parametrize(("rows", "step_s"), [(2, 10.0), (3, 60.0), (30, 10.0)])
def test_a_rest_whose_last_row_held_the_voltage_of_the_load_relaxed_to_far_less(rows, step_s):
    """A logger that writes the current a row after its voltage."""
    time = step_s * np.arange(rows + 20)
    run = simulate(LG_M50, time, np.where(np.arange(rows + 20) < rows, 0.0, 5.0), 0.6, hold="backward")
    found = initial_state(LG_M50, record(time, np.append(0.0, run.current_a[:-1]), run.voltage_v))
    assert abs(found.soc - 0.6) < min(0.01, found.sd)


@pytest.mark.parametrize("below_mv", [0.0, 6.0, 20.0])
def test_a_full_charge_that_relaxed_is_state_of_charge_one(below_mv):
    found = initial_state(LG_M50, resting(LG_M50.upper_voltage_v - 1e-3 * below_mv))
    assert (found.basis, found.soc) == ("full charge", 1.0)
    by_voltage = 1.0 - float(np.interp(LG_M50.upper_voltage_v - 1e-3 * below_mv, *_ocv()))
    assert found.sd >= 0.49 * by_voltage  # the table of potentials is coarse


def test_a_rest_above_the_upper_cut_off_is_said_to_be_above_it():
    said = initial_state(LG_M50, resting(LG_M50.upper_voltage_v + 0.05)).sentence
    assert "rests at 4.250 V, 50 mV above the upper cut-off (4.2 V): a full charge" in said
    assert said.endswith("check the voltage's sensor, and the cell file, which may be another cell's.")


@pytest.mark.parametrize(
    ("cut_off_v", "rest_v", "off"),
    [
        (4.1, 4.08, "rests at 4.200 V, 100 mV above this cut-off"),
        (4.1, 4.15, "rests at 4.200 V, 100 mV above this cut-off"),
        (4.35, 4.33, "rests at 4.200 V, 130 mV below this record"),
    ],
)
def test_limits_of_another_upper_cut_off_put_a_full_charge_elsewhere_without_a_word(cut_off_v, rest_v, off):
    edited = LG_M50.with_cut_offs(LG_M50.lower_voltage_v, cut_off_v)
    found = initial_state(edited, resting(rest_v))
    assert found.basis == "full charge"
    assert off in found.sentence
    assert "limits" not in initial_state(LG_M50, resting(4.18)).sentence


def test_a_cold_start_under_load_was_told_to_be_of_another_cell():
    """A drop that builds up over seconds is all there at once in a model without double layers."""
    amperes = 2.0 * LG_M50.capacity_ah
    time = np.arange(0.0, 60.0)
    data = record(time, np.full(60, amperes), np.full(60, LG_M50.upper_voltage_v - 0.05))
    found = initial_state(LG_M50, data)
    assert found.basis == "full charge"
    assert "mV above the upper cut-off" in found.sentence
    assert found.sentence.endswith("by its first row the cell may have dropped by less than the model does.")
    assert "another cell's" not in found.sentence


LFP = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")


@pytest.mark.parametrize("below_v", [0.05, 0.1])
def test_a_full_charge_of_a_flat_potential_that_fell_by_more_than_others_do_was_read_as_a_part_of_it(below_v):
    """An LFP cell rests 0.1 to 0.25 V below its cut-off: a row of rest before C/2 told 0.79 +/- 0.17 of its charge."""
    time = np.append(0.0, np.arange(1.0, 300.0))
    run = simulate(LFP, time, np.append(0.0, np.full(299, 0.5 * LFP.capacity_ah)), 0.9975, hold="backward")
    data = record(time, run.current_a, run.voltage_v)
    data.voltage_v[0] = LFP.upper_voltage_v - below_v
    found = initial_state(LFP, data)
    assert (found.basis, found.soc) == ("full charge", 1.0)
    assert f"{1e3 * below_v:.0f} mV below the upper cut-off" in found.sentence


def test_a_flat_potential_after_a_charge_that_was_broken_off_is_no_full_charge():
    time = np.arange(0.0, 1800.0, 10.0)
    charge = simulate(LFP, time, np.full(len(time), -LFP.capacity_ah), 0.3, hold="backward")
    rest = simulate(LFP, np.arange(2000.0), np.where(np.arange(2000.0) < 1800.0, -LFP.capacity_ah, 0.0), 0.3)
    assert charge.voltage_v[-1] > rest.voltage_v[1801]
    found = initial_state(LFP, record(np.arange(190.0), np.zeros(190), rest.voltage_v[1810:2000]))
    assert found.basis == "rest"
    assert abs(found.soc - 0.8) < 2.0 * found.sd


def test_what_a_voltage_leaves_open_the_charge_that_moves_tells():
    """A record of 0.96 of the capacity of an LFP cell was read to begin at 0.79, and refused for ending at -0.17."""
    time = np.arange(0.0, 6901.0, 100.0)
    amperes = np.full(len(time), 0.5 * LFP.capacity_ah)
    read = InitialState(0.786, 0.168, "load", "It begins at 0.786 +/- 0.168.")
    moved = record(time, amperes, np.zeros(len(time))).discharged_ah("backward") / LFP.capacity_ah
    found = truncated_by_charge(read, moved, start_bounds(moved))
    drawn = np.random.default_rng(1).normal(read.soc, read.sd, 400_000)
    drawn = drawn[(drawn > 6900.0 / 7200.0 - SOC_MARGIN) & (drawn < 1.0 + SOC_MARGIN)]
    assert found.soc == pytest.approx(drawn.mean(), abs=2e-3)
    assert found.sd == pytest.approx(drawn.std(), abs=2e-3)
    assert found.sentence.startswith(
        "It begins at 0.786 +/- 0.168; as the record moves 0.958 of the capacity, "
    )
    wrong = replace(read, soc=0.3)
    assert truncated_by_charge(wrong, moved, start_bounds(moved)) is wrong


def test_more_charge_than_the_cell_has_was_told_by_a_time_that_all_rows_share():
    time = 1.7e9 + np.arange(0.0, 3601.0, 100.0)
    hour = record(time, np.full(len(time), LFP.capacity_ah), np.full(len(time), 3.3))
    first = int(np.argmax(np.arange(len(time)) / 36.0 > 0.5 + SOC_MARGIN))
    with pytest.raises(DataError, match=rf"a state of charge of -14 % at {time[first]:.12g} s, from 50 % at"):
        check_charge(LFP, hour, 0.5, "backward")
    check_charge(LFP, hour, 1.0 - SOC_MARGIN, "backward")
    with pytest.raises(DataError, match="114 %"):
        check_charge(LFP, replace(hour, current_a=-hour.current_a), 0.5, "backward")


def test_a_potential_that_rises_beyond_all_bounds_past_full_had_a_start_under_load_fail():
    """A formula of an LFP cell is 1e9 V beyond full, and the errors of (1) of a load could not be inverted."""
    theta = np.linspace(0.0, 1.0, 2001)
    beyond = np.maximum(LG_M50.positive.theta_min - theta - 1e-3, 0.0)
    steep = LookupTable(tuple(theta), tuple(LG_M50.positive.ocp(theta.clip(1e-6, 1.0)) + 1e12 * beyond))
    cell, before = LG_M50.with_positive(ocp=steep), cut_from_a_drive(600)
    found = initial_state(cell, before[0].take(slice(0, 300)))
    assert abs(found.soc - before[1]) < 3.0 * found.sd


def test_a_start_under_load_was_told_to_rest_at_a_voltage_that_no_cell_has():
    """The model's drop stands beside what was read, not behind a sum of both that is called a rest voltage."""
    time, current = np.arange(0.0, 60.0), np.full(60, 2.0 * LG_M50.capacity_ah)
    said = initial_state(LG_M50, record(time, current, np.full(60, LG_M50.upper_voltage_v - 0.05))).sentence
    drop_mv = round(1e3 * (float(re.search(r"at once at (\S+) V", said)[1]) - LG_M50.upper_voltage_v + 0.05))
    assert f"at 4.150 V, and with the {drop_mv} mV that the model drops at once" in said
    assert "at rest" not in said


def test_a_rest_as_far_above_full_as_below_leaves_the_same_doubt():
    open_circuit = OpenCircuit(LG_M50)
    below, above = (open_circuit.full_sd(open_circuit.voltage_at(1.0 + off)) for off in (-0.02, 0.02))
    assert above == pytest.approx(below, rel=1e-2)
    assert above == pytest.approx(0.01, rel=1e-2)


def _ocv() -> tuple[np.ndarray, np.ndarray]:
    soc = np.linspace(0.0, 1.0, 2001)
    return LG_M50.rest_voltage_v(soc), soc


def test_a_flat_potential_leaves_a_wider_state_of_charge_than_a_steep_one():
    steep, flat = (
        initial_state(LG_M50, resting(float(LG_M50.rest_voltage_v(soc)[0]))).sd for soc in (0.03, 0.55)
    )
    assert flat > 2.0 * steep


@pytest.mark.parametrize("current_a", [1.0, 5.0, -3.0])
def test_a_load_that_begins_with_the_record_is_no_rest(current_a):
    time = np.arange(600.0)
    run = simulate(LG_M50, time, np.full(600, current_a), soc0=0.6)
    found = initial_state(LG_M50, record(time, np.full(600, current_a), run.voltage_v), hold="linear")
    as_rest = float(np.interp(run.voltage_v[0], *_ocv()))
    assert found.basis == "load"
    assert abs(found.soc - 0.6) < min(0.01, 0.5 * abs(as_rest - 0.6))
    assert f"{current_a:g} A" in found.sentence


@pytest.mark.parametrize("current_a", [2.5, 5.0])
def test_a_load_that_has_flowed_for_long_is_seen_from_the_minutes_after(current_a):
    time = np.arange(2400.0)
    run = simulate(LG_M50, time, np.full(2400, current_a), soc0=0.9)
    cut = record(time[1200:], np.full(1200, current_a), run.voltage_v[1200:])
    found = initial_state(LG_M50, cut, hold="linear")
    assert found.soc == pytest.approx(float(run.series["soc"][1200]), abs=0.02)
    assert abs(found.soc - float(run.series["soc"][1200])) < 2.0 * found.sd


def after(cell: Cell, soc0: float, before_c: float, then_c: float, degc: float) -> tuple[Measurement, float]:
    """A record of 400 s under one current, after 200 s under another, and its true state of charge at the first row."""
    time = np.arange(600.0)
    current = cell.capacity_ah * np.where(time < 200.0, before_c, np.where(time > 400.0, 0.2, then_c))
    run = simulate(cell, time, current, soc0, (), degc, "backward")
    noise_v = 5e-4 * np.random.default_rng(0).standard_normal(400)
    cut = record(time[200:], current[200:], run.voltage_v[200:] + noise_v, np.full(400, degc))
    return cut, float(run.series["soc"][200])


@pytest.mark.parametrize("name", ["lg_m50_chen2020", "lfp_prada2013", "nca_kim2011"])
@pytest.mark.parametrize("degc", [0.0, 25.0])
@pytest.mark.parametrize(
    ("soc0", "before_c", "then_c"), [(0.95, 2.0, 0.1), (0.3, 1.0, 0.03), (0.6, -1.0, -0.03), (0.6, 1.0, -0.5)]
)
def test_a_start_under_a_small_current_was_read_as_if_it_had_not_come_after_a_large_one(
    name, degc, soc0, before_c, then_c
):
    """2C, then 0.1C: an LG M50 was read as 0.632 +/- 0.032 instead of 0.839, an LFP cell 12 deviations off."""
    cell = Cell.from_bpx(CELLS / f"{name}.bpx.json")
    cut, soc = after(cell, soc0, before_c, then_c, degc)
    found = initial_state(cell, cut)
    assert found.basis == "load"
    assert abs(found.soc - soc) < 2.0 * found.sd
    assert abs(found.soc - soc) < 0.1


@pytest.mark.parametrize("cell_is", ["colder", "warmer"])
@pytest.mark.parametrize("seed", range(3))
def test_a_drive_in_the_cold_began_with_a_full_charge_by_a_drop_of_the_model_alone(cell_is, seed):
    """At 3.06 V and 0.64 of the charge, with 1.16 V of drop by a file that was fitted at 25 degC: 1 +/- 0.008."""
    names = ["panasonic_ncr18650pf", "panasonic_ncr18650pf_25degc"][:: 1 if cell_is == "colder" else -1]
    cell, file = (Cell.from_bpx(CELLS / f"{name}.bpx.json") for name in names)
    c_rate, soc0 = (1.0, 0.7) if cell_is == "colder" else (0.5, 0.5)
    time = np.arange(900.0)
    current = cell.capacity_ah * np.repeat(np.random.default_rng(seed).normal(c_rate, 0.2, 45), 20)
    run = simulate(cell, time, current, soc0, (), -20.0, "backward", on_depletion="clip")
    found = initial_state(file, record(time[200:], current[200:], run.voltage_v[200:], np.full(700, -20.0)))
    assert found.basis == "load"
    assert abs(found.soc - float(run.series["soc"][200])) < 2.5 * found.sd


def test_a_voltage_beyond_full_was_known_to_the_least_deviation_of_any():
    open_circuit = OpenCircuit(LG_M50)
    spread_v, beyond_v = 0.3, 0.4
    soc, sd = open_circuit.reading(float(open_circuit.ocv[-1]) + beyond_v, spread_v)
    assert soc == open_circuit.soc[-1]
    assert sd == pytest.approx(
        0.5 * (soc - open_circuit.soc_at(float(open_circuit.ocv[-1]) - spread_v - beyond_v))
    )


@pytest.mark.parametrize("c_rate", [-0.05, -0.1, -0.3])
def test_a_charge_that_still_flowed_at_the_upper_cut_off_had_ended_full(c_rate):
    time = np.arange(0.0, 1200.0, 10.0)
    current = np.full(len(time), c_rate * LG_M50.capacity_ah)
    run = simulate(LG_M50, time, current, 0.97, (), hold="backward")
    cut = record(time[30:], current[30:], run.voltage_v[30:])
    found, soc = initial_state(LG_M50, cut), float(run.series["soc"][30])
    assert found.basis == "load"
    assert abs(found.soc - soc) < 2.0 * found.sd


@pytest.mark.parametrize("soc0", [1.05, 1.07])
def test_a_charge_beyond_full_is_read_as_far_as_the_potentials_reach(soc0):
    cell = Cell.from_bpx(CELLS / "panasonic_ncr18650pf.bpx.json")
    time = np.arange(0.0, 600.0, 10.0)
    current = np.full(len(time), -0.2 * cell.capacity_ah)
    run = simulate(cell, time, current, soc0, (), -10.0, "backward", on_depletion="clip")
    found = initial_state(cell, record(time, current, run.voltage_v, np.full(len(time), -10.0)))
    assert found.basis == "load"
    assert abs(found.soc - soc0) < 2.0 * found.sd


def test_a_full_charge_under_load_is_as_uncertain_as_the_drop():
    open_circuit = OpenCircuit(LG_M50)
    full_v = open_circuit.voltage_at(1.0)
    assert open_circuit.full_sd(full_v, 0.03) > 1.5 * open_circuit.full_sd(full_v)


def test_records_cut_from_a_drive_are_as_far_off_as_they_claim():
    off = []
    for at in range(100, 2800, 60):
        cut, soc = cut_from_a_drive(at)
        found = initial_state(LG_M50, cut)
        off.append(abs(found.soc - soc) / found.sd)
    assert np.mean(np.array(off) < 2.0) >= 0.9  # 95 % of a normal deviation


def test_the_temperature_of_the_record_moves_the_reading_of_a_potential_with_entropy(nmc):
    voltage = float(nmc.rest_voltage_v(0.5)[0])
    at_reference = initial_state(nmc, resting(voltage, temperature_degc=25.0)).soc
    cold = initial_state(nmc, resting(voltage, temperature_degc=-10.0)).soc
    assert at_reference == pytest.approx(0.5, abs=5e-4)
    assert abs(cold - at_reference) > 1e-3


def test_a_reading_is_as_uncertain_as_the_potentials_of_the_file():
    data = resting(float(LG_M50.rest_voltage_v(0.5)[0]))
    good, usual = (initial_state(LG_M50, data, potentials_v=v) for v in (3e-3, READING_V))
    slope_v = float(np.diff(LG_M50.rest_voltage_v(np.array([0.49, 0.51])))[0]) / 0.02
    assert good.soc == usual.soc == pytest.approx(0.5, abs=5e-4)
    # Beside how far the rest may still relax, which is the same in both.
    more = np.sqrt(usual.sd**2 - good.sd**2)
    assert more == pytest.approx(np.sqrt(READING_V**2 - 3e-3**2) / slope_v, rel=0.15)
    assert good.sd > 3e-3 / slope_v
    assert usual.read_sd == usual.sd
    assert initial_state(LG_M50, data, 0.5).read_sd == 0.0
    full = resting(LG_M50.upper_voltage_v - 0.01)
    assert (initial_state(LG_M50, full).basis, initial_state(LG_M50, full).read_sd) == ("full charge", 0.0)


def test_a_given_state_of_charge_is_believed_for_one_record_and_checked_for_several():
    data = resting(float(LG_M50.rest_voltage_v(0.4)[0]))
    alone, one_of_many = initial_state(LG_M50, data, 0.9), initial_state(LG_M50, data, 0.9, shared=True)
    assert (alone.soc, alone.basis, alone.contradicted) == (0.9, "given", True)
    assert one_of_many.soc == pytest.approx(0.4, abs=5e-3)
    assert "contradicts" in one_of_many.sentence
    assert initial_state(LG_M50, data, 0.41, shared=True).basis == "given"


def test_what_is_known_of_one_record_goes_before_what_is_given_for_several():
    data = resting(float(LG_M50.rest_voltage_v(0.4)[0])).begun_at(0.7)
    for given_for_all in (None, 0.9, 0.41):
        found = initial_state(LG_M50, data, given_for_all, shared=True)
        assert (found.soc, found.basis) == (0.7, "given"), given_for_all
    assert initial_state(LG_M50, data, 0.9).soc == 0.9
    assert initial_state(LG_M50, data.take(slice(1, None))).soc == pytest.approx(0.4, abs=5e-3)


def test_a_given_state_of_several_records_was_not_believed_where_the_charge_leaves_no_other():
    """A full discharge behind the drop of leads, which the first voltages take for a cell that is half empty."""
    time = np.arange(0.0, 3240.0, 10.0)
    current = np.full(len(time), 5.0)
    voltage = simulate(LG_M50, time, current, soc0=1.0).voltage_v - 0.08 * current
    data = record(time, current, voltage)
    assert initial_state(LG_M50, data).soc < 0.7
    found = initial_state(LG_M50, data, 1.0, shared=True)
    assert (found.basis, found.soc, found.contradicted) == ("given", 1.0, True)
    assert "rather says" in found.sentence
    short = initial_state(LG_M50, data.take(slice(0, 60)), 1.0, shared=True)
    assert short.basis == "load"
    # The one that was given is for all records, and not believed for this one.
    assert "--soc0" not in short.sentence


def test_a_given_state_that_the_first_seconds_under_load_speak_against_was_taken_without_a_word():
    data, _ = cut_from_a_drive(1000)
    read = initial_state(LG_M50, data)
    assert read.basis == "load"
    given_soc = read.soc - 4.2 * read.sd
    assert 0.05 < read.soc - given_soc < 0.15
    far = initial_state(LG_M50, data, given_soc)
    assert (far.soc, far.basis, far.contradicted, far.doubted) == (given_soc, "given", False, True)
    assert (
        f"as given; its first voltage ({data.voltage_v[0]:.3f} V) rather says {read.soc:.3f} +/- "
        in far.sentence
    )
    near = initial_state(LG_M50, data, read.soc - 3.8 * read.sd)
    assert (near.contradicted, near.doubted) == (False, False)
    assert "rather says" not in near.sentence
    assert initial_state(LG_M50, data, given_soc, shared=True).basis == "given"


def test_a_start_under_load_was_told_as_if_the_model_knew_the_current_before_it():
    data, soc = cut_from_a_drive(1000)
    off_mv = 1e3 * (
        data.voltage_v - simulate(LG_M50, data.time_s, data.current_a, soc, hold="backward").voltage_v
    )
    assert np.abs(off_mv[:60]).max() > 10.0 > np.abs(off_mv[-60:]).max()
    for given_soc in (None, soc):
        start = initial_state(LG_M50, data, given_soc)
        assert start.flowed
        assert "the model begins at rest: if so, its first minutes are off" in start.sentence
    begun = data.time_s < 900.0
    new_v = simulate(LG_M50, data.time_s, np.full(len(begun), 2.5), soc, hold="backward").voltage_v
    new = initial_state(LG_M50, record(data.time_s, np.full(len(begun), 2.5), new_v).take(begun))
    assert not new.flowed
    assert "as if no current had flowed before" in new.sentence


def test_a_given_state_on_a_flat_potential_is_not_contradicted_by_what_two_deviations_of_the_voltage_span():
    lfp = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    data = resting(float(lfp.rest_voltage_v(0.9)[0]) + 2.0 * READING_V)  # where it is steep
    read = initial_state(lfp, data)
    assert read.soc - 0.88 > 0.05 + 2.0 * read.sd
    found = initial_state(lfp, data, 0.88, shared=True)
    assert (found.basis, found.soc, found.contradicted) == ("given", 0.88, False)
    assert initial_state(lfp, data, 0.5, shared=True).basis == "rest"


def test_an_instrument_fault_is_taken_off_the_reading():
    offset = CATALOGUE["voltage_sensor_offset"].activate(offset_v=0.02)
    found = initial_state(LG_M50, resting(float(LG_M50.rest_voltage_v(0.5)[0]) + 0.02), effects=[offset])
    assert found.soc == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("voltage_v", [2.46, 3.7, 4.16, 4.17, 4.18, 4.21, 4.24, 4.5])
@pytest.mark.parametrize("offset_v", [0.0, 0.02])
def test_a_rest_voltage_had_another_rule_in_a_simulation(voltage_v, offset_v):
    """4.21 V were 1.0053 to one and 1 to the other, 4.24 V an error and 1, 2.46 V an error and empty."""
    effects = [CATALOGUE["voltage_sensor_offset"].activate(offset_v=offset_v)]

    def simulated(rest_v: float) -> float:
        run = simulate(LG_M50, np.arange(3.0), np.zeros(3), None, effects, rest_voltage_v=rest_v)
        return float(run.series["soc"][0])

    if voltage_v == 4.5:
        for refused in (simulated, lambda v: initial_state(LG_M50, resting(v), effects=effects)):
            with pytest.raises(DataError, match="lies outside"):
                refused(voltage_v + offset_v)
        return
    read = initial_state(LG_M50, resting(voltage_v + offset_v), effects=effects)
    assert simulated(voltage_v + offset_v) == pytest.approx(read.soc, abs=1e-4)
    assert (read.soc == 1.0) == (voltage_v >= 4.17)


@pytest.mark.parametrize("flowed_s", [30, 600])
@pytest.mark.parametrize("current_a", [7.0, -5.0])
@pytest.mark.parametrize("stopped_s", [1, 15, 120])
def test_a_rest_after_a_current_that_nobody_saw_is_read_as_what_it_relaxes_to(flowed_s, current_a, stopped_s):
    time = np.arange(flowed_s + stopped_s + 61.0)
    current = np.where(time <= flowed_s, current_a, 0.0)
    run = simulate(
        LG_M50, time, current, soc0=0.55, hold="backward", model="dfn"
    )  # another model than reads it
    start = flowed_s + stopped_s
    cut = record(time[start:] - time[start], current[start:], run.voltage_v[start:])
    found, soc = initial_state(LG_M50, cut), float(run.series["soc"][-1])
    as_it_stands = float(np.interp(run.voltage_v[-1], *_ocv()))
    assert abs(found.soc - soc) < 2.0 * found.sd
    assert abs(found.soc - soc) < max(abs(as_it_stands - soc), 2e-3)
    if abs(found.rest_voltage_v - cut.voltage_v[-15:].mean()) > READING_V:
        assert "relaxing to" in found.sentence


@pytest.mark.parametrize("layer_f_m2", [0.2, 10.0])
def test_the_charge_of_double_layers_made_nothing_known_of_a_full_cell_at_rest(layer_f_m2):
    lfp = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    layered = lfp.with_negative(double_layer_f_m2=layer_f_m2).with_positive(double_layer_f_m2=layer_f_m2)
    data = resting(float(lfp.rest_voltage_v(0.97)[0]))
    found, plain = initial_state(layered, data), initial_state(lfp, data)
    assert found.basis == "rest"
    assert found.soc == pytest.approx(plain.soc, abs=1e-3)
    assert found.sd == pytest.approx(plain.sd, rel=0.1)


def slow(soc: float, c_rate: float, hours: float, step_s: float) -> Measurement:
    """At one current below that of a load, from equilibrium; it ends before full or empty."""
    hours = min(hours, 0.99 * (soc if c_rate > 0.0 else 1.0 - soc) / abs(c_rate))
    time = np.arange(0.0, hours * SECONDS_PER_HOUR, step_s)
    current = np.full(len(time), c_rate * LG_M50.capacity_ah)
    return record(time, current, simulate(LG_M50, time, current, soc, hold="backward").voltage_v)


@pytest.mark.parametrize(("hours", "step_s"), [(1.0, 10.0), (8.0, 10.0), (45.0, 60.0), (45.0, 600.0)])
@pytest.mark.parametrize("c_rate", [1 / 50, -1 / 50, 1 / 55, -1 / 55])
@pytest.mark.parametrize("soc", [0.02, 0.5, 0.97])
def test_hours_of_a_slow_current_were_read_as_one_rest_that_relaxes(soc, c_rate, hours, step_s):
    found = initial_state(LG_M50, slow(soc, c_rate, hours, step_s))  # from 0.97 it was 1.36 +/- 0.004
    assert found.basis == "rest"
    assert abs(found.soc - soc) < min(2.0 * found.sd, 0.01)
    assert found.off(soc) == 0.0
    if step_s == 600.0:  # its first row alone is as if it were the record
        assert found.soc == initial_state(LG_M50, slow(soc, c_rate, hours, step_s).take(slice(0, 1))).soc


def test_a_rest_on_which_a_testers_zero_is_read_stays_that_rest():
    """0.1 % of a range of 1C, as `calibration.records.zero` takes for usual, moves what a rest may in half an hour."""
    time = np.arange(0.0, 12.0 * SECONDS_PER_HOUR, 30.0)
    after = simulate(LG_M50, time, np.where(time < 1200.0, 2.5, 0.0), 0.6, hold="backward")
    rests = time >= 1200.0
    zero_current = record(time[rests], np.zeros(rests.sum()), after.voltage_v[rests])
    true, offset_a = float(after.series["soc"][-1]), 1e-3 * LG_M50.capacity_ah
    plain, off = (
        initial_state(LG_M50, replace(zero_current, current_a=zero_current.current_a + a))
        for a in (0, offset_a)
    )
    assert plain.soc == pytest.approx(true, abs=2e-3)
    assert off.soc == pytest.approx(true, abs=2e-3)
    assert off.sd < 1.5 * plain.sd


@pytest.mark.parametrize("c_rate", [1 / 50, -1 / 50])
def test_the_rest_voltage_and_the_ends_were_those_of_the_last_row_of_a_rest(c_rate):
    """Where the cell is steep, what a rest moves is three deviations of a voltage."""
    found = initial_state(LG_M50, slow(0.01, c_rate, 1.0, 10.0).take(slice(0, 10)))
    assert found.soc == pytest.approx(float(np.interp(found.rest_voltage_v, *_ocv())), abs=2e-5)
    low, high = found.ends
    assert found.soc - low == pytest.approx(high - found.soc, rel=0.1)


def test_a_current_too_small_for_a_load_widens_what_is_read_once_it_has_moved_charge():
    data = slow(0.5, 1 / 50, 1.0, 10.0)
    short, long = (initial_state(LG_M50, d, potentials_v=3e-3) for d in (data.take(slice(0, 9)), data))
    assert short.soc == pytest.approx(long.soc, abs=1e-3)
    assert long.sd > 1.5 * short.sd  # its drop at C/50, 6 mV in the end, beside 3 of a potential


def test_a_rest_on_a_flat_potential_asks_for_the_state_of_charge():
    lfp = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    flat, steep = (initial_state(lfp, resting(float(lfp.rest_voltage_v(soc)[0]))) for soc in (0.5, 0.02))
    assert (flat.sd > 0.05) == flat.sentence.endswith("; give --soc0 if it is known.")
    assert flat.sd > 0.05 > steep.sd
    assert "--soc0" not in steep.sentence


def test_one_of_several_records_asks_for_its_own_state_of_charge():
    """It asked for `--soc0`, which is for all of them."""
    lfp = Cell.from_bpx(CELLS / "lfp_prada2013.bpx.json")
    flat = initial_state(lfp, resting(float(lfp.rest_voltage_v(0.5)[0])), shared=True)
    assert flat.sentence.endswith("; give --soc0 FILE=SOC if it is known.")
    for unreadable in (resting(4.6), resting(np.nan)):
        with pytest.raises(DataError, match=r"give --soc0 FILE=SOC\.$"):
            initial_state(lfp, unreadable, shared=True)
        with pytest.raises(DataError, match=r"give --soc0\.$"):
            initial_state(lfp, unreadable)


def test_a_rest_is_read_as_it_is_where_it_does_not_move():
    data = resting(3.7, rows=60)
    moving = replace(data, voltage_v=3.7 - 0.02 * np.exp(-np.arange(60.0) / 20.0))
    still, drifting = initial_state(LG_M50, data), initial_state(LG_M50, moving)
    assert "relaxing" not in still.sentence
    assert still.rest_voltage_v == pytest.approx(3.7, abs=1e-4)
    assert "relaxing to" in drifting.sentence
    assert drifting.rest_voltage_v > moving.voltage_v[-1] + GOOD_READING_V


def rest_after(cell: Cell, c_rate: float, rest_s: float, step_s: float = 1.0, degc: float = 25.0):
    """A record that begins with a rest, 20 minutes of a current before it, and its true state of charge."""
    loaded = np.arange(0.0, 1200.0)
    time = np.concatenate([loaded, loaded[-1] + np.arange(step_s, rest_s + 0.5 * step_s, step_s)])
    current = np.where(np.arange(len(time)) < len(loaded), c_rate * cell.capacity_ah, 0.0)
    temperature = np.full(len(time), degc)
    run = simulate(cell, time, current, 0.8, temperature_degc=temperature, hold="backward")
    rests = slice(len(loaded), None)
    cut = record(time[rests] - time[rests][0], current[rests], run.voltage_v[rests], temperature[rests])
    return cut, float(run.series["soc"][-1])


@pytest.mark.parametrize("rows", [1, 2, 3, 5, 7, 8])
@pytest.mark.parametrize("step_s", [1.0, 10.0, 60.0])
def test_a_rest_of_some_rows_after_a_load_was_read_as_one_that_had_settled(rows, step_s):
    cut, soc = rest_after(LG_M50, 0.8, rows * step_s, step_s)
    assert len(cut) == rows
    as_it_stands = float(np.interp(cut.voltage_v.mean(), *_ocv()))
    found = initial_state(LG_M50, cut)
    assert abs(found.soc - soc) < 2.0 * found.sd
    assert rows == 1 or abs(found.soc - soc) < 0.6 * abs(as_it_stands - soc)


def test_one_row_of_rest_says_less_than_some_and_those_less_than_a_minute():
    sds = [initial_state(LG_M50, rest_after(LG_M50, 0.8, rest_s)[0]).sd for rest_s in (1, 3, 8, 60)]
    assert sds == sorted(sds, reverse=True)
    assert sds[0] > 0.05


def test_a_long_rest_is_known_as_well_by_few_rows_as_by_many():
    """Time is what a rest says, not how often it was written down."""
    volts = float(LG_M50.rest_voltage_v(0.5)[0])
    few = initial_state(LG_M50, replace(resting(volts, rows=5), time_s=600.0 * np.arange(5)))
    many = initial_state(LG_M50, resting(volts, rows=2400))
    assert few.soc == pytest.approx(many.soc, abs=1e-4)
    assert few.sd == pytest.approx(many.sd, rel=0.05)


@pytest.mark.parametrize("rest_s", [100, 300, 600])
@pytest.mark.parametrize("degc", [0.0, -10.0])
@pytest.mark.parametrize("name", ["panasonic_ncr18650pf", "lg_18650hg2", "lg_18650hg2_cold"])
def test_in_the_cold_a_rest_was_read_many_of_its_deviations_off(name, degc, rest_s):
    """32 of them, and 24 points of charge: what a large current leaves there has another shape than what a small one
    does."""
    cell = Cell.from_bpx(CELLS / f"{name}.bpx.json")
    cut, soc = rest_after(cell, 0.9, rest_s, degc=degc)
    found = initial_state(cell, cut)
    assert abs(found.soc - soc) < 2.5 * found.sd


def test_a_rest_of_a_fast_logger_was_read_by_its_first_minutes():
    cell = Cell.from_bpx(CELLS / "panasonic_ncr18650pf.bpx.json")
    (fast, soc), (slow_rows, _) = (rest_after(cell, 0.9, 3600, step_s, -10.0) for step_s in (0.1, 1.0))
    assert initial_state(cell, fast).soc == pytest.approx(initial_state(cell, slow_rows).soc, abs=2e-3)
    assert initial_state(cell, fast).soc == pytest.approx(soc, abs=0.01)


def test_a_drive_cut_in_the_cold_was_a_full_charge_by_the_drop_of_another_file():
    """At 3.06 V and 64 % of charge, by 1.2 V of drop: 1 +/- 0.008."""
    true, other = (
        Cell.from_bpx(CELLS / f"panasonic_ncr18650pf{suffix}.bpx.json") for suffix in ("", "_25degc")
    )
    time = np.arange(0.0, 600.0)
    current, degc = np.full(600, true.capacity_ah), np.full(600, -20.0)
    run = simulate(true, time, current, 0.7, temperature_degc=degc, hold="backward")
    cut = record(time[200:] - 200.0, current[200:], run.voltage_v[200:], degc[200:])
    found = initial_state(other, cut)
    assert found.basis == "load"
    assert abs(found.soc - float(run.series["soc"][200])) < 2.5 * found.sd


def test_a_charge_that_still_flows_at_the_upper_cut_off_was_a_full_one():
    """C/13 of a constant-voltage phase brings 1.3 % yet, and was read as 1 +/- 0.004."""
    cell = Cell.from_bpx(CELLS / "panasonic_ncr18650pf.bpx.json")
    time = np.arange(0.0, 60.0)
    current = np.full(60, -cell.capacity_ah / 13.0)
    charging = record(time, current, np.full(60, cell.upper_voltage_v))
    assert initial_state(cell, charging).basis == "load"
    assert initial_state(cell, replace(charging, current_a=0.01 * current)).basis == "full charge"


def test_a_voltage_beyond_full_was_known_to_the_least_of_all_deviations():
    open_circuit, spread_v = OpenCircuit(LG_M50), 0.08
    end_v = float(open_circuit.ocv[-1])
    sds = [open_circuit.reading(end_v + beyond_v, spread_v)[1] for beyond_v in (0.0, 0.01, 0.02)]
    assert sds == sorted(sds)
    assert sds[-1] > 1.2 * sds[0]
    reached = open_circuit.soc_at(end_v - spread_v - 0.02)
    assert sds[-1] == pytest.approx(0.5 * (open_circuit.soc[-1] - reached))


def test_a_voltage_of_another_cell_is_refused():
    with pytest.raises(DataError, match=r"2\.5"):
        initial_state(LG_M50, resting(1.9))


def test_a_potential_that_ends_within_the_range_was_told_as_a_voltage_between_two_that_are_no_number():
    potential = LG_M50.negative.ocp.text + " + 0.0 * sqrt(x - 0.02)"
    cell = LG_M50.with_negative(ocp=Expression(potential))
    assert cell.negative.theta_min > 0.02
    with pytest.raises(
        CellError, match="by its potentials the open-circuit voltage is not finite at a state of"
    ):
        simulate(cell, [0.0, 1.0], [0.0, 0.0], rest_voltage_v=3.7)


def test_no_voltage_and_nothing_given_is_refused():
    with pytest.raises(DataError, match="--soc0"):
        initial_state(LG_M50, resting(np.nan))
    assert initial_state(LG_M50, resting(np.nan), 0.7).soc == 0.7


@pytest.mark.parametrize("current_a", [0.0, 2.0])
def test_a_voltage_that_is_not_known_further_on_made_a_start_that_is_no_number(current_a):
    time, current = np.arange(100.0), np.full(100, current_a)
    voltage = simulate(LG_M50, time, current, 0.6, hold="backward").voltage_v
    whole = initial_state(LG_M50, record(time[:40], current[:40], voltage[:40]))
    found = initial_state(LG_M50, record(time, current, np.where(time < 40.0, voltage, np.nan)))
    assert (found.soc, found.sd, found.basis) == (whole.soc, whole.sd, whole.basis)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"hold": "zoh"}, "hold = 'zoh' is not known; give 'linear' or 'backward'"),
        ({"model": "spm"}, "model = 'spm' is not known; give 'espm' or 'dfn'"),
        ({"effects": "clock_skew"}, "effects is the text 'clock_skew'; give a list of them"),
        ({"effects": [CATALOGUE["clock_skew"]]}, "which has no values yet"),
    ],
)
def test_an_unknown_hold_was_taken_for_straight_lines_and_an_effect_without_values_for_one(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        initial_state(LG_M50, resting(3.7), **changes)


@pytest.mark.parametrize("soc0", [np.nan, 50.0])
def test_a_start_that_is_no_state_of_charge_was_taken_as_given(soc0):
    with pytest.raises(InputError, match="is not a state of charge"):
        initial_state(LG_M50, resting(3.7), soc0)


@pytest.mark.parametrize("low_soc_excess", [0.0, 0.5])
def test_an_effect_in_series_was_taken_for_open_circuit_voltage_at_rest(low_soc_excess):
    effects = [
        CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.03, start=1.0, low_soc_excess=low_soc_excess)
    ]
    run = simulate(LG_M50, [0.0, 1.0], [0.0, 0.0], effects=effects, rest_voltage_v=3.7)
    assert run.voltage_v[0] == pytest.approx(3.7, abs=1e-6)
    found = initial_state(LG_M50, resting(3.7), effects=effects)
    assert found.soc == pytest.approx(float(run.series["soc"][0]), abs=1e-9)


def test_an_effect_in_series_was_taken_for_a_drop_of_the_load():
    effects = [CATALOGUE["ocv_hysteresis"].activate(magnitude_v=-0.03, rate=1.0, start=1.0)]
    time, current = np.arange(60.0), np.full(60, 5.0)
    run = simulate(LG_M50, time, current, 0.6, effects)
    found = initial_state(LG_M50, record(time, current, run.voltage_v), effects=effects)
    assert (found.basis, found.soc) == ("load", pytest.approx(0.6, abs=0.005))


ON_RECORD = {
    "current_sensor_offset": {"offset_a": 0.3},
    "current_sensor_gain": {"gain": 1.2},
    "clock_skew": {"skew": 0.1, "lag_s": 2.0},
    "leakage_current": {"leakage_a": 0.3},
}


@pytest.mark.parametrize("name", [name for name, effect in CATALOGUE.items() if effect.on_record is not None])
@pytest.mark.parametrize("rests_s", [0.0, 300.0])
def test_a_start_was_read_by_the_current_as_it_was_written_where_the_cell_is_known_to_have_seen_another(
    name, rests_s
):
    """Of 5 Ah at rest, 0.3 A of a sensor's offset made a load, and 28.6 mV of the drive after it."""
    effects = [CATALOGUE[name].activate(**ON_RECORD[name])]
    time = np.arange(1200.0)
    written = np.where(time < rests_s, 0.3 if name == "current_sensor_offset" else 0.0, 5.0)
    run = simulate(LG_M50, time, written, 0.9, effects, hold="backward")
    saw = as_cell_saw(Record(time, written), effects).beside_voltage(True)
    found = initial_state(LG_M50, record(time, written, run.voltage_v), effects=effects)
    seen = initial_state(LG_M50, record(saw.time_s, saw.current_a, run.voltage_v))
    assert replace(found, sentence=seen.sentence) == seen
    told = found.basis == "load" and saw.current_a[0] != written[0]
    assert (f"({written[0]:.3g} A as written)" in found.sentence) == told
    assert abs(found.soc - 0.9) < found.sd
    assert found.basis == ("rest" if rests_s and name != "leakage_current" else "load")


def test_a_start_was_read_with_effects_on_the_current_in_another_order_than_it_is_simulated():
    gain, leak = (
        CATALOGUE[name].activate(**ON_RECORD[name]) for name in ("current_sensor_gain", "leakage_current")
    )
    time, current = np.arange(600.0), np.full(600, 5.0)
    data = record(
        time, current, simulate(LG_M50, time, current, 0.6, [gain, leak], hold="backward").voltage_v
    )
    assert initial_state(LG_M50, data, effects=[leak, gain]) == initial_state(
        LG_M50, data, effects=[gain, leak]
    )


def test_a_temperature_that_an_effect_sets_right_is_the_one_a_start_is_read_at():
    cold = Effect(
        "too_warm", "instrument", "", on_record=lambda r: replace(r, temperature_k=r.temperature_k - 30.0)
    )
    nmc = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    current = np.full(20, 10.0)
    written, true = (
        record(np.arange(20.0), current, np.full(20, 3.6), np.full(20, degc)) for degc in (25.0, -5.0)
    )
    assert initial_state(nmc, written, effects=[cold.activate()]).soc == pytest.approx(
        initial_state(nmc, true).soc
    )


@pytest.mark.parametrize("lag_s", [-2.0, -0.3, 0.4])
def test_a_lag_made_charge_of_the_long_rows_before_a_load(lag_s):
    """Rows of a minute at rest and of a second under load: a row that began to be loaded was loaded all along."""
    lag = [CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=lag_s)]
    time = np.concatenate(
        [60.0 * np.arange(10.0), 540.0 + np.arange(1.0, 61.0), 600.0 + 60.0 * np.arange(1.0, 5.0)]
    )
    current = np.where((time > 540.0) & (time <= 600.0), 5.0, 0.0)
    seen = as_cell_saw(Record(time, current), lag).beside_voltage(True)
    moved = record(seen.time_s, seen.current_a, np.full(len(time), 3.7)).discharged_ah("backward")
    assert moved[-1] == pytest.approx(5.0 / 60.0)
    dense = (time > 545.0) & (time < 595.0)
    assert np.all(seen.current_a[dense] == 5.0)


def test_a_voltage_lost_before_the_end_leaves_what_the_cell_saw_until_then():
    """A voltage that is read 5 s early has the current of 5 s later, also beside its last row."""
    early = [CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=-5.0)]
    time = np.arange(100.0)
    current = np.where(time < 43.0, 0.0, 5.0)
    voltage = simulate(LG_M50, time, current, 0.6, early, hold="backward").voltage_v
    saw = as_cell_saw(Record(time, current), early).beside_voltage(True)
    found = initial_state(
        LG_M50, record(time, current, np.where(time < 40.0, voltage, np.nan)), effects=early
    )
    seen = record(saw.time_s[:40], saw.current_a[:40], voltage[:40])
    assert found == initial_state(LG_M50, seen)


@pytest.mark.parametrize("rows", [1, 3, 7])
def test_a_few_rows_of_rest_before_a_load_left_doubts_of_a_tenth_and_more(rows):
    rng = np.random.default_rng(3)
    time_s = np.arange(0.0, 3000.0)
    current_a = np.repeat(rng.normal(3.0, 4.0, 100), 30).clip(-5.0, 12.0)
    current_a[1500 : 1500 + rows] = 0.0
    run = simulate(LG_M50, time_s, current_a, soc0=0.9, hold="backward")
    voltage_v = run.voltage_v + 5e-4 * rng.standard_normal(len(time_s))
    stop = record(time_s, current_a, voltage_v).take(slice(1500, None))
    found = initial_state(LG_M50, stop, hold="backward")
    truth = float(run.series["soc"][1500])
    assert abs(found.soc - truth) < min(2.0 * found.sd, 0.02)
    assert found.sd < 0.03
    assert "too briefly to read the state from that alone" in found.sentence


def test_a_third_of_the_uncertainty_was_told_without_a_word_where_the_potentials_are_fitted():
    """The user of a simulation took the smaller one for that of its start."""
    at_rest = resting(float(LG_M50.rest_voltage_v(0.5)[0]))
    told = {v: initial_state(LG_M50, at_rest, potentials_v=v).sentence for v in (READING_V, GOOD_READING_V)}
    assert told[GOOD_READING_V].endswith(" by potentials that are fitted with it.")
    assert "potentials" not in told[READING_V]


@pytest.mark.parametrize(
    "effect",
    [
        CATALOGUE["lithium_inventory_loss"].activate(loss=0.15),
        CATALOGUE["active_material_loss_positive"].activate(loss=0.2),
        CATALOGUE["active_material_loss_negative"].activate(loss=0.2, lost_at_soc=0.0),
    ],
    ids=lambda effect: effect.id,
)
@pytest.mark.parametrize("rest_s", [0.0, 600.0])
@pytest.mark.parametrize("soc", [0.3, 0.9])
def test_a_sentence_told_the_state_of_an_aged_cell_in_windows_that_soc0_is_not_of(effect, rest_s, soc):
    """Of a cell whose positive electrode had lost a fifth it said 0.3875, and given that, a simulation starts there."""
    time = np.arange(0.0, rest_s + 300.0, 5.0)
    run = simulate(LG_M50, time, np.where(time < rest_s, 0.0, 2.0), soc, [effect], hold="backward")
    found = initial_state(LG_M50, record(time, run.current_a, run.voltage_v), effects=[effect])
    told = float(re.search(r"state of charge ([\d.]+) ", found.sentence)[1])
    assert told == pytest.approx(found.soc, abs=5.1e-4)


def _reading(fault):
    return Effect("fault", "instrument", "A fault of the voltmeter.", on_reading=fault).activate()


@pytest.mark.parametrize(
    "fault",
    [
        lambda trace: 1.03 * trace.voltage_v,
        lambda trace: trace.voltage_v - 0.02 * trace.current_a,
        lambda trace: trace.voltage_v + 1e-3 * (trace.series["temperature_k"] - 298.15),
        lambda trace: trace.voltage_v + 0.1 * trace.series["hysteresis"],
    ],
    ids=["gain", "leads", "drift with temperature", "a state of another effect"],
)
@pytest.mark.parametrize("rest_s", [0.0, 300.0])
def test_a_fault_of_the_voltmeter_other_than_an_offset_moved_the_start_or_had_no_states(fault, rest_s):
    """A gain of 3 % left 4 mV, leads under 3 A six points of charge, and a state raised KeyError."""
    time = np.arange(0.0, rest_s + 120.0)
    effects = [CATALOGUE["ocv_hysteresis"].activate(start=-1.0)]
    true, faulty = (
        simulate(LG_M50, time, np.where(time < rest_s, 0.0, 3.0), 0.6, active, 35.0, "backward").voltage_v
        for active in (effects, [*effects, _reading(fault)])
    )
    current, degc = np.where(time < rest_s, 0.0, 3.0), np.full(len(time), 35.0)
    known = initial_state(LG_M50, record(time, current, true, degc), effects=effects)
    found = initial_state(LG_M50, record(time, current, faulty, degc), effects=[*effects, _reading(fault)])
    # A gain also stretches what the voltage changes by over the first minutes.
    assert found.soc == pytest.approx(known.soc, abs=1e-4 if rest_s else 3e-3)
    if rest_s:
        rest_v = float(faulty[0])
        run = simulate(
            LG_M50, time[:2], np.zeros(2), effects=[*effects, _reading(fault)], temperature_degc=35.0,
            rest_voltage_v=rest_v,
        )  # fmt: skip
        assert run.voltage_v[0] == pytest.approx(rest_v, abs=1e-5)


@pytest.mark.parametrize("share", [0.85, 0.7])
def test_the_charge_of_a_larger_cell_was_held_against_the_capacity_of_its_file(share):
    """Coatings a fifth thicker hold a fifth more: by the file's capacity 0.85 was read as 0.960 +/- 0.059."""
    effect = CATALOGUE["electrode_thickness"].activate(negative_factor=1.2, positive_factor=1.2)
    larger = folded(LFP, [effect]).cell
    assert larger.capacity_ah == pytest.approx(1.2 * LFP.capacity_ah)
    time = np.arange(0.0, 4.0 * SECONDS_PER_HOUR * (share - 0.02), 60.0)
    run = simulate(larger, time, np.full(len(time), 0.25 * larger.capacity_ah), share, hold="backward")
    data = record(time, run.current_a, run.voltage_v)
    found, by_its_file = initial_state(LFP, data, effects=[effect]), initial_state(larger, data)
    assert found.sentence == by_its_file.sentence
    assert found.soc == pytest.approx(by_its_file.soc, abs=1e-6)
    assert abs(found.soc - share) < 0.5 * found.sd
