"""`aesi bench left_out`: its plan, what it tells of records that are not there, and its table."""

from pathlib import Path

import pytest

from aesi.bench.left_out import DEVELOPMENT_SETS, SETS, judged, plan, summary, table
from aesi.bench.real.plan import chosen
from aesi.physics import Cell

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def test_every_record_is_left_out_once():
    names = [case.name for case in plan()]
    assert (
        len(names)
        == len(set(names))
        == sum(len(one.slow) + len(one.drives) - len(one.fitted) for one in SETS)
    )
    assert [case.test for case in plan("nmc/C2")] == ["C20", "C2"]


@pytest.mark.parametrize("one", [one for one in (*SETS, *DEVELOPMENT_SETS) if one.cell])
def test_a_discharge_that_the_cell_file_was_fitted_to_was_left_out_as_if_it_were_unseen(one):
    fitted = {name for name, _ in Cell.from_bpx(CELLS / one.cell).fitted_at_k}
    assert not fitted & set(one.left_out)
    assert set(one.fitted) <= fitted & {*one.slow, *one.drives}


def test_development_sets_hold_development_records_of_several_kinds():
    cases = plan(development=True)
    assert {case.set for case in cases} == set(DEVELOPMENT_SETS)
    for one in DEVELOPMENT_SETS:
        assert one.slow
        assert one.drives
    assert ("panasonic_ncr18650pf", "25degC_hppc") not in {
        (case.set.data, case.test) for case in cases
    }  # fitted
    development = {case.take.file for case in chosen(development=True) if case.take is not None}
    assert {case.test for case in cases} <= development


def test_records_that_cannot_be_had_are_not_run(tmp_path, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    row = judged(plan("lg_m50t")[0], "experiments/cells")
    assert row["verdict"] == "not run"
    assert row["error"]


def test_a_model_that_fails_on_the_left_out_record_ended_the_benchmark(shared_data, monkeypatch):
    errors = {
        "before": {"test": {}},
        "recalibrated": {"test": {"rmse_mv": 8.0}},
        "after": {"test": {"rmse_mv": 8.0}},
    }
    content = errors | {"verdict": "none", "effects": []}
    monkeypatch.setattr("aesi.bench.left_out.discover", lambda *_: None)
    monkeypatch.setattr("aesi.bench.left_out.discovery_content", lambda _: content)
    row = judged(plan("nmc/C2")[0], "experiments/cells")
    assert summary([row])["failed"] == 1
    assert "cannot be simulated" in table([row])[-1]


@pytest.fixture
def rows():
    def row(name, after, **more):
        better = {"before_mv": 10.0, "recalibrated_mv": 8.0, "after_mv": after, "times_better": after / 8.0}
        return (
            {"case": name, "cell": "c", "record": name, "verdict": "found", "effects": ["x"]} | better | more
        )

    failed = {
        "case": "d", "cell": "c", "record": "d", "verdict": "error", "error": "no charge", "effects": [],
    }  # fmt: skip
    return [row("a", 8.0), row("b", 12.0), row("e", 4.0), failed]


def test_the_summary_counts_what_is_worse_than_leaving_the_cell_alone(rows):
    last = summary(rows)
    assert (last["cases"], last["failed"], last["no_worse"]) == (4, 1, 2)
    assert (last["worst_case"], last["worst_times"]) == ("b", 1.5)


def test_names_beside_unknown_were_counted_as_findings(rows):
    rows[0] |= {"verdict": "unknown"}
    rows[1] |= {"verdict": "none", "effects": []}
    assert summary(rows)["confusion"] == {"unknown: x": 1, "none": 1, "x": 1}


def test_the_table_has_the_worst_in_bold_and_says_what_failed(rows):
    lines = table(rows)
    assert [line for line in lines if "**" in line] == ["| c | b | found: x | 10.0 | 8.0 | 12.0 | **1.50** |"]
    assert "no charge" in lines[-1]
