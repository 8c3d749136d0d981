"""Content keys: what a result depends on, as a hash. The code is part of it, with the libraries that compute."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import aesi

# Presentation does not change a number, so editing a report keeps the cache.
PRESENTATION = ("pipeline/report", "bench")
LIBRARIES = ("numba", "numpy", "pybamm", "pysindy", "quantile-forest", "scikit-learn", "scipy")


@cache
def code() -> str:
    """Hash of the package's source, presentation left out, and of the versions of what it computes with."""
    root = Path(aesi.__file__).parent
    sha = hashlib.sha256(" ".join(version(name) for name in LIBRARIES).encode())
    for path in sorted(root.rglob("*.py")):
        name = path.relative_to(root).as_posix()
        if not name.startswith(PRESENTATION):
            sha.update(name.encode() + b"\0" + path.read_bytes())
    return sha.hexdigest()[:16]


def key(*parts: bytes | str) -> str:
    """Hash of the parts, 32 hexadecimal digits; the boundaries between the parts count."""
    sha = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        sha.update(len(data).to_bytes(8, "big") + data)
    return sha.hexdigest()[:32]
