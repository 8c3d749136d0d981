"""`aesi bench cells`: how large is the error of the physics models on every measured record, in free run?

Each record is simulated whole, from the state of charge that `initial_state` finds, with

    declared          the start file of its cell (for a cell with published parameters, the published file)
    calibrated        the cell file of this project, which was calibrated on other records of the cell
    with_temperature  the same file, at the measured temperature of the record
    aged              the same, at the state of health that the calibration gives the cell for the day of the record
                      (`aesi.bench.physics.tested`); the cells aged during months of tests
    windows           the calibrated file, or else the published one, under the protocol of a publication: windows of
                      WINDOW_ROWS rows, each from rest at a given state of charge

The figures are RMS errors of the voltage, mV. A model that runs out of lithium or salt (`aesi.physics.depletion`) is
held at that limit to the end of the record; `ran_out` gives the time, s, and the figure counts all rows. Where a tester
holds the lower cut-off voltage, the current is the one that the cell delivers at this voltage. Under that current a
model with a little more charge continues above the cut-off, and a model with a little less charge collapses. For such
records `held_from_s` gives the time, and `until_held_mv` the errors over the rows before. A record that entered the
calibration of its file is marked `fitted`: its figure is no test. Published figures of others stand beside ours with
their protocol; they were not computed here.

With `archive` the records are those of the published archives (`aesi.bench.physics.archive`). Further figures are then
those of other files of the cell at the measured temperature, where there are such: of the file that was fitted at 25
degC alone (`alone`), and of the file that was also fitted to records of the archive in the cold (`cold`). Figures of a
file on records that it was fitted to are marked and are left out of the medians. Rules may be chosen on every second
record of an archive, beginning with the first (`development`). With `charges` the records are the charges of the
archives, and a further figure is that at the state of health that the charge itself shows, since it ends full
(`charged`; `aesi.calibration.records.sizes.charged_share`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench import some_chosen
from aesi.bench.physics.archive import ARCHIVE, CHARGES, archive_day, for_development
from aesi.bench.physics.cells_table import tested_mv
from aesi.bench.physics.tested import soh_on_its_day
from aesi.calibration.records.sizes import charged_share, ends_full
from aesi.constants import MV_PER_V
from aesi.data.catalogue import HG2, LFP, M50T, NMC, PANASONIC, locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError, InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics import Cell, ModelName, initial_state, simulate
from aesi.records import Measurement

WINDOW_ROWS = 1024
"""Rows of a window in the protocol of the publication (ECM_UDE)."""
HELD_WITHIN_V = 0.01
"""Distance above the lower cut-off voltage, V, within which a row counts as held there by the tester. Of the held rows
of 0degC_cycle_1, 98 % are within 5 mV below and 9 mV above it."""
HELD_SHARE, HELD_FROM_THEN_ON = 0.01, 0.1
"""Least share of held rows among all rows, and among the rows from the first held one on, of a record that the tester
held at the cut-off. Conventions: of 45 records of the Panasonic, 8 have 1 to 8 % of held rows among all; from the first
of them on two of these have 30 and 40 %, and six have 3 to 4 %."""
START = "lg_m50_chen2020"
ECM_UDE = (
    "circuit + neural ODE, trained on UDDS at 25 degC, windows of 1,024 rows with the state of charge given"
)
PUBLISHED = "porous-electrode model, published parameters, full charge taken as state of charge 1"


@dataclass(frozen=True)
class MeasuredRecord:
    """A record with the best published figure on it.

    data, name : data set and record.  fitted : whether the calibrated file of the cell was fitted to the record.
    until_s : s, the record is read up to this time; None reads all of it.  others_mv : lowest published RMS error, mV,
    or None.  protocol : model and protocol of that figure.
    """

    data: str
    name: str
    fitted: bool = False
    until_s: float | None = None
    others_mv: float | None = None
    protocol: str = ""


FILES = {
    PANASONIC: (START, PANASONIC),
    HG2: (START, HG2),
    NMC: (None, None),
    LFP: (None, None),
    M50T: (START, None),
}
"""Data set -> (start file, calibrated file) of `experiments/cells`. None as the start file means the file published
with the data, None as the calibrated file that there is none."""
NOMINAL_AH = {PANASONIC: 2.9, HG2: 3.0}
"""Nominal capacity as the maker states it, Ah, to which the start file of another cell is scaled."""

BESIDE = {"alone": "_25degc", "cold": "_cold"}
"""Figure -> suffix of the calibrated file that it is of: fitted at 25 degC alone, and also fitted to records of the
archive in the cold."""
MODELS = ("declared", "calibrated", "with_temperature", "porous", "aged", "charged", *BESIDE)
"""The figures of a record, each an entry `..._mv` of its row."""

RECORDS = (
    *(MeasuredRecord(NMC, name, others_mv=mv, protocol=PUBLISHED) for name, mv in (
        ("drive_cycle", 18.8), ("C20", 15.9), ("C2", 12.3), ("1C", 13.4))),
    *(MeasuredRecord(LFP, name) for name in ("drive_cycle", "C20", "C2", "1C", "2C")),
    MeasuredRecord(PANASONIC, "25degC_us06", others_mv=39.3, protocol=ECM_UDE),
    MeasuredRecord(PANASONIC, "25degC_la92", others_mv=19.4, protocol=ECM_UDE),
    MeasuredRecord(PANASONIC, "25degC_hwfet", others_mv=73.4, protocol=ECM_UDE),
    *(MeasuredRecord(PANASONIC, f"25degC_cycle_{k}") for k in (1, 2, 3)),
    MeasuredRecord(PANASONIC, "10degC_cycle_1", others_mv=43.5, protocol=f"UDDS; {ECM_UDE}"),
    MeasuredRecord(PANASONIC, "0degC_cycle_1", others_mv=71.0, protocol=f"UDDS; {ECM_UDE}"),
    MeasuredRecord(PANASONIC, "n10degC_cycle_1", others_mv=127.4, protocol=f"UDDS; {ECM_UDE}"),
    *(MeasuredRecord(PANASONIC, name, fitted=True)
        for name in ("25degC_1c_start", "25degC_c20_ocv", "25degC_hppc", "10degC_hppc", "0degC_hppc")),
    MeasuredRecord(PANASONIC, "n10degC_hppc", fitted=True, until_s=78611.0),
    MeasuredRecord(HG2, "25degC_us06"),
    MeasuredRecord(HG2, "25degC_la92"),
    MeasuredRecord(HG2, "25degC_mixed2"),
    MeasuredRecord(HG2, "25degC_mixed3"),
    MeasuredRecord(HG2, "0degC_mixed1"),
    MeasuredRecord(HG2, "40degC_la92"),
    MeasuredRecord(HG2, "10degC_us06"),
    MeasuredRecord(HG2, "25degC_cap_1c_b"),
    *(MeasuredRecord(HG2, name, fitted=True)
        for name in ("25degC_c20_ocv", "40degC_c20_ocv", "0degC_c20_ocv", "25degC_cap_1c", "25degC_mixed1",
                     "n10degC_cap_1c")),
    MeasuredRecord(M50T, "n0_udds", others_mv=15.3, protocol="SPMe of PyBaMM, parameters of O'Regan et al. 2022"),
)  # fmt: skip


def run(
    cells: str = "experiments/cells",
    only: Sequence[str] | str = (),
    archive: bool = False,
    charges: bool = False,
    development: bool | None = None,
    porous: bool = False,
) -> Iterator[dict[str, Any]]:
    """One row per record, and a last row with `summary`: true.

    cells : folder of the cell files.  only : names of data sets or records; empty takes all.  archive : take the
    records of the published archives in place of those of the data sets.  charges : take the charges of the archives
    in place of them.  development : of records of the archives, True takes those on which rules may be chosen, False
    the others.  porous : add `porous_mv`, the error of the porous-electrode model with the calibrated file at the
    measured temperature, which takes some seconds per record.
    Raises InputError if a name in `only` is no data set and no record, for `archive` with `charges`, and for
    `development` without one of them.
    """
    if archive and charges:
        raise InputError("cells: archive and charges are two sets of records; give one of them.")
    if development is not None and not (archive or charges):
        raise InputError(
            "cells: development chooses among the records of the archives; add --set archive=true or --set "
            "charges=true."
        )
    rows = []
    records = _of_archive(CHARGES if charges else ARCHIVE, development) if archive or charges else RECORDS
    for record in _chosen([only] if isinstance(only, str) else only, records):
        row = judged(Path(cells), record, porous)
        rows.append(row)
        yield row
    tests = [r for r in rows if not r["fitted"] and "error" not in r]
    beaten = [r for r in tests if r.get("others_mv") is not None]
    yield {
        "summary": True,
        "records": len(rows),
        "failed": sum("error" in r for r in rows),
        "ran_out": sum(bool(r.get("ran_out")) for r in rows),
        "test_records": len(tests),
        "median_rmse_mv": float(np.median([best(r) for r in tests])) if tests else None,
        "geometric_mean_mv": _geometric_means(tests),
        "others_printed": len(beaten),
        "below_others": sum(best(r) < r["others_mv"] for r in beaten),
    }


def _of_archive(kind: Mapping[str, Mapping[str, str]], development: bool | None) -> list[MeasuredRecord]:
    """The records of one kind of the archives: those for development, or the others; None takes all."""
    return [
        MeasuredRecord(data, name)
        for data, days in kind.items()
        for name in days
        if development is None or for_development(data, name) == development
    ]


def _geometric_means(rows: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Model -> the geometric mean of its RMS errors, mV, over the records that it was not fitted to."""
    columns = {key: tested_mv(rows, key) for key in (f"{model}_mv" for model in MODELS)}
    return {key: round(float(np.exp(np.mean(np.log(mv)))), 2) for key, mv in columns.items() if mv}


