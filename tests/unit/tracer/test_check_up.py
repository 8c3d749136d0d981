"""A check-up of an aged cell: lithium is gone and contacts are worse, at the sampling that cyclers log with."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import discover

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
LOST, CONTACT_OHM = 0.1, 6e-3
TRIED = (
    "lithium_inventory_loss",
    "series_resistance",
    "electrolyte_transport",
    "active_material_loss_positive",
)


def record(cell: Cell, time_s, current_a, name: str) -> Measurement:
    """From full to the lower limit, with 0.3 mV of noise; constant since the row before, as declared."""
    aged = (
        CATALOGUE["lithium_inventory_loss"].activate(loss=LOST),
        CATALOGUE["series_resistance"].activate(resistance_ohm=CONTACT_OHM),
    )
    run = simulate(cell, time_s, current_a, 1.0, aged, 25.0, "backward", on_depletion="clip")
    noise = 3e-4 * np.random.default_rng(len(time_s)).standard_normal(len(time_s))
    whole = Measurement(time_s, current_a, run.voltage_v + noise, np.full(len(time_s), 25.0), name)
    end = int(np.argmax(np.append(run.voltage_v, 0.0) < cell.lower_voltage_v))
    return replace(whole.take(slice(0, end)), hold="backward")


@pytest.mark.slow
def test_an_electrolyte_was_named_where_lithium_and_contacts_were_lost():
    cell = Cell.from_bpx(CELL)
    slow, pulses = np.arange(0.0, 22 * 3600.0, 120.0), np.arange(0.0, 9000.0, 5.0)
    phase = pulses % 1500.0
    drawn = np.select([phase < 300, phase < 340, phase < 640, phase < 680], [0.0, 8.0, 0.0, 3.0], 2.5)
    records = [
        record(cell, slow, np.where(slow < 600.0, 0.0, cell.capacity_ah / 20), "slow"),
        record(cell, pulses, drawn, "pulses"),
    ]
    found = discover(cell, records, effects={name: CATALOGUE[name] for name in TRIED})
    assert set(found.verdict.effects) == {"lithium_inventory_loss", "series_resistance"}
