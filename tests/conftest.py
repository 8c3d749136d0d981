"""Shared by all tests: one thread a process, no telemetry, and where measured data may be found."""

import json
import os
import sys

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("PYBAMM_DISABLE_TELEMETRY", "true")
os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
os.environ.setdefault("DO_NOT_TRACK", "1")
# A temporary server takes longer than most commands that are tested.
os.environ.setdefault("AESI_PREFECT", "false")
os.environ.setdefault("PREFECT_SERVER_ANALYTICS_ENABLED", "false")

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

# A busy machine is no fault of the code: examples are not timed.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

ROOT = Path(__file__).resolve().parents[1]
BESIDE = ROOT.parent / "shared" / "data"

if BESIDE.is_dir():
    # Here and not in a fixture: experiments that tests run in processes of their own look there too.
    os.environ.setdefault("AESI_DATA", str(BESIDE))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured cells, drive schedules and labelled virtual cases; skips where it is absent."""
    folder = Path(os.environ.get("AESI_DATA", ""))
    if os.environ.get("AESI_DATA") and folder.is_dir():
        return folder
    pytest.skip("no measured data here: set AESI_DATA to their folder")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20260)


@pytest.fixture
def calls_of():
    """calls_of(work): how many functions a call of `work` calls, Python's and compiled ones. What the work costs,
    without a clock: a busy machine takes longer but calls no more."""

    def count(work) -> int:
        seen = 0

        def profile(frame, event, argument):
            nonlocal seen
            seen += event in ("call", "c_call")

        before = sys.getprofile()
        sys.setprofile(profile)
        try:
            work()
        finally:
            sys.setprofile(before)
        return seen

    return count


@pytest.fixture
def dated_file(tmp_path):
    """write(cell, share, day): the file of a cell that had its capacity on 1 January 2018, and a share of it on a later
    day (YYYYMMDD)."""

    def write(cell: Path, share: float, day: int) -> Path:
        content = json.loads(cell.read_text())
        content["Parameterisation"]["User-defined"] = {
            "Capacity share by record": {"new": 1.0, "old": share},
            "Day of test by record [YYYYMMDD]": {"new": 20180101, "old": day},
        }
        path = tmp_path / "dated.json"
        path.write_text(json.dumps(content))
        return path

    return write
