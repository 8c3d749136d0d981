"""Cases on measured cells: the plan, faults put in by hand, judging by hand, and data that cannot be had."""

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.bench.detectable import seen_on_measured
from aesi.bench.limit import NO_TIME, NOT_RUN
from aesi.bench.physics.archive import ARCHIVE
from aesi.bench.physics.cells import _of_archive
from aesi.bench.real import chosen, judged, plan, summary, table, write_report
from aesi.bench.real.answers import answer_scores, initial_state_row
from aesi.bench.real.faults import declared_with_fault, soc0_with_fault, with_fault
from aesi.bench.real.judge import _shift_k, _truth, declared_cell, taken
from aesi.bench.real.references import measured_resistances, model_resistances
from aesi.data.catalogue import locate
from aesi.data.spectra import read_spectra
from aesi.physics import Cell
from aesi.physics.effect import Record
from aesi.physics.effects import CATALOGUE, self_heating
from aesi.records import Measurement, Spectrum

CELLS = "experiments/cells"


def test_the_plan_has_what_a_benchmark_on_measured_cells_needs():
    cases = plan()
    assert len(cases) >= 60
    names = {case.name for case in cases}
    assert len(names) == len(cases)
    groups = Counter(case.group for case in cases)
    assert groups["control"] == 20
    assert groups["witness"] == 2
    assert groups["fault"] == 45
    assert groups["fault_beside"] == 51
    assert groups["control_beside"] == 9
    assert groups["withheld"] >= 12
    assert abs(sum(case.development for case in cases) - len(cases) / 2) <= 3
    for case in cases:
        assert case.source
        assert case.matched is None or case.matched in names
        assert set(case.answers) <= set(CATALOGUE)
        for key in case.parameters:
            effect, name = key.split(".")
            assert name in CATALOGUE[effect].parameters
    assert {case.take.temperature for case in cases if case.group == "withheld"} == {False}


def test_of_the_archives_a_temperature_is_withheld_wherever_it_is_given_beside_it():
    cases = plan(archive=True)
    names = {case.name for case in cases}
    assert Counter(case.group for case in cases) == {"withheld": 37, "control": 37}
    assert not names & {case.name for case in plan()}
    for group in ("withheld", "control"):
        ours = [case for case in cases if case.group == group]
        assert all(case.development for case in ours[::2])
        assert all(case.take.temperature == (group == "control") for case in ours)
        assert not any(case.take.file.startswith("25degC") for case in ours)


def test_drives_that_the_energies_of_the_files_were_chosen_on_stood_as_unseen():
    chose = {(record.data, record.name) for record in _of_archive(ARCHIVE, development=True)}
    unseen = [case for case in chosen(archive=True, development=False) if case.group == "withheld"]
    assert len(unseen) == 10
    assert not chose & {(case.take.set, case.take.file) for case in unseen}


def test_cases_are_chosen_by_group_and_by_what_they_are_for():
    assert {case.group for case in chosen(only="ageing")} == {"ageing"}
    assert {case.development for case in chosen(development=False)} == {False}
    assert len(chosen(cases=3)) == 3


def test_faults_beside_good_records_are_the_same_faults():
    by_name = {case.name: case for case in plan()}
    beside = [case for case in by_name.values() if case.group == "fault_beside"]
    for case in beside:
        alone = by_name[case.name.removeprefix("beside-")]
        assert (case.fault, case.take, case.answers) == (alone.fault, alone.take, alone.answers)
        assert case.good
        assert case.take not in case.good
        assert by_name[case.matched].good == case.good
        assert by_name[case.matched].fault is None


def test_each_fault_changes_a_record_as_worked_out_by_hand():
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
        "margin": 3.0,
        "before": errors,
        "recalibrated": errors,
        "after": errors,
        "candidates": [{"effect": name, "parameters": parameters or {}} for name in effects],
        "own_parameters": {"recalibrated": [], "after": []},
    }


def test_each_right_name_takes_back_what_was_put_into_the_current():
    taken_back = 0
    data = Measurement(np.arange(4.0), np.array([0.0, 1.0, 2.0, -1.0]), np.full(4, 3.7))
    for case in plan():
        if case.fault is None or case.fault.kind not in ("current_offset", "current_gain"):
            continue
        faulty = with_fault(data, case.fault.kind, case.fault.size)
        for key, value in case.parameters.items():
            effect, name = key.split(".")
            seen = CATALOGUE[effect].on_record(Record(faulty.time_s, faulty.current_a), **{name: value})
            np.testing.assert_allclose(seen.current_a, data.current_a, atol=1e-12)
            taken_back += 1
    assert taken_back == 2 * (9 * 2 + 9)


