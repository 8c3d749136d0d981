"""The porous electrode against PyBaMM's DFN with IDAKLU: time, difference, and what accuracy costs.

One load after another, each held against PyBaMM on a mesh that is fine enough: `reference_moves_mv` says by how much
the next coarser one is off. Then a line for each number of points across an electrode and in a particle, ours and the
peer's, with its error and its time. Then the records that the pouch cell's parameters were published with, beside the
errors printed there. The last line but one times a long drive at 10 Hz, as the single particle's benchmark has it; the
summary says the worst of everything at the numbers in use.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import CaseRow
from aesi.bench.physics.espm import STEP_S, random_load
from aesi.bench.physics.published import published
from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, EspmModel
from aesi.physics.dfn.run import run_porous_electrode
from aesi.pipeline.cross_check import DEFAULT_MESH, PybammRun, pybamm_run

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
SOC0 = 0.95
"""Where a load starts, so that charges stay below full."""
KELVIN = {"25 degC": 298.15, "0 degC": 273.15}
LARGEST_RATE = {"nmc_30ah": 3.0, "lg_m50_chen2020": 2.0, "lfp_prada2013": 1.0}
"""C-rate of the hardest load of each cell."""
DRIVE_RATE = 3.0
"""C-rate that `espm.random_load` runs to."""
OURS = ((3, 6), (5, 8), (7, 12), (10, 18), (14, 24))
"""(points across an electrode, modes in a particle); the third is in use."""
PEERS = ((10, 10), (20, 20), (40, 40))
"""(volumes across an electrode, volumes in a particle); the second is its default."""
FINE, LESS_FINE = (160, 200), (120, 120)
"""Graded towards the surfaces of the particles, unlike the peer's own."""
PEER = "PyBaMM DFN IDAKLU"


@dataclass(frozen=True, eq=False)
class Load:
    """A current, a straight line between break points, and the samples at which voltages are compared."""

    name: str
    content: CaseRow
    cell: Cell
    breaks_s: Array
    current_a: Array
    time_s: Array

    @property
    def sampled_a(self) -> Array:
        """(n,) A at the samples."""
        return np.interp(self.time_s, self.breaks_s, self.current_a)


def run(
    samples: PositiveInt = 88_200,
    repeats: PositiveInt = 3,
    cell: str = "",
    seed: NonNegativeInt = 0,
    seconds: PositiveInt = 200,
    curves: bool = True,
    records: bool = True,
) -> Iterator[CaseRow]:
    """Lines of every load and numbers, then the published records, the timing and the summary.

    samples : of the timed drive at 10 Hz, 0 leaves it out.  cell : one of the shipped cells, or a BPX file; the
    shipped ones without it.  seconds : of the drives and pulses that are compared.
    curves : false leaves these out.  records : false leaves the published ones out.
    """
    worst: dict[str, float] = {}
    names = [cell] if cell else list(LARGEST_RATE)
    for name in names if curves else ():
        for load in benchmark_loads(name, seed, seconds):
            for line in curve(load, repeats):
                if line.get("in_use"):
                    for key in ("rmse_mv", "max_mv", "doubling_mv"):
                        worst[key] = max(worst.get(key, 0.0), line[key])
                yield line
    for line in published() if records else ():
        if "apart_mv" in line:
            worst["published_apart_mv"] = max(worst.get("published_apart_mv", 0.0), line["apart_mv"])
        yield line
    if samples:
        timed = timing(names[0], samples, repeats, seed)
        yield timed
        worst |= {key: timed[key] for key in ("ours_s", "peer_s", "ratio")}
    yield {"summary": True, **worst}


def benchmark_loads(name: str, seed: int, seconds: int) -> Iterator[Load]:
    """Drive, pulses and a discharge of a cell, warm and cold."""
    path = Path(name) if Path(name).suffix else CELLS / f"{name}.bpx.json"
    if not path.is_file():
        raise InputError(
            f"there is no cell file {path}; name a BPX file or one of: {', '.join(LARGEST_RATE)}."
        )
    rate = LARGEST_RATE.get(name, 1.0)
    for temperature, kelvin in KELVIN.items():
        cell = replace(Cell.from_bpx(path), initial_temperature_k=kelvin, ambient_temperature_k=kelvin)
        content = cell.to_bpx()
        capacity = cell.nominal_capacity_ah
        for kind in ("drive", "pulses", "discharge"):
            level = rate if kelvin > KELVIN["0 degC"] or kind != "discharge" else 0.5 * rate
            if kind == "drive":
                breaks, current = random_load(round(seconds / STEP_S), capacity, np.random.default_rng(seed))
                current = current * level / DRIVE_RATE
            elif kind == "pulses":
                breaks, current = pulse_load(level * capacity, seconds)
            else:
                breaks, current = discharge_load(level, capacity)
            inside = np.arange(0.0, breaks[-1], 1.0)
            time = np.unique(np.concatenate([inside, breaks]))
            yield Load(
                f"{kind} to {level:g}C, {temperature}, {cell.name}", content, cell, breaks, current, time
            )


