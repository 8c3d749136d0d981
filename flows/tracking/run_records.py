"""What is known of a run while it is not finished: its record on disk, and who is alive.

.aesi/state/<run id>.json holds experiment, config digest and status; .aesi/state/<run id>.lock is held by the
process that works on the run, and the kernel frees it with that process.
"""

from __future__ import annotations

import fcntl
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import IO

from flows.base import environment
from flows.base.files import write_atomically


@dataclass(frozen=True)
class RunRecord:
    """One flow run. status : running, killed, failed or finished; started_s : seconds since the epoch."""

    run_id: str
    experiment: str
    config_digest: str
    uri: str
    started_s: float
    status: str = "running"

    def write(self) -> None:
        """Keep it on disk."""
        write_atomically(_folder() / f"{self.run_id}.json", json.dumps(asdict(self)).encode())


def records(experiment: str | None = None) -> list[RunRecord]:
    """All records, newest first; unreadable ones are left out."""
    found = []
    for path in _folder().glob("*.json"):
        try:
            found.append(RunRecord(**json.loads(path.read_text())))
        except (OSError, ValueError, TypeError):
            continue
    found.sort(key=lambda record: record.started_s, reverse=True)
    return [record for record in found if experiment in (None, record.experiment)]


class RunLock:
    """The right to work on a run; `held` says whether this process has it."""

    def __init__(self, run_id: str) -> None:
        self._path = _folder() / f"{run_id}.lock"
        self._stream: IO[str] | None = None
        self.held = False

    def acquire(self) -> bool:
        """Take the lock if nobody has it."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._stream = self._path.open("w")
        try:
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._stream.close()
            return False
        self.held = True
        return True

    def release(self) -> None:
        """Give it back."""
        if self.held and self._stream is not None:
            fcntl.flock(self._stream, fcntl.LOCK_UN)
            self._stream.close()
            self.held = False

    def __enter__(self) -> RunLock:
        self.acquire()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def _folder() -> Path:
    return environment.state() / "state"
