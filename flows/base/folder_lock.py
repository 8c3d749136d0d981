"""One process at a time writes to a folder of results: two would leave a mixture of both, or the one that ends last."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from aesi.errors import InputError
from flows.base.locks import ProcessLock

LOCK = ".aesi.lock"


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Within, no other process that asks for it writes to the folder, which is made. Where its file system has no locks
    that is said, and nothing keeps others out.

    Raises InputError where another one does now.
    """
    lock = ProcessLock(folder / LOCK, f"--out {folder}", "writing its results there too")
    if not lock.acquire():
        raise InputError(
            f"--out {folder}: another process writes its results there now; wait for its end, or name another folder."
        )
    try:
        yield
    finally:
        lock.release()
