"""Unfinished runs: the record of each on disk, and whether a process still works on it.

.aesi/state/<run id>.json holds experiment, config digest and status; .aesi/state/<run id>.lock is held by the
process that works on the run, and the kernel frees it with that process.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from aesi.numerics.files.whole import READ_BY_OWNER, write_whole
from flows.base import environment
from flows.base.locks import ProcessLock


@dataclass(frozen=True)
class RunRecord:
    """One flow run. status : running, killed, failed or finished; started_s : seconds since the epoch.

    config_digest : what another run has to share to go on with it.
    """

    run_id: str
    experiment: str
    config_digest: str
    uri: str
    started_s: float
    status: str = "running"

    def write(self) -> None:
        """Keep it on disk."""
        # The address of a store may hold a password.
        write_whole(_folder() / f"{self.run_id}.json", json.dumps(asdict(self)), READ_BY_OWNER)

    def forget(self) -> None:
        """Take it off the disk."""
        (_folder() / f"{self.run_id}.json").unlink(missing_ok=True)


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
    """The right to work on a run; `held` says whether this process has it, as none is known to where the workspace's
    file system has no locks."""

    def __init__(self, run_id: str) -> None:
        folder = _folder()
        self._lock = ProcessLock(folder / f"{run_id}.lock", str(folder), "working on the same run")

    @property
    def held(self) -> bool:
        """Whether this process works on the run."""
        return self._lock.held

    def acquire(self) -> bool:
        """Take the lock; False where another process has it."""
        return self._lock.acquire()

    def release(self) -> None:
        """Give it back."""
        self._lock.release()

    def __enter__(self) -> RunLock:
        self.acquire()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def _folder() -> Path:
    return environment.state() / "state"
