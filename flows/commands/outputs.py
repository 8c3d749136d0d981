"""Where a command writes, checked before its work: what is computed can be kept, and no input is overwritten."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from aesi.errors import InputError
from aesi.numerics.files.whole import check_writable
from aesi.pipeline.product.contents import effect_files
from aesi.pipeline.written import ARRAYS, HEAD, MODEL, SUMMARY

PAGES = (".html", ".htm")
OTHER_FORMATS = (
    *(".xlsx", ".xls", ".ods", ".parquet", ".feather", ".json", ".mat", ".h5"),
    *(".zip", ".bz2", ".xz", ".zst", ".7z", ".tar", ".tgz"),
)


def check_file(
    out: Path, inputs: Iterable[Path], written: Sequence[Path] = (), option: str = "--out"
) -> None:
    """Raises InputError where `out` cannot be a file to write, or what is written is one of the files that are read.

    inputs : files, and folders of saved models, whose files are read.  written : the files, where there are more.
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


def check_table(out: Path, inputs: Iterable[Path]) -> None:
    """As `check_file`, of a CSV.  Raises InputError also where the name promises another format."""
    check_file(out, inputs)
    if out.suffix.lower() in OTHER_FORMATS:
        raise InputError(f"--out {out}: what is written is a CSV; give a name that ends in .csv or .csv.gz.")


def check_json(out: Path, inputs: Iterable[Path], written: Sequence[Path] = ()) -> None:
    """As `check_file`, of a cell's file.  Raises InputError also where the name promises another format."""
    check_file(out, inputs, written)
    if out.suffix.lower() != ".json":
        raise InputError(f"--out {out}: what is written is BPX; give a name that ends in .json.")


def check_page(out: Path) -> None:
    """As `check_file`, of a page, beside which no file is read.  Raises InputError also where the name promises another
    format."""
    check_file(out, ())
    if out.suffix.lower() not in PAGES:
        raise InputError(f"--out {out}: what is written is a page; give a name that ends in .html.")


def check_folder(
    out: Path, inputs: Iterable[Path] = (), written: Sequence[Path] = (), option: str = "--out"
) -> None:
    """Raises InputError where `out` cannot be a folder to write to, or what is written in it is one of the files that
    are read; one that is there is kept, and its files may be replaced.

    inputs, written : as in `check_file`.
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
        if (out / SUMMARY).is_file() and (out / MODEL).is_dir():
            raise InputError(
                f"{option} {out} holds the results of a run ({SUMMARY}), whose model would be lost; name another "
                "folder."
            )
        check_writable(out / MODEL)


def check_beside(out: Path, source: Path) -> None:
    """Raises InputError where `out` is the folder `source` or lies in it: what is written would be read next time."""
    if source.is_dir() and out.resolve().is_relative_to(source.resolve()):
        raise InputError(
            f"--out {out} lies in {source}, whose subfolders are read as cells; name a folder beside it."
        )


def first_lost(written: Iterable[Path], inputs: Iterable[Path]) -> Path | None:
    """The first of the files that are written which is there and is read."""
    read = {file.resolve() for given in inputs for file in _files_read(given)}
    return next((file for file in written if file.is_file() and file.resolve() in read), None)


def _files_read(given: Path) -> Iterator[Path]:
    """The file itself; of a folder with a saved model its files, and those of the user's effects that it names."""
    if not given.is_dir():
        yield given
    elif (given / HEAD).is_file():
        head = _content(given / HEAD)
        names = head.get("parts") if isinstance(head, dict) else None
        parts = [f"{name}.json" for name in names] if isinstance(names, list) else []
        yield from (given / name for name in (HEAD, ARRAYS, *parts))
        yield from effect_files(given)


def _content(file: Path) -> object:
    """None of a file that cannot be read, which whoever loads the model says."""
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


@contextmanager
def _refused(out: Path, option: str = "--out") -> Iterator[None]:
    """What the system refuses, as a sentence about the option; and `-`, which elsewhere is the standard output."""
    if str(out) == "-":
        raise InputError(f"{option} -: name a place to write to; the standard output is /dev/stdout.")
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{option} {out} cannot be written ({error.filename}: {error.strerror}); name another place."
        ) from None
