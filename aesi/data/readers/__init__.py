"""One reader per kind of file; the only modules of `aesi.data` that open measurement files.

A cycler's text export needs no reader of its own: its names, units and sign are one file of `formats`.
"""

from __future__ import annotations

import codecs
from collections.abc import Collection
from pathlib import Path

from aesi.data.readers.table import TableFile
from aesi.errors import DataError

GZIP_MAGIC = b"\x1f\x8b"
PARQUET_MAGIC = b"PAR1"
XLSX_MAGIC = b"PK\x03\x04"
XLS_MAGIC = b"\xd0\xcf\x11\xe0"
JSON_MAGIC = b"{"
HTML_MAGIC = (b"<!doctype", b"<html")
LFS_MAGIC = b"version https://git-lfs"
MATLAB_MAGIC = b"MATLAB"
HDF_MAGIC = b"\x89HDF"
PROMISES = {
    ".xlsx": "workbook",
    ".xls": "workbook",
    ".parquet": "Parquet file",
    ".gz": "gzip file",
    ".mat": "MATLAB file",
}
"""Suffix -> kind of file, for kinds that are recognised by their first bytes."""


def open_table(path: str | Path, wanted: Collection[str] = ()) -> TableFile:
    """The reader for a file: cyclers' own formats by their suffix, all others by their first bytes.

    wanted : names of columns that the user gave; they show where a table begins below other lines.
    Raises DataError where there is no such file, it is empty, or no reader takes it.
    """
    file = Path(path)
    magic = _first_bytes(file)
    _refuse_unread_kinds(file, magic)
    suffix = file.suffix.lower()
    if suffix == ".mpr":
        from aesi.data.readers.biologic_mpr import open_mpr

        return open_mpr(file)
    if suffix in (".nda", ".ndax"):
        from aesi.data.readers.neware_nda import open_nda

        return open_nda(file)
    if magic.startswith(PARQUET_MAGIC):
        from aesi.data.readers.parquet import ParquetTable

        return ParquetTable(file)
    if magic.startswith(XLSX_MAGIC):
        from aesi.data.readers.spreadsheet import open_sheet

        return open_sheet(file, wanted)
    if magic.startswith(MATLAB_MAGIC) or (
        suffix == ".mat" and b"\x00" in magic
    ):  # version 4 begins with numbers
        from aesi.data.readers.matlab import open_mat

        return open_mat(file, wanted)
    return _open_text(file, magic, wanted)


def _refuse_unread_kinds(file: Path, magic: bytes) -> None:
    """Raises DataError for a kind of file that no reader takes, by its first bytes."""
    if magic.startswith(XLS_MAGIC):
        raise DataError(f"{file.name} is an old Excel workbook (.xls); save it as .xlsx or CSV.")
    if magic.startswith(HDF_MAGIC):
        raise DataError(
            f"{file.name} is an HDF5 file, which is not read; export time, current and voltage as CSV."
        )
    begin = magic.removeprefix(codecs.BOM_UTF8).lstrip()
    if begin == LFS_MAGIC:
        raise DataError(
            f"{file.name} holds not the data but a pointer to them, as a copy of a repository has without Git LFS; "
            "fetch the file itself (git lfs pull)."
        )
    if begin.lower().startswith(HTML_MAGIC):
        raise DataError(
            f"{file.name} is a web page (HTML), as a server sends in place of a file that asks for a login or is gone; "
            "fetch the file itself."
        )
    if begin.startswith(JSON_MAGIC):
        raise DataError(
            f"{file.name} is JSON, which holds no record: a table is read as CSV, Excel or Parquet, and a cell's file "
            "is given as --cell."
        )


def _open_text(file: Path, magic: bytes, wanted: Collection[str]) -> TableFile:
    """The file as a table of text, with a note where its suffix promises another kind of file."""
    from aesi.data.readers.text import TextTable

    compressed, suffix = magic.startswith(GZIP_MAGIC), file.suffix.lower()
    if compressed or suffix not in PROMISES:
        return TextTable(file, compressed=compressed, wanted=wanted)
    mismatch = f"its name ends in {suffix}, but it is text and no {PROMISES[suffix]}"
    try:
        table = TextTable(file, compressed=False, wanted=wanted)
    except DataError as error:
        raise DataError(f"{file.name}: {mismatch}, and cannot be read as that either: {error}") from None
    table.notes = (*table.notes, f"{mismatch[0].upper()}{mismatch[1:]}; read as text.")
    return table


def _first_bytes(file: Path) -> bytes:
    """The first bytes of a file, enough to tell its kind.  Raises DataError where it cannot be opened or is empty."""
    if file.is_dir():
        raise DataError(f"{file} is a folder; give one file of it.")
    try:
        with file.open("rb") as stream:
            magic = stream.read(len(LFS_MAGIC))
    except FileNotFoundError:
        raise DataError(f"There is no file {file}.") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{file} cannot be opened: {error}.") from None
    if not magic:
        raise DataError(f"{file.name} is empty; it should hold a header and at least two rows.")
    return magic
