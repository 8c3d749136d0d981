"""The benchmark of first rows: a cell's own answers are read back, and a foreign one is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.bench.physics import start
from aesi.bench.physics.start import reading_figures, readings
from aesi.errors import DataError
from aesi.physics import Cell, simulate
from aesi.records import Measurement

CELL = Cell.from_bpx(
    Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
)


def discharge() -> Measurement:
    """A rest of ten minutes and a discharge at C/5, as the cell itself answers."""
    time = np.arange(0.0, 9000.0, 10.0)
    current = np.where(time < 600.0, 0.0, 1.0)
    run = simulate(CELL, time, current, 0.9, hold="backward")
    return Measurement(time, current, run.voltage_v, name="drawn")


def test_what_the_cell_itself_answers_is_read_within_what_is_claimed():
    found = reading_figures(readings(CELL, discharge(), 6, np.random.default_rng(0)))
    assert found["readings"] == 6
    assert found["refused"] == 0
    assert found["load_worst_points"] < 1.0
    assert found["load_worst_sds"] < 2.0
    assert found["right_doubted_pct"] == 0.0


def test_a_voltage_that_is_off_shows_in_points_of_charge():
    data = discharge()
    later = replace(data, voltage_v=data.voltage_v + np.where(data.time_s > 600.0, 0.03, 0.0))
    right = reading_figures(readings(CELL, data, 6, np.random.default_rng(0)))
    assert (
        reading_figures(readings(CELL, later, 6, np.random.default_rng(0)))["load_rms_points"]
        > 1.0 + (right["load_rms_points"])
    )


def test_more_cuts_than_rows_ended_the_benchmark_and_its_sum_told_no_record_that_failed(monkeypatch):
    with pytest.raises(DataError, match="its 900 rows leave 600 places for 601 cuts"):
        readings(CELL, discharge(), 601, np.random.default_rng(0))
    monkeypatch.setattr(start, "locate", lambda data, name: name)
    monkeypatch.setattr(start, "cell_of", lambda *_: CELL)
    monkeypatch.setattr(start, "read_measurement", lambda name: discharge())
    sums = [row for row in start.run(cuts=601) if row.get("summary")]
    assert [(row["failed"], row["readings"]) for row in sums] == [(3, 0), (3, 0)]
