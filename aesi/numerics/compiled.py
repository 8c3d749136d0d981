"""numba's compiler with machine code kept on disk under a digest of all the sources that it was made of.

numba itself watches the file of the compiled function alone. After an update of the package it would go on with the
code of a function from another file as it was, or end with an AttributeError where a named tuple of a signature has
moved (numba, Notes on Caching, "Caching limitations"). Here each file with compiled functions has a folder of its own
for each state of its sources, so that what was compiled from others is never opened.
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
from aesi.numerics.files.first_use import compiling

SETTINGS: Any = numba.config
CHOOSING = threading.Lock()
"""Numba has one cache folder a process: functions that two threads define at once would take each other's, or the
working folder."""
ROOT = Path(__file__).resolve().parents[2]
IMPORT = re.compile(rb"^from (aesi[\w.]*) import", re.MULTILINE)
COMPILED = re.compile(rb"^@(njit|compiled|kept_njit)\b", re.MULTILINE)


class _Compiling(event.Listener):
    """Hears when numba compiles; what it finds on disk it does not compile."""

    def on_start(self, event: Any) -> None:
        compiling()

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Compiling())  # type: ignore[no-untyped-call]


def kept_njit(**options: Any) -> Callable[[Any], Any]:
    """numba.njit with these options whose machine code is found again by the next process.

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
    """All files that decide what is compiled from `source`: itself, what it imports of this package, on through files
    with compiled functions, and the layouts beside those, whose named tuples stand in signatures."""
    found: set[Path] = set()
    ahead = {source.resolve()}
    while ahead:
        file = ahead.pop()
        found.add(file)
        ahead |= _asked_by(file) - found
    return found


@cache
def _asked_by(file: Path) -> frozenset[Path]:
    """What a file with compiled functions imports of this package, and the layouts beside it; of any other, nothing."""
    text = _text(file)
    if not COMPILED.search(text):
        return frozenset()
    imported = (_file_of(name.decode()) for name in IMPORT.findall(text))
    return frozenset((*imported, *file.parent.glob("*layout.py")))


@cache
def _text(file: Path) -> bytes:
    return file.read_bytes()


def _file_of(module: str) -> Path:
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


@cache
def _folder(source: Path, chosen: str) -> Path:
    """Of the machine code from `source`, its sources as they are now."""
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
    """What was compiled from earlier sources. A process that still runs them compiles again where it looks for it."""
    with suppress(OSError):
        for other in kept.parent.glob(f"{stem}-*"):
            if other != kept:
                shutil.rmtree(other, ignore_errors=True)
