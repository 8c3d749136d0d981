"""Arrays cached on disk under the hash of everything that determines them.

A killed process leaves no partial entry; one that does not
match its own checksum is computed again, with a warning.
"""

from __future__ import annotations

import hashlib
import io
import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.errors import DataError
from aesi.numerics.files.arrays import read_arrays
from aesi.numerics.files.cache_folder import cache_folder
from aesi.numerics.files.whole import write_whole
from aesi.numerics.typing import Array

CHECKSUM = "checksum"
SHIPPED = Path(__file__).with_name("shipped")
"""Entries that come with the package, once `docs/hooks/ship.py` has put an experiment's virtual records there. They are
found by their key like any other; without them, the arrays are computed."""


def key_of(parts: Mapping[str, Any]) -> str:
    """First 24 hexadecimal digits of the SHA-256 of plain values and arrays."""
    sha = hashlib.sha256()
    for name in sorted(parts):
        value = parts[name]
        sha.update(name.encode())
        if isinstance(value, np.ndarray):
            sha.update(np.ascontiguousarray(value, dtype=float).tobytes())
        elif isinstance(value, bytes):
            sha.update(value)
        else:
            sha.update(json.dumps(value, sort_keys=True).encode())
    return sha.hexdigest()[:24]


def cached(kind: str, key: str, make: Callable[[], dict[str, Array]]) -> dict[str, Array]:
    """The arrays cached under kind and key; computed by `make` and cached where they are missing.

    Those that come with the package (`SHIPPED`) are looked up first.
    Raises DataError where the cache folder cannot be written.
    """
    path = cache_folder() / kind / f"{key}.npz"
    for place in (SHIPPED / path.name, path):
        kept = _load(place)
        if kept is not None:
            return kept
    arrays = make()
    _store(path, arrays)
    return arrays


def _digest(arrays: Mapping[str, Array]) -> str:
    sha = hashlib.sha256()
    for name in sorted(arrays):
        sha.update(name.encode())
        sha.update(np.ascontiguousarray(arrays[name], dtype=float).tobytes())
    return sha.hexdigest()


def _load(path: Path) -> dict[str, Array] | None:
    if not path.exists():
        return None
    try:
        arrays = read_arrays(path)
        if str(arrays.pop(CHECKSUM)) == _digest(arrays):
            return arrays
    except (OSError, ValueError, KeyError):
        pass
    warnings.warn(f"The cache entry {path} is damaged; it is computed again.", stacklevel=3)
    return None


def _store(path: Path, arrays: dict[str, Array]) -> None:
    try:
        stream = io.BytesIO()
        content: dict[str, Any] = {**arrays, CHECKSUM: np.array(_digest(arrays))}
        np.savez_compressed(stream, **content)
        write_whole(path, stream.getvalue())
    except OSError as error:
        raise DataError(
            f"The cache folder {path.parent} cannot be written ({error}); set AESI_CACHE to one that can."
        ) from None
