"""What a page that compares runs holds of one: its ranges belong to the figures that they stand below."""

import numpy as np
import pytest
from scipy.signal import lfilter

from aesi.pipeline.experiment.comparison import _intervals, _map
from aesi.pipeline.report.views import ModelVoltage, RecordTrace


@pytest.fixture
def learned_on_recalibrated():
    """A correction that halves what a recalibration left, which is half of what was declared."""
    n = 4000
    rng = np.random.default_rng(0)
    declared = 3.7 + 0.01 * rng.standard_normal(n)
    measured = np.full(n, 3.7)
    recalibrated = measured + 0.5 * (declared - measured)
    corrected = measured + 0.25 * (declared - measured)
    return RecordTrace(
        "drive", "test", np.arange(n) * 1.0, rng.normal(0.0, 3.0, n), np.linspace(0.9, 0.3, n), measured, recalibrated,
        {"ESPM + AESI I": ModelVoltage(corrected)},
        {"ESPM": declared, "ESPM recalibrated": recalibrated},
    )  # fmt: skip


def test_a_reduction_is_against_the_declared_physics_where_another_was_corrected(learned_on_recalibrated):
    trace = learned_on_recalibrated
    reduction = {
        n: _intervals([trace], n, 0)["test_mser_pct"] for n in ("ESPM", "ESPM recalibrated", "ESPM + AESI I")
    }
    assert reduction["ESPM"] == pytest.approx([0.0, 0.0])
    assert reduction["ESPM recalibrated"] == pytest.approx([75.0, 75.0])
    assert reduction["ESPM + AESI I"] == pytest.approx([93.75, 93.75])


def test_the_map_of_the_declared_physics_is_of_what_was_declared(learned_on_recalibrated):
    trace = learned_on_recalibrated
    declared, recalibrated = (
        np.array(_map([trace], name)["mean_mv"], dtype=float) for name in ("ESPM", "ESPM recalibrated")
    )
    assert declared == pytest.approx(2.0 * recalibrated, abs=2e-3, nan_ok=True)


def test_the_range_of_an_rmse_holds_it_where_errors_are_correlated_over_minutes():
    # Errors of 10 mV with a correlation time of 100 s, on records of 7,000 and 3,000 s; 90 % are so, of 200 draws
    # 0.90 +- 0.02. In 70 % with blocks of 60 s.
    rng, keep = np.random.default_rng(0), np.exp(-0.1)
    within = []
    for _ in range(200):
        noise = 0.01 * np.sqrt(1.0 - keep**2) * rng.standard_normal((1100, 2))
        errors = lfilter([1.0], [1.0, -keep], noise, axis=0)[100:].T
        drives = [
            RecordTrace(
                name, "test", np.arange(n) * 10.0, np.ones(n), np.linspace(0.9, 0.3, n), 3.7 + error[:n],
                np.full(n, 3.7), {}, {"ESPM": np.full(n, 3.7)},
            )
            for name, n, error in zip("ab", (700, 300), errors, strict=True)
        ]  # fmt: skip
        low, high = _intervals(drives, "ESPM", 0)["test_rmse_mv"]
        within.append(low <= 10.0 <= high)
    assert 0.84 < np.mean(within) < 0.96


def test_a_test_of_a_single_row_has_no_range():
    row = np.full(1, 3.7)
    trace = RecordTrace(
        "drive", "test", np.zeros(1), np.ones(1), np.ones(1), row + 0.01, row, {}, {"ESPM": row}
    )
    assert _intervals([trace], "ESPM", 0) == {}
