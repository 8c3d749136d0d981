"""What a recalibration keeps of records that each err in a way of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_experiment import BPX, SOC0

import aesi
from aesi.physics.cell.relations import Constant
from aesi.pipeline.experiment.recalibrate import FitRecord, recalibrate
from aesi.pipeline.product.deviations import ALL, FILM, KNOBS, RESISTOR, deviating
from aesi.records import Measurement

CELL = replace(aesi.Cell.from_bpx(BPX), contact_resistance_ohm=1e-3)


def record(added_ohm: float) -> FitRecord:
    """An hour of random steps under a cell with so much more contact resistance, without noise."""
    current_a = np.repeat(np.random.default_rng(1).normal(5.0, 40.0, 180), 20)
    time_s = np.arange(len(current_a), dtype=float)
    run = aesi.simulate(CELL, time_s, current_a, soc0=SOC0, hold="backward")
    measured = Measurement(time_s, current_a, run.voltage_v - added_ohm * current_a, name="drive")
    return FitRecord(measured, SOC0, np.ones(len(time_s), dtype=bool))


def resistance(records: dict[str, FitRecord], same_record: bool = False) -> float:
    """What a fit of the contact alone adds to the declared one."""
    fitted = recalibrate(CELL, (), records, "backward", RESISTOR, same_record=same_record)
    return fitted.cell.contact_resistance_ohm - CELL.contact_resistance_ohm


def test_records_that_agree_move_the_cell_by_what_their_number_bears_out():
    for count in (1, 2, 4):
        moved = resistance({str(k): record(1e-3) for k in range(count)})
        assert moved == pytest.approx(1e-3 * count / (1 + count), rel=0.03)


def test_records_that_disagree_leave_the_cell_as_it_is():
    moved = resistance({"worse": record(5e-4), "better": record(-5e-4)})
    assert moved == pytest.approx(0.0, abs=2e-5)


def test_other_rows_of_the_same_record_get_what_the_fitted_ones_tell():
    half = record(1e-3)
    half = replace(half, rows=np.arange(len(half.rows)) < len(half.rows) // 2)
    assert resistance({"drive": half}, same_record=True) == pytest.approx(1e-3, rel=0.03)


def test_all_parameters_are_told_from_each_record_by_itself():
    fitted = recalibrate(CELL, (), {"worse": record(1e-3), "as declared": record(0.0)}, "backward", ALL)
    assert len(fitted.deviations) == len(ALL)
    assert fitted.cell.contact_resistance_ohm == pytest.approx(1e-3 * (1 + 1 / 3), rel=0.05)


def test_films_are_moved_where_the_file_has_some():
    films = [k for k, knob in enumerate(KNOBS) if knob.owner == FILM]
    moved = deviating(CELL, (), films, np.ones(2), "espm").cell
    assert (moved.negative, moved.positive) == (CELL.negative, CELL.positive)
    filmed = replace(CELL, negative=replace(CELL.negative, film_ohm_m2=Constant(2e-3)))
    moved = deviating(filmed, (), films, np.ones(2), "espm").cell
    assert moved.negative.film_ohm_m2 == Constant(2e-3 * np.exp(KNOBS[films[0]].deviation))
    assert moved.positive == CELL.positive
