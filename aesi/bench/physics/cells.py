"""`aesi bench cells`: the physics alone on every measured cell, record and temperature, in free run.

Each record is simulated whole, from the state of charge that `initial_state` finds, three times: as the start file of
its cell declares it (for a cell with published parameters: as published), with the cell file of this project that was
calibrated on other records of it, and with that file at the record's measured temperature. `aged` is the last one with
the capacity that a calibration record of the same month had. A record that entered the calibration of its file is
marked: its figure is no test.

What others print is beside ours with its protocol; none of it was run here.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from aesi.constants import MV_PER_V
from aesi.data.catalogue import locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError
from aesi.physics import Cell, initial_state, simulate
from aesi.records import Measurement

NCR, HG2, NMC, M50T = "panasonic_ncr18650pf", "lg_18650hg2", "about_energy_nmc", "lg_m50t_w8"
START = "lg_m50_chen2020"
ECM_UDE = (
    "circuit + neural ODE, trained on UDDS at 25 degC, windows of 1,024 rows with the state of charge given"
)
PUBLISHED = "porous-electrode model, published parameters, full charge taken as state of charge 1"


@dataclass(frozen=True)
class MeasuredRecord:
    """A record: its set and file, whether its cell's file was fitted to it, and what others print on it.

    until_s : where it is read to.  capacity_share : of the file's, found on a calibration record of the same month.
    others_mv, protocol : the best figure known, and how it was had.
    """

    data: str
    name: str
    fitted: bool = False
    until_s: float | None = None
    others_mv: float | None = None
    protocol: str = ""
    same_month: str | None = None


FILES = {NCR: (START, NCR), HG2: (START, HG2), NMC: (None, None), M50T: (START, None)}
"""Set -> start file and calibrated file of `experiments/cells`; None: the file published with the data, or none."""

RECORDS = (
    *(MeasuredRecord(NMC, name, others_mv=mv, protocol=PUBLISHED) for name, mv in (
        ("drive_cycle", 18.8), ("C20", 15.9), ("C2", 12.3), ("1C", 13.4))),
    MeasuredRecord(NCR, "25degC_us06", others_mv=39.3, protocol=ECM_UDE),
    MeasuredRecord(NCR, "25degC_la92", others_mv=19.4, protocol=ECM_UDE),
    MeasuredRecord(NCR, "25degC_hwfet", others_mv=73.4, protocol=ECM_UDE),
    *(MeasuredRecord(NCR, f"25degC_cycle_{k}") for k in (1, 2, 3)),
    MeasuredRecord(NCR, "10degC_cycle_1", others_mv=43.5, protocol=f"UDDS; {ECM_UDE}", same_month="10degC_hppc"),
    MeasuredRecord(NCR, "0degC_cycle_1", others_mv=71.0, protocol=f"UDDS; {ECM_UDE}", same_month="0degC_hppc"),
    MeasuredRecord(NCR, "n10degC_cycle_1", others_mv=127.4, protocol=f"UDDS; {ECM_UDE}", same_month="n10degC_hppc"),
    MeasuredRecord(NCR, "25degC_1c_start"),
    *(MeasuredRecord(NCR, f"{name}", fitted=True)
        for name in ("25degC_c20_ocv", "25degC_hppc", "10degC_hppc", "0degC_hppc")),
    MeasuredRecord(NCR, "n10degC_hppc", fitted=True, until_s=78611.0),
    MeasuredRecord(HG2, "25degC_us06"),
    MeasuredRecord(HG2, "25degC_la92"),
    MeasuredRecord(HG2, "25degC_mixed2"),
    MeasuredRecord(HG2, "25degC_mixed3"),
    MeasuredRecord(HG2, "0degC_mixed1"),
    MeasuredRecord(HG2, "40degC_la92"),
    MeasuredRecord(HG2, "10degC_us06"),
    MeasuredRecord(HG2, "n10degC_cap_1c"),
    *(MeasuredRecord(HG2, name, fitted=True) for name in ("25degC_cap_1c", "25degC_mixed1")),
    MeasuredRecord(M50T, "n0_udds", others_mv=15.3, protocol="SPMe of PyBaMM, parameters of O'Regan et al. 2022"),
)  # fmt: skip


def run(cells: str = "experiments/cells", only: Sequence[str] | str = ()) -> Iterator[dict[str, Any]]:
    """One dict a record, and a last one with `summary`: true.

    cells : folder of the cell files.  only : names of sets or records; all without it.
    """
    wanted = {only} if isinstance(only, str) else set(only)
    rows = []
    for record in RECORDS:
        if wanted and not wanted & {record.data, record.name}:
            continue
        row = judged(Path(cells), record)
        rows.append(row)
        yield row
    tests = [r for r in rows if not r["fitted"] and "error" not in r]
    beaten = [r for r in tests if r.get("others_mv") is not None]
    yield {
        "summary": True,
        "records": len(rows),
        "failed": sum("error" in r for r in rows),
        "test_records": len(tests),
        "median_rmse_mv": float(np.median([best(r) for r in tests])) if tests else None,
        "others_printed": len(beaten),
        "below_others": sum(best(r) < r["others_mv"] for r in beaten),
    }


def best(row: dict[str, Any]) -> float:
    """The figure of the fullest model that a row has, the age of the cell not used."""
    return next(
        row[k] for k in ("with_temperature_mv", "calibrated_mv", "declared_mv") if row.get(k) is not None
    )


def judged(cells: Path, record: MeasuredRecord) -> dict[str, Any]:
    """RMSE of one record, mV; a record that cannot be had or simulated says why."""
    head: dict[str, Any] = {"cell": record.data, "record": record.name, "fitted": record.fitted}
    try:
        data = read_measurement(locate(record.data, record.name), stop_s=record.until_s)
        measured = data.temperature_degc
        head["mean_degc"] = None if measured is None else round(float(measured.mean()), 1)
        bare = replace(data, temperature_degc=None)
        start, calibrated = FILES[record.data]
        head["declared_mv"] = rmse_mv(cell_of(cells, record.data, start), bare)
        if calibrated is not None:
            cell = cell_of(cells, record.data, calibrated)
            head["calibrated_mv"] = rmse_mv(cell, bare)
            head["with_temperature_mv"] = None if measured is None else rmse_mv(cell, data)
            if record.same_month is not None:
                share = capacity_share(cells, record.data, calibrated, record.same_month)
                head["aged_mv"] = rmse_mv(aged(cell, share), data)
                head["capacity_share"] = round(share, 3)
    except AesiError as error:
        return head | {"error": str(error)}
    return head | {"others_mv": record.others_mv, "others": record.protocol}


def cell_of(cells: Path, data: str, name: str | None) -> Cell:
    """A cell file of the folder, sized to the set where it is another cell's; None: the one published with the data."""
    if name is None:
        return Cell.from_bpx(locate(data, "cell.bpx.json"))
    cell = Cell.from_bpx(cells / f"{name}.bpx.json")
    if name != START or data == M50T:
        return cell
    factor = NOMINAL_AH[data] / cell.capacity_ah
    return replace(
        cell, electrode_area_m2=cell.electrode_area_m2 * factor, nominal_capacity_ah=NOMINAL_AH[data]
    )


