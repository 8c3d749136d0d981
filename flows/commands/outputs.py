"""Where a command writes, checked before its work: what is computed can be kept, and no input is overwritten."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from aesi.errors import InputError
from aesi.numerics.files.whole import check_writable

HEAD = "model.json"
"""Of a saved model, as `aesi.pipeline.product.model_folder` has it, which takes its time to import."""
MODEL = "model"
"""The folder of the model within a folder of results."""
PAGES = (".html", ".htm")
SUMMARY = "summary.json"
"""Beside a model it is that of a run."""
OTHER_FORMATS = (
    *(".xlsx", ".xls", ".ods", ".parquet", ".feather", ".json", ".mat", ".h5"),
    *(".zip", ".bz2", ".xz", ".zst", ".7z", ".tar", ".tgz"),
)


def check_file(out: Path, inputs: Sequence[Path] = (), written: Sequence[Path] = ()) -> None:
    """Raises InputError where `out` cannot be a file to write, or what is written is one of the files that are read.

    inputs : files, and folders of saved models, whose files are read.  written : the files, where there are more.
    """
    with _refused(out):
        if out.is_dir():
            raise InputError(f"--out {out} is a folder; name the file to write.")
        lost = [
            file for file in {out, *written} if file.exists() and any(_is_read(file, one) for one in inputs)
        ]
        if lost:
            beside = "" if out in lost else f": {lost[0]}, which is written beside it,"
            raise InputError(
                f"--out {out}{beside} is a file that is read, and would be lost; give another name."
            )
        if out.exists() and not os.access(out, os.W_OK):
            raise InputError(f"--out {out} is there and may not be written over; give another name.")
        check_writable(out)


def check_table(out: Path, inputs: Sequence[Path] = ()) -> None:
    """As `check_file`, of a CSV.  Raises InputError also where the name promises another format."""
    check_file(out, inputs)
    if out.suffix.lower() in OTHER_FORMATS:
        raise InputError(f"--out {out}: what is written is a CSV; give a name that ends in .csv or .csv.gz.")


def check_json(out: Path, inputs: Sequence[Path] = ()) -> None:
    """As `check_file`, of a cell's file.  Raises InputError also where the name promises another format."""
    check_file(out, inputs)
    if out.suffix.lower() != ".json":
        raise InputError(f"--out {out}: what is written is BPX; give a name that ends in .json.")


def check_page(out: Path) -> None:
    """As `check_file`, of a page.  Raises InputError also where the name promises another format."""
    check_file(out)
    if out.suffix.lower() not in PAGES:
        raise InputError(f"--out {out}: what is written is a page; give a name that ends in .html.")


def check_folder(out: Path, inputs: Sequence[Path] = (), option: str = "--out") -> None:
    """Raises InputError where `out` cannot be a folder to write to, or the model in it is one that is read; one that is
    there is kept, and its files may be replaced."""
    with _refused(out, option):
        if out.exists() and not out.is_dir():
            raise InputError(f"{option} {out} is a file; name a folder.")
        if any(_lies_in(given, out / MODEL) for given in inputs):
            raise InputError(
                f"--out {out}: the model in it is the one that is read, and would be lost; name another folder."
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


def _is_read(file: Path, given: Path) -> bool:
    """Is a file that is there the one that is given, or of the saved model that is?  Of other folders none is read."""
    return (not given.is_dir() or (given / HEAD).exists()) and _lies_in(file, given)


def _lies_in(file: Path, place: Path) -> bool:
    """Is a file or folder that is there the place, or in it?"""
    return place.exists() and file.resolve().is_relative_to(place.resolve())


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
