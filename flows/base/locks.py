"""Locks between processes, which the kernel frees with the process that holds them; some file systems have none."""

from __future__ import annotations

import errno
from pathlib import Path

from filelock import FileLock, Timeout

from flows.base.console import Console

NO_LOCKS = (errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP)

_told: set[str] = set()
"""What was said of file systems without locks: a search asks for thousands of them."""


class ProcessLock:
    """A lock on a file, which is made; it stays behind, since two could hold one that is removed. Who removes it has to
    bear that.

    Where its file system has no locks nothing keeps others out. That is said, once a process: `where`, and what it does
    not keep a second process from (`doing`).
    """

    def __init__(self, path: Path, where: str, doing: str) -> None:
        self.path, self._where, self._doing = path, where, doing
        self._lock = FileLock(path, thread_local=False)

    @property
    def held(self) -> bool:
        """Whether this process has it."""
        return self._lock.is_locked

    def acquire(self, *, wait: bool = False) -> bool:
        """Whether nobody else has it, as far as the file system can tell: `held`, unless it has no locks. Waits for its
        owner's end if told to. Raises OSError where the file cannot be made."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._lock.acquire(blocking=wait)
        except Timeout:
            return False
        except (NotImplementedError, OSError) as error:
            if isinstance(error, OSError) and error.errno not in NO_LOCKS:
                raise
            self._tell()
        return True

    def release(self) -> None:
        """Give it back."""
        self._lock.release()

    def _tell(self) -> None:
        words = (
            f"{self._where}: its file system has no locks, so that nothing keeps a second process from {self._doing}; "
            "start no other one there before this one has ended."
        )
        if words not in _told:
            _told.add(words)
            Console().say(words)