NOMINAL_AH = {NCR: 2.9, HG2: 3.0}
"""As the makers state them, for cell files of another size of the same chemistry."""


def rmse_mv(cell: Cell, data: Measurement) -> float:
    """Root mean square error of a free run over all rows, held backward as loggers write."""
    start = initial_state(cell, data)
    run = simulate(
        cell,
        data.time_s,
        data.current_a,
        start.soc,
        (),
        data.temperature_degc,
        "backward",
        on_depletion="clip",
    )
    return round(MV_PER_V * float(np.sqrt(np.mean((data.voltage_v - run.voltage_v) ** 2))), 2)


def aged(cell: Cell, share: float) -> Cell:
    """The cell with a share of its capacity, all else the same."""
    n, p = cell.negative, cell.positive
    cell = cell.with_negative(c_max_mol_m3=n.c_max_mol_m3 * share)
    return cell.with_positive(c_max_mol_m3=p.c_max_mol_m3 * share)


@cache
def capacity_share(cells: Path, data: str, name: str, record: str) -> float:
    """Share of the file's capacity at which a calibration record is met best, by its error over the whole record."""
    until = next(r.until_s for r in RECORDS if (r.data, r.name) == (data, record))
    measured = read_measurement(locate(data, record), stop_s=until)
    cell = cell_of(cells, data, name)
    shares = np.linspace(0.86, 1.0, 8)
    errors = [rmse_mv(aged(cell, float(s)), measured) for s in shares]
    return float(shares[int(np.argmin(errors))])
