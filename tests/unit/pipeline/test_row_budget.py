"""How many rows a discovery is run on: what judges it changes nothing of what it fits."""

from contextlib import suppress

import numpy as np
import pandas as pd
import pytest
from small_experiment import BPX, SOC0, experiment, write_record

import aesi
from aesi.data import read_measurement
from aesi.physics import Cell
from aesi.pipeline.discovery.budget import most_rows_each
from aesi.pipeline.discovery.cases import case_of_experiment, case_of_files
from aesi.tracer.case.records import prepare_test

ROWS, FITTED = 3000, 2000


@pytest.fixture
def most(monkeypatch):
    def set_to(rows, read=2_000_000):
        monkeypatch.setattr("aesi.pipeline.discovery.budget.MOST_ROWS", rows)
        monkeypatch.setattr("aesi.pipeline.discovery.budget.MAX_ROWS", read)

    return set_to


@pytest.fixture
def whole(tmp_path):
    return write_record(tmp_path, "whole.csv")


def part(whole, name, first, last):
    """A file of some of the rows of another one."""
    path = whole.with_name(name)
    pd.read_csv(whole).iloc[first:last].to_csv(path, index=False)
    return path


def test_the_name_of_a_test_file_changed_what_is_fitted(tmp_path, whole, most):
    other = write_record(tmp_path, "other.csv", seed=1)
    short = part(write_record(tmp_path, "third.csv", seed=2), "short.csv", 0, 301)
    for budget, rows in ((ROWS, ROWS), (2000, 1500)):
        most(budget)
        alone, *judged = (
            case_of_files(BPX, [whole], tests) for tests in ([], [short], [other], [short, other])
        )
        assert len(alone.measurements[0]) == rows
        for case in judged:
            assert case.measurements[0].digest == alone.measurements[0].digest
    assert [len(test) for test in judged[-1].tests] == [301, 1500]  # each by its own length


def test_a_state_of_charge_of_one_record_is_not_that_of_the_others(tmp_path, whole, most):
    most(2000)
    other = write_record(tmp_path, "other.csv", seed=1)
    case = case_of_files(BPX, [whole], [other], soc0=0.9, known_soc0={"other": 0.6})
    assert (case.soc0, case.measurements[0].soc0, case.tests[0].soc0) == (0.9, None, 0.6)
    # The test part that goes on from a fitted record begins where that did.
    first, second = part(whole, "first.csv", 0, 600), part(whole, "second.csv", 600, 1200)
    led = case_of_files(BPX, [first], [second], known_soc0={"first": 0.6, "second": 0.2})
    test = prepare_test(Cell.from_bpx(BPX), led.tests[0], led.measurements, None)
    assert (test.start.basis, test.soc0, test.continues) == ("given", 0.6, 0)


def test_what_short_records_do_not_need_is_for_the_long_ones(tmp_path, whole, most):
    assert most_rows_each([10, 100, 5], 60) == 45
    assert most_rows_each([10, 20], 30) == 20
    assert most_rows_each([50, 50, 50], 60) == 20
    short = part(write_record(tmp_path, "other.csv", seed=1), "short.csv", 0, 301)
    most(2000)
    case = case_of_files(BPX, [whole], good=[short])
    assert [len(record) for record in case.records] == [1500, 301]
    (note,) = (note for note in case.notes if "Decimated" in note)
    assert note.startswith("whole: Decimated from 3,000 to 1,500 rows: runs of 2 rows")


@pytest.mark.parametrize(
    ("budget", "rows", "behind"), [(4000, 2000, 1000), (1500, 1000, 500), (600, 500, 250)]
)
@pytest.mark.parametrize("begins", [True, False])
def test_fitted_rows_were_judged_where_they_are_the_beginning_of_a_test(
    whole, most, budget, rows, behind, begins
):
    fit = part(whole, "fit.csv", 0, FITTED)
    test = whole if begins else part(whole, "rest.csv", FITTED, ROWS)
    most(budget)
    case = case_of_files(BPX, [fit], [test])
    assert len(case.measurements[0]) == rows
    prepared = prepare_test(Cell.from_bpx(BPX), case.tests[0], case.measurements, SOC0)
    assert (prepared.continues, prepared.lead_rows) == (0, rows)
    assert len(prepared.data) == rows + behind
    assert prepared.data.time_s[rows] >= FITTED
    read = read_measurement(whole)
    last = int(prepared.data.time_s[-1])
    # A thinned row is the average since the row before.
    taken_ah = prepared.data.discharged_ah("backward" if rows < FITTED else "linear")
    assert taken_ah[-1] == pytest.approx(read.discharged_ah("linear")[last])


def test_a_test_that_goes_on_by_less_than_a_run_of_rows_keeps_a_row(whole, most):
    fit, test = part(whole, "fit.csv", 0, FITTED), part(whole, "longer.csv", 0, FITTED + 1)
    most(600)
    case = case_of_files(BPX, [fit], [test])
    prepared = prepare_test(Cell.from_bpx(BPX), case.tests[0], case.measurements, SOC0)
    assert len(prepared.data) == prepared.lead_rows + 1
    assert any(note.startswith("longer: goes on from fit, which is fitted;") for note in case.notes)


def test_a_record_in_memory_and_one_of_an_experiment_had_all_rows_where_their_file_had_few(
    whole, most, monkeypatch
):
    most(600, read=1000)
    seen = []

    def kept(case, *_):
        seen.append(case)
        raise StopIteration

    monkeypatch.setattr("aesi.pipeline.api.run_case", kept)
    for data in (whole, read_measurement(whole), read_measurement(whole, max_rows=1000)):
        with suppress(StopIteration):
            aesi.discover(BPX, data, soc0=SOC0)
    settings = experiment(whole, discover={"fit": [str(whole)]})
    of_file, *others = [case.measurements[0] for case in (*seen, case_of_experiment(settings))]
    assert len(of_file) == 375
    for other in others:
        np.testing.assert_array_equal(other.time_s, of_file.time_s)
        np.testing.assert_allclose(other.voltage_v, of_file.voltage_v, rtol=1e-12)
    assert all("to 375 rows" in record.notes[-1] for record in (of_file, *others))
