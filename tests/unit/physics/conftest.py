"""Cells and a load that every physics test may use."""

from pathlib import Path

import numpy as np
import pytest

from aesi.physics import Cell

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture(scope="session")
def nmc() -> Cell:
    return Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")


@pytest.fixture(scope="session")
def lg_m50() -> Cell:
    return Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


@pytest.fixture(scope="session")
def load() -> tuple[np.ndarray, np.ndarray]:
    """600 s of a current that changes every few seconds, for the 30 Ah cell."""
    time = np.arange(600.0)
    current = 30.0 * (0.4 + np.sin(time / 9.0) + 0.8 * np.sign(np.sin(time / 31.0)))
    current[:5] = 0.0
    return time, current
