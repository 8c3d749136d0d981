"""Cases on measured cells: the plan, faults put in by hand, judging by hand, and data that cannot be had."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from aesi.bench.real import chosen, judged, plan, summary, write_report
from aesi.bench.real.faults import declared_with_fault, soc0_with_fault, with_fault
from aesi.bench.real.judge import scored
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement

CELLS = "experiments/cells"


def test_the_plan_has_what_a_benchmark_on_measured_cells_needs():
    cases = plan()
    assert len(cases) >= 60
    names = {case.name for case in cases}
    assert len(names) == len(cases)
    groups = Counter(case.group for case in cases)
    assert groups["control"] >= 20
    assert groups["fault"] == 45
    assert groups["withheld"] >= 12
    assert abs(sum(case.development for case in cases) - len(cases) / 2) <= 3
    for case in cases:
        assert case.source
        assert case.matched is None or case.matched in names
        assert set(case.answers) <= set(CATALOGUE)
        for key in case.parameters:
            effect, name = key.split(".")
            assert name in CATALOGUE[effect].parameters
    assert all(not case.take.temperature for case in cases if case.group == "withheld")


def test_cases_are_chosen_by_group_and_by_what_they_are_for():
    assert {case.group for case in chosen(only="ageing")} == {"ageing"}
    assert all(not case.development for case in chosen(development=False))
    assert len(chosen(cases=3)) == 3


def test_faults_by_hand():
    data = Measurement(np.arange(4.0), np.array([0.0, 2.0, 2.0, 0.0]), np.array([4.0, 3.9, 3.8, 3.9]))
    assert with_fault(data, "current_offset", 0.1).current_a == pytest.approx([0.1, 2.1, 2.1, 0.1])
    assert with_fault(data, "current_gain", 1.02).current_a == pytest.approx([0, 2.04, 2.04, 0])
    assert with_fault(data, "voltage_offset", 0.01).voltage_v == pytest.approx([4.01, 3.91, 3.81, 3.91])
    assert with_fault(data, "voltage_lag", 0.5).voltage_v == pytest.approx([4.0, 3.95, 3.85, 3.85])
    assert with_fault(data, "contact_resistance", 0.01).voltage_v == pytest.approx([4.0, 3.88, 3.78, 3.9])
    assert with_fault(data, "wrong_soc0", 0.05) is data
    assert soc0_with_fault(1.0, "wrong_soc0", 0.05) == pytest.approx(0.95)
    assert soc0_with_fault(None, "wrong_soc0", 0.05) is None


def test_more_in_the_file_than_in_the_cell():
    cell = Cell.from_bpx(f"{CELLS}/nmc_30ah.bpx.json")
    more = declared_with_fault(cell, "capacity_in_file", 0.05)
    assert more.nominal_capacity_ah == pytest.approx(1.05 * cell.nominal_capacity_ah)
    assert more.electrode_area_m2 == pytest.approx(1.05 * cell.electrode_area_m2)


def content(*effects, groups=(), parameters=None, verdict="found"):
    errors = {"test": {"rmse_mv": 5.0}}
    return {
        "verdict": verdict,
        "effects": list(effects),
        "indistinguishable": [list(g) for g in groups],
        "confidence": 0.9,
        "before": errors,
        "recalibrated": errors,
        "after": errors,
        "candidates": [{"effect": name, "parameters": parameters or {}} for name in effects],
    }


def test_a_name_counts_in_a_group_of_two_and_not_of_three():
    right = ("current_sensor_offset",)
    assert scored(right, {}, content("current_sensor_offset"))["named"]
    pair = [("leakage_current", "current_sensor_offset")]
    assert scored(right, {}, content("leakage_current", groups=pair))["named"]
    three = [("leakage_current", "current_sensor_offset", "ocp_shape")]
    assert not scored(right, {}, content("leakage_current", groups=three))["named"]
    assert scored(right, {}, content("ocp_shape", "current_sensor_offset"))["others"] == ["ocp_shape"]


def test_a_control_is_right_where_nothing_is_named():
    assert scored((), {}, content(verdict="none"))["named"]
    assert not scored((), {}, content("ocp_shape", verdict="unknown"))["named"]


def test_sizes_count_from_where_there_is_no_effect():
    estimate = {"gain": {"value": 1.018, "low": 1.01, "high": 1.03, "unit": "dimensionless"}}
    row = scored(
        ("current_sensor_gain",),
        {"current_sensor_gain.gain": 1.02},
        content("current_sensor_gain", parameters=estimate),
    )
    assert row["size_error"] == pytest.approx(0.1)
    assert row["size_covered"]


def test_data_that_cannot_be_had_is_not_run_and_not_passed(monkeypatch, tmp_path):
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    monkeypatch.setenv("AESI_CACHE", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    case = next(case for case in plan() if case.take.set == "lg_18650hg2")
    row = judged(case, CELLS)
    assert row["verdict"] == "not run"
    assert "10.17632" in row["error"]
    last = summary([row])
    assert last["not_run"] == [case.name]
    assert last["control_silent_cases"] == 0


def test_the_report_is_one_file_with_what_was_said(tmp_path):
    row = {
        "case": "current_offset-0.1-x",
        "group": "fault",
        "development": False,
        "answer": ["current_sensor_offset"],
        "source": "put in",
        "processor_s": 1.0,
        "residual": {
            "time_s": [0.0, 1.0],
            "before_mv": [5.0, -5.0],
            "recalibrated_mv": [3.0, 1.0],
            "after_mv": [1.0, 0.0],
        },
    }
    estimate = {"offset_a": {"value": 0.11, "low": 0.09, "high": 0.13, "unit": "A"}}
    row |= scored(
        ("current_sensor_offset",),
        {"current_sensor_offset.offset_a": 0.1},
        content("current_sensor_offset", parameters=estimate),
    )
    last = summary([row])
    assert last["fault_named_pct"] == 100.0
    assert last["reported"]["size_error_median"] == pytest.approx(0.1)
    assert last["confusion"] == {"current_sensor_offset": {"current_sensor_offset": 1}}
    page = write_report(tmp_path / "real.html", [row], last).read_text()
    assert "current_offset-0.1-x" in page
    assert "<polyline" in page
    assert "http" not in page


@pytest.mark.parametrize("name", ["control-about_energy_nmc-1C", "ageing-25degC_1c_end"])
def test_records_are_read_and_hold_the_answer(shared_data, name):
    from aesi.bench.real.judge import _load

    case = next(case for case in plan() if case.name == name)
    data, truth = _load(case)
    assert len(data) > 300
    if case.measured == "capacity":
        # 2.80 Ah in March and 2.43 Ah in July, the last rows at the end of discharge included.
        assert truth["lithium_inventory_loss.loss"] == pytest.approx(1 - 2.43 / 2.80, abs=0.02)
    else:
        assert truth == {}


def test_a_withheld_temperature_is_in_the_answer_and_not_in_the_data(shared_data):
    from aesi.bench.real.judge import _load

    case = next(case for case in plan() if case.name == "withheld-lg_18650hg2-10degC_us06")
    data, truth = _load(case)
    assert data.temperature_degc is None
    assert truth["ambient_temperature.shift_k"] == pytest.approx(10.9 - 25, abs=0.3)
    given = replace(case, take=replace(case.take, temperature=True))
    assert _load(given)[0].temperature_degc is not None
