"""The splits of the measured drives: complete, apart, and half of them for development."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from aesi.bench.hybrid.splits import EXPERIMENTS, against, all_splits, chosen_splits, judged
from aesi.errors import InputError
from aesi.pipeline.experiment.config import read_experiment
from aesi.pipeline.experiment.fit import Fitted
from aesi.records import ErrorSeries
from aesi.sparse.yardsticks import Bare
from flows.benchmarks.splits import summary

EXPERIMENT_FILES = Path(__file__).resolve().parents[3] / "experiments"


def test_every_split_is_there_once_and_half_of_a_cell_is_for_development():
    splits = all_splits()
    assert len({split.name for split in splits}) == len(splits)
    counts = {cell: sum(s.cell == cell for s in splits) for cell in EXPERIMENTS}
    assert counts == {"nmc": 20, "hg2": 5, "panasonic": 6, "m50t": 2}
    for cell, count in counts.items():
        assert sum(s.development for s in splits if s.cell == cell) == count // 2
    assert not any(s.abroad for s in splits if s.development)


@pytest.mark.parametrize("split", all_splits(), ids=lambda split: split.name)
def test_no_drive_trains_and_tests(split):
    data = read_experiment(EXPERIMENT_FILES / split.experiment, split.overrides).data
    roles = (data.repeats.train, data.repeats.test) if data.repeats else (data.train, data.test)
    assert all(roles)
    assert not set(roles[0]) & set(roles[1])
    assert set(split.abroad) <= set(roles[1])
    assert not data.valid


def test_the_measured_experiments_differ_in_no_setting_that_a_test_could_have_chosen():
    for name in EXPERIMENTS.values():
        content = yaml.safe_load((EXPERIMENT_FILES / name).read_text())
        assert "library" not in content
        assert set(content["search"]) <= {
            "candidates", "population", "resamples", "block", "workers", "timeout_s",
        }  # fmt: skip


def test_a_part_of_a_name_and_a_number_choose():
    assert {s.cell for s in chosen_splits(["hg2"], a_cell=2)} == {"hg2"}
    assert len(chosen_splits(["nmc"], a_cell=5)) == 5
    assert [s.name for s in chosen_splits(only="us06")] == [
        "hg2 without 25degC_us06",
        "panasonic without 25degC_us06",
    ]
    with pytest.raises(InputError, match="there is no cell 'lfp'"):
        chosen_splits(["lfp"])


def test_both_reductions_are_of_the_squared_error():
    n = 50
    series = ErrorSeries(
        "record",
        1.0,
        np.arange(n, dtype=float),
        np.full(n, 1e-3),
        np.zeros((n, 5)),
        np.ones(n),
        np.full(n, 3.7),
        physics={"ESPM": np.full(n, 3.7 - 9e-3), "ESPM recalibrated": np.full(n, 3.7)},
    )
    names = ("ESPM", "ESPM recalibrated")
    figures = judged([Fitted(Bare(name), 0, 0.0) for name in names], [series, replace(series, name="other")])
    assert figures["ESPM"]["rmse_mv"] == pytest.approx(10.0)
    assert figures["ESPM recalibrated"]["mser_pct"] == pytest.approx(99.0)
    assert against(figures["ESPM recalibrated"], figures["ESPM"]) == pytest.approx(99.0)
    assert against(figures["ESPM"], figures["ESPM recalibrated"]) == pytest.approx(-9900.0)
    assert figures["ESPM"]["drives"]["other"]["rmse_mv"] == pytest.approx(10.0)
    row = {"cell": "nmc", "development": True, "models": figures}
    best = summary([row])["all"]["nmc"]["best_in_hindsight"]
    assert best == {"mser_recalibrated_pct_mean": 0.0, "mser_recalibrated_pct_worst": 0.0}
