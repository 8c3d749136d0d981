"""What bands are calibrated on: rows that the model which predicted them had been trained around."""

import numpy as np
import pytest

from aesi.conformal import WHOLE_DRIVE
from aesi.pipeline.bands import HonestErrors
from aesi.records import ErrorSeries, FreeRun

N, DT = 400, 1.0


class Held:
    """Holds the measured error it was given."""

    name = "held"

    def one_step(self, series):
        return self.k_step(series, 1)

    def free_run(self, series, error0_v=None):
        return FreeRun(np.full(len(series), series.error_v[0]), None, np.zeros(len(series), dtype=bool))

    def k_step(self, series, steps):
        return np.concatenate([np.full(steps, series.error_v[0]), series.error_v[:-steps]])


@pytest.fixture
def drive() -> ErrorSeries:
    """A discharge: the second input falls all along, the current swings."""
    time = DT * np.arange(N)
    inputs = np.column_stack([np.sin(time), 1 - time / N])
    return ErrorSeries("drive", DT, time, 1e-5 * time, inputs, 1 - time / N, time, ("I", "c_sp"))


def test_a_piece_at_either_end_was_extrapolated(drive) -> None:
    pieces = [drive.take(slice(a, a + 101)) for a in (0, 100, 200, 299)]
    errors = HonestErrors.of([(Held(), piece) for piece in pieces], (drive,), (10.0,))
    assert [bool(inside.any()) for inside in errors.inside] == [False, True, True, False]
    assert errors.inside[1].mean() > 0.95


def test_another_record_is_inside_where_the_training_went(drive) -> None:
    other = drive.take(slice(0, N), "validation")
    beyond = ErrorSeries(
        "validation",
        DT,
        drive.time_s,
        drive.error_v,
        1.5 * drive.inputs,
        drive.soc,
        drive.model_v,
        drive.input_names,
    )
    errors = HonestErrors.of([(Held(), other), (Held(), beyond)], (drive,), ())
    assert errors.inside[0].all()
    assert 0 < errors.inside[1].mean() < 0.7


def test_errors_are_those_of_the_horizon(drive) -> None:
    errors = HonestErrors.of([(Held(), drive)], (drive.take(slice(0, N), "other"),), (10.0,))
    (ahead,) = errors.by_horizon[10.0]
    assert np.isnan(ahead[:10]).all()
    np.testing.assert_allclose(ahead[10:], 1e-4)
    np.testing.assert_allclose(errors.by_horizon[WHOLE_DRIVE][0], drive.error_v)
