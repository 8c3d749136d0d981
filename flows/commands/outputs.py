"""Where a command writes, checked before its work: what is computed can be kept, and no input is overwritten."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from aesi.errors import InputError


def check_file(out: Path, inputs: Iterable[Path] = ()) -> None:
    """Raises InputError where `out` cannot be a file to write, or is one of the files that are read."""
    if out.is_dir():
        raise InputError(f"--out {out} is a folder; name the file to write.")
    if any(out.exists() and given.exists() and out.samefile(given) for given in inputs):
        raise InputError(f"--out {out} is a file that is read, and would be lost; give another name.")
    _check_parents(out)


def check_folder(out: Path) -> None:
    """Raises InputError where `out` cannot be a folder to write to; one that is there is kept, and its files may be
    replaced."""
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out} is a file; name a folder.")
    _check_parents(out)


def _check_parents(out: Path) -> None:
    for parent in out.parents:
        if parent.exists():
            if not parent.is_dir():
                raise InputError(f"--out {out}: {parent} is a file, not a folder.")
            return