def test_a_name_counts_in_a_group_of_two_and_not_of_three():
    right = ("current_sensor_offset",)
    assert answer_scores(right, {}, content("current_sensor_offset"))["named"]
    pair = [("leakage_current", "current_sensor_offset")]
    assert answer_scores(right, {}, content("leakage_current", groups=pair))["named"]
    three = [("leakage_current", "current_sensor_offset", "ocp_shape")]
    assert not answer_scores(right, {}, content("leakage_current", groups=three))["named"]
    assert answer_scores(right, {}, content("ocp_shape", "current_sensor_offset"))["others"] == ["ocp_shape"]


def test_a_control_is_right_where_nothing_is_named():
    assert answer_scores((), {}, content(verdict="none"))["named"]
    assert not answer_scores((), {}, content("ocp_shape", verdict="unknown"))["named"]


def test_sizes_count_from_where_there_is_no_effect():
    estimate = {"gain": {"value": 1.018, "low": 1.01, "high": 1.03, "unit": "dimensionless"}}
    row = answer_scores(
        ("current_sensor_gain",),
        {"current_sensor_gain.gain": 1.02},
        content("current_sensor_gain", parameters=estimate),
    )
    assert row["size_error"] == pytest.approx(0.1)
    assert row["size_covered"]
    estimate["gain"] |= {"low": None}
    without = answer_scores(
        ("current_sensor_gain",),
        {"current_sensor_gain.gain": 1.02},
        content("current_sensor_gain", parameters=estimate),
    )
    assert without["size_covered"] is False


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
        "source": "added",
        "put_in": "current_offset 0.1",
        "seen_nats": 9.0,
        "record": "x/drive",
        "processor_s": 1.0,
        "residual": {
            "time_s": [0.0, 1.0],
            "before_mv": [5.0, -5.0],
            "recalibrated_mv": [3.0, 1.0],
            "after_mv": [1.0, 0.0],
        },
    }
    estimate = {"offset_a": {"value": 0.11, "low": 0.09, "high": 0.13, "unit": "A"}}
    row |= answer_scores(
        ("current_sensor_offset",),
        {"current_sensor_offset.offset_a": 0.1},
        content("current_sensor_offset", parameters=estimate),
    )
    unseen = row | {"case": "current_offset-0.01-x", "seen_nats": 0.4, "named": False}
    both = summary([row, unseen])
    assert (both["fault_named_pct"], both["fault_seen_named_pct"], both["fault_seen_named_cases"]) == (
        50.0,
        100.0,
        1,
    )
    last = summary([row])
    assert last["fault_named_pct"] == 100.0
    assert last["reported"]["size_error_median"] == pytest.approx(0.1)
    assert last["confusion"] == {"current_sensor_offset": {"current_sensor_offset": 1}}
    page = write_report(tmp_path / "real.html", [row], last).read_text()
    body = page[: page.index("<script>")]
    assert "current_offset-0.1-x" in body
    assert 'data-figure="worst_0"' in body
    assert 'data-figure="confusion"' in body
    assert 'data-figure="sizes"' in body
    assert "100 [2, 100] of 1" in body
    # No page was written where the declared model failed on the held-out data, or the data of a fault were not there.
    failed = row | {"case": "current_offset-0.2-x", "before_test_mv": None}
    not_run = {k: v for k, v in row.items() if k not in ("named", "effects", "residual")} | {
        "verdict": "not run"
    }
    rows = [failed, not_run]
    page = write_report(tmp_path / "real.html", rows, summary(rows)).read_text()
    assert "x: not run" in page
    assert "RMSE on held-out data: 5.0 mV recalibrated model, 5.0 mV written model." in page


def test_the_table_counts_by_kind_and_shows_each_case(gain_rows):
    lines = table(gain_rows)
    assert "| current gain |  | 2 | 1 | 1 | 1 | 10 % | 1 of 1 |" in lines
    assert "| control |  | 1 | 0 |  |  |  |  |" in lines
    each = [line.strip() for line in lines if "drive |" in line]
    assert each[0] == (
        "| x/drive | current gain 1.02 | found: current_sensor_gain | yes | 9.0 | 1.02 | 1.02 [1.01, 1.03] "
        "| 5.0 | 5.0 | 5.0 |"
    )
    assert len(each) == 3


