"""The benchmark of designs, small: its figures are reductions on repeats that nobody was trained on."""

from pathlib import Path

import pytest

from aesi.bench.hybrid.design import SETTINGS, _summary, run

CELL = Path(__file__).parents[3] / "experiments" / "cells" / "nmc_30ah.bpx.json"


def test_a_line_for_each_setting():
    names = ["fold 200", "fold 1800"]
    lines = list(run(cell=str(CELL), virtual=1, candidates=6, settings=names, sindy=False))
    assert [line["setting"] for line in lines] == names
    assert set(names) <= set(SETTINGS)
    for line in lines:
        assert line["cells"] == 1
        assert line["aesi_i_mean_pct"] == max(0.0, line["aesi_i_median_pct"])
        assert "sindy_c_mean_pct" not in line
    # Strong ridges on the whole library, which every search begins with, correct this cell.
    assert lines[0]["aesi_i_mean_pct"] > 45.0


def test_a_setting_gives_the_same_figures_again():
    once, again = (
        next(run(cell=str(CELL), virtual=1, candidates=4, settings=["fold 200"], sindy=False)) for _ in "ab"
    )
    assert {**once, "cpu_s": 0} == pytest.approx({**again, "cpu_s": 0})


def test_a_cell_on_which_nothing_survives_was_in_no_mean():
    line = _summary([{"AESI I": 80.0}, {"AESI I": 60.0}, {}, {}])
    assert line["failed"] == 2
    assert line["aesi_i_mean_pct"] == pytest.approx(35.0)
    assert line["aesi_i_median_pct"] == pytest.approx(30.0)
    assert line["aesi_i_below_45"] == 2
