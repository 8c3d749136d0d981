"""The extended single-particle model against PyBaMM's SPMe with IDAKLU: time and difference in one run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.errors import InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, simulate
from aesi.physics.simulation import forget_solutions
from aesi.pipeline.cross_check import DEFAULT_MESH, FINE_MESH, pybamm_run

DEFAULT_CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"
STEP_S = 0.1
BREAK_POINT_S = 1.0
"""The current is a straight line between break points, so that the peer can be told where they are."""
SOC0 = 0.95
"""Where the load starts, so that charges stay below full."""
MEAN_C_RATE, SPREAD_C_RATE, LARGEST_C_RATE, CORRELATION_S = 0.25, 1.0, 3.0, 20.0
"""Mean, spread and largest rate of the load, 1/h, and its correlation time, s: conventions, as of a drive that
discharges the cell."""


def run(
    samples: PositiveInt = 88_200,
    repeats: PositiveInt = 5,
    cell: str | Path = DEFAULT_CELL,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One line: seconds of ours (median, warm) and of the peer (its default mesh), and both against a fine mesh.

    samples : at 10 Hz, of a drive profile up to 3C.  `ours_first_call_s` includes loading the compiled code.
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
        "bench": "espm",
        "case": f"{samples} samples at 10 Hz, drive profile to 3C, {model.name}",
        "ours_s": ours,
        "ours_first_call_s": first,
        "peer": "PyBaMM SPMe IDAKLU",
        "peer_s": peer.seconds,
        "ratio": peer.seconds / ours,
        "rmse_mv": _rmse_mv(voltage, fine.voltage_v),
        "peer_rmse_mv": _rmse_mv(peer.voltage_v, fine.voltage_v),
        "reference": "PyBaMM SPMe, 60 radial points",
    }


def random_load(samples: int, capacity_ah: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Break points (s) and current there (A): a correlated random load, discharging on average, within 3C."""
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
    forget_solutions()
    start = process_time()
    run = simulate(cell, time, current, soc0=SOC0)
    return process_time() - start, run.voltage_v


def _rmse_mv(a: Array, b: Array) -> float:
    return rms(a - b) * 1e3
