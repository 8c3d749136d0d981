"""The program that computes, as a hash: its source, and the versions of the libraries that it computes with."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PRESENTATION = ("pipeline/report", "bench")
"""It changes no number, so that a report may be edited and what was computed is kept."""
DECIDING = (".py", ".json", ".csv")
"""Endings of the package's files that a number depends on: code, frequencies of verdicts, drive schedules."""
LIBRARIES = ("numba", "numpy", "pybamm", "pysindy", "quantile-forest", "scikit-learn", "scipy")
ALTERED: list[str] = []
"""Constants that have another value here than in the source (`docs/hooks/constant.py`)."""


@cache
def source_digest(*beside: Path) -> str:
    """Hash of the package's source, presentation left out, and of the versions of what it computes with.

    beside : folders whose source counts too, such as that of a benchmark, with all that lies in them.
    """
    sha = hashlib.sha256(" ".join([*(version(name) for name in LIBRARIES), *ALTERED]).encode())
    for name, path in sorted(_files(ROOT).items()):
        if not name.startswith(PRESENTATION):
            sha.update(name.encode() + b"\0" + path.read_bytes())
    for folder in beside:
        for name, path in sorted(_files(folder).items()):
            sha.update(f"{folder.name}/{name}".encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()[:16]


def _files(folder: Path) -> dict[str, Path]:
    """Name below the folder -> file, of all that a number may depend on."""
    return {
        path.relative_to(folder).as_posix(): path
        for path in folder.rglob("*")
        if path.suffix in DECIDING and path.is_file()
    }
