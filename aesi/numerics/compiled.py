"""numba's compiler with machine code cached on disk under a digest of all its source files.

numba itself checks only the file of the compiled function. After an update of the package it would use outdated code of
a function from another file, or fail with an AttributeError where a named tuple of a signature has moved (numba, Notes
on Caching, "Caching limitations"). Here each file with compiled functions has a folder for each state of its sources,
so that code compiled from other sources is never loaded.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import threading
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba import njit
from numba.core import event

from aesi.numerics.files.cache_folder import cache_folder
from aesi.numerics.files.first_use import report_compilation

SETTINGS: Any = numba.config
CHOOSING = threading.Lock()
"""Lock: numba has one cache folder per process, so functions that two threads define at once would use each other's, or
the working folder."""
ROOT = Path(__file__).resolve().parents[2]
IMPORT = re.compile(rb"^from (aesi[\w.]*) import", re.MULTILINE)
COMPILED = re.compile(rb"^@(njit|compiled|kept_njit)\b", re.MULTILINE)


class _Compiling(event.Listener):
    """Listener for numba's compilations; code loaded from disk does not count as one."""

    def on_start(self, event: Any) -> None:
        report_compilation()

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Compiling())  # type: ignore[no-untyped-call]


def kept_njit(**options: Any) -> Callable[[Any], Any]:
    """numba.njit with these options, with machine code that the next process loads from disk.

    The folder is chosen when the function is defined: beside its source, else (a read-only installation) in the cache
    folder of the package; NUMBA_CACHE_DIR comes before both.
    """

    def compiler(function: Any) -> Any:
        source = Path(function.__code__.co_filename)
        with CHOOSING:
            chosen = SETTINGS.CACHE_DIR
            if source.exists():
                SETTINGS.CACHE_DIR = str(_folder(source, chosen))
            try:
                return njit(cache=True, **options)(function)
            finally:
                SETTINGS.CACHE_DIR = chosen

    return compiler


def sources(source: Path) -> set[Path]:
    """All files that determine the code compiled from `source`: itself, its imports from this package, recursively
    through files with compiled functions, and the layouts beside those, whose named tuples are in signatures."""
    found: set[Path] = set()
    pending = {source.resolve()}
    while pending:
        file = pending.pop()
        found.add(file)
        pending |= _direct_sources(file) - found
    return found


@cache
def _direct_sources(file: Path) -> frozenset[Path]:
    """Imports from this package of a file with compiled functions, and the layouts beside it; empty for other files."""
    text = _text(file)
    if not COMPILED.search(text):
        return frozenset()
    imported = (_file_of(name.decode()) for name in IMPORT.findall(text))
    return frozenset((*imported, *file.parent.glob("*layout.py")))


@cache
def _text(file: Path) -> bytes:
    return file.read_bytes()


def _file_of(module: str) -> Path:
    """The file of a module of this package, such as `aesi.numerics.blocks`."""
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _folder(source: Path, chosen: str) -> Path:
    """Folder of the machine code compiled from `source` in the present state of its sources."""
    sha = hashlib.sha256()
    for file in sorted(sources(source)):
        sha.update(str(file.relative_to(ROOT)).encode() + b"\0" + _text(file) + b"\0")
    name = f"{source.stem}-{sha.hexdigest()[:16]}"
    if chosen:
        return Path(chosen) / name
    beside = source.parent / "__pycache__" / name
    if beside.exists():
        return beside if os.access(beside, os.W_OK) else cache_folder() / "compiled" / name
    try:
        beside.mkdir(parents=True, exist_ok=True)
    except OSError:  # a read-only installation
        return cache_folder() / "compiled" / name
    _drop_earlier(beside, source.stem)
    return beside


def _drop_earlier(kept: Path, stem: str) -> None:
    """Delete code compiled from earlier sources. A process that still uses those compiles again when it needs it."""
    with suppress(OSError):
        for other in kept.parent.glob(f"{stem}-*"):
            if other != kept:
                shutil.rmtree(other, ignore_errors=True)