def _chosen(only: Sequence[str], records: Sequence[MeasuredRecord]) -> list[MeasuredRecord]:
    """The records that `only` names, by data set or by record; all if it is empty.  Raises InputError for an unknown
    name."""
    names = [name for record in records for name in (record.data, record.name)]
    for one in only:
        some_chosen("cells", [name for name in names if name == one], names)
    return [record for record in records if not only or record.data in only or record.name in only]


def best(row: dict[str, Any]) -> float:
    """The RMS error, mV, of the most complete model of a row that does not use the age of the cell: with temperature,
    else calibrated, else declared."""
    return next(
        row[k] for k in ("with_temperature_mv", "calibrated_mv", "declared_mv") if row.get(k) is not None
    )


def judged(cells: Path, record: MeasuredRecord, porous: bool = False) -> dict[str, Any]:
    """The row of one record; if it is not available or cannot be simulated, the row has the reason in `error`."""
    head: dict[str, Any] = {"cell": record.data, "record": record.name, "fitted": record.fitted}
    try:
        return (
            head
            | _figures(cells, record, porous)
            | {"others_mv": record.others_mv, "others": record.protocol}
        )
    except AesiError as error:
        return head | {"error": str(error)}


def _figures(cells: Path, record: MeasuredRecord, porous: bool) -> dict[str, Any]:
    """The entries of a row about the errors, mV, of the models that there are for the cell (see the module)."""
    data = read_measurement(locate(record.data, record.name), stop_s=record.until_s)
    measured = data.temperature_degc
    bare = replace(data, temperature_degc=None)
    start, calibrated = FILES[record.data]
    cell = cell_of(cells, record.data, start)
    runs = {"declared": free_run(cell, bare)}
    out: dict[str, Any] = {"mean_degc": None if measured is None else round(float(measured.mean()), 1)}
    if calibrated is not None:
        cell = cell_of(cells, record.data, calibrated)
        runs["calibrated"] = free_run(cell, bare)
        if measured is not None:
            runs["with_temperature"] = free_run(cell, data)
            if porous:
                runs["porous"] = free_run(cell, data, "dfn")
        soh = soh_on_its_day(cell, record.data, record.name)
        if soh is not None:
            out["soh"] = round(soh, 3)
            runs["aged"] = free_run(cell.with_soh(soh), data)
        charged = charged_share(cell, data, initial_state(cell, data)) if ends_full(cell, data) else None
        if charged is not None:
            out["charged_soh"], out["charged_soh_sd"] = round(charged.share, 3), round(charged.sd, 3)
            runs["charged"] = free_run(cell.with_soh(charged.share), data)
        if measured is not None and archive_day(record.data, record.name) is not None:
            others = _beside(cells, record.data, calibrated)
            runs |= {name: free_run(other, data) for name, other in others.items()}
            fitted = [name for name, other in others.items() if record.name in dict(other.fitted_at_k)]
            out["fitted_mv"] = [f"{name}_mv" for name in fitted]
    if "windows" in record.protocol:
        out["windows_mv"] = windows_mv(cell, data)
    out |= {f"{name}_mv": run.rmse_mv for name, run in runs.items()}
    row = held_from(cell, data)
    if row is not None:
        out["held_from_s"] = float(data.time_s[row] - data.time_s[0])
        out["until_held_mv"] = {
            name: round(MV_PER_V * rms(run.error_v[:row]), 2) for name, run in runs.items()
        }
    return out | {"ran_out": {name: run.ran_out_s for name, run in runs.items() if run.ran_out_s is not None}}


