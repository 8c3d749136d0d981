"""`aesi bench cells`: the physics alone on every measured cell, record and temperature, in free run.

Each record is simulated whole, from the state of charge that `initial_state` finds: as the start file of its cell
declares it (for a cell with published parameters: as published), with the cell file of this project that was calibrated
on other records of it, with that file at the record's measured temperature, and the same at the state of health that
the calibration gives the cell for the day of the record (`aged`, see `aesi.bench.physics.tested`): a cell that was
tested for five months is not the same cell.
`windows` is ours under a protocol of others: windows of 1,024 rows, each from rest at a state of charge that is given.

A model that runs out (a surface or the electrolyte, see `aesi.physics.depletion`) is held at its edge to the end of the
record and said in `ran_out`; its figure counts all rows. Where a tester holds the lower cut-off voltage, the current is
what the cell gives there and no longer what was asked of it: by that current a model that has a little more charge goes
on above, one that has a little less falls to nothing. Such records say from when (`held_from_s`), and what is left of
the rows before (`until_held_mv`). A record that entered the calibration of its file is marked:
its figure is no test. What others print is beside ours with its protocol; none of it was run here.
With `archive` it is the records of the published archives that chose nothing (`aesi.bench.physics.archive`); beside the
others stands, where there is one, the file that was fitted to loads of the archive in the cold as well, whose figures
on these are marked and count in no median.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench import some_chosen
from aesi.bench.physics.archive import ARCHIVE, HG2, NCR, chamber, degc_of
from aesi.bench.physics.tested import soh_on_its_day
from aesi.constants import MV_PER_V
from aesi.data.catalogue import locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics import Cell, ModelName, initial_state, simulate
from aesi.records import Measurement

WINDOW_ROWS = 1024
"""Rows of a window, as ECM-UDE judges."""
HELD_WITHIN_V = 0.01
"""Distance from the cut-off voltage, V, within which a tester holds the rows. Of those of 0degC_cycle_1 98 % are
within 5 mV below and 9 above it."""
HELD_SHARE, HELD_FROM_THEN_ON = 0.01, 0.1
"""Shares of held rows among all, and among those from the first of them on: a record with more of both was held from
then on. Conventions: 8 of 45 of the Panasonic have 1 to 8 % of all, two of these 30 and 40 % from then on, six 3 to
4 %."""
NMC, LFP, M50T = "about_energy_nmc", "about_energy_lfp", "lg_m50t_w8"
START = "lg_m50_chen2020"
ECM_UDE = (
    "circuit + neural ODE, trained on UDDS at 25 degC, windows of 1,024 rows with the state of charge given"
)
PUBLISHED = "porous-electrode model, published parameters, full charge taken as state of charge 1"


@dataclass(frozen=True)
class MeasuredRecord:
    """A record: its set and file, whether its cell's file was fitted to it, and what others print on it.

    until_s : where it is read to.  others_mv, protocol : the best figure known, and how it was had.
    """

    data: str
    name: str
    fitted: bool = False
    until_s: float | None = None
    others_mv: float | None = None
    protocol: str = ""


FILES = {NCR: (START, NCR), HG2: (START, HG2), NMC: (None, None), LFP: (None, None), M50T: (START, None)}
"""Set -> start file and calibrated file of `experiments/cells`; None: the file published with the data, or none."""

COLD = "_cold"
"""Ends the name of the file of a cell that was fitted to loads in the cold of its archive, too, where there is one."""

RECORDS = (
    *(MeasuredRecord(NMC, name, others_mv=mv, protocol=PUBLISHED) for name, mv in (
        ("drive_cycle", 18.8), ("C20", 15.9), ("C2", 12.3), ("1C", 13.4))),
    *(MeasuredRecord(LFP, name) for name in ("drive_cycle", "C20", "C2", "1C", "2C")),
    MeasuredRecord(NCR, "25degC_us06", others_mv=39.3, protocol=ECM_UDE),
    MeasuredRecord(NCR, "25degC_la92", others_mv=19.4, protocol=ECM_UDE),
    MeasuredRecord(NCR, "25degC_hwfet", others_mv=73.4, protocol=ECM_UDE),
    *(MeasuredRecord(NCR, f"25degC_cycle_{k}") for k in (1, 2, 3)),
    MeasuredRecord(NCR, "10degC_cycle_1", others_mv=43.5, protocol=f"UDDS; {ECM_UDE}"),
    MeasuredRecord(NCR, "0degC_cycle_1", others_mv=71.0, protocol=f"UDDS; {ECM_UDE}"),
    MeasuredRecord(NCR, "n10degC_cycle_1", others_mv=127.4, protocol=f"UDDS; {ECM_UDE}"),
    *(MeasuredRecord(NCR, f"{name}", fitted=True)
        for name in ("25degC_1c_start", "25degC_c20_ocv", "25degC_hppc", "10degC_hppc", "0degC_hppc")),
    MeasuredRecord(NCR, "n10degC_hppc", fitted=True, until_s=78611.0),
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


ARCHIVED = tuple(MeasuredRecord(data, name) for data, days in ARCHIVE.items() for name in days)


def run(
    cells: str = "experiments/cells",
    only: Sequence[str] | str = (),
    archive: bool = False,
    porous: bool = False,
) -> Iterator[dict[str, Any]]:
    """One dict a record, and a last one with `summary`: true.

    cells : folder of the cell files.  only : names of sets or records; all without it.  archive : of the records of the
    published archives, in place of those of the sets.  porous : add `porous_mv`, the file at the measured temperature
    with the porous electrode in place of the single particle, some seconds a record.  Raises InputError where a name of
    `only` is none.
    """
    rows = []
    for record in _chosen([only] if isinstance(only, str) else only, ARCHIVED if archive else RECORDS):
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
        "others_printed": len(beaten),
        "below_others": sum(best(r) < r["others_mv"] for r in beaten),
    }


def _chosen(only: Sequence[str], there: Sequence[MeasuredRecord]) -> list[MeasuredRecord]:
    """The records of the named sets or names, each of which has to be one; all where none is given."""
    names = [name for record in there for name in (record.data, record.name)]
    for one in only:
        some_chosen("cells", [name for name in names if name == one], names)
    return [record for record in there if not only or record.data in only or record.name in only]


def best(row: dict[str, Any]) -> float:
    """The figure of the fullest model that a row has, the age of the cell not used."""
    return next(
        row[k] for k in ("with_temperature_mv", "calibrated_mv", "declared_mv") if row.get(k) is not None
    )


COLUMNS = {
    "declared_mv": "declared",
    "calibrated_mv": "calibrated",
    "with_temperature_mv": "with temperature",
    "aged_mv": "aged",
    "windows_mv": "windows",
    "hybrid_mv": "hybrid",
}


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines of Markdown: the rows, then the protocols of others."""
    protocols = list(dict.fromkeys(r["others"] for r in rows if r.get("others")))
    lines = [f"| cell | record | mean degC | {' | '.join(COLUMNS.values())} | others |"]
    lines.append("|---|---|" + "---:|" * (len(COLUMNS) + 1) + "---|")
    for row in rows:
        name = row["record"] + (" (fitted)" if row["fitted"] else "")
        shown = [_shown(row, key) for key in COLUMNS]
        others = (
            f"{row['others_mv']:g} [{protocols.index(row['others']) + 1}]" if row.get("others_mv") else ""
        )
        degc = "" if row.get("mean_degc") is None else f"{row['mean_degc']:.1f}"
        lines.append(f"| {row['cell']} | {name} | {degc} | {' | '.join(shown)} | {others} |")
    return [*lines, "", *(f"[{k}] {text}.  " for k, text in enumerate(protocols, start=1))]


