"""The project's own cell files, and a cache that lives as long as the tests."""

from pathlib import Path

import pytest

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture(scope="session")
def nmc() -> Path:
    return CELLS / "nmc_30ah.bpx.json"


@pytest.fixture(scope="session")
def m50() -> Path:
    return CELLS / "lg_m50_chen2020.bpx.json"


@pytest.fixture(scope="session")
def cells() -> Path:
    return CELLS


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def laboratory_cache(session_cache, monkeypatch) -> Path:
    """Runs are shared between tests, and with nothing else."""
    monkeypatch.setenv("AESI_CACHE", str(session_cache))
    return session_cache
