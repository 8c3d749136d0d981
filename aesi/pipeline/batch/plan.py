"""Which cells with which records: from a folder, or from a table.

A folder holds one subfolder a cell with its records, and a BPX file in it (or one for all, given). A table is a CSV
with the columns `name` and `data` (several files separated by `;`), and where wanted `cell` (BPX file), `test`, `soc0`,
`soh`, `specimen` and `at`: rows of one specimen are check-ups of one cell, at a time or throughput of any unit.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TextIO

from aesi.data.reading import SUFFIXES
from aesi.errors import CellError, InputError
from aesi.physics.cell import Soh, checked_soh, read_soh
from aesi.pipeline.product.contents import contents
from aesi.pipeline.written import BATCH_SUMMARIES

CELL_FILES = ("*.bpx.json", "*.json")
LAID_BESIDE = (".", "~$")
"""Beginnings of the names of files that systems lay beside others: hidden ones, and locks of open workbooks."""
OTHER_SIGNS = {";": "semicolons", "\t": "tabs"}
"""Other separators of tables, which are refused: the semicolon stands between the files of one cell."""
COLUMNS = ("name", "data", "cell", "test", "soc0", "soh", "specimen", "at")


@dataclass(frozen=True)
class Job:
    """One cell and its records.

    specimen, at : which physical cell a check-up is of, and when; empty and None where it is none.
    soh : share of the cell file's capacity that the cell had in its discovery, or the day of the test; None for all of
    it.
    unusable : why the job cannot be done, as far as the plan tells; empty where it can.
    """

    name: str
    cell: Path
    data: tuple[Path, ...]
    tests: tuple[Path, ...] = ()
    soc0: float | None = None
    specimen: str = ""
    at: float | None = None
    soh: Soh | None = None
    unusable: str = ""

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that the job reads: the cell's (a saved model is a folder) and the records."""
        return self.cell, *self.data, *self.tests

    def resolved(self) -> Job:
        """The job with absolute paths, for a worker that was started in another folder."""
        data, tests = (tuple(path.resolve() for path in files) for files in (self.data, self.tests))
        return replace(self, cell=self.cell.resolve(), data=data, tests=tests)

    def key(self, settings: str) -> str:
        """Hash that identifies the job: content and purpose of its files, and its settings."""
        sha = hashlib.sha256(f"{settings}|{self.soc0}|{self.soh}|{bool(self.specimen)}".encode())
        for role, paths in (("cell", (self.cell,)), ("data", self.data), ("tests", self.tests)):
            for path in paths:
                for held in contents([path]):
                    sha.update(f"|{role}|".encode() + hashlib.sha256(held).digest())
        return sha.hexdigest()[:16]


def read_plan(source: Path, cell: Path | None = None, soh: Soh | None = None) -> tuple[Job, ...]:
    """The jobs of a folder or a table.

    cell : the BPX file (or model folder) of every job that names none.  soh : of every job that names none.
    What is missing of one job alone makes that `unusable`.  Raises InputError, one sentence, for what concerns the
    whole plan, and where no job can be done.
    """
    if soh is not None:
        checked_soh(soh)
    if not source.exists():
        raise InputError(f"There is no folder or table {source}.")
    if cell is not None and not cell.exists():
        raise InputError(f"There is no cell file {cell}, which is to be that of every job that names none.")
    jobs = _of_folder(source, cell) if source.is_dir() else _of_table(source, cell)
    _check_names(source, [job.name for job in jobs])
    _check_one_visit(source, jobs)
    _check_one_cell(source, jobs)
    if not jobs:
        raise InputError(f"{source} holds no cell: one subfolder each with its records, or a table of them.")
    if all(job.unusable for job in jobs):
        none = (
            "the one cell cannot be used"
            if len(jobs) == 1
            else f"none of the {len(jobs)} cells can be used; the first"
        )
        raise InputError(f"{none}: {jobs[0].unusable}")
    return tuple(job if job.soh is not None else replace(job, soh=soh) for job in jobs)


