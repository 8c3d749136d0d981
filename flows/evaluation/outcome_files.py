"""Outcomes of candidates as files below a folder, claimed by file locks that the kernel drops with their process."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from aesi.numerics.files.whole import write_whole
from flows.base.locks import ProcessLock


class FileOutcomes:
    """One file a result below `folder`, and one below its folder `claims` for each that is claimed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._locks: dict[str, ProcessLock] = {}

    def get(self, key: str) -> bytes | None:
        try:
            return self._path(key).read_bytes()
        except FileNotFoundError:
            return None

    def put(self, key: str, data: bytes) -> None:
        write_whole(self._path(key), data)

    def discard(self, key: str) -> None:
        self._path(key).unlink(missing_ok=True)

    def claim(self, key: str) -> bool:
        if key in self._locks:
            return True
        lock = ProcessLock(
            self._folder / "claims" / key, str(self._folder), "evaluating the same candidates again"
        )
        if not lock.acquire():
            return False
        self._locks[key] = lock
        return True

    def release(self, key: str) -> None:
        lock = self._locks.pop(key, None)
        if lock is not None:
            # So that no file a candidate is left. Whoever opened it just now may then hold a claim beside another's:
            # the candidate is evaluated twice, to the same outcome, which is put whole.
            with suppress(OSError):  # Windows keeps a file that is open
                lock.path.unlink(missing_ok=True)
            lock.release()

    def close(self) -> None:
        for key in list(self._locks):
            self.release(key)

    def _path(self, key: str) -> Path:
        return self._folder / key[:2] / f"{key}.bin"
