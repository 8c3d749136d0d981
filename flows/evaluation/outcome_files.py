"""What has been computed, by content key, and who is computing what: on disk, or in a database.

Every process on a study walks through the same deterministic search. Before it evaluates a candidate it looks
here, then claims it; a claim ends with its owner, whatever ends the owner.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import Protocol

from flows.base.files import write_atomically


class Outcomes(Protocol):
    """A store of results by key; keys are hexadecimal."""

    def get(self, key: str) -> bytes | None:
        """What was stored under the key, or None."""
        ...

    def put(self, key: str, data: bytes) -> None:
        """Store atomically: a reader sees all of it or nothing."""
        ...

    def discard(self, key: str) -> None:
        """Forget a damaged entry."""
        ...

    def claim(self, key: str) -> bool:
        """True if this process is now the one that computes the key."""
        ...

    def release(self, key: str) -> None:
        """Give the claim back."""
        ...

    def close(self) -> None:
        """Give back everything."""
        ...


def open_outcomes(folder: Path, url: str | None = None) -> Outcomes:
    """A database where a URL is given, else the folder."""
    if not url:
        return FileOutcomes(folder)
    from flows.evaluation.outcome_database import DatabaseOutcomes

    return DatabaseOutcomes(url)


class FileOutcomes:
    """One file a result below `folder`; claims are file locks, which the kernel drops with their process."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._locks: dict[str, int] = {}

    def get(self, key: str) -> bytes | None:
        try:
            return self._path(key).read_bytes()
        except FileNotFoundError:
            return None

    def put(self, key: str, data: bytes) -> None:
        write_atomically(self._path(key), data)

    def discard(self, key: str) -> None:
        self._path(key).unlink(missing_ok=True)

    def claim(self, key: str) -> bool:
        if key in self._locks:
            return True
        path = self._folder / "claims" / key
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(handle)
            return False
        self._locks[key] = handle
        return True

    def release(self, key: str) -> None:
        handle = self._locks.pop(key, None)
        if handle is not None:
            (self._folder / "claims" / key).unlink(missing_ok=True)
            # Evaluation processes are forks and hold a copy of the handle: unlock, do not merely close.
            fcntl.flock(handle, fcntl.LOCK_UN)
            os.close(handle)

    def close(self) -> None:
        for key in list(self._locks):
            self.release(key)

    def _path(self, key: str) -> Path:
        return self._folder / key[:2] / f"{key}.bin"
