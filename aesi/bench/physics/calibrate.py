"""`aesi bench calibrate`: what does a calibration recover from records of a known virtual cell?

The records are simulated with a porous-electrode model of an LG M50 that has a contact resistance and a slower negative
electrode than the shipped file. The single-particle model of the shipped file is calibrated on a drive and a 1C
discharge at 25 degC. It leaves a model error of some millivolts, as on measured cells. The two records contain little
information, so that the priors and the weights of the fit matter. A second drive is held out.
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
from aesi.physics.simulation import ModelName
from aesi.records import Measurement

CONTACT_OHM = 8e-3
"""Contact resistance of the true cell, ohm. A convention."""
SLOWER = 0.6
"""Diffusivity of the true cell's negative electrode over that of the start file. A convention."""
NOISE_V = 1e-3
"""Standard deviation of the white noise on the voltage, V. A convention."""
HOLD_S, REST_S = 30, 60
"""Duration of each constant current of a drive, and of the rest at its beginning, s. Conventions."""


def run(
    cell: str = "experiments/cells/lg_m50_chen2020.bpx.json",
    evaluations: PositiveInt = EVALUATIONS,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One row per record with the RMS error of the declared and of the calibrated model, mV, the held-out record last;
    then the summary.

    cell : the start file.  evaluations : most evaluations of the fit.  seed : of the drives and of the noise.
    `contact_mohm` of the summary, with its 95 % interval, is to be compared with CONTACT_OHM.
    """
    start = Cell.from_bpx(Path(cell))
    truth = replace(start, contact_resistance_ohm=CONTACT_OHM)
    truth = truth.with_negative(diffusivity=scaled(truth.negative.diffusivity, SLOWER))
    rng = np.random.default_rng(seed)
    fitted = [
        virtual_record(truth, "drive", random_drive(rng, start.capacity_ah), 0.9, rng),
        virtual_record(truth, "1C", discharge(start.capacity_ah), 1.0, rng),
    ]
    unseen = virtual_record(truth, "unseen drive", random_drive(rng, start.capacity_ah), 0.7, rng)
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


def random_drive(rng: np.random.Generator, capacity_ah: float) -> Array:
    """A random drive, (2400,) A at 1 Hz, discharge positive: a rest, then constant currents of HOLD_S each, with a mean
    of 0.6C, between a charge at 1C and a discharge at 2.4C."""
    current = np.repeat(rng.normal(0.6, 0.8, 80), HOLD_S).clip(-1.0, 2.4) * capacity_ah
    current[:REST_S] = 0.0
    return current


def discharge(capacity_ah: float) -> Array:
    """A 1C discharge between two rests, (3000,) A at 1 Hz."""
    current = np.full(3000, capacity_ah)
    current[:REST_S] = current[-300:] = 0.0
    return current


def virtual_record(
    truth: Cell,
    name: str,
    current: Array,
    soc0: float,
    rng: np.random.Generator,
    model: ModelName = "dfn",
) -> Measurement:
    """A record at 1 Hz, with noise.  current : (n,) A, constant since the row before.  model : of the true cell."""
    time_s = np.arange(float(len(current)))
    run = simulate(truth, time_s, current, soc0, hold="backward", model=model)
    noise = NOISE_V * rng.standard_normal(len(current))
    return Measurement(time_s, current, run.voltage_v + noise, name=name, hold="backward")


def _error_mv(cell: Cell, record: Measurement, soc0: float) -> float:
    run = simulate(cell, record.time_s, record.current_a, soc0, hold="backward", model="espm")
    return round(MV_PER_V * rms(record.voltage_v - run.voltage_v), 2)
