"""Contents of files and saved models, for cache keys of results that depend on them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from aesi.pipeline.written import EFFECTS


def contents(paths: Iterable[Path]) -> list[bytes]:
    """The bytes of each file, and of each file of a folder, in order; missing files are skipped. For a saved model they
    include the user's effects that it refers to elsewhere (older models had no copy in their folder)."""
    files = [file for path in paths for file in _files(path)]
    return [file.read_bytes() for file in files if file.is_file()]


def effect_files(folder: Path) -> list[Path]:
    """The files of the user's own effects that a saved model refers to; empty where it is no model or cannot be read,
    which loading it reports."""
    try:
        effects = json.loads((folder / f"{EFFECTS}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    named = (
        [each.get("file") for each in effects if isinstance(each, dict)] if isinstance(effects, list) else []
    )
    return [folder / file for file in named if isinstance(file, str)]


def _files(path: Path) -> Iterator[Path]:
    if path.is_dir():
        inside = sorted(path.iterdir())
        yield from inside
        yield from (file for file in effect_files(path) if file not in inside)
    else:
        yield path
