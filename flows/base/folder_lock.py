"""One process at a time writes to a folder of results: two would leave a mixture of both, or the one that ends last."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from aesi.errors import InputError
from flows.base.console import Console

LOCK = ".aesi.lock"
"""Stays behind, empty: removed, it could be held by two. The kernel frees it with the process that holds it."""
NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Within, no other process that asks for it writes to the folder, which is made. Where its file system has no locks
    that is said, and nothing keeps others out.

    Raises InputError where another one does now.
    """
    folder.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder / LOCK, thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise InputError(
            f"--out {folder}: another process writes its results there now; wait for its end, or name another folder."
        ) from None
    except (NotImplementedError, OSError) as error:
        if isinstance(error, OSError) and error.errno not in NO_LOCKS:
            raise
        Console().say(
            f"--out {folder}: its file system has no locks, so that nothing keeps a second process from writing its "
            "results there too; start no other one with the same --out before this one has ended."
        )
        yield
        return
    try:
        yield
    finally:
        lock.release()
