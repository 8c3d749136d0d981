"""Content keys: what a result depends on, as a hash."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path


def key(*parts: bytes | str) -> str:
    """Hash of the parts, 32 hexadecimal digits; the boundaries between the parts count."""
    sha = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        sha.update(len(data).to_bytes(8, "big") + data)
    return sha.hexdigest()[:32]


def contents(paths: Iterable[Path]) -> list[bytes]:
    """What is in each file, and in each file of a folder, in order; nothing of what is not there."""
    files = [file for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return [file.read_bytes() for file in files if file.is_file()]
