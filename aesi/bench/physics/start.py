"""`aesi bench start`: the state of charge that the first row of a cut record is read as, against counted charge.

Some of the records are those that the cell files of this project were calibrated on, others of cells whose file was
published by others and saw none of them. Each is cut at random rows; what remains is read by `initial_state` as if it
were a record of its own, at rest or under load as it happens to begin. The reference is the reading of the whole
record, which begins with a rest or a full charge, less the charge that has flowed since; its own error is in all
figures, and so is the capacity of the file. A state of charge is also given, within `NEAR` of the reference and as far
off as `WRONG`: each reading says whether its voltage contradicts it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench.physics.archive import HG2, NCR
from aesi.bench.physics.cells import M50T, NMC, START, cell_of
from aesi.data.catalogue import locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError, DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics import Cell, initial_state
from aesi.records import Measurement

FITTED = ((NCR, NCR, "25degC_hppc"), (HG2, HG2, "25degC_cap_1c"), (HG2, HG2, "25degC_mixed1"))
"""Set, cell file, record: at 25 degC, where the capacity is that of the cell file, and without the slow discharges,
whose cycler counts some percent of charge too much."""
PUBLISHED = ((NMC, None, "drive_cycle"), (M50T, START, "n0_hppc"), (M50T, START, "n0_udds"))
"""Set, cell file and record of the same cases by files that saw none of the records; None is the file published with
the set."""
NEAR, WRONG = 0.02, 0.2
"""Errors of a given state of charge: that of a careful user, and a mistake. Conventions of this benchmark."""
LEAST_ROWS = 300
"""Least rows that have to remain of a record."""


def run(
    cells: str = "experiments/cells", cuts: PositiveInt = 40, seed: NonNegativeInt = 0
) -> Iterator[dict[str, Any]]:
    """A dict a record, and one with `summary`: true for the files fitted to the records (`fitted`) and for the others,
    which counts the records that could not be read or cut (`failed`).

    cells : folder of the cell files.  cuts : rows at which each record is cut.
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
            yield {"cell": data, "record": name, **figures(rows)}
        yield {"summary": True, "fitted": fitted, "failed": failed, **figures(found)}


def readings(cell: Cell, record: Measurement, cuts: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """One dict a cut: on what its reading rests, how far it is off the reference, and what it contradicts.

    Raises DataError where the record has fewer rows than cuts to begin at.
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


def figures(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """By basis how many readings, their root mean square and largest error in points of charge and over what the
    reading claims; how many were refused; of states given, the percentage of right ones doubted and of wrong ones
    caught.

    A load that charges stands apart: of a cell with hysteresis the file has the discharge alone.
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