def test_a_case_without_an_answer_left_the_rates_and_the_table(shared_data, monkeypatch):
    """It was not among the faults that stand out, and of fewer cases more were named."""
    case = next(case for case in plan() if case.name == "voltage_lag-2-about_energy_nmc")
    case = replace(case, take=replace(case.take, stop_s=900.0))
    monkeypatch.setattr("aesi.bench.real.judge.seen_on_measured", lambda *_: 7.1)
    row = judged(case, CELLS, limit_s=1e-3)
    assert (row["verdict"], row["named"], row["seen_nats"]) == ("out of time", False, 7.1)
    last = summary([row])
    assert (last["fault_seen_named_pct"], last["fault_seen_named_cases"]) == (0.0, 1)
    lines = table([row])
    assert "| voltage lag |  | 1 | 0 | 1 | 0 |  |  |" in lines
    assert any("| voltage lag 2 | out of time | no | 7.1 |" in line for line in lines)


def test_what_the_tracer_refuses_says_nothing():
    cell = Cell.from_bpx(f"{CELLS}/lg_m50_chen2020.bpx.json")
    short = Measurement(np.arange(20.0), np.zeros(20), np.full(20, 3.7), name="short")
    assert seen_on_measured(cell, short, 0.5, ("series_resistance",), (), 0.3) is None


@pytest.fixture
def gain_rows():
    put_in = {
        "group": "fault",
        "put_in": "current_gain 1.02",
        "record": "x/drive",
        "answer": ["current_sensor_gain"],
    }
    estimate = {"gain": {"value": 1.018, "low": 1.01, "high": 1.03, "unit": "dimensionless"}}
    truth, right = {"current_sensor_gain.gain": 1.02}, ("current_sensor_gain",)
    seen = put_in | {"seen_nats": 9.0} | answer_scores(right, truth, content(*right, parameters=estimate))
    unseen = put_in | {"seen_nats": 0.3} | answer_scores(right, truth, content(verdict="unknown"))
    return [seen, unseen, control("still", "ocp_shape") | {"record": "x/drive"}, {"verdict": "not run"}]


def test_half_of_a_wrong_initial_state_taken_back():
    moved = {"effect": "soc0", "parameter": "x", "value": 0.975}
    row = initial_state_row("x", 0.95, 1.0, {"own_parameters": {"after": [moved]}})
    assert row["size_true"] == pytest.approx(0.05)
    assert row["size_error"] == pytest.approx(0.5)
    unmoved = initial_state_row("x", 0.95, 1.0, {"own_parameters": {"after": []}})
    assert unmoved["size_error"] == pytest.approx(1.0)


def test_the_state_of_a_good_record_that_moved_further_was_taken_for_that_of_the_case():
    good, moved = ({"effect": "soc0", "parameter": n, "value": v} for n, v in (("good", 0.9), ("x", 0.99)))
    row = initial_state_row("x", 0.95, 1.0, {"own_parameters": {"after": [good, moved]}})
    assert row["size_found"] == pytest.approx(0.04)
    assert row["size_error"] == pytest.approx(0.2)


def control(name, *effects):
    head = {"case": name, "group": "control", "development": False, "put_in": "", "processor_s": 1.0}
    return head | {"answer": [], "matched": None} | answer_scores((), {}, content(*effects))


def test_a_control_that_shows_the_name_of_its_matched_case_is_counted():
    fault = control("cold") | {"group": "withheld", "answer": ["ambient_temperature"], "matched": "given"}
    last = summary([fault, control("given", "ambient_temperature"), control("other", "ocp_shape")])
    assert last["control_silent_pct"] == 0.0
    assert last["control_matched_false_pct"] == 100.0
    assert last["control_matched_false_cases"] == 1
    assert last["control_false_names"] == {"given": ["ambient_temperature"], "other": ["ocp_shape"]}
    silent = control("given") | {"verdict": "out of time", "effects": [], "named": False}
    assert summary([fault, silent])["control_matched_false_cases"] == 0
    assert last["withheld_within_2k_pct"] == 0.0
    sized = fault | {"named": True, "size_found": -13.0, "size_true": -14.1}
    assert summary([sized])["withheld_within_2k_pct"] == 100.0
    assert summary([sized | {"size_found": -10.0}])["withheld_within_2k_pct"] == 0.0


def test_the_resistances_of_a_circuit_are_read_off_its_spectrum():
    hz = np.geomspace(1e-2, 1e4, 200)
    omega = 2 * np.pi * hz
    lead = 1j * omega * 2e-7  # crosses zero where the semicircle is small
    z = 0.02 + lead + 0.008 / (1 + 1j * omega * 0.008 * 0.5)
    found = measured_resistances(Spectrum("circuit", hz, z, soc=0.5))
    assert found.ohmic_ohm == pytest.approx(0.02, rel=0.02)
    assert found.transfer_ohm == pytest.approx(0.008, rel=0.05)


