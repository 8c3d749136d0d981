"""Coverage on a measured drive: the one-step error of persistence about the bare physics model."""

from pathlib import Path

import numpy as np
import pytest

import aesi
from aesi.conformal import METHODS
from aesi.conformal.scores import MIN_BIN_SAMPLES, low_minute_share, scores_of

PIECE = 1800  # the drive repeats its schedule every 1,800 s


@pytest.fixture(scope="module")
def pieces(shared_data: Path) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(residual, current, soc) of each repeat at 1 Hz."""
    folder = shared_data / "measured" / "about_energy_nmc"
    drive = aesi.read_measurement(folder / "drive_cycle.csv")
    run = aesi.simulate(aesi.Cell.from_bpx(folder / "cell.bpx.json"), drive.time_s, drive.current_a, soc0=1.0)
    error = drive.voltage_v - run.voltage_v
    columns = (np.diff(error), drive.current_a[1:], run.series["soc"][1:])
    return [tuple(c[i : i + PIECE] for c in columns) for i in range(0, 4 * PIECE + 1, PIECE)]


@pytest.mark.parametrize("name", ["spci_linear", "spci_boosted"])
def test_holds_within_bins_and_minutes(pieces, name: str) -> None:
    past, future = pieces[0::2], pieces[1::2]
    calibrated = METHODS[name].fit([p[0] for p in past], current_a=[p[1] for p in past])
    for residual, current, soc in future:
        intervals = calibrated.intervals(residual, current)
        scores = scores_of(intervals, residual, 0.1, current, soc)
        # 1,800 samples whose misses the adaptive step spaces out: the share scatters by less than a per cent.
        assert 0.88 <= scores.coverage <= 0.925
        # Some eight bins of little more than 200 samples, each of which scatters by 2.1 %: four of these below 90 %.
        assert scores.worst_bin_coverage >= 0.9 - 4.0 * np.sqrt(0.9 * 0.1 / MIN_BIN_SAMPLES)
        assert low_minute_share([intervals.covers(residual)], 1.0) <= 0.01


def test_the_current_narrows_the_band(pieces) -> None:
    past, (residual, current, _) = pieces[0::2], pieces[1]
    method = METHODS["spci_boosted"]
    blind = method.fit([p[0] for p in past]).intervals(residual)
    seeing = method.fit([p[0] for p in past], current_a=[p[1] for p in past]).intervals(residual, current)
    assert seeing.width_v.mean() < 0.6 * blind.width_v.mean()