def _check_names(source: Path, names: list[str]) -> None:
    """Raises InputError for a name that is there twice, for one that is no name of a folder, and for that of a file of
    the batch, in capitals too: some file systems do not tell them apart."""
    first: dict[str, str] = {}
    for name in names:
        if name.lower() in first:
            other = first[name.lower()]
            also = "" if other == name else f" and {other!r}, which differ in capitals alone"
            raise InputError(
                f"{source}: two rows are named {name!r}{also}; names tell the folders of results apart: give each row "
                "its own."
            )
        first[name.lower()] = name
        if Path(name).name != name or name.startswith("."):
            raise InputError(
                f"{source}: {name!r} names a folder of results; give a name without slashes that starts with no dot."
            )
        if name.lower() in BATCH_SUMMARIES:
            raise InputError(
                f"{source}: {name!r} names a folder of results, and is the name of a file beside these; give another "
                "name."
            )


def _check_one_visit(source: Path, jobs: tuple[Job, ...]) -> None:
    """Raises InputError for two check-ups of one specimen at one time."""
    visits = [(job.specimen, job.at) for job in jobs if job.specimen]
    for specimen, at in visits:
        if visits.count((specimen, at)) > 1:
            raise InputError(
                f"{source}: two check-ups of {specimen!r} are at {at:g}; several files of one are separated by ;"
            )


def _check_one_cell(source: Path, jobs: tuple[Job, ...]) -> None:
    """Raises InputError where check-ups of one specimen start from different cell files: what was lost between two
    of them shows only from the same start, and would be mixed with the difference of the files."""
    first: dict[str, Job] = {}
    for job in (each for each in jobs if not each.unusable):
        begun = first.setdefault(job.specimen, job) if job.specimen else job
        if job.cell != begun.cell and contents([job.cell]) != contents([begun.cell]):
            raise InputError(
                f"{source}: the check-ups {begun.name!r} and {job.name!r} of {job.specimen!r} start from different "
                f"cells, {begun.cell} and {job.cell}; give both the one that the specimen was when new."
            )


def without_records(source: Path) -> tuple[str, ...]:
    """The subfolders of a folder that hold no record and are no job; none of a table."""
    return (
        tuple(each.name for each in _subfolders(source) if not _records_in(each)) if source.is_dir() else ()
    )


def of_no_cell(source: Path) -> tuple[str, ...]:
    """The files in a folder itself that may be records: only those in its subfolders are read; none of a table."""
    return tuple(file.name for file in _records_in(source)) if source.is_dir() else ()


def _of_folder(folder: Path, cell: Path | None) -> tuple[Job, ...]:
    return tuple(
        _of_subfolder(each, cell, data) for each in _subfolders(folder) if (data := _records_in(each))
    )


def _of_subfolder(folder: Path, cell: Path | None, data: tuple[Path, ...]) -> Job:
    try:
        return Job(folder.name, _cell_in(folder, cell), data)
    except InputError as error:
        return Job(folder.name, Path(), (), unusable=str(error))


def _subfolders(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.is_dir() and _visible(p))


def _records_in(folder: Path) -> tuple[Path, ...]:
    return tuple(sorted(p for p in folder.iterdir() if p.suffix.lower() in SUFFIXES and _visible(p)))


def _visible(path: Path) -> bool:
    return not path.name.startswith(LAID_BESIDE)


def _cell_in(folder: Path, given: Path | None) -> Path:
    for pattern in CELL_FILES:
        found = sorted(filter(_visible, folder.glob(pattern)))
        if len(found) > 1:
            raise InputError(f"{folder} holds {len(found)} files {pattern}; leave one, the cell's.")
        if found:
            return found[0]
    if given is None:
        raise InputError(f"{folder} holds no BPX file (*.bpx.json); put one in, or give --cell for all.")
    return given


def _of_table(table: Path, cell: Path | None) -> tuple[Job, ...]:
    try:
        with table.open(encoding="utf-8-sig", newline="") as stream:
            return tuple(_jobs(table, stream, cell))
    except UnicodeDecodeError:
        raise InputError(f"{table} is no text in UTF-8; save the table as CSV in that encoding.") from None
    except csv.Error as error:
        raise InputError(f"{table} is no CSV: {error}.") from None


