"""Records of two cells in one run are told by what a full discharge takes, and those of one cell never."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.calibration import Conditions
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.sizes import aged_sentence, capacity_test_ah, charged_share, sizes_sentence
from aesi.errors import DataError
from aesi.physics import Cell, InitialState, initial_state, simulate
from aesi.pipeline.calibrate import start_at_size
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.experiment.config import parse_experiment
from aesi.pipeline.experiment.load import _on_grid
from aesi.pipeline.experiment.sources import Sources
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.simulation import ProfileRequest, simulate_file
from aesi.records import Measurement

FILE = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"


@pytest.fixture(scope="module")
def m50():
    return Cell.from_bpx(FILE)


def discharge(cell, name, charge_ah, c_rate, degc=None, n=400):
    """A full discharge along the open-circuit voltage, from full to empty."""
    time_s = np.linspace(0.0, 3600.0 / c_rate, n)
    soc = np.linspace(1.0, 0.0, n)
    current_a = np.full(n, charge_ah * c_rate)
    voltage_v = cell.rest_voltage_v(soc) - 0.02 * c_rate
    measured = None if degc is None else np.full(n, degc)
    return Measurement(time_s, current_a, voltage_v, measured, name)


def test_a_cell_of_half_the_size_beside_another_passed_without_a_word(m50):
    large = discharge(m50, "large", 4.9, 0.05)
    small = discharge(m50, "small", 2.75, 1.0, 24.0)
    assert sizes_sentence(m50, [large, small]) == (
        "small: a full discharge takes 2.75 Ah, and one in large takes 4.9: the record is of another cell, or the cell "
        "had lost 44 % of its capacity by then."
    )
    case = Case(FILE, (small, discharge(m50, "smaller", 2.7, 0.05)))
    told = [note for note in case.assumed if "full discharge" in note]
    assert told == [
        f"small and smaller: a full discharge takes 2.75 and 2.7 Ah, and the file of {m50.name} has 5.15: the records "
        "are of another cell, or the cell had lost 48 % of its capacity by then."
    ]
    assert not [
        note for note in replace(case, soh=0.55).assumed if "full discharge" in note
    ]  # as was declared


@pytest.mark.parametrize(
    ("c_rate", "degc", "counts"),
    [
        (0.05, None, True),
        (0.05, 23.0, True),
        (1.0, 23.0, True),
        (1.0, None, False),  # it may have been cold
        (1.0, -10.0, False),
        (0.05, -10.0, False),
        (3.0, 23.0, False),  # its load ends it early
    ],
)
def test_a_discharge_in_the_cold_or_under_a_high_load_tells_no_size(m50, c_rate, degc, counts):
    record = discharge(m50, "one", 2.7, c_rate, degc)
    charge_ah = capacity_test_ah(m50, record)
    assert (charge_ah is not None) == counts
    if counts:
        assert charge_ah == pytest.approx(2.7, rel=0.02)
    assert bool(sizes_sentence(m50, [record], m50.capacity_ah)) == counts


def test_a_part_of_a_discharge_and_an_aged_cell_are_not_noted(m50):
    whole = discharge(m50, "whole", 5.0, 0.05)
    part = discharge(m50, "part", 5.0, 0.05).take(slice(0, 200))
    aged = discharge(m50, "aged", 4.0, 0.05)
    assert sizes_sentence(m50, [whole, replace(part, name="part"), aged], m50.capacity_ah) == ""


def rested(record):
    """The record with a first row at rest, by which a full cell is known."""
    return replace(record, current_a=np.concatenate([[0.0], record.current_a[1:]]))


def test_an_aged_cell_was_no_reason_to_point_to_its_state_of_health(m50):
    aged = rested(discharge(m50, "aged", 0.84 * m50.capacity_ah, 1.0, 24.0))
    (note,) = [note for note in Case(FILE, (aged,)).assumed if "--soh" in note]
    assert note == (
        "aged: from a state of charge of 1.000 it is empty after 4.33 Ah, as a cell with 0.84 of the 5.15 Ah in the "
        "cell's file; if it has aged, --soh 0.84 takes it so."
    )
    assert not [note for note in Case(FILE, (aged,), soh=0.84).assumed if "--soh" in note]  # as was declared
    (note,) = [note for note in Case(FILE, (aged,), reader="python").assumed if "soh" in note]
    assert note.endswith("--soh 0.84 takes it so (in Python: soh).")


def test_a_simulation_passed_over_the_age_that_its_record_shows(m50, tmp_path):
    aged = rested(discharge(m50, "aged", 0.84 * m50.capacity_ah, 0.05, 24.0))
    aged.to_frame().to_csv(tmp_path / "aged.csv", index=False)
    for soh, noted in ((None, True), (0.84, False)):
        said: list[str] = []
        simulate_file(
            FILE,
            tmp_path / "aged.csv",
            tmp_path / "out.csv",
            ProfileRequest(soh=soh),
            say_notes=said.extend,
        )
        assert any("--soh 0.84 takes it so" in one for one in said) == noted


@pytest.mark.parametrize(
    ("share", "c_rate", "degc", "soc0", "noted"),
    [
        (0.84, 1.0, 24.0, 1.0, True),
        (0.84, 0.05, None, 1.0, True),
        (0.84, 1.0, 24.0, 0.9, False),  # it was not full
        (0.95, 1.0, 24.0, 1.0, False),  # as discharges of new cells show
        (0.84, 1.0, None, 1.0, False),  # it may have been cold
        (0.84, 1.0, -10.0, 1.0, False),
        (0.84, 3.0, 24.0, 1.0, False),  # its load ends it early
        (0.4, 0.05, 24.0, 0.5, False),  # hangs on where it starts
    ],
)
def test_a_discharge_that_shows_no_capacity_is_no_sign_of_age(m50, share, c_rate, degc, soc0, noted):
    record = discharge(m50, "one", share * m50.capacity_ah, c_rate, degc)
    start = InitialState(soc0, 0.0, "given", "")
    assert bool(aged_sentence(m50, record, start)) == noted
    assert not aged_sentence(m50, record.take(slice(0, 200)), start)


def test_a_charge_from_empty_and_a_discharge_said_to_begin_there_divided_by_zero(m50):
    full_discharge = discharge(m50, "one", m50.capacity_ah, 0.05)
    charge = replace(
        full_discharge,
        current_a=-full_discharge.current_a,
        voltage_v=full_discharge.voltage_v[::-1].copy(),
    )
    empty = InitialState(0.0, 0.0, "given", "")
    assert aged_sentence(m50, charge, empty) == ""
    assert aged_sentence(m50, full_discharge, empty) == ""


def test_a_record_was_refused_for_the_size_that_another_one_gave_the_file(m50):
    """The message said that the file of an 18650 has 13.1 Ah, as a pouch cell has whose record was beside its own."""
    large = discharge(m50, "large", 13.1, 0.05)
    small = discharge(m50, "small", 2.8, 0.05)
    with pytest.raises(
        DataError, match=r"^small: a full discharge takes 2\.8 Ah, and one in large takes 13\.1: "
    ):
        start_at_size(m50, [large, small], None)


def test_a_smaller_cell_beside_another_was_told_as_other_electrode_materials(m50):
    large = discharge(m50, "large", 4.9, 0.05)
    small = discharge(m50, "small", 2.3, 0.05)
    _, said = prepared_model(m50, [large, small], Conditions())
    assert not [sentence for sentence in said if "electrode materials" in sentence]
    assert [sentence for sentence in said if sentence.startswith("small: a full discharge takes 2.3 Ah")]


def test_an_experiment_took_a_record_of_another_cell_without_a_word(m50):
    config = parse_experiment(
        {"name": "x", "data": {"kind": "virtual", "dt_s": 180.0}, "cell": {"bpx": str(FILE), "soc0": 1.0}}
    )
    small = discharge(m50, "small", 2.75, 0.05, n=401)
    sources = Sources({"small": small}, {"train": ("small",), "valid": (), "test": ()})
    _, _, notes = _on_grid(config, declared_model(FILE), sources)
    assert [
        note for note in notes if note.startswith("small: a full discharge takes 2.75 Ah, and the file of")
    ]


def charge(cell, soc0, degc, c_rate=1.0):
    """A rest, a charge at c_rate to the upper cut-off and then at that voltage to C/60, and a rest."""
    time_s, volts = list(np.arange(0.0, 1800.0, 60.0)), cell.upper_voltage_v
    rate = [0.0] * len(time_s)
    amperes, step_s = -c_rate * cell.capacity_ah, 120.0
    while amperes < -cell.capacity_ah / 60.0:
        time_s.append(time_s[-1] + step_s)
        low, high = amperes, 0.0  # the largest current that does not pass the voltage

        def ends_v(try_a):
            run = simulate(cell, time_s, [*rate, try_a], soc0, (), degc, "backward", on_depletion="clip")
            return run.voltage_v[-1]

        if ends_v(amperes) > volts:
            for _ in range(12):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if ends_v(middle) > volts else (low, middle)
            amperes = high
        rate.append(amperes)
    time_s += [time_s[-1] + 10.0, time_s[-1] + 20.0]
    rate += [0.0, 0.0]
    run = simulate(cell, time_s, rate, soc0, (), degc, "backward")
    return Measurement(
        np.array(time_s), np.array(rate), run.voltage_v, np.full(len(rate), degc), "charge", hold="backward"
    )


@pytest.mark.parametrize(("share", "soc0", "degc"), [(0.9, 0.2, 25.0), (1.04, 0.1, 25.0), (0.9, 0.15, 10.0)])
def test_a_charge_to_full_told_no_capacity(m50, share, soc0, degc):
    """At any rate and temperature, while a discharge in the cold or under a load tells none."""
    record = charge(m50.with_soh(share), soc0, degc)
    start = initial_state(m50, record)
    shown = charged_share(m50, record, start)
    assert shown.share == pytest.approx(share, abs=2.0 * shown.sd)
    assert shown.sd < 0.03
    (note,) = [note for note in Case(FILE, (record,)).assumed if "--soh" in note]
    assert f"as a cell with {shown.share:.2f}" in note
    assert not [note for note in Case(FILE, (record,), soh=share).assumed if "it is full after" in note]


def test_a_charge_that_shows_the_capacity_of_the_file_or_does_not_end_full_is_not_noted(m50):
    record = charge(m50, 0.2, 25.0)
    start = initial_state(m50, record)
    assert charged_share(m50, record, start).share == pytest.approx(1.0, abs=0.01)
    assert aged_sentence(m50, record, start) == ""
    flows = np.flatnonzero(record.current_a)
    for part in (record.take(slice(0, flows[-8])), record.take(slice(0, 2))):
        assert charged_share(m50, part, start) is None
    assert charged_share(m50, record, replace(start, soc=1.0)) is None  # a cycle that began full