HEADINGS = COLUMNS | {"porous_mv": "porous electrode", "cold_mv": "fitted in the cold"}
JUDGED = ("declared_mv", "with_temperature_mv", "porous_mv", "aged_mv", "cold_mv")
"""Of a record of an archive: the start file, the calibrated one by both models, and at the state of its day, and the
one that was fitted to a load in the cold as well."""


def archive_table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines of Markdown: median and worst of the records of each chamber, mV, then each record in a block to open."""
    there = sorted(
        (row for row in rows if "error" not in row),
        key=lambda row: (row["cell"], degc_of(row["record"]), row["record"]),
    )
    keys = [key for key in JUDGED if any(row.get(key) is not None for row in there)]
    records = (f"    {line}" for line in _by_record(there, keys))
    return [*_by_chamber(there, keys), "", '??? note "Each record of the archives"', "", *records]


def _by_chamber(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> Iterator[str]:
    """Median and worst of the records of each cell and chamber that were not fitted, mV."""
    yield f"| cell | chamber | records | {' | '.join(HEADINGS[key] for key in keys)} | ran out |"
    yield "|---|---|---:|" + "---:|" * (len(keys) + 1)
    for cell, place in dict.fromkeys((row["cell"], chamber(row["record"])) for row in rows):
        ours = [row for row in rows if (row["cell"], chamber(row["record"])) == (cell, place)]
        figures = [
            [row[key] for row in ours if row.get(key) is not None and key not in row.get("fitted_mv", ())]
            for key in keys
        ]
        told = " | ".join(f"{np.median(each):.1f} / {max(each):.1f}" if each else "" for each in figures)
        out = sum("with_temperature" in row["ran_out"] for row in ours)
        yield f"| {cell} | {place} | {len(ours)} | {told} | {out or ''} |"


def _by_record(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> Iterator[str]:
    yield f"| cell | record | mean degC | {' | '.join(HEADINGS[key] for key in keys)} |"
    yield "|---|---|---:|" + "---:|" * len(keys)
    for row in rows:
        told = " | ".join(_shown(row, key) for key in keys)
        yield f"| {row['cell']} | {row['record']} | {row['mean_degc']:.1f} | {told} |"


def _shown(row: Mapping[str, Any], key: str) -> str:
    if key == "hybrid_mv" and row.get("trained"):
        return "trained"
    if row.get(key) is None:
        return ""
    name = key.removesuffix("_mv")
    ran_out = row.get("ran_out", {}).get(name)
    until_held = row.get("until_held_mv", {}).get(name)
    fitted = " (fitted)" if key in row.get("fitted_mv", ()) else ""
    told = "" if ran_out is None else f" (ran out at {ran_out:.0f} s)"
    held = "" if until_held is None else f" ({until_held:.1f} until {row['held_from_s']:.0f} s)"
    return f"{row[key]:.1f}{fitted}{told}{held}"


def judged(cells: Path, record: MeasuredRecord, porous: bool = False) -> dict[str, Any]:
    """RMSE of one record, mV; a record that cannot be had or simulated says why."""
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
    data = read_measurement(locate(record.data, record.name), stop_s=record.until_s)
    measured = data.temperature_degc
    bare = replace(data, temperature_degc=None)
    start, calibrated = FILES[record.data]
    best_cell = cell_of(cells, record.data, start)
    runs = {"declared": free_run(best_cell, bare)}
    out: dict[str, Any] = {"mean_degc": None if measured is None else round(float(measured.mean()), 1)}
    if calibrated is not None:
        best_cell = cell_of(cells, record.data, calibrated)
        runs["calibrated"] = free_run(best_cell, bare)
        if measured is not None:
            runs["with_temperature"] = free_run(best_cell, data)
            if porous:
                runs["porous"] = free_run(best_cell, data, "dfn")
        soh = soh_on_its_day(best_cell, record.data, record.name)
        if soh is not None:
            out["soh"] = round(soh, 3)
            runs["aged"] = free_run(best_cell.with_soh(soh), data)
        if record in ARCHIVED and (cells / f"{calibrated}{COLD}.bpx.json").is_file():
            cold = cell_of(cells, record.data, calibrated + COLD)
            runs["cold"] = free_run(cold, data)
            out["fitted_mv"] = ["cold_mv"] if record.name in dict(cold.fitted_at_k) else []
    if "windows" in record.protocol:
        out["windows_mv"] = windows_mv(best_cell, data)
    out |= {f"{name}_mv": run.rmse_mv for name, run in runs.items()}
    row = held_from(best_cell, data)
    if row is not None:
        out["held_from_s"] = float(data.time_s[row] - data.time_s[0])
        out["until_held_mv"] = {
            name: round(MV_PER_V * rms(run.error_v[:row]), 2) for name, run in runs.items()
        }
    return out | {"ran_out": {name: run.ran_out_s for name, run in runs.items() if run.ran_out_s is not None}}


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
"""Capacities as the makers state them, Ah, for cell files of another size of the same chemistry."""


@dataclass(frozen=True, eq=False)
class FreeRunError:
    """error_v : (n,) V measured less model.  rmse_mv : of all rows.  ran_out_s : from when on the model was held at an
    edge; None where it never was."""

    error_v: Array
    rmse_mv: float
    ran_out_s: float | None


def free_run(cell: Cell, data: Measurement, model: ModelName = "espm") -> FreeRunError:
    """A free run over all rows, held backward as loggers write, from the state of charge of the first."""
    error, gone = _errors(cell, data, initial_state(cell, data).soc, model)
    out_s = float(data.time_s[int(np.argmax(gone))]) if gone.any() else None
    return FreeRunError(error, round(MV_PER_V * rms(error), 2), out_s)


def held_from(cell: Cell, data: Measurement) -> int | None:
    """The first row at the lower cut-off voltage of a record that a tester held there from then on; None of one that it
    did not."""
    held = data.voltage_v < cell.lower_voltage_v + HELD_WITHIN_V
    first = int(np.argmax(held))
    return first if held.mean() > HELD_SHARE and held[first:].mean() > HELD_FROM_THEN_ON else None


def windows_mv(cell: Cell, data: Measurement, rows: int = WINDOW_ROWS) -> float:
    """Root mean square error, mV, over windows of `rows` rows, each from rest at the state of charge there.

    That is the record's first less the charge passed since: what one who gives the state of charge has.
    """
    soc = initial_state(cell, data).soc - data.discharged_ah("backward") / cell.capacity_ah
    parts = [slice(k, k + rows) for k in range(0, len(data), rows)]
    errors = [_errors(cell, data.take(part), float(soc[part.start]))[0] for part in parts]
    return round(MV_PER_V * rms(np.concatenate(errors)), 2)


def _errors(cell: Cell, data: Measurement, soc0: float, model: ModelName = "espm") -> tuple[Array, BoolArray]:
    """(n,) V measured less model, and whether the model is held at an edge there."""
    measured = data.temperature_degc
    run = simulate(
        cell, data.time_s, data.current_a, soc0, (), measured, "backward", on_depletion="clip", model=model
    )
    return data.voltage_v - run.voltage_v, run.series["depleted"] > 0.0
