"""A workspace of its own for every test, so that no test sees another's runs."""

import os
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from flows import cli
from flows.base import environment

ROOT = Path(__file__).resolve().parents[2]
SMOKE = ROOT / "experiments" / "smoke.yaml"
SMALL = (
    "search.candidates=6",
    "search.population=3",
    "search.resamples=5",
    "search.timeout_s=600",  # on a busy machine a candidate took longer than the 60 s of the file
    'models=["ESPM", "AESI I", "ridge"]',
)
ASIDE = ("tracking.system_metrics=false", "tracking.log_model=false")


@contextmanager
def home(folder):
    """The folder as the workspace, for fixtures that outlive a test."""
    before = os.environ.get("AESI_HOME")
    os.environ["AESI_HOME"] = str(folder)
    os.environ.pop("MLFLOW_TRACKING_URI", None)  # which MLflow sets itself when a model is logged
    environment.prepare_process()
    try:
        yield
    finally:
        os.environ.pop("AESI_HOME") if before is None else os.environ.update(AESI_HOME=before)


def laid_under(more):
    """The overrides of a small run, without those keys that `more` sets, which may be given once."""
    from flows.benchmarks.splits import merged_overrides

    return [*merged_overrides((*SMALL, *ASIDE), more)]


@pytest.fixture(scope="session")
def empty_store(tmp_path_factory):
    """An empty MLflow database: making its tables takes seconds, copying it takes none."""
    from flows.tracking.store import Store

    folder = tmp_path_factory.mktemp("store")
    with home(folder):
        Store(f"sqlite:///{folder}/mlflow.db").client._tracking_client.store.engine.dispose()
    return folder / "mlflow.db"


@pytest.fixture(scope="session")
def finished(tmp_path_factory, empty_store):
    """A workspace in which the small experiment ran once, uninterrupted. Copy it to change it."""
    from flows.jobs.start import start

    folder = tmp_path_factory.mktemp("finished")
    copy_store(empty_store, folder)
    with home(folder):
        start(SMOKE, [*SMALL, "tracking.system_metrics=false"], use_prefect=False)
    return folder


def copy_store(database, folder):
    """The database with its write-ahead log."""
    for path in database.parent.glob("mlflow.db*"):
        shutil.copy(path, folder / path.name)


@pytest.fixture(autouse=True)
def workspace(tmp_path, monkeypatch):
    """An empty workspace, in the environment and as the current folder."""
    monkeypatch.setenv("AESI_HOME", str(tmp_path))
    monkeypatch.setenv("PREFECT_HOME", str(tmp_path / ".aesi" / "prefect"))
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.chdir(tmp_path)
    environment.prepare_process()
    return tmp_path


@pytest.fixture
def tracked(workspace, empty_store):
    """The workspace with a tracking store in it."""
    copy_store(empty_store, workspace)
    return workspace


@pytest.fixture
def said():
    """What was said; pass `said.append` where a function to say things is wanted."""
    return []


@pytest.fixture
def aesi(workspace):
    """Starts the command as a process of its own: aesi("run", ...) -> Popen."""
    started = []

    def start(*arguments, **environ):
        command = [sys.executable, "-m", "flows.cli", *map(str, arguments)]
        process = subprocess.Popen(
            command,
            cwd=workspace,
            env=os.environ | {"PYTHONPATH": str(ROOT)} | environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()


@pytest.fixture
def arguments():
    """Arguments of an `aesi run` that takes seconds; more `--set` values may be added.

    prefect : said either way, because the tests' environment turns Prefect off where nothing is said.
    """

    def make(*more, prefect=False):
        pairs = (part for text in laid_under(more) for part in ("--set", text))
        return ["run", str(SMOKE), "--prefect" if prefect else "--no-prefect", *pairs]

    return make


@pytest.fixture
def run(tracked):
    """Runs the small experiment in this process; the folder of its results."""
    from flows.jobs.start import start

    def go(*more, **options):
        return start(SMOKE, laid_under(more), use_prefect=False, **options)

    return go


@pytest.fixture
def call(monkeypatch, capsys):
    """Runs `aesi` in this process: exit code, stdout, stderr."""

    def go(*arguments):
        monkeypatch.setattr(sys, "argv", ["aesi", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        out, err = capsys.readouterr()
        return ended.value.code or 0, out, err

    return go


@pytest.fixture
def cell():
    """The project's 30 Ah cell."""
    return ROOT / "experiments" / "cells" / "nmc_30ah.bpx.json"


@pytest.fixture
def current(tmp_path):
    """Ten minutes of a drive-like current, without voltage."""
    time_s = np.arange(0.0, 600.0)
    current_a = 30 * np.sin(time_s / 40) ** 3
    path = tmp_path / "current.csv"
    pd.DataFrame({"time_s": time_s, "current_a": current_a}).to_csv(path, index=False)
    return path
