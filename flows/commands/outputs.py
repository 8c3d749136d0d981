"""Checks of the places that a command writes to. They run before its work, so that its results can be saved at the end
and no input file is overwritten."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from aesi.errors import InputError
from aesi.numerics.files.whole import check_writable
from aesi.pipeline.product.contents import effect_files
from aesi.pipeline.written import ARRAYS, HEAD, MODEL, SUMMARY, SUMMARY_TABLE

PAGES = (".html", ".htm")
OTHER_FORMATS = (
    *(".xlsx", ".xls", ".ods", ".parquet", ".feather", ".json", ".mat", ".h5"),
    *(".zip", ".bz2", ".xz", ".zst", ".7z", ".tar", ".tgz"),
)


def check_file(
    out: Path, inputs: Iterable[Path], written: Sequence[Path] = (), option: str = "--out"
) -> None:
    """Check that `out` can be written, and that no written file is one of those that are read.

    inputs : files, and folders of saved models, that are read.  written : further files that are written.  option : the
    option that names `out`, for the sentence.
    Raises InputError if one of the checks fails.
    """
    with _refused(out, option):
        if out.is_dir():
            raise InputError(f"{option} {out} is a folder; name the file to write.")
        lost = first_lost((out, *written), inputs)
        if lost is not None:
            beside = "" if lost == out else f": {lost}, which is written beside it,"
            raise InputError(
                f"{option} {out}{beside} is a file that is read, and would be lost; give another name."
            )
        if out.exists() and not os.access(out, os.W_OK):
            raise InputError(f"{option} {out} is there and may not be written over; give another name.")
        check_writable(out)


BDF = ".bdf"
"""Suffix by which the Battery Data Format is known, also before another, as in `drive.bdf.csv`."""


def check_table(out: Path, inputs: Iterable[Path], *, bdf: bool = False, advice: str = "") -> None:
    """`check_file` for a CSV.  Raises InputError also if the name has the suffix of another format.

    bdf : the table is one of the Battery Data Format.  advice : clause on what writes one, for the sentence.
    """
    check_file(out, inputs)
    if not bdf and BDF in map(str.lower, out.suffixes):
        raise InputError(
            f"--out {out}: the name is that of the Battery Data Format, where current is positive on charge, and what "
            f"is written is not; give a name without {BDF}{advice}."
        )
    if out.suffix.lower() in OTHER_FORMATS:
        raise InputError(f"--out {out}: what is written is a CSV; give a name that ends in .csv or .csv.gz.")


def check_json(out: Path, inputs: Iterable[Path], written: Sequence[Path]) -> None:
    """`check_file` for a cell file (BPX).  Raises InputError also if the name does not end in .json."""
    check_file(out, inputs, written)
    if out.suffix.lower() != ".json":
        raise InputError(f"--out {out}: what is written is BPX; give a name that ends in .json.")


def check_page(out: Path, mark: str) -> None:
    """`check_file` for an HTML page; no file is read for it.  Raises InputError also if the name does not end in .html
    or .htm, and for a page that is there without the line `mark`, which each page of the command holds."""
    check_file(out, ())
    if out.suffix.lower() not in PAGES:
        raise InputError(f"--out {out}: what is written is a page; give a name that ends in .html.")
    if out.is_file() and mark.encode() not in out.read_bytes():
        raise _not_own("--out", out, out)


def check_folder(
    out: Path, inputs: Iterable[Path] = (), written: Sequence[Path] = (), option: str = "--out"
) -> None:
    """Check that `out` can be a folder to write to, and that no written file is one of those that are read.

    An existing folder is kept; a folder with the results of a run is refused. `check_own` tells which of its files may
    be replaced.
    inputs, written, option : as in `check_file`.
    Raises InputError if one of the checks fails.
    """
    with _refused(out, option):
        if out.exists() and not out.is_dir():
            raise InputError(f"{option} {out} is a file; name a folder.")
        lost = first_lost(written, inputs)
        if lost is not None:
            raise InputError(
                f"{option} {out}: {lost}, which is written there, is a file that is read, and would be lost; name "
                "another folder."
            )
        of_batch = (out / SUMMARY_TABLE).is_file()  # there `model` is the folder of a cell of that name
        if (out / SUMMARY).is_file() and (out / MODEL).is_dir() and not of_batch:
            raise InputError(
                f"{option} {out} holds the results of a run ({SUMMARY}), whose model would be lost; name another "
                "folder."
            )
        check_writable(out / MODEL)


def check_own(out: Path, written: Iterable[Path], marks: Iterable[Path], option: str = "--out") -> None:
    """Raises InputError for a file that would be replaced and that the same command did not write before.

    written : the files that are written.  marks : files of which each run of the command leaves at least one; where one
    is there, an earlier run of it wrote the others, and they may be replaced.
    """
    there = next((file for file in written if file.exists()), None)
    if there is not None and not any(mark.is_file() for mark in marks):
        raise _not_own(option, out, there)


def _not_own(option: str, out: Path, there: Path) -> InputError:
    return InputError(
        f"{option} {out}: {there} is there, was not written by this command, and would be lost; name another "
        "place, or move it."
    )


def check_beside(out: Path, source: Path) -> None:
    """Raises InputError if `out` is the folder `source` or lies in it, since the next run would read the results as
    cells."""
    if source.is_dir() and out.resolve().is_relative_to(source.resolve()):
        raise InputError(
            f"--out {out} lies in {source}, whose subfolders are read as cells; name a folder beside it."
        )


def first_lost(written: Iterable[Path], inputs: Iterable[Path]) -> Path | None:
    """The first written file that exists and is one of the files that are read; None if there is none.

    inputs : as in `check_file`.
    """
    read = {file.resolve() for given in inputs for file in _files_read(given)}
    return next((file for file in written if file.is_file() and file.resolve() in read), None)


def _files_read(given: Path) -> Iterator[Path]:
    """The files that are read for an input: a file itself; of a saved model's folder all its files, and the files of
    the user's own effects that it names."""
    if not given.is_dir():
        yield given
    elif (given / HEAD).is_file():
        head = _content(given / HEAD)
        names = head.get("parts") if isinstance(head, dict) else None
        parts = [f"{name}.json" for name in names] if isinstance(names, list) else []
        yield from (given / name for name in (HEAD, ARRAYS, *parts))
        yield from effect_files(given)


def _content(file: Path) -> object:
    """The content of a JSON file; None if it cannot be read. Loading the model raises the error on such a file."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


@contextmanager
def _refused(out: Path, option: str) -> Iterator[None]:
    """Turns an OSError in the body of the `with` statement into an InputError about the option.  Raises InputError also
    for `-`, which other programs take as the standard output."""
    if str(out) == "-":
        raise InputError(f"{option} -: name a place to write to; the standard output is /dev/stdout.")
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{option} {out} cannot be written ({error.filename}: {error.strerror}); name another place."
        ) from None
