"""Arrays of an `.npz` file, whole or not at all."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

import numpy as np

from aesi.numerics.typing import AnyArray

DAMAGED = (EOFError, RuntimeError, zipfile.BadZipFile, zlib.error)
"""What zipfile raises for bytes that were changed: in the stream, in a checksum, in what they say of compression."""


def read_arrays(path: Path) -> dict[str, AnyArray]:
    """The arrays of a file as numpy.savez and numpy.savez_compressed write it; nothing in it is executed.

    Raises OSError where the file cannot be read, ValueError where it is not as it was written.
    """
    content = path.read_bytes()
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            damaged = archive.testzip()  # before numpy takes a header of an array for Python's syntax
    except DAMAGED as error:
        raise ValueError(str(error) or "it ends early") from None
    if damaged is not None:
        raise ValueError(f"{damaged} does not match its checksum")
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}
