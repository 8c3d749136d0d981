"""`aesi bench start`: how accurate is the state of charge that the first row of a record is read as?

Each record is cut at random rows. `initial_state` reads the state of charge of the first row that remains, as if the
rest were a record of its own; it may begin at rest or under load. The reference is the reading of the whole record,
which begins with a rest or a full charge, minus the charge passed since over the capacity of the file. The errors of
this reference and of that capacity are part of all figures. Some records entered the calibration of their cell file;
for the others the file was published and has seen none of them.

The benchmark also tests whether a given state of charge is recognised as wrong: one within NEAR of the reference should
not be contradicted by the voltage, one that is off by WRONG should be.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.physics.cells import START, cell_of
from aesi.data.catalogue import HG2, M50T, NMC, PANASONIC, locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError, DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, initial_state
from aesi.records import Measurement

FITTED = ((PANASONIC, PANASONIC, "25degC_hppc"), (HG2, HG2, "25degC_cap_1c"), (HG2, HG2, "25degC_mixed1"))
"""(data set, cell file, record) of records that the file was fitted to: at 25 degC, where the capacity is that of the
file, and without the slow discharges, whose cycler counts some per cent of charge too much."""
PUBLISHED = ((NMC, None, "drive_cycle"), (M50T, START, "n0_hppc"), (M50T, START, "n0_udds"))
"""(data set, cell file, record) of records that the file has not seen; None takes the file published with the set."""
NEAR, WRONG = 0.02, 0.2
"""Errors of a given state of charge, 0 to 1: of a careful user, and of a mistake. Conventions."""
LEAST_ROWS = 300
"""Least number of rows that remain of a record after a cut. A convention."""


def run(
    cells: str = "experiments/cells", cuts: PositiveInt = 40, seed: NonNegativeInt = 0
) -> Iterator[dict[str, Any]]:
    """One row per record, and one with `summary`: true for the records that the files were fitted to (`fitted`: true)
    and one for the others. `failed` counts the records that could not be read or cut.

    cells : folder of the cell files.  cuts : number of rows at which each record is cut.  seed : of these rows.
    """
    for fitted, records in ((True, FITTED), (False, PUBLISHED)):
        found: list[dict[str, Any]] = []
        failed = 0
        for data, file, name in records:
            try:
                record = read_measurement(locate(data, name))
                rows = readings(cell_of(Path(cells), data, file), record, cuts, np.random.default_rng(seed))
            except AesiError as error:
                failed += 1
                yield {"cell": data, "record": name, "error": str(error)}
                continue
            found += rows
            yield {"cell": data, "record": name, **reading_figures(rows)}
        yield {"summary": True, "fitted": fitted, "failed": failed, **reading_figures(found)}


def readings(cell: Cell, record: Measurement, cuts: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """One entry per cut of the record: what the reading is based on, its error, and which given states it contradicts.

    `basis` is `rest`, `full charge`, `load`, `charge` (a load that charges), or `refused`; `off` is the reading minus
    the reference, and `sd` the stated standard deviation, both as shares of the capacity.
    Raises DataError if the record has too few rows for the cuts.
    """
    places = len(record) - LEAST_ROWS
    if places < cuts:
        raise DataError(
            f"{record.name}: its {len(record):,} rows leave {max(places, 0):,} places for {cuts:,} cuts, with "
            f"{LEAST_ROWS} rows after each; ask for fewer (cuts)."
        )
    truth = initial_state(cell, record).soc - record.discharged_ah("backward") / cell.capacity_ah
    return [
        _read(cell, record.take(slice(int(row), None)), float(truth[row]))
        for row in np.sort(rng.choice(places, cuts, replace=False))
    ]


def _read(cell: Cell, record: Measurement, truth: float) -> dict[str, Any]:
    try:
        read = initial_state(cell, record)
    except DataError:
        return {"basis": "refused"}
    wrong = truth + (WRONG if truth < 0.5 else -WRONG)
    return {
        "basis": "charge" if read.basis == "load" and record.current_a[0] < 0.0 else read.basis,
        "off": read.soc - truth,
        "sd": read.sd,
        "doubted": max(initial_state(cell, record, truth + d).contradicted for d in (-NEAR, NEAR)),
        "caught": initial_state(cell, record, wrong).contradicted,
    }


def reading_figures(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The figures of many readings.

    For each basis the number of readings, and their RMS and largest error in percentage points of the state of charge
    (`points`) and in stated standard deviations (`sds`). `refused` counts records without a reading.
    `right_doubted_pct` is the share of readings where the voltage contradicts one of two nearly right states, NEAR
    above and below the reference, and `wrong_caught_pct` that where it contradicts a wrong one. Readings under a
    charging load are separate, since the file of a cell with hysteresis has the potential of the discharge alone.
    """
    out: dict[str, Any] = {"readings": len(rows), "refused": sum(r["basis"] == "refused" for r in rows)}
    read = [r for r in rows if r["basis"] != "refused"]
    for basis in ("rest", "full charge", "load", "charge"):
        off = np.array([r["off"] for r in read if r["basis"] == basis])
        sd = np.array([r["sd"] for r in read if r["basis"] == basis])
        if len(off):
            key = basis.replace(" ", "_")
            out |= {key: len(off), f"{key}_rms_points": _points(rms(off))}
            out |= {f"{key}_worst_points": _points(np.abs(off).max())}
            out |= {f"{key}_rms_sds": round(rms(off / sd), 2), f"{key}_worst_sds": _worst(off, sd)}
    if read:
        out["right_doubted_pct"] = _points(np.mean([r["doubted"] for r in read]))
        out["wrong_caught_pct"] = _points(np.mean([r["caught"] for r in read]))
    return out


def _points(share: float) -> float:
    return round(100.0 * float(share), 2)


def _worst(off: Array, sd: Array) -> float:
    return round(float(np.max(np.abs(off) / sd)), 2)
