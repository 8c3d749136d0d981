"""`aesi bench calibrate`: what a calibration makes of records of a known cell, and of a drive that entered no fit.

The truth is an LG M50 as a porous electrode with contacts of its own and slower particles; fitted is the single
particle from the shipped file, so that a model error of some millivolts is left, as on measured cells. Fitted are a
drive and a 1C discharge at 25 degC, in a millivolt of noise: little, so that priors and weights count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.limit import Stopwatch
from aesi.calibration import calibrate
from aesi.calibration.fit import EVALUATIONS
from aesi.constants import MILLI, MV_PER_V
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, simulate
from aesi.physics.cell.relations import scaled
from aesi.records import Measurement

CONTACT_OHM = 8e-3
SLOWER = 0.6
"""What the true cell has that the start file has not: its contacts, and the factor on its negative electrode's
diffusivity."""
NOISE_V = 1e-3
"""White noise of the voltage. A convention, as the sizes above."""
HOLD_S, REST_S = 30, 60
"""Duration of one current of a drive, and of the rest that it begins with, s."""


def run(
    cell: str = "experiments/cells/lg_m50_chen2020.bpx.json",
    evaluations: PositiveInt = EVALUATIONS,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One dict a record with its error in mV as declared and calibrated, the last record unseen; then the summary.

    cell : the start file.  evaluations : of the descent, at most.
    """
    start = Cell.from_bpx(Path(cell))
    truth = replace(start, contact_resistance_ohm=CONTACT_OHM)
    truth = truth.with_negative(diffusivity=scaled(truth.negative.diffusivity, SLOWER))
    rng = np.random.default_rng(seed)
    fitted = [
        _record(truth, "drive", _drive(rng, start.capacity_ah), 0.9, rng),
        _record(truth, "1C", _discharge(start.capacity_ah), 1.0, rng),
    ]
    unseen = _record(truth, "unseen drive", _drive(rng, start.capacity_ah), 0.7, rng)
    spent = Stopwatch()
    found = calibrate(start, fitted, evaluations=evaluations)
    spent_row = spent.row
    for error in found.errors:
        yield {
            "record": error.name,
            "declared_mv": round(MV_PER_V * error.before_v, 2),
            "calibrated_mv": round(MV_PER_V * error.after_v, 2),
        }
    declared_mv, calibrated_mv = (_error_mv(each, unseen, 0.7) for each in (start, found.cell))
    yield {"record": unseen.name, "declared_mv": declared_mv, "calibrated_mv": calibrated_mv}
    contact = found.parameters["contact.resistance"]
    yield {
        "summary": True,
        "unseen_mv": calibrated_mv,
        "contact_mohm": round(MILLI * contact.value, 2),
        "contact_low_mohm": round(MILLI * contact.low, 2),
        "contact_high_mohm": round(MILLI * contact.high, 2),
        "capacity_ah": round(found.cell.capacity_ah, 3),
        "simulations": found.model.simulations,
        **spent_row,
    }


def _drive(rng: np.random.Generator, capacity_ah: float) -> Array:
    """(2400,) A: a rest, then currents of 30 s each, 0.6C in the mean, 1C of charge to 2.4C of discharge."""
    current = np.repeat(rng.normal(0.6, 0.8, 80), HOLD_S).clip(-1.0, 2.4) * capacity_ah
    current[:REST_S] = 0.0
    return current


def _discharge(capacity_ah: float) -> Array:
    """(3000,) A at 1C between two rests."""
    current = np.full(3000, capacity_ah)
    current[:REST_S] = current[-300:] = 0.0
    return current


def _record(truth: Cell, name: str, current: Array, soc0: float, rng: np.random.Generator) -> Measurement:
    time_s = np.arange(float(len(current)))
    run = simulate(truth, time_s, current, soc0, hold="backward", model="dfn")
    noise = NOISE_V * rng.standard_normal(len(current))
    return Measurement(time_s, current, run.voltage_v + noise, name=name, hold="backward")


def _error_mv(cell: Cell, record: Measurement, soc0: float) -> float:
    run = simulate(cell, record.time_s, record.current_a, soc0, hold="backward", model="espm")
    return round(MV_PER_V * rms(record.voltage_v - run.voltage_v), 2)
