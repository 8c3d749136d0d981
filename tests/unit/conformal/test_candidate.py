import numpy as np
import pytest

from aesi.bench.intervals.spci import oracle_series
from aesi.conformal import METHODS
from aesi.conformal.validation import spaced_pieces, validation_scores


def test_scores_a_candidate_by_what_it_covers(rng: np.random.Generator) -> None:
    residuals, valid = oracle_series(88_200, rng), oracle_series(10_000, rng)
    halves = [residuals.residuals[:50_000], residuals.residuals[50_000:]]
    calibration, judged = (
        [(one, np.zeros(len(one))) for one in each] for each in (halves, [valid.residuals])
    )
    scores = validation_scores(METHODS["spci_linear"], calibration, judged, 0.1, 200, rng, 20_000)
    assert scores.coverage == pytest.approx(0.9, abs=0.015)


def test_thinning_keeps_residual_and_current_together() -> None:
    records = [np.arange(0.0, 700.0), np.arange(700.0, 1000.0)]
    kept = spaced_pieces([(r, 10 * r) for r in records], 200)
    assert 180 <= sum(len(record) for record, _ in kept) <= 200
    for record, current in kept:
        np.testing.assert_array_equal(np.diff(record), 1.0)
        np.testing.assert_array_equal(current, 10 * record)


def test_short_records_are_kept_whole() -> None:
    records = [(np.arange(5.0), np.zeros(5))]
    assert spaced_pieces(records, 100) == records
