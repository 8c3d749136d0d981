"""`aesi bench dfn`: accuracy and processor time of the porous-electrode model, against the DFN of PyBaMM (IDAKLU).

The rows are, in this order:

1. For each load, the error and the time of this package and of PyBaMM at several numbers of points across an electrode
   and in a particle. The reference is PyBaMM on a fine mesh; `reference_moves_mv` is the difference between this mesh
   and the next coarser one.
2. The records that the parameters of the NMC pouch cell were published with, beside the published errors.
3. The times on a long drive at 10 Hz, as in `aesi bench espm`.
4. The summary: the largest errors of all loads at the numbers of points in use.
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
from aesi.constants import MV_PER_V, SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.errors import InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, EspmModel
from aesi.physics.dfn.run import run_porous_electrode
from aesi.pipeline.cross_check import DEFAULT_MESH, PybammRun, pybamm_run

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
SOC0 = 0.95
"""State of charge at which each load starts; below 1, so that charging currents do not exceed the full charge."""
KELVIN = {"25 degC": 25.0 + ZERO_CELSIUS_K, "0 degC": ZERO_CELSIUS_K}
"""Temperature in words -> K, of the cell and its surroundings."""
LARGEST_RATE = {"nmc_30ah": 3.0, "lg_m50_chen2020": 2.0, "lfp_prada2013": 1.0}
"""Name of a shipped cell -> largest C-rate of its loads, 1/h. Conventions."""
DRIVE_RATE = 3.0
"""Largest C-rate of `espm.random_load`, 1/h."""
PULSE_S = 30.0
"""Duration of each rest, discharge and charge of the pulses, s. A convention."""
OURS = ((3, 6), (5, 8), (7, 12), (10, 18), (14, 24))
"""(points across an electrode, modes in a particle) of this package; the third pair is its default."""
PEERS = ((10, 10), (20, 20), (40, 40))
"""(volumes across an electrode, volumes in a particle) of PyBaMM; the second pair is its default."""
FINE, LESS_FINE = (160, 200), (120, 120)
"""The same of the reference and of the next coarser mesh. Unlike PyBaMM's default meshes they are graded towards the
surfaces of the particles."""
PEER = "PyBaMM DFN IDAKLU"


@dataclass(frozen=True, eq=False)
class Load:
    """A current profile for one cell.

    content : of the cell's BPX file.  breaks_s, current_a : (k,) s and A (discharge positive), the current is linear
    between these break points.  time_s : (n,) s, samples at which voltages are compared.
    """

    name: str
    content: CaseRow
    cell: Cell
    breaks_s: Array
    current_a: Array
    time_s: Array

    @property
    def sampled_a(self) -> Array:
        """The current at the samples, (n,) A."""
        return np.interp(self.time_s, self.breaks_s, self.current_a)


def run(
    samples: NonNegativeInt = 88_200,
    repeats: PositiveInt = 3,
    cell: str = "",
    seed: NonNegativeInt = 0,
    seconds: PositiveInt = 200,
    curves: bool = True,
    records: bool = True,
) -> Iterator[CaseRow]:
    """The rows of the benchmark (see the module).

    samples : of the timed drive at 10 Hz, 0 leaves it out.  repeats : timed runs, of which the median counts.  cell : a
    key of LARGEST_RATE, or a BPX file; empty takes all of LARGEST_RATE.  seed : of the drives.  seconds : duration of
    the drives that are compared, s, in which there are as many whole steps of PULSE_S of the pulses as fit.  curves :
    false leaves out the comparison over numbers of points.  records : false leaves out the published records.
    Raises InputError where `seconds` leaves no room for a pulse, and for a drive of one sample.
    """
    if samples == 1:
        raise InputError("samples = 1: a drive has two at least; give more, or 0 to leave it out.")
    if curves and seconds < 2 * PULSE_S:
        raise InputError(
            f"seconds = {seconds}: the first pulse comes after a rest, {PULSE_S:g} s each; give at least "
            f"{2 * PULSE_S:g}, or curves=false."
        )
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
    """A drive, pulses and a discharge of a cell, each at 25 degC and at 0 degC.

    name : key of LARGEST_RATE, or a BPX file.  seconds : duration of the drive, and longest one of the pulses, s.
    Raises InputError if there is no such file.
    """
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
    """Break points, (k,) s, and current there, (k,) A: rests, discharges and charges of PULSE_S each, with ramps of
    0.1 s.

    current_a : the largest discharge current, A.  seconds : the longest duration, s, at least PULSE_S; the load ends
    with the last whole step.
    """
    edges = np.arange(0.0, seconds + 1.0, PULSE_S)
    level = np.resize([0.0, 1.0, 0.0, -0.5, 0.3, 1.0, 0.0, 0.6], len(edges) - 1)
    breaks = np.sort(np.concatenate([edges[:1], edges[1:-1], edges[1:-1] + 0.1, edges[-1:]]))
    return breaks, current_a * np.repeat(level, 2)


def discharge_load(rate: float, capacity_ah: float) -> tuple[Array, Array]:
    """Break points, (k,) s, and current there, (k,) A: a discharge at a constant C-rate (1/h) between a rest
    of 10 s and one of 300 s. Discharge and first rest together take as long as 60 % of the capacity would, so that it
    takes out 10 s less: 59.7 % at 1C, 59.2 % at 3C."""
    end = 0.6 * SECONDS_PER_HOUR / rate
    breaks = np.array([0.0, 10.0, 11.0, end, end + 1.0, end + 300.0])
    return breaks, rate * capacity_ah * np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])


def curve(load: Load, repeats: int) -> Iterator[CaseRow]:
    """One row per number of points, of this package and of PyBaMM, on one load: RMS and largest difference from the
    reference, mV, and processor time, s.

    The row of the numbers in use has `in_use`, and in `doubling_mv` the RMS change when both numbers are doubled.
    """
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
    """The row of the times on a drive at 10 Hz: this package (median of `repeats` runs, compiled code loaded), and
    PyBaMM on its default mesh; `apart_rmse_mv` is the difference between both, mV."""
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
    """Voltage, (n,) V, and median processor time of `repeats` runs after a first one, s."""
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
        "rmse_mv": MV_PER_V * rms(a - b),
        "max_mv": MV_PER_V * float(np.abs(a - b).max()),
    }
