"""A disk that is full, for real: a small file system of its own, filled in mid-run. One sentence, then resumable."""

import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from flows.tracking.store import KIND, NUMBER, PARENT, Store

MEGABYTE = 1 << 20
SIZE = 48 * MEGABYTE


@pytest.fixture
def small_disk(tracked, monkeypatch):
    """A workspace on a tmpfs of its own, with an empty tracking store."""
    folder = tracked / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={SIZE}", "tmpfs", str(folder)]
    if os.geteuid() or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small file system is not permitted here")
    try:
        for path in tracked.glob("mlflow.db*"):
            shutil.copy(path, folder)
        monkeypatch.setenv("AESI_HOME", str(folder))
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def fill(folder: Path) -> Path:
    """Leave nothing of the disk."""
    ballast = folder / "ballast"
    with ballast.open("wb", buffering=0) as stream:
        for size in (MEGABYTE, 4096):
            try:
                while True:
                    stream.write(b"\0" * size)
            except OSError:
                continue
    return ballast


def candidates_on_disk(workspace):
    return list((workspace / ".aesi/cache/candidates").glob("??/*.bin"))


def filled_in_mid_run(small_disk, process, ready):
    """Fill the disk as soon as `ready`, see the run end, free the disk; what the run said."""
    deadline = time.monotonic() + 300
    while not ready():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.01)
    ballast = fill(small_disk)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 1, said
    ballast.unlink()
    return said


def assert_complete(workspace):
    store = Store(f"sqlite:///{workspace}/mlflow.db")
    experiment = store.find_experiment("smoke")
    finished = list(store.runs(experiment, f"tags.`{KIND}` = 'run' and attributes.status = 'FINISHED'"))
    assert len(finished) == 1
    nested = store.runs(experiment, f"tags.`{PARENT}` = '{finished[0].info.run_id}'")
    labels = [run.data.tags[NUMBER] for run in nested]
    assert sorted(label for label in labels if label.startswith("candidate:")) == [
        f"candidate:{n}" for n in range(6)
    ]
    assert len(list((workspace / "runs/smoke").glob("*/report.html"))) == 1
    assert not list((workspace / "runs/smoke").glob("*/*.part"))


def test_full_in_the_search(small_disk, aesi, arguments, run, capsys):
    process = aesi(*arguments())
    said = filled_in_mid_run(small_disk, process, lambda: len(candidates_on_disk(small_disk)) >= 2)
    last = said.splitlines()[-1]
    assert last.startswith(f"aesi: no room is left for {small_disk} (No space left on device)")
    assert last.endswith("--resume")
    assert "Traceback" not in said
    run(resume=True)
    assert "known from before" in capsys.readouterr().err
    assert_complete(small_disk)
