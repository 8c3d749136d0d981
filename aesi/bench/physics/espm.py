"""`aesi bench espm`: processor time and accuracy of the single-particle model, against the SPMe of PyBaMM (IDAKLU)."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import AtLeastTwo
from aesi.constants import MV_PER_V
from aesi.errors import InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, simulate
from aesi.physics.simulation import forget_solutions
from aesi.pipeline.cross_check import DEFAULT_MESH, FINE_MESH, pybamm_run

DEFAULT_CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"
STEP_S = 0.1
"""Time step of the samples, s."""
BREAK_POINT_S = 1.0
"""Time between the break points of the current, s. The current is linear between them, so that PyBaMM can be told at
which times its slope changes."""
SOC0 = 0.95
"""State of charge at which the load starts; below 1, so that charging currents do not exceed the full charge."""
MEAN_C_RATE, SPREAD_C_RATE, LARGEST_C_RATE, CORRELATION_S = 0.25, 1.0, 3.0, 20.0
"""Mean, standard deviation and largest value of the C-rate, 1/h, and its correlation time, s. Conventions: a drive that
discharges the cell."""


def run(
    samples: AtLeastTwo = 88_200,
    repeats: PositiveInt = 5,
    cell: str | Path = DEFAULT_CELL,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One row: processor times of this package (median of `repeats` runs, compiled code loaded) and of PyBaMM on its
    default mesh, s, and the RMS difference of both from PyBaMM on a fine mesh, mV.

    samples : of a random drive at 10 Hz with up to 3C.  cell : BPX file.  seed : of the drive.  `ours_first_call_s`
    includes loading the compiled code.  Raises InputError if there is no such file.
    """
    if not Path(cell).is_file():
        raise InputError(f"there is no cell file {cell}; name a BPX file with cell=...")
    model = Cell.from_bpx(cell)
    breaks, current_at_breaks = random_load(samples, model.nominal_capacity_ah, np.random.default_rng(seed))
    time = np.arange(samples, dtype=np.float64) * np.float64(STEP_S)
    current = np.interp(time, breaks, current_at_breaks)
    first = _timed(model, time, current)[0]
    ours = sorted(_timed(model, time, current)[0] for _ in range(repeats))[repeats // 2]
    voltage = _timed(model, time, current)[1]
    content = json.loads(Path(cell).read_text(encoding="utf-8"))
    peer, fine = (
        pybamm_run(content, model, breaks, current_at_breaks, time, SOC0, mesh)
        for mesh in (DEFAULT_MESH, FINE_MESH)
    )
    yield {
        "case": f"{samples} samples at 10 Hz, drive profile to 3C, {model.name}",
        "ours_s": ours,
        "ours_first_call_s": first,
        "peer": "PyBaMM SPMe IDAKLU",
        "peer_s": peer.seconds,
        "ratio": peer.seconds / ours,
        "rmse_mv": MV_PER_V * rms(voltage - fine.voltage_v),
        "peer_rmse_mv": MV_PER_V * rms(peer.voltage_v - fine.voltage_v),
        "reference": f"PyBaMM SPMe, {FINE_MESH['r_n']} radial points",
    }


def random_load(samples: int, capacity_ah: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """A correlated random load: break points, (k,) s, and current there, (k,) A, discharge positive.

    The load discharges the cell on average and stays within LARGEST_C_RATE.  samples : number of steps of STEP_S.
    capacity_ah : current at 1C, A.
    """
    breaks = np.arange(0.0, samples * STEP_S + BREAK_POINT_S, BREAK_POINT_S)
    keep = np.exp(-BREAK_POINT_S / CORRELATION_S)
    noise = rng.standard_normal(len(breaks)) * np.sqrt(1.0 - keep**2)
    load = np.zeros(len(breaks))
    for k in range(1, len(breaks)):
        load[k] = keep * load[k - 1] + noise[k]
    c_rate = np.clip(MEAN_C_RATE + SPREAD_C_RATE * load, -LARGEST_C_RATE, LARGEST_C_RATE)
    c_rate[0] = 0.0
    return breaks, c_rate * capacity_ah


def _timed(cell: Cell, time: Array, current: Array) -> tuple[float, Array]:
    """Processor time of one simulation, s, and its voltage, (n,) V. Earlier results are forgotten first, so that none
    is taken from the cache."""
    forget_solutions()
    start = process_time()
    run = simulate(cell, time, current, soc0=SOC0)
    return process_time() - start, run.voltage_v
