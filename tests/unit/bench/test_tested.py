"""The state of health of a measured record's cell on its day, from the records of a calibration."""

from dataclasses import replace
from datetime import date
from pathlib import Path

import pytest

from aesi.bench.physics.cells import RECORDS
from aesi.bench.physics.tested import TESTED, soh_on_its_day
from aesi.data.catalogue import HG2, PANASONIC
from aesi.physics import Cell

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture(scope="module")
def cell() -> Cell:
    bare = Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")
    shares = (("25degC_hppc", 1.0), ("0degC_hppc", 0.97), ("n10degC_hppc", 0.952))
    days = tuple((name, date.fromisoformat(TESTED[PANASONIC][name])) for name, _ in shares)
    return replace(bare, capacity_shares=shares, tested_on=days)


def test_a_record_of_the_calibration_has_its_own_share(cell):
    assert soh_on_its_day(cell, PANASONIC, "0degC_hppc") == pytest.approx(0.97)


def test_between_two_records_capacity_falls_evenly_with_the_days(cell):
    # 30 May is 10 of the 18 days from 20 May to 7 June.
    assert soh_on_its_day(cell, PANASONIC, "0degC_cycle_1") == pytest.approx(0.97 - 0.018 * 10 / 18)


def test_before_the_first_and_after_the_last_it_stays(cell):
    assert soh_on_its_day(cell, PANASONIC, "25degC_1c_start") == pytest.approx(1.0)
    assert soh_on_its_day(cell, PANASONIC, "n10degC_cycle_1") == pytest.approx(0.952)


def test_where_no_day_or_no_share_is_known_there_is_none(cell):
    assert soh_on_its_day(cell, PANASONIC, "unknown") is None
    assert soh_on_its_day(replace(cell, tested_on=()), PANASONIC, "0degC_hppc") is None


def test_every_record_of_a_dated_set_has_its_day():
    assert all(record.name in TESTED[record.data] for record in RECORDS if record.data in TESTED)


@pytest.mark.parametrize("name", [HG2, PANASONIC])
def test_the_days_are_those_of_the_cell_files(name):
    known = dict(Cell.from_bpx(CELLS / f"{name}.bpx.json").tested_on)
    assert known
    assert {record: TESTED[name][record] for record in known} == {k: f"{day}" for k, day in known.items()}
