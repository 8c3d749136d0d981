"""The benchmark of free-run bands, on one virtual cell."""

from itertools import pairwise

import numpy as np
import pytest

from aesi.bench.intervals.bands import DESIGNS, HORIZONS_S, _line, run
from aesi.bench.virtual_drives import virtual_splits
from aesi.errors import FitError
from aesi.physics import Cell


@pytest.fixture(scope="module")
def cell(request):
    return request.config.rootpath / "experiments" / "cells" / "nmc_30ah.bpx.json"


def test_every_horizon_and_design_has_a_line(cell) -> None:
    lines = list(run(cell=str(cell), virtual=1, layouts=["repeats"]))
    assert len(lines) == len(DESIGNS) * (len(HORIZONS_S) + 1)
    for line in lines:
        assert 0 < line["coverage_pct"] <= 100
        assert line["interval_score_mv"] >= line["width_mv"] > 0
        assert line["coverage_sd_pct"] is line["coverage_se_pct"] is None  # one cell tells no deviation


def test_the_standard_error_of_few_cells_was_too_small() -> None:
    # By hand: 0.8, 0.9 and 1 deviate by 0.1 from their mean, with two degrees of freedom.
    figures = np.array([[coverage, 1e-3, 1e-3, 0.5, 1.0] for coverage in (0.8, 0.9, 1.0)])
    line = _line("repeats", "scaled", 1.0, 0, figures)
    assert (line["coverage_sd_pct"], line["coverage_se_pct"]) == (10.0, 5.77)


def test_a_layout_without_any_model_ended_in_a_division_by_zero(cell, monkeypatch) -> None:
    monkeypatch.setattr("aesi.bench.intervals.bands._errors", lambda *_: None)
    with pytest.raises(
        FitError, match="no model of any of the 1 cells of the layout repeats; ask for more cells"
    ):
        next(run(cell=str(cell), virtual=1, layouts=["repeats"]))


def test_cells_of_one_seed_are_the_same_and_differ_among_each_other(cell) -> None:
    declared = Cell.from_bpx(cell)
    first, again = (list(virtual_splits(declared, "repeats", 2, seed=3)) for _ in range(2))
    assert [s.train[0].digest for s in first] == [s.train[0].digest for s in again]
    assert first[0].train[0].digest != first[1].train[0].digest


def test_test_repeats_lie_between_training_repeats_in_charge(cell) -> None:
    (split,) = virtual_splits(Cell.from_bpx(cell), "repeats", 1)
    for (before, after), test in zip(pairwise(split.train), split.test, strict=True):
        assert before.soc[-1] >= test.soc[0] > test.soc[-1] >= after.soc[0]
    assert np.abs(split.test[0].error_v).max() < 0.5


def test_the_layout_beyond_the_trained_range_tests_what_was_never_trained(cell) -> None:
    (split,) = virtual_splits(Cell.from_bpx(cell), "beyond", 1)
    highest = max(record.current_a.max() for record in split.train)
    assert min(record.current_a.min() for record in split.train) == 0.0
    for test in split.test:
        assert test.current_a.min() < -0.1 * highest
        assert test.current_a.max() == pytest.approx(1.3 * highest, rel=0.01)
