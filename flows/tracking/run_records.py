"""Unfinished runs: the record of each on disk, and whether a process still works on it.

.aesi/state/<run id>.json holds experiment, config digest and status; .aesi/state/<run id>.lock is held by the
process that works on the run, and the kernel frees it with that process.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from aesi.errors import AesiError
from aesi.numerics.files.whole import write_whole
from flows.base import environment
from flows.base.locks import ProcessLock


class RunTaken(AesiError):
    """Another process works on the run."""


@dataclass(frozen=True)
class RunRecord:
    """One flow run. status : running, killed, failed or finished; started_s : seconds since the epoch.

    config_digest : what another run has to share to go on with it.  anew : whether it takes no result that another run
    has stored (`--no-cache`), which holds for whoever goes on with it.
    """

    run_id: str
    experiment: str
    config_digest: str
    started_s: float
    status: str = "running"
    anew: bool = False

    def write(self) -> None:
        """Keep it on disk."""
        write_whole(_folder() / f"{self.run_id}.json", json.dumps(asdict(self)))

    def again(self) -> RunRecord | None:
        """As it is on disk now: who waited for the run's lock knows the record of before. None where it is gone."""
        return _read(_folder() / f"{self.run_id}.json")

    def forget(self) -> None:
        """Take it off the disk."""
        (_folder() / f"{self.run_id}.json").unlink(missing_ok=True)


def records(experiment: str | None = None) -> list[RunRecord]:
    """All records, newest first; unreadable ones are left out."""
    found = [record for path in _folder().glob("*.json") if (record := _read(path))]
    found.sort(key=lambda record: record.started_s, reverse=True)
    return [record for record in found if experiment in (None, record.experiment)]


class RunLock(ProcessLock):
    """The right to work on a run; `held` says whether this process has it, as none is known to where the workspace's
    file system has no locks.

    As a context it raises RunTaken where another process has it: nobody works on a run beside another.
    """

    def __init__(self, run_id: str) -> None:
        super().__init__(_folder() / f"{run_id}.lock", str(_folder()), "working on the same run")
        self._run_id = run_id

    def __enter__(self) -> RunLock:
        if not self.acquire():
            raise RunTaken(
                f"another process works on run {self._run_id} or delivers what it tracked; wait for its end, then "
                "start again."
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def _read(path: Path) -> RunRecord | None:
    try:
        return RunRecord(**json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return None


def _folder() -> Path:
    return environment.state() / "state"