def pulse_load(current_a: float, seconds: int) -> tuple[Array, Array]:
    """Break points and current: rests, discharges and charges of half a minute each, with edges of 0.1 s."""
    edges = np.arange(0.0, seconds + 1.0, 30.0)
    level = np.resize([0.0, 1.0, 0.0, -0.5, 0.3, 1.0, 0.0, 0.6], len(edges) - 1)
    breaks = np.sort(np.concatenate([edges[:1], edges[1:-1], edges[1:-1] + 0.1, edges[-1:]]))
    return breaks, current_a * np.repeat(level, 2)


def discharge_load(rate: float, capacity_ah: float) -> tuple[Array, Array]:
    """Break points and current of 60 % of the capacity at a constant rate, and a rest."""
    end = 0.6 * SECONDS_PER_HOUR / rate
    breaks = np.array([0.0, 10.0, 11.0, end, end + 1.0, end + 300.0])
    return breaks, rate * capacity_ah * np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])


def curve(load: Load, repeats: int) -> Iterator[CaseRow]:
    """Error and time of one load over numbers of points, ours and the peer's."""
    fine, less = (_peer(load, *numbers, graded=True).voltage_v for numbers in (FINE, LESS_FINE))
    moves = _errors_mv(less, fine)["rmse_mv"]
    ours = {numbers: _ours(load, *numbers, repeats) for numbers in OURS}
    in_use = (EspmModel(load.cell).electrode_points, EspmModel(load.cell).solid_order)
    for (across, within), (voltage, took) in ours.items():
        line: CaseRow = {"load": load.name, "who": "ours", "across": across, "in_particle": within}
        line |= {**_errors_mv(voltage, fine), "seconds": took, "reference_moves_mv": moves}
        if (across, within) == in_use:
            twice = ours[2 * across, 2 * within][0]
            line |= {"in_use": True, "doubling_mv": _errors_mv(voltage, twice)["rmse_mv"]}
        yield line
    for across, within in PEERS:
        peer = _peer(load, across, within)
        line = {"load": load.name, "who": PEER, "across": across, "in_particle": within}
        yield line | _errors_mv(peer.voltage_v, fine) | {"seconds": peer.seconds, "reference_moves_mv": moves}


def timing(name: str, samples: int, repeats: int, seed: int) -> CaseRow:
    """Ours (median, warm) and the peer (its default mesh) on a drive at 10 Hz."""
    load = next(iter(benchmark_loads(name, seed, round(samples * STEP_S))))
    time = np.arange(samples, dtype=np.float64) * STEP_S
    load = replace(load, time_s=time)
    model = EspmModel(load.cell)
    voltage, took = _ours(load, model.electrode_points, model.solid_order, repeats)
    peer = _peer(load, DEFAULT_MESH["x_n"], DEFAULT_MESH["r_n"])
    return {
        "case": f"{samples} samples at 10 Hz, {load.name}",
        "ours_s": took,
        "peer": PEER,
        "peer_s": peer.seconds,
        "ratio": peer.seconds / took,
        "apart_rmse_mv": _errors_mv(voltage, peer.voltage_v)["rmse_mv"],
    }


def _ours(load: Load, across: int, within: int, repeats: int) -> tuple[Array, float]:
    """(n,) V and the median of warm seconds of the processor."""
    model = EspmModel(load.cell, electrode_points=across, solid_order=within)
    times, rows = [], np.empty(0)
    for _ in range(repeats + 1):
        start = process_time()
        rows = run_porous_electrode(model, load.time_s, load.sampled_a, None, SOC0, "linear")[0]
        times.append(process_time() - start)
    return rows[0], float(np.median(times[1:]))


def _peer(load: Load, across: int, within: int, graded: bool = False) -> PybammRun:
    mesh = {"x_n": across, "x_s": max(across // 2, 10), "x_p": across, "r_n": within, "r_p": within}
    return pybamm_run(
        load.content, load.cell, load.breaks_s, load.current_a, load.time_s, SOC0, mesh, "DFN", graded
    )


def _errors_mv(a: Array, b: Array) -> CaseRow:
    return {
        "rmse_mv": 1e3 * rms(a - b),
        "max_mv": 1e3 * float(np.abs(a - b).max()),
    }