def cell_of(cells: Path, data: str, name: str | None) -> Cell:
    """A cell file of the folder `cells`; None as the name takes the file published with the data set.

    The start file is that of another cell for most sets: its electrode area is scaled to the nominal capacity of the
    set's cell (NOMINAL_AH).
    """
    if name is None:
        return Cell.from_bpx(locate(data, "cell.bpx.json"))
    cell = Cell.from_bpx(cells / f"{name}.bpx.json")
    if name != START or data == M50T:
        return cell
    factor = NOMINAL_AH[data] / cell.capacity_ah
    return replace(
        cell, electrode_area_m2=cell.electrode_area_m2 * factor, nominal_capacity_ah=NOMINAL_AH[data]
    )


def _beside(cells: Path, data: str, calibrated: str) -> dict[str, Cell]:
    """Figure -> the cell file that it is of, for the further files of a data set (`BESIDE`) that are in the folder."""
    paths = {name: cells / f"{calibrated}{suffix}.bpx.json" for name, suffix in BESIDE.items()}
    return {
        name: cell_of(cells, data, calibrated + BESIDE[name])
        for name, path in paths.items()
        if path.is_file()
    }


@dataclass(frozen=True, eq=False)
class FreeRunError:
    """The error of one free run.

    error_v : (n,) V, measured minus model.  rmse_mv : over all rows.  ran_out_s : s, time of the first row at which the
    model was held at the limit of depletion; None if it never was.
    """

    error_v: Array
    rmse_mv: float
    ran_out_s: float | None


