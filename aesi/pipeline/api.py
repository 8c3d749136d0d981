"""`aesi.discover` and `aesi.calibrate`: what the commands of that name do, over files or records, in Python."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from os import PathLike
from pathlib import Path

from aesi.calibration import Calibration
from aesi.calibration import calibrate as fit_cell
from aesi.calibration.start import sized
from aesi.data.read import Reading, read
from aesi.physics import ModelName
from aesi.physics.belongs import check_belongs
from aesi.pipeline.calibrate import check_records
from aesi.pipeline.discovery.cases import MOST_ROWS
from aesi.pipeline.discovery.discover import Case, run_case
from aesi.pipeline.discovery.finding import Finding
from aesi.pipeline.product.declared import Declared, declared_model
from aesi.records import Hold, Measurement
from aesi.tracer.discovery import Progress

FileOrRecord = str | PathLike[str] | Measurement
Data = FileOrRecord | Sequence[FileOrRecord]
"""Files, or what `aesi.read_measurement` gave; one, or several."""


def discover(
    cell: Declared,
    data: Data,
    tests: Data = (),
    *,
    soc0: float | None = None,
    holdout: float = 0.3,
    max_effects: int = 3,
    seed: int = 0,
    hold: Hold | None = None,
    effect_files: Sequence[str | PathLike[str]] = (),
    model: ModelName | None = None,
    soh: float | None = None,
    good: Data = (),
    out: str | PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Finding:
    """Find what a cell's model lacks to explain measurements.

    cell : a BPX file, the folder of a saved model, a Cell or a HybridModel.
    data : measurements that may be looked at, less the last `holdout` share of each where there are no `tests`.
    tests : measurements that choose nothing.
    soc0 : state of charge at the first sample; None takes it from the voltage.
    hold : how the current runs between rows; None takes what the records say.
    effect_files : Python files with effects of your own; they are run, so name only files that you trust.
    model : "espm" or "dfn" for every hypothesis; None takes the porous electrode where it differs notably.
    soh : share of the cell file's capacity that the cell had then; None takes all of it.
    good : measurements of the same cell that are known to be good: what is sought is what `data` have beside them.
    out : a folder for discovery.json, report.html and model/, and for fits, so that an interrupted search goes on.

    Raises AesiError, one sentence, for what cannot be read, decided or be of this cell.
    """
    given, parts = declared_model(cell).with_soh(soh), [_listed(part) for part in (data, tests, good)]
    rows = MOST_ROWS // max(1, sum(len(part) for part in parts))
    measurements, judged, known = (tuple(_read(one, rows, hold) for one in part) for part in parts)
    check_belongs(given.cell, [*measurements, *judged, *known])
    files = tuple(Path(file) for file in effect_files)
    case = Case(given, measurements, judged, soc0, holdout, max_effects, seed, files, model=model, good=known)
    finding = Finding(case, run_case(case, None if out is None else Path(out), progress))
    if out is not None:
        finding.save(Path(out))
    return finding


def calibrate(
    cell: Declared,
    data: Data,
    *,
    soc0: float | None = None,
    temperatures_degc: Mapping[str, float] | None = None,
    dates: Mapping[str, date] | None = None,
    as_of: date | None = None,
    hold: Hold | None = None,
    model: ModelName | None = None,
) -> Calibration:
    """Fit the parameters that a cell's file declares to measurements; the fitted cell is `.cell` of what comes back.

    cell, data, soc0, hold : as for `discover`; the records may be of any temperatures together.
    temperatures_degc : of records without a temperature column, by name.  dates : days of the records, by name; those
    of other days may be of another age.  as_of : day of the file's state; None takes the last with a load.
    model : that is fitted, "espm" or "dfn"; None takes that of a saved model, else "espm".
    Raises AesiError, one sentence, for what cannot be used.
    """
    given = declared_model(cell)
    declared, physics = given.cell, model or given.model
    measurements = [_read(one, None, hold) for one in _listed(data)]
    check_records(measurements, temperatures_degc)
    check_belongs(sized(declared, measurements)[0], measurements)  # the start file may be of another size
    return fit_cell(
        declared,
        measurements,
        soc0=soc0,
        temperatures_degc=temperatures_degc,
        physics=physics,
        dates=dates,
        as_of=as_of,
    )


def _listed(records: Data) -> list[FileOrRecord]:
    single = isinstance(records, str | PathLike | Measurement)
    return [records] if single else list(records)  # type: ignore[list-item, arg-type]


def _read(record: FileOrRecord, rows: int | None, hold: Hold | None) -> Measurement:
    found = record if isinstance(record, Measurement) else read(Path(record), Reading(), max_rows=rows)
    return found if hold is None else found.held(hold)
