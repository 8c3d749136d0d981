"""One case on a measured record: load, put in or withhold, look, and hold the answer against what is known."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench.limit import OutOfTime, processor_limit
from aesi.bench.real.case import RealCase, Take
from aesi.bench.real.faults import declared_with_fault, soc0_with_fault, with_fault
from aesi.constants import SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.data import read_measurement
from aesi.data.catalogue import locate
from aesi.errors import AesiError, DataError
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import discovery_content
from aesi.records import Measurement
from aesi.tracer import Discovery, discover

MV = 1e3
LIMIT_S = 600.0
MOST_ROWS = 20_000
"""Rows that a case is read with; more are averaged, as `aesi discover` does."""
GROUP_OF = 2
"""A name counts where it is given, or is one of a group of so many."""
DRAWN = 160
"""Points of a residual that the report draws."""


def judged(case: RealCase, cells: str, limit_s: float | None = LIMIT_S) -> dict[str, Any]:
    """The row of one case; `verdict` is 'not run' where its data cannot be had.

    cells : folder of the cell files.  limit_s : processor seconds; a case that takes longer is a miss.
    """
    began, processor = time.perf_counter(), time.process_time()
    row: dict[str, Any] = {
        "case": case.name,
        "group": case.group,
        "development": case.development,
        "cell": case.cell,
        "record": f"{case.take.set}/{case.take.file}",
        "seconds_of_record": case.take.stop_s,
        "given": "temperature" if case.take.temperature else "no temperature",
        "put_in": f"{case.fault.kind} {case.fault.size:g}" if case.fault else "",
        "answer": list(case.answers),
        "source": case.source,
        "matched": case.matched,
    }
    try:
        data, truth = _load(case)
        declared = Cell.from_bpx(_cell(case.cell, Path(cells)))
    except DataError as error:
        return row | {"verdict": "not run", "error": str(error), **_spent(began, processor)}
    soc0 = case.soc0
    if case.fault:
        data = with_fault(data, case.fault.kind, case.fault.size)
        declared = declared_with_fault(declared, case.fault.kind, case.fault.size)
        soc0 = soc0_with_fault(soc0, case.fault.kind, case.fault.size)
    try:
        with processor_limit(limit_s):
            found = discover(declared, [data], soc0=soc0)
    except AesiError as error:
        answer = {"verdict": "error", "error": str(error), "effects": [], "named": False}
    except OutOfTime:
        answer = {
            "verdict": "out of time",
            "error": f"more than {limit_s:g} s",
            "effects": [],
            "named": False,
        }
    else:
        answer = scored(case.answers, truth, discovery_content(found)) | {"residual": _residual(found)}
    return row | answer | _spent(began, processor)


def _spent(began: float, processor: float) -> dict[str, float]:
    return {"processor_s": time.process_time() - processor, "ours_s": time.perf_counter() - began}


def _cell(name: str, folder: Path) -> Path:
    place, colon, file = name.partition(":")
    return locate(place, file) if colon else folder / name


def _load(case: RealCase) -> tuple[Measurement, dict[str, float]]:
    """The record as the finder gets it, and the true values of parameters."""
    read = _read(case.take)
    truth = dict(case.parameters)
    if case.measured == "temperature":
        full = _read(Take(case.take.set, case.take.file, case.take.stop_s))
        if full.temperature_degc is None:
            raise DataError(f"{full.name} has no column of temperature.")
        reference_degc = 298.15 - ZERO_CELSIUS_K
        truth["ambient_temperature.shift_k"] = float(np.mean(full.temperature_degc)) - reference_degc
    if case.measured == "capacity" and case.against:
        before = _charge_ah(_read(case.against))
        loss = 1 - _charge_ah(read) / before
        truth["lithium_inventory_loss.loss"] = loss
    return read, truth


def _read(take: Take) -> Measurement:
    columns: dict[str, str | None] | None = None if take.temperature else {"temperature_degc": None}
    path = locate(take.set, take.file)
    if take.set in ("about_energy_nmc", "lg_m50t_w8"):
        columns = None  # these have no such column
    return read_measurement(path, columns, max_rows=MOST_ROWS, stop_s=take.stop_s)


def _charge_ah(data: Measurement) -> float:
    return float(np.trapezoid(data.current_a, data.time_s)) / SECONDS_PER_HOUR


def scored(
    answers: tuple[str, ...], truth: Mapping[str, float], content: Mapping[str, Any]
) -> dict[str, Any]:
    """What the answer (as in discovery.json) is worth.

    named : a right name is given, or is one of a group of two with one that is; with no right name, that none is
    given.  size_* : of the parameter whose truth is known.
    """
    effects = list(content["effects"])
    groups = {
        name: {name}.union(*(g for g in content["indistinguishable"] if name in g and len(g) <= GROUP_OF))
        for name in effects
    }
    hit = [name for name, group in groups.items() if group & set(answers)]
    named = bool(hit) if answers else not effects
    row: dict[str, Any] = {
        key: content[key] for key in ("verdict", "effects", "indistinguishable", "confidence")
    }
    for state in ("before", "recalibrated", "after"):
        row[f"{state}_test_mv"] = content[state]["test"].get("rmse_mv")
    return row | {
        "named": named,
        "others": [name for name in effects if name not in hit],
        **_size(truth, content),
    }


def _size(truth: Mapping[str, float], content: Mapping[str, Any]) -> dict[str, Any]:
    for candidate in content["candidates"]:
        if candidate["effect"] not in content["effects"]:
            continue
        for name, estimate in candidate["parameters"].items():
            key = f"{candidate['effect']}.{name}"
            if key not in truth or estimate["value"] is None:
                continue
            true, value = truth[key], float(estimate["value"])
            neutral = CATALOGUE[candidate["effect"]].parameters[name].neutral or 0.0
            known = estimate["low"] is not None and estimate["high"] is not None
            return {
                "parameter": key,
                "size_true": true,
                "size_found": value,
                "size_error": abs(value - true) / abs(true - neutral),
                "size_off": abs(value - true),
                "size_covered": bool(estimate["low"] <= true <= estimate["high"]) if known else None,
            }
    return {}


def _residual(found: Discovery) -> dict[str, list[float]]:
    """Time in s and residual in mV of each state over the record, thinned for drawing."""
    time_s = np.concatenate([f.time_s for f in found.files])
    kept = np.unique(np.linspace(0, len(time_s) - 1, DRAWN).astype(int))
    out = {"time_s": time_s[kept].round(1).tolist()}
    for state in ("before", "recalibrated", "after"):
        residual = MV * np.concatenate([f.residual_v(state) for f in found.files])
        out[f"{state}_mv"] = residual[kept].round(2).tolist()
    return out