def free_run(cell: Cell, data: Measurement, model: ModelName = "espm") -> FreeRunError:
    """A free run over all rows, from the state of charge that `initial_state` finds. The current is constant between
    rows (hold `backward`), as loggers record it."""
    error, depleted = _errors(cell, data, initial_state(cell, data).soc, model)
    ran_out_s = float(data.time_s[int(np.argmax(depleted))]) if depleted.any() else None
    return FreeRunError(error, round(MV_PER_V * rms(error), 2), ran_out_s)


def held_from(cell: Cell, data: Measurement) -> int | None:
    """Index of the first row at the lower cut-off voltage if the tester held the cell there from then on; None if it
    did not."""
    held = data.voltage_v < cell.lower_voltage_v + HELD_WITHIN_V
    first = int(np.argmax(held))
    return first if held.mean() > HELD_SHARE and held[first:].mean() > HELD_FROM_THEN_ON else None


def windows_mv(cell: Cell, data: Measurement, rows: int = WINDOW_ROWS) -> float:
    """RMS error, mV, over windows of `rows` rows. Each window is simulated from rest at a given state of charge: that
    of the record's first row minus the charge passed since."""
    soc = initial_state(cell, data).soc - data.discharged_ah("backward") / cell.capacity_ah
    parts = [slice(k, k + rows) for k in range(0, len(data), rows)]
    errors = [_errors(cell, data.take(part), float(soc[part.start]))[0] for part in parts]
    return round(MV_PER_V * rms(np.concatenate(errors)), 2)


def _errors(cell: Cell, data: Measurement, soc0: float, model: ModelName = "espm") -> tuple[Array, BoolArray]:
    """(n,) V, measured minus model, and (n,) whether the model is held at the limit of depletion."""
    measured = data.temperature_degc
    run = simulate(
        cell, data.time_s, data.current_a, soc0, (), measured, "backward", on_depletion="clip", model=model
    )
    return data.voltage_v - run.voltage_v, run.series["depleted"] > 0.0
