"""Ctrl-C in the midst of a search, under Prefect: one line, nothing left running, and the next command goes on."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import psutil
import pytest

import aesi
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.written import ARCHIVE

ROOT = Path(__file__).resolve().parents[3]
CELL = ROOT / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
pytestmark = pytest.mark.slow


@pytest.fixture
def record(tmp_path):
    """Twenty minutes of a cell whose contacts are worse than its file says."""
    rng = np.random.default_rng(0)
    time_s = np.arange(0.0, 1200.0)
    current_a = np.repeat(rng.normal(3.0, 4.0, 40), 30).clip(-5.0, 12.0)
    current_a[:60] = 0.0
    more = [CATALOGUE["series_resistance"].activate(resistance_ohm=8e-3)]
    run = aesi.simulate(aesi.Cell.from_bpx(CELL), time_s, current_a, soc0=0.9, effects=more)
    voltage_v = run.voltage_v + 1e-3 * rng.standard_normal(len(time_s))
    table = pd.DataFrame({"time_s": time_s, "current_a": current_a, "voltage_v": voltage_v})
    table.to_csv(tmp_path / "drive.csv", index=False)
    return tmp_path / "drive.csv"


def to_the_group(number):
    """As a terminal sends Ctrl-C, and `timeout` SIGTERM."""
    return number, lambda process: os.killpg(process.pid, number)


def to_the_command(number):
    """As a scheduler sends SIGTERM."""
    return number, lambda process: process.send_signal(number)


CTRL_C = to_the_group(signal.SIGINT)


def interrupted(arguments, at, after_s=1.0, by=CTRL_C):
    """What a command says from the moment on when a signal reaches it, some time after a line with `at` in it."""
    number, send = by
    process = subprocess.Popen(
        [sys.executable, "-m", "flows.cli", *arguments],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert any(at in line for line in process.stderr), "it ended before"
    time.sleep(after_s)
    family = psutil.Process(process.pid).children(recursive=True)
    assert family  # Prefect's temporary server at least
    send(process)
    with process.stderr:
        rest = process.stderr.read()
    process.wait(timeout=30)
    assert process.returncode == 128 + number
    psutil.wait_procs(family, timeout=1.0)
    assert not [one for one in family if one.is_running() and one.status() != psutil.STATUS_ZOMBIE]
    return [
        line for line in rest.splitlines() if not line.startswith("  ")
    ]  # progress may come before it ends


def test_a_run_interrupted_in_its_search_goes_on(aesi, arguments, tracked):
    said = interrupted(arguments(prefect=True), " started")
    assert len(said) == 1
    assert said[0].startswith("Stopped. Everything so far is kept; go on with: aesi run")
    done = aesi(*arguments(), "--resume")
    _, said = done.communicate(timeout=240)
    assert done.returncode == 0, said
    assert "resumed" in said


@pytest.mark.parametrize("send", [to_the_command, to_the_group])
def test_a_run_that_a_scheduler_ended_told_no_way_back_or_showed_a_traceback(arguments, tracked, send):
    said = interrupted(arguments(prefect=True), " started", by=send(signal.SIGTERM))
    assert len(said) == 1
    assert said[0].startswith("Stopped. Everything so far is kept; go on with: aesi run")


def test_a_discovery_interrupted_in_its_search_goes_on(aesi, record, tracked):
    """At its first hypothesis: all of them take some seconds, of which none is to spare."""
    archive = tracked / "found" / ARCHIVE
    command = ["discover", "--cell", str(CELL), "--data", str(record), "--out", "found", "--model", "dfn"]
    command += ["--only", "series_resistance", "--only", "ocv_hysteresis"]
    said = interrupted([*command, "--prefect"], "hypotheses: 1 in", after_s=0.0)
    assert said == ["Stopped. What was fitted is kept in found; the same command goes on from there."]
    kept = archive.read_text().splitlines()
    done = aesi(*command, "--no-prefect")
    _, said = done.communicate(timeout=240)
    assert done.returncode == 0, said
    assert "found holds an earlier search" in said
    assert "its finding is replaced" not in said  # it has none
    assert "Report: found" in said
    fits = archive.read_text().splitlines()
    assert 0 < len(kept) < len(fits)  # within the search, not before or after
    assert fits[: len(kept)] == kept
    entries = [json.loads(line) for line in fits]
    assert len({one["fit"] for one in entries}) == len(entries)  # what was kept is not fitted again