def test_a_contact_is_in_the_ohmic_part_of_the_model_and_slow_kinetics_in_the_other():
    cell = Cell.from_bpx(f"{CELLS}/lg_m50_chen2020.bpx.json")
    plain = model_resistances(cell, (), 0.5, 25.0)
    contact = model_resistances(
        cell, (CATALOGUE["series_resistance"].activate(resistance_ohm=5e-3),), 0.5, 25.0
    )
    slow = CATALOGUE["charge_transfer_kinetics"].activate(negative_factor=0.5, positive_factor=0.5)
    slower = model_resistances(cell, (slow,), 0.5, 25.0)
    assert contact.ohmic_ohm - plain.ohmic_ohm == pytest.approx(5e-3)
    assert contact.transfer_ohm == pytest.approx(plain.transfer_ohm)
    assert slower.ohmic_ohm == pytest.approx(plain.ohmic_ohm, rel=1e-3)
    assert slower.transfer_ohm > 1.2 * plain.transfer_ohm


def known(name):
    case = next(case for case in plan() if case.name == name)
    data = taken(case.take)
    return case, data, _truth(case, data, declared_cell(case.cell, CELLS))


@pytest.mark.parametrize("name", ["control-about_energy_nmc-1C", "ageing-25degC_1c_end"])
def test_records_are_read_and_hold_the_answer(shared_data, name):
    case, data, truth = known(name)
    assert len(data) > 300
    if case.measured == "capacity":
        # 2.80 Ah in March and 2.43 Ah in July, the last rows at the end of discharge included.
        assert truth.lost == pytest.approx(1 - 2.43 / 2.80, abs=0.02)
    else:
        assert truth.parameters == {}


def test_a_withheld_temperature_is_in_the_answer_and_not_in_the_data(shared_data):
    case, data, truth = known("withheld-lg_18650hg2-10degC_us06")
    assert data.temperature_degc is None
    assert len(truth.temperature_degc) == len(data)
    declared = declared_cell(case.cell, CELLS)
    shift = SimpleNamespace(
        effect="ambient_temperature", parameters={"shift_k": SimpleNamespace(value=-14.0)}
    )
    constant = SimpleNamespace(model_effects=(), candidates=(shift,))
    warmed = SimpleNamespace(model_effects=(self_heating.of_file(declared),), candidates=(shift,))
    told = [_shift_k(one, declared, data, 1.0, truth.temperature_degc) for one in (constant, warmed)]
    assert told[0] == pytest.approx(10.9 - 25, abs=0.3)
    assert told[1] + 25.0 == pytest.approx(
        truth.temperature_degc[0], abs=1.0
    )  # the cell was at the chamber's
    given = replace(case, take=replace(case.take, temperature=True))
    assert taken(given.take).temperature_degc is not None


def test_the_spectra_of_a_witness_are_those_of_its_month(shared_data):
    case, _, truth = known("witness-10degC_hppc")
    spectra = read_spectra(locate(case.take.set, case.spectra))
    assert len(spectra) == 13
    assert {round(s.temperature_degc) for s in (*spectra, truth.witness.spectrum)} == {10}


def test_a_spectrum_without_a_zero_crossing_ended_every_case(monkeypatch):
    hz = np.geomspace(0.01, 1e3, 20)
    capacitive = Spectrum("month", hz, 0.02 + 0.01 / (1 + 1j * hz), soc=0.5)
    monkeypatch.setattr("aesi.bench.real.judge.locate", lambda *names: names)
    monkeypatch.setattr("aesi.bench.real.judge.declared_cell", lambda *names: None)
    monkeypatch.setattr("aesi.bench.real.judge.taken", lambda take: None)
    monkeypatch.setattr("aesi.bench.real.judge.read_spectra", lambda path: (capacitive,))
    case = next(case for case in plan() if case.group == "witness")
    row = judged(case, CELLS)
    assert row["verdict"] == NOT_RUN
    assert row["error"].startswith("month shows no ohmic resistance: its imaginary part has to cross zero")


def test_a_case_whose_process_was_ended_entered_the_median_as_no_time_at_all():
    lost = control("lost") | NO_TIME
    last = summary([control("a") | {"processor_s": 4.0}, control("b") | {"processor_s": 6.0}, lost])
    assert last["processor_s_median"] == pytest.approx(5.0)
    assert last["processor_s_total"] == pytest.approx(10.0)
