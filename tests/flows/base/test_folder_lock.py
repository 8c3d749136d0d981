"""A folder of results is written by one process at a time."""

import errno
import subprocess
import sys

import pytest
from filelock import FileLock

from aesi.errors import InputError
from flows.base.folder_lock import LOCK, alone_in

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


@pytest.mark.parametrize("error", [NotImplementedError(), OSError(errno.ENOLCK, "No locks available")])
def test_a_file_system_without_locks_let_two_in_without_a_word(tmp_path, monkeypatch, capsys, error):
    def refuse(self, blocking=True):
        raise error

    monkeypatch.setattr(FileLock, "acquire", refuse)
    with alone_in(tmp_path / "out"), alone_in(tmp_path / "out"):
        pass
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert "no locks" in said[0]
    assert "--out" in said[0]


def test_a_folder_that_cannot_be_locked_for_another_reason_is_no_folder_without_locks(tmp_path, monkeypatch):
    def refuse(self, blocking=True):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(FileLock, "acquire", refuse)
    with pytest.raises(OSError, match="No space left"), alone_in(tmp_path / "out"):
        pass
