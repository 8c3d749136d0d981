"""One reader a format; the only modules of the data room that open measurement files."""

from __future__ import annotations

from pathlib import Path

from aesi.data.readers.table import TableFile
from aesi.errors import DataError

GZIP_MAGIC = b"\x1f\x8b"
PARQUET_MAGIC = b"PAR1"
OFFICE_MAGIC = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # .xlsx and .xls
CYCLER_SUFFIXES = (".mpt", ".nda", ".ndax")
MATLAB_MAGIC = (b"MATLAB", b"\x89HDF")


def open_table(path: str | Path) -> TableFile:
    """The reader for a file: cyclers' own by their suffix, all others by their first bytes.

    Raises DataError where there is no such file, it is empty, or it is no text table and no Parquet file.
    """
    file = Path(path)
    magic = _first_bytes(file)
    if file.suffix.lower() in CYCLER_SUFFIXES:
        from aesi.data.readers.cycler import CyclerTable

        return CyclerTable(file)
    if magic.startswith(PARQUET_MAGIC):
        from aesi.data.readers.parquet import ParquetTable

        return ParquetTable(file)
    if magic.startswith(OFFICE_MAGIC):
        raise DataError(
            f"{file.name} is a spreadsheet or an archive; save the sheet as CSV and give that file."
        )
    if magic.startswith(MATLAB_MAGIC):
        raise DataError(f"{file.name} is a MATLAB or HDF5 file; export time, current and voltage as CSV.")
    from aesi.data.readers.text import TextTable

    return TextTable(file, compressed=magic.startswith(GZIP_MAGIC))


def _first_bytes(file: Path) -> bytes:
    if file.is_dir():
        raise DataError(f"{file} is a folder; give one file of it.")
    try:
        with file.open("rb") as stream:
            magic = stream.read(8)
    except FileNotFoundError:
        raise DataError(f"There is no file {file}.") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{file} cannot be opened: {error}.") from None
    if not magic:
        raise DataError(f"{file.name} is empty; it should hold a header and at least two rows.")
    return magic
