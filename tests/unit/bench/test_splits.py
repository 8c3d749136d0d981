"""The splits of the measured drives: complete, apart, and half of most cells for development."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from aesi.bench.hybrid.split_figures import summary, table
from aesi.bench.hybrid.splits import EXPERIMENTS, against, all_splits, chosen_splits, judged
from aesi.errors import InputError
from aesi.physics import Cell
from aesi.pipeline.experiment.config import read_experiment
from aesi.pipeline.experiment.fit import Fitted
from aesi.records import ErrorSeries
from aesi.sparse.bare import Bare

EXPERIMENT_FILES = Path(__file__).resolve().parents[3] / "experiments"


def test_every_split_is_there_once_and_half_of_a_cell_or_none_is_for_development():
    splits = all_splits()
    assert len({split.name for split in splits}) == len(splits)
    counts = {cell: sum(s.cell == cell for s in splits) for cell in EXPERIMENTS}
    assert counts == {"nmc": 20, "lfp": 20, "hg2": 5, "panasonic": 6, "m50t": 2}
    for cell, count in counts.items():
        assert sum(s.development for s in splits if s.cell == cell) == (0 if cell == "lfp" else count // 2)
    assert not any(s.abroad for s in splits if s.development)


@pytest.mark.parametrize("split", all_splits(), ids=lambda split: split.name)
def test_no_drive_trains_and_tests(split):
    data = read_experiment(EXPERIMENT_FILES / split.experiment, split.overrides).data
    roles = (data.repeats.train, data.repeats.test) if data.repeats else (data.train, data.test)
    assert all(roles)
    assert not set(roles[0]) & set(roles[1])
    assert set(split.abroad) <= set(roles[1])
    assert not data.valid


@pytest.mark.parametrize("split", chosen_splits(["hg2", "panasonic"]), ids=lambda split: split.name)
def test_a_cell_file_was_fitted_to_the_drive_that_tests(split):
    """A recalibration by the other drives could but lose there, against a file that had seen the test."""
    config = read_experiment(EXPERIMENT_FILES / split.experiment, split.overrides)
    fitted = {name for name, _ in Cell.from_bpx(EXPERIMENT_FILES / config.cell.bpx).fitted_at_k}
    assert fitted
    assert not fitted & set(config.data.test)


def test_the_measured_experiments_differ_in_no_setting_that_a_test_could_have_chosen():
    for name in EXPERIMENTS.values():
        content = yaml.safe_load((EXPERIMENT_FILES / name).read_text())
        assert "library" not in content
        assert set(content["search"]) <= {
            "candidates", "population", "resamples", "block", "workers",
        }  # fmt: skip


def test_a_part_of_a_name_and_a_number_choose():
    assert {s.cell for s in chosen_splits(["hg2"], a_cell=2)} == {"hg2"}
    assert len(chosen_splits(["nmc"], a_cell=5)) == 5
    assert [s.name for s in chosen_splits(only="us06")] == [
        "hg2 without 25degC_us06",
        "panasonic without 25degC_us06",
    ]
    with pytest.raises(InputError, match="there is no cell 'lto'"):
        chosen_splits(["lto"])


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
    row = {"split": "nmc 1+2", "cell": "nmc", "development": True, "models": figures}
    best = summary([row])["all"]["nmc"]["best_in_hindsight"]
    assert best == {"mser_recalibrated_pct_mean": 0.0, "mser_recalibrated_pct_worst": 0.0}


def row(split: str, cell: str, seed: int, mser_pct: float) -> dict:
    """Of a split whose recalibrated model leaves 10 mV, and whose correction takes as much off as it says."""

    def figures(mser_pct: float) -> dict:
        rmse_mv = 20.0 * np.sqrt(1.0 - mser_pct / 100.0)
        bands = {
            "coverage_pct": 90.0 + seed,
            "worst_drive_coverage_pct": 80.0,
            "winkler_mv": 40.0,
            "rows": 100,
        }
        return {"rmse_mv": rmse_mv, "mser_pct": mser_pct, **bands}

    models = {"ESPM": figures(0.0), "ESPM recalibrated": figures(75.0)}
    models |= {name: figures(mser_pct) for name in ("AESI I", "AESI II")}
    abroad = {"10degC_us06": models} if cell == "hg2" else {}
    head = {"case": f"{split}, seed {seed}", "split": split, "cell": cell, "seed": seed, "development": False}
    return head | {"models": models, "abroad": abroad, "validation_mser_pct": {"AESI I": 70.0}}


def test_the_table_has_each_split_by_its_mean_over_the_seeds_and_the_worst_split():
    rows = [row("nmc 1+2", "nmc", seed, value) for seed, value in enumerate((80.0, 90.0))]
    rows += [row("nmc 1+3", "nmc", seed, 60.0) for seed in range(2)] + [row("hg2 without x", "hg2", 0, 80.0)]
    rows += [
        {
            "case": "m50t 1, seed 0",
            "split": "m50t 1",
            "cell": "m50t",
            "development": False,
            "error": "no data",
        }
    ]
    lines = table(rows)
    nmc = next(line for line in lines if line.startswith("| NMC pouch"))
    assert (
        "| 2 | 2 | 75.0 / 75.0 | 72.5 / 60.0 | -10.0 / -60.0 | 12.5 / 15.0 | 90.5 / 80.0 | 40.0 / 40.0 |"
        in nmc
    )
    assert any(
        line.startswith("| LG HG2, 10degC_us06 | 1 | 1 | 75.0 / 75.0 | 80.0 / 80.0 |") for line in lines
    )
    assert any(
        line.startswith("    | nmc 1+2 | the others | 75.0 | 85.0 | 85.0 | 40.0 | 70.0 |") for line in lines
    )
    assert "m50t 1, seed 0 failed: no data" in lines
    assert summary(rows)["failed"] == 1


def test_a_split_without_two_pieces_to_leave_out_ended_the_summary():
    lone = row("nmc 1+2", "nmc", 0, 80.0) | {"validation_mser_pct": {}}
    assert "validation_minus_test" not in summary([lone])["all"]["nmc"]
    assert any("| 80.0 | 20.0 |  | 90.0 |" in line for line in table([lone]))
    both = [lone, row("nmc 1+3", "nmc", 0, 60.0)]
    assert summary(both)["all"]["nmc"]["validation_minus_test"] == {"median": 10.0, "worst": 10.0}
    nmc = next(line for line in table(both) if line.startswith("| NMC pouch"))
    assert "| 10.0 / 10.0 | 90.0 / 80.0 |" in nmc


def failed(split: str, cell: str, seed: int, verdict: dict[str, str] | None = None) -> dict:
    return {
        key: value
        for key, value in row(split, cell, seed, 0.0).items()
        if key not in ("models", "abroad", "validation_mser_pct")
    } | {"error": "no charge left", **(verdict or {})}


def test_a_split_that_failed_left_the_mean_to_the_others():
    rows = [row("hg2 without a", "hg2", seed, 80.0) for seed in range(2)]
    rows += [failed("hg2 without b", "hg2", seed) for seed in range(2)]
    rows += [row("nmc 1+2", "nmc", 0, 80.0), failed("nmc 1+2", "nmc", 1)]
    last = summary(rows)
    assert (last["splits"], last["runs"], last["failed"]) == (3, 6, 3)
    for cell in ("hg2", "nmc"):
        assert last["all"][cell]["AESI I"]["mser_pct_mean"] == pytest.approx(40.0)
        assert last["all"][cell]["AESI I"]["mser_recalibrated_pct_mean"] == pytest.approx(10.0)
        assert last["all"][cell]["best_in_hindsight"]["mser_recalibrated_pct_mean"] == pytest.approx(10.0)
    lines = table(rows)
    assert any(
        line.startswith("| LG HG2, 25 °C | 2 | 2 | 37.5 / 0.0 | 40.0 / 0.0 | 10.0 / 0.0 |") for line in lines
    )
    # At another temperature a failed run counts in no figure, as in the summary.
    assert any(line.startswith("| LG HG2, 10degC_us06 | 1 | 2 | 75.0 / 75.0 |") for line in lines)
    half = [row("hg2 without a", "hg2", 0, 80.0), failed("hg2 without a", "hg2", 1)]
    assert any(line.startswith("| LG HG2, 10degC_us06 | 1 | 2 | 75.0 / 75.0 |") for line in table(half))
    assert any(
        line.startswith("| NMC pouch, parts of a drive | 1 | 2 | 37.5 / 37.5 | 40.0 / 40.0 |")
        for line in lines
    )


def test_a_cell_all_of_whose_splits_failed_was_in_no_line_of_the_table():
    lines = table([failed("hg2 without b", "hg2", seed) for seed in range(2)])
    assert "| LG HG2, 25 °C | 1 | 2 | 0.0 / 0.0 | 0.0 / 0.0 | 0.0 / 0.0 |  |  |  |" in lines


def test_a_split_whose_data_cannot_be_had_is_in_no_mean():
    away = failed("hg2 without b", "hg2", 0, {"verdict": "not run"})
    rows = [row("hg2 without a", "hg2", 0, 80.0), away]
    last = summary(rows)
    assert (last["splits"], last["failed"], last["not_run"]) == (1, 0, ["hg2 without b, seed 0"])
    assert last["all"]["hg2"]["AESI I"]["mser_pct_mean"] == pytest.approx(80.0)
    assert "hg2 without b, seed 0 not run: no charge left" in table(rows)


def test_a_table_with_development_splits_ended_at_the_first_other_temperature():
    here = row("hg2 without a", "hg2", 0, 80.0)
    development = row("hg2 without b", "hg2", 0, 60.0) | {"development": True}
    del development["abroad"]
    lines = table([here, development])
    assert any(line.startswith("| LG HG2, 25 °C | 2 | 1 | 75.0 / 75.0 | 70.0 / 60.0 |") for line in lines)
    assert any(
        line.startswith("| LG HG2, 10degC_us06 | 1 | 1 | 75.0 / 75.0 | 80.0 / 80.0 |") for line in lines
    )


def test_other_temperatures_were_in_the_mean_of_what_the_correction_takes_off():
    there = row("hg2 without a", "hg2", 0, 80.0)
    there["abroad"] = {"10degC_us06": there["models"] | {"AESI I": there["models"]["ESPM recalibrated"]}}
    figures = summary([there])["all"]["hg2"]["AESI I"]
    assert figures["mser_recalibrated_pct_mean"] == pytest.approx(20.0)
    assert figures["abroad_mser_recalibrated_pct_mean"] == pytest.approx(0.0)


def test_a_model_that_one_run_lacks_ended_the_summary():
    rows = [row("nmc 1+2", "nmc", seed, 80.0) for seed in range(2)]
    del rows[1]["models"]["AESI II"]
    figures = summary(rows)["all"]["nmc"]
    assert figures["AESI II"]["mser_recalibrated_pct_mean"] == pytest.approx(20.0)


def test_a_model_without_a_band_ended_the_table():
    rows = [row("nmc 1+2", "nmc", seed, 80.0) for seed in range(2)]
    for name in ("coverage_pct", "worst_drive_coverage_pct", "winkler_mv", "rows"):
        del rows[1]["models"]["AESI I"][name]
    lines = table(rows)
    head = "| NMC pouch, parts of a drive | 1 | 2 | 75.0 / 75.0 | 80.0 / 80.0 | 20.0 / 20.0 | 10.0 / 10.0 |  |  |"
    assert head in lines
    assert "    | nmc 1+2 | the others | 75.0 | 80.0 | 80.0 | 20.0 | 70.0 |  |  |  |" in lines
