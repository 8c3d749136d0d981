"""`aesi.discover` and `aesi.calibrate`: the commands of the same names as Python functions, over files or records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from itertools import islice
from numbers import Real
from os import PathLike
from pathlib import Path

import numpy as np

from aesi.advice import advises_python, with_arguments
from aesi.calibration import Calibration, Conditions
from aesi.constants import LARGEST_SEED
from aesi.data.read import Reading, examined, read
from aesi.data.reading import record_names
from aesi.data.spectra import check_spectrum, read_spectra
from aesi.errors import DataError, InputError, in_words
from aesi.over_time import stamp
from aesi.physics import ModelName
from aesi.physics.arguments import check_choice, checked_soc
from aesi.physics.cell import Soh
from aesi.pipeline.calibrate import Request, calibrate_declared, check_request
from aesi.pipeline.discovery.discover import Case, run_case
from aesi.pipeline.discovery.finding import Finding
from aesi.pipeline.discovery.searchable import searchable
from aesi.pipeline.product.declared import Declared, declared_model
from aesi.records import Hold, Measurement, Spectrum
from aesi.records.checked import check_whole_number, row_words
from aesi.tracer.discovery import Progress

FileOrRecord = str | PathLike[str] | Measurement
Data = FileOrRecord | Sequence[FileOrRecord]
"""One or several files, or measurements that `aesi.read_measurement` gave."""
FileOrSpectrum = str | PathLike[str] | Spectrum
Spectra = FileOrSpectrum | Sequence[FileOrSpectrum]
"""One or several spectra, or files of impedance spectra."""
MOST_HOLDOUT, MOST_EFFECTS = 0.9, 10
"""Upper limits of `holdout` and `max_effects`, as of `--holdout` and `--max-effects`."""


@advises_python
def discover(
    cell: Declared,
    data: Data,
    tests: Data = (),
    *,
    soc0: float | None = None,
    holdout: float | None = None,
    max_effects: int = 3,
    seed: int = 0,
    hold: Hold | None = None,
    effect_files: str | PathLike[str] | Sequence[str | PathLike[str]] = (),
    only: str | Sequence[str] = (),
    without: str | Sequence[str] = (),
    model: ModelName | None = None,
    soh: Soh | None = None,
    good: Data = (),
    out: str | PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Finding:
    """Find the effects that a cell's model lacks to explain measurements.

    cell : a BPX file, the folder of a saved model, a Cell or a HybridModel.
    data : measurements to fit, one or several. Without `tests`, the last `holdout` share of each (0 to 0.9 of its time;
    None: 0.3) is kept back for the test.
    tests : measurements for the test only; nothing is fitted to them.
    soc0 : state of charge at the first sample, 0 to 1; None reads it from the voltage.
    max_effects : most effects that may be added, 0 to 10.  seed : of the bootstrap intervals.
    hold : how the current runs between rows; None takes the declaration of each record, and of one without what
    explains it better.
    effect_files : Python files with effects of your own; they are executed, so name only files that you trust.
    only, without : ids of the effects to try, or not to try; parameters that excluded effects restate stay fixed.
    model : "espm" or "dfn" for every hypothesis; None takes the porous electrode where it differs notably from the
    single particle.
    soh : capacity of the cell then over that in its file, or the day of the test; None takes 1.
    good : measurements of the same cell that are known to be good. The search is then for differences of `data` from
    these.
    out : folder for discovery.json, report.html, model/ and the stored fits with which an interrupted search resumes.
    progress : called after each hypothesis.

    Raises AesiError, one sentence, for data that cannot be read, cannot decide anything, or are not of this cell.
    """
    soc0 = checked_soc(soc0)
    _check_asked(holdout, max_effects, seed)
    folder = None if out is None else _folder(out)
    given, parts = declared_model(cell), [_listed(part) for part in (data, tests, good)]
    given.with_soh(soh)  # refused before a record is read
    asked = [one for part in parts for one in part]
    found = iter(_read_all(asked, hold))
    measurements, judged, known = (tuple(islice(found, len(part))) for part in parts)
    named = [effect_files] if isinstance(effect_files, str | PathLike) else effect_files
    files = tuple(Path(file) for file in named)
    case = Case(
        given,
        measurements,
        judged,
        soc0=soc0,
        holdout=holdout,
        max_effects=max_effects,
        seed=seed,
        effect_files=files,
        only=_names("only", only),
        without=_names("without", without),
        model=model,
        soh=soh,
        good=known,
        reader="python",
    )
    case = searchable(case)  # refused before anything is searched
    finding = Finding(case, run_case(case, folder, progress))
    if folder is not None:
        finding.save(folder)
    return finding


@advises_python
def calibrate(
    cell: Declared,
    data: Data,
    *,
    soc0: float | None = None,
    temperatures_degc: Mapping[str, float] | None = None,
    dates: Mapping[str, date] | None = None,
    as_of: date | None = None,
    cut_offs_v: tuple[float, float] | None = None,
    body_mm: Sequence[float] | None = None,
    mass_g: float | None = None,
    priors: Mapping[str, tuple[float, float]] | None = None,
    spectra: Spectra = (),
    hold: Hold | None = None,
    model: ModelName | None = None,
    starts: int = 1,
    seed: int = 0,
) -> Calibration:
    """Fit the parameters that a cell's file declares to measurements; the fitted cell is `.cell` of the result.

    cell, data, soc0, hold : as for `discover`; the records may have different temperatures.
    temperatures_degc : record name -> degC, for records without a temperature column.  dates : record name -> day of
    the test; records of different days may have different ages.  as_of : day whose state of the cell is written; None
    takes the last day with a load.
    cut_offs_v : (lower, upper) V between which this cell is cycled; None takes those of its file.
    body_mm : (diameter, height) of this cell, or the three edges of a flat one, mm.  mass_g : its mass, g. They replace
    volume, surface and density of the file, see `Cell.with_body`.
    priors : parameter -> (value, standard deviation), for parameters that are known from elsewhere, with the names and
    units of the report (a factor is relative to the start file). The standard deviation is that of the natural
    logarithm for factors, double layers and the thermal conductivity.
    spectra : impedance spectra of this very cell, fitted together with the records, as with `--fit-impedance`: files or
    `aesi.records.Spectrum`s, one or several.
    model : "espm" or "dfn"; None takes that of a saved model, or the one that the file was fitted with, else "espm".
    starts : number of fits: one from the file, the others from cells drawn from the priors with `seed`; the best end is
    taken, and a note says how far apart they are.
    Raises AesiError, one sentence, for arguments or data that cannot be used.
    """
    soc0 = checked_soc(soc0)
    _check_by_name("temperatures_degc", temperatures_degc)
    _check_by_name("dates", dates)
    _check_priors(priors)
    _check_days(dates or {}, as_of)
    check_whole_number("starts", starts, 1)
    check_whole_number("seed", seed, 0, LARGEST_SEED)
    if cut_offs_v is not None and not _is_pair(cut_offs_v):
        raise InputError(f"cut_offs_v = {in_words(cut_offs_v)}: give (lower, upper) V, as in (2.5, 4.2).")
    given = declared_model(cell)
    conditions = Conditions(
        soc0,
        temperatures_degc or {},
        dates or {},
        as_of,
        model,
        spectra=_read_spectra(spectra),
        priors=priors or {},
    )
    request = Request(
        conditions,
        cut_offs_v=cut_offs_v,
        starts=starts,
        seed=seed,
        body_mm=body_mm,
        mass_g=mass_g,
    )
    check_request(given, request)  # refused before a record is read
    found = calibrate_declared(given, _read_all(_listed(data), hold), request)
    return replace(found, notes=tuple(map(with_arguments, found.notes)))


def _read_spectra(given: Spectra) -> tuple[Spectrum, ...]:
    """The spectra, read from files or given as such.  Raises InputError for any other object, and for a spectrum that a
    file would be refused for."""
    several = isinstance(given, Sequence) and not isinstance(given, str)
    found: list[Spectrum] = []
    listed = list(given) if several else [given]  # type: ignore[arg-type]
    for one in listed:
        if isinstance(one, Spectrum):
            check_spectrum(one)
            found.append(one)
        elif isinstance(one, str | PathLike):
            found += read_spectra(Path(one))
        else:
            raise InputError(
                f"spectra: an object of type {type(one).__name__} is no spectrum; give a file of spectra, or "
                "aesi.records.Spectrum."
            )
    return tuple(found)


def _names(what: str, ids: str | Sequence[str]) -> tuple[str, ...]:
    """The ids.  Raises InputError where `ids`, the argument `what`, is neither a text nor a sequence of texts."""
    given = (ids,) if isinstance(ids, str) else ids
    if not isinstance(given, Sequence) or not all(isinstance(one, str) for one in given):
        raise InputError(f"{what} = {ids!r}: give the id of an effect, or a list of ids.")
    return tuple(given)


def _is_pair(values: object) -> bool:
    """Whether a value is a sequence of two numbers."""
    return isinstance(values, Sequence) and len(values) == 2 and all(isinstance(one, Real) for one in values)


def _check_asked(holdout: object, max_effects: int, seed: int) -> None:
    """Raises InputError for a number that a search cannot use."""
    if holdout is not None and not (isinstance(holdout, Real) and 0.0 <= float(holdout) <= MOST_HOLDOUT):
        raise InputError(
            f"holdout = {in_words(holdout)} is not a share of the record, from 0 to {MOST_HOLDOUT:g}, to be kept back; "
            "30 % is 0.3."
        )
    check_whole_number("max_effects", max_effects, 0, MOST_EFFECTS)
    check_whole_number("seed", seed, 0, LARGEST_SEED)


def _check_by_name(what: str, given: object) -> None:
    """Raises InputError where an argument is no dict by record names."""
    if given is not None and not isinstance(given, Mapping):
        raise InputError(f"{what} = {in_words(given)} names no record; give a dict by the records' names.")


def _check_priors(priors: object) -> None:
    """Raises InputError where `priors` is no dict of (value, standard deviation) by parameter."""
    form = "a dict of (value, standard deviation) by the parameters' names in the report"
    if priors is not None and not isinstance(priors, Mapping):
        raise InputError(f"priors = {in_words(priors)} names no parameter; give {form}.")
    for name, prior in (priors or {}).items():
        if not _is_pair(prior):
            raise InputError(f"priors[{name!r}] = {prior!r} is no pair of numbers; give {form}.")


def _check_days(dates: Mapping[str, date], as_of: date | None) -> None:
    """Raises InputError for a day that is no datetime.date."""
    days = {f"dates[{name!r}]": day for name, day in dates.items()} | {"as_of": as_of}
    for name, day in days.items():
        if day is not None and not isinstance(day, date):
            raise InputError(f"{name} = {day!r} is no day; give a datetime.date, as in date(2019, 5, 31).")


def _folder(out: str | PathLike[str]) -> Path:
    """The folder for the results, created before the search, so that minutes of work are not lost for want of it."""
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"out = {str(out)!r} cannot be a folder: {error.strerror or error}.") from None
    return folder


def _listed(records: Data) -> list[FileOrRecord]:
    several = isinstance(records, Sequence) and not isinstance(records, str)
    listed = list(records) if several else [records]  # type: ignore[arg-type]
    for one in listed:
        if not isinstance(one, str | PathLike | Measurement):
            raise InputError(
                f"an object of type {type(one).__name__} is no record; give a file, what aesi.read_measurement gave, "
                "or aesi.Measurement(time_s, current_a, voltage_v), or a list of these."
            )
    return listed  # type: ignore[return-value]


def _read_all(records: Sequence[FileOrRecord], hold: Hold | None) -> list[Measurement]:
    """The records in their order; files of one name in several folders are called after folder and file."""
    if hold is not None:
        check_choice("hold", hold, Hold)
    names = iter(record_names([Path(one) for one in records if not isinstance(one, Measurement)]))
    return [
        _checked(one if isinstance(one, Measurement) else read(Path(one), Reading(), None, next(names)), hold)
        for one in records
    ]


def _checked(found: Measurement, hold: Hold | None) -> Measurement:
    """The record with the declared hold. One that no reader examined passes the checks of a file first.

    Raises DataError where a voltage is missing, and where a file with these rows would be refused.
    """
    if len(found) < 2:
        raise DataError(f"{found.name} has too few rows ({len(found)}); a record needs at least two.")
    unknown = np.isnan(found.voltage_v)
    if unknown.any():
        row = int(np.argmax(unknown))
        raise DataError(
            f"{found.name}: voltage_v is nan at {stamp(found.time_s[row])} s ({row_words(row)}); drop the row, or give "
            "the parts before and after it as records of their own."
        )
    whole = found if found.was_examined else examined(found)
    return whole if hold is None else whole.held(hold)
