"""The program that computes, as a hash: its source, and the versions of the libraries that it computes with."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PRESENTATION = ("pipeline/report", "bench")
"""It changes no number, so that a report may be edited and what was computed is kept."""
LIBRARIES = ("numba", "numpy", "pybamm", "pysindy", "quantile-forest", "scikit-learn", "scipy")


@cache
def source_digest() -> str:
    """Hash of the package's source, presentation left out, and of the versions of what it computes with."""
    sha = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for path in sorted(ROOT.rglob("*.py")):
        name = path.relative_to(ROOT).as_posix()
        if not name.startswith(PRESENTATION):
            sha.update(name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()[:16]
