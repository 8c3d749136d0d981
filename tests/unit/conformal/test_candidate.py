import numpy as np
import pytest

from aesi.bench.intervals.spci import oracle_series
from aesi.conformal import METHODS
from aesi.conformal.validation import spaced_pieces, validation_scores


def test_scores_a_candidate_by_what_it_covers(rng: np.random.Generator) -> None:
    residuals, valid = oracle_series(88_200, rng), oracle_series(10_000, rng)
    halves = [residuals.residuals[:50_000], residuals.residuals[50_000:]]
    scores = validation_scores(METHODS["spci_linear"], halves, [valid.residuals])
    assert scores.coverage == pytest.approx(0.9, abs=0.015)
    assert scores.n == 10_000


def test_thinning_keeps_residual_and_current_together() -> None:
    records = [np.arange(0.0, 700.0), np.arange(700.0, 1000.0)]
    kept, currents = spaced_pieces(records, [10 * r for r in records], 200)
    assert currents is not None
    assert 180 <= sum(len(r) for r in kept) <= 200
    for record, current in zip(kept, currents, strict=True):
        np.testing.assert_array_equal(np.diff(record), 1.0)
        np.testing.assert_array_equal(current, 10 * record)


def test_short_records_are_kept_whole() -> None:
    records = [np.arange(5.0)]
    assert spaced_pieces(records, None, 100)[0][0] is records[0]
