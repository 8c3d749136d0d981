"""A folder of results is written by one process at a time."""

import errno
import subprocess
import sys

import pytest
from filelock import FileLock

from aesi.errors import InputError
from flows.base.folder_lock import LOCK, alone_in
from flows.evaluation.outcome_files import FileOutcomes
from flows.tracking.run_records import RunLock
from flows.tracking.store import _alone

HOLD = "import sys; from pathlib import Path; from flows.base.folder_lock import alone_in\n"
HOLD += "with alone_in(Path(sys.argv[1])): print('held', flush=True); sys.stdin.read()"


def test_two_processes_that_wrote_to_one_folder_left_a_mixture(tmp_path):
    out = tmp_path / "out ü"
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, out], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(InputError, match="another process writes its results there now"), alone_in(out):
            pass
        other.kill()  # as when it is ended at once: nothing is left that would keep others out
    with alone_in(out):
        assert (out / LOCK).exists()


def test_one_folder_does_not_wait_for_another(tmp_path):
    with alone_in(tmp_path / "a"), alone_in(tmp_path / "b"):
        pass


LACKING = [NotImplementedError(), OSError(errno.ENOLCK, "No locks available")]


@pytest.fixture(params=LACKING, ids=["unknown", "none left"])
def no_locks(request, monkeypatch):
    def refuse(self, blocking=True):
        raise request.param

    monkeypatch.setattr(FileLock, "acquire", refuse)
    monkeypatch.setattr("flows.base.locks._told", set())


def test_a_file_system_without_locks_let_two_in_without_a_word(tmp_path, no_locks, capsys):
    with alone_in(tmp_path / "out"), alone_in(tmp_path / "other"), alone_in(tmp_path / "out"):
        pass
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2  # each folder once
    assert "no locks" in said[0]
    assert "--out" in said[0]


def test_a_workspace_without_locks_ended_every_run_with_a_bare_error(tmp_path, no_locks, capsys, monkeypatch):
    monkeypatch.setenv("AESI_HOME", str(tmp_path))
    outcomes = FileOutcomes(tmp_path / "candidates")
    assert all(outcomes.claim(key) for key in ("aa", "bb"))
    with RunLock("one") as lock:
        assert not lock.held  # so that nobody closes a run that may be alive
        assert lock.acquire()
    with _alone(tmp_path / "mlflow.db"):
        pass
    outcomes.close()
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 3
    for line, doing in zip(
        said, ("evaluating the same candidates", "working on the same run", "setting up"), strict=True
    ):
        assert f"no locks, so that nothing keeps a second process from {doing}" in line


def test_a_folder_that_cannot_be_locked_for_another_reason_is_no_folder_without_locks(tmp_path, monkeypatch):
    def refuse(self, blocking=True):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(FileLock, "acquire", refuse)
    with pytest.raises(OSError, match="No space left"), alone_in(tmp_path / "out"):
        pass
