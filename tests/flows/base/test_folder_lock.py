"""A folder of results is written by one process at a time."""

import subprocess
import sys

import pytest

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
