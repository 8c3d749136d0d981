"""What is in files and folders, for keys of what rests on them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path


def contents(paths: Iterable[Path]) -> list[bytes]:
    """What is in each file, and in each file of a folder, in order; nothing of what is not there."""
    files = [file for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return [file.read_bytes() for file in files if file.is_file()]