def _jobs(table: Path, stream: TextIO, cell: Path | None) -> Iterator[Job]:
    reader = csv.DictReader(stream)
    header = tuple(reader.fieldnames or ())
    other = next((sign for sign in OTHER_SIGNS if len(header) == 1 and sign in header[0]), None)
    if other is not None:
        raise InputError(
            f"{table} is separated by {OTHER_SIGNS[other]}; separate its cells by commas (several files of one cell "
            "are separated by ;)."
        )
    twice = next((name for name in header if header.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{table} has {header.count(twice)} columns named {twice!r}; leave one.")
    unknown = [name for name in header if name not in COLUMNS]
    if unknown or not {"name", "data"} <= set(header):
        raise InputError(
            f"{table} needs the columns name and data and may have {', '.join(COLUMNS[2:])}; it has: "
            f"{', '.join(header) or 'none'}."
        )
    for row in reader:
        plan_row = _Row(table, row, reader.line_num)
        name = plan_row.text("name")
        if not name:
            raise InputError(f"{plan_row.place}: name and data have to be given.")
        try:
            yield _job(plan_row, cell, name)
        except InputError as error:
            yield Job(name, Path(), (), unusable=str(error))


@dataclass(frozen=True)
class _Row:
    """A row of a table, by its columns, and the place that sentences on it begin with."""

    table: Path
    cells: Mapping[str | None, Any]
    line: int

    @property
    def place(self) -> str:
        return f"{self.table}, line {self.line}"

    def text(self, column: str) -> str:
        """The text in a column of the row; '' where it is empty or there is no such column."""
        return (self.cells.get(column) or "").strip()

    def files(self, column: str) -> tuple[Path, ...]:
        """The files of a cell, beside the table."""
        names = (name.strip() for name in self.text(column).split(";"))
        return tuple(self.table.parent / name for name in names if name)

    def number(self, column: str) -> float | None:
        """Raises InputError for what is no number, or no finite one."""
        text = self.text(column)
        try:
            value = float(text) if text else None
        except ValueError:
            value = math.nan
        if value is not None and not math.isfinite(value):
            raise InputError(f"{self.place}: {column} = {text!r} is no number.")
        return value

    @property
    def soc0(self) -> float | None:
        """Raises InputError for what is no state of charge."""
        value = self.number("soc0")
        if value is not None and not 0.0 <= value <= 1.0:
            raise InputError(
                f"{self.place}: soc0 = {value:g}: a state of charge is a share of the capacity, from 0 (empty) to "
                "1 (full); 90 % is 0.9."
            )
        return value

    @property
    def soh(self) -> Soh | None:
        """Raises InputError for what is no state of health."""
        text = self.text("soh")
        try:
            return read_soh(text) if text else None
        except CellError as error:
            raise InputError(f"{self.place}: soh: {error}") from None


def _job(row: _Row, cell: Path | None, name: str) -> Job:
    """Raises InputError, which begins with the place of the row, for what cannot be used of it."""
    if None in row.cells:
        raise InputError(
            f"{row.place}: more cells than the header has; several files of a cell are separated by ;"
        )
    own = row.files("cell")
    if not own and cell is None:
        raise InputError(f"{row.place}: no cell is named; add the column cell, or give --cell for all.")
    data = row.files("data")
    if not data:
        raise InputError(f"{row.place}: name and data have to be given.")
    missing = [path for path in (*own, *data, *row.files("test")) if not path.exists()]
    if missing:
        raise InputError(f"{row.place}: there is no file {missing[0]}.")
    specimen, at = row.text("specimen"), row.number("at")
    if bool(specimen) != (at is not None):
        raise InputError(
            f"{row.place}: a check-up has a specimen and an at, and {name!r} has one of the two; give both, or neither."
        )
    return Job(
        name,
        own[0] if own else cell or Path(),
        data,
        row.files("test"),
        row.soc0,
        specimen,
        at,
        row.soh,
    )
