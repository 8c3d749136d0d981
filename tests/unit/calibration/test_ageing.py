"""Records of other days: one course of ageing, a file in the state of a stated day, and dates that fit no record."""

from datetime import date
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.calibration.ageing import LOADED_SD, SLOW_SD, WALK_SD, Ageing
from aesi.calibration.fit import problem
from aesi.errors import DataError

DAYS = {"march": date(2017, 3, 11), "april": date(2017, 4, 11), "june": date(2017, 6, 7)}


def of(names, dates, slow=(), as_of=None):
    records = [SimpleNamespace(name=n, slow=n in slow) for n in names]
    return Ageing.of(records, dates, as_of)


def test_shares_of_records_further_apart_may_differ_by_more():
    root = of(list(DAYS), DAYS).root
    covariance = root @ root.T
    days = np.array([(d - DAYS["march"]).days for d in DAYS.values()])
    apart = np.abs(days[:, None] - days)
    difference = np.diag(covariance)[:, None] + np.diag(covariance) - 2.0 * covariance
    expected = WALK_SD**2 * apart + 2.0 * LOADED_SD**2 * (apart > 0)
    assert difference == pytest.approx(expected)


def test_a_day_between_two_records_lies_on_the_line_between_them():
    root = of(list(DAYS), DAYS, as_of=DAYS["march"]).root
    covariance = root @ root.T
    other = [0, 2]
    weights = np.linalg.solve(covariance[np.ix_(other, other)], covariance[other, 1])
    share = 31 / 88
    assert weights[1] == pytest.approx(share, rel=0.05)  # but for what a record has of its own


def test_the_file_is_in_the_state_of_the_last_day_with_a_load_or_of_a_given_one():
    assert of(list(DAYS), DAYS, slow=["june"]).day == DAYS["april"]
    assert of(["march"], {"march": DAYS["march"]}, slow=["march"]).day == DAYS["march"]
    given = of(list(DAYS), DAYS, as_of=DAYS["march"])
    assert "2017-03-11" in given.sentences[0]
    assert np.diag(given.root @ given.root.T)[0] == pytest.approx(LOADED_SD**2)
    with pytest.raises(DataError, match="no record has a date"):
        of(["march"], {}, as_of=DAYS["march"])


def test_records_without_a_date_differ_from_the_file_alone():
    ageing = of(["slow", "loaded"], {}, slow=["slow"])
    assert ageing.root == pytest.approx(np.diag([SLOW_SD, LOADED_SD]))
    assert ageing.day is None
    assert ageing.sentences == ()


def test_a_date_of_no_record_is_refused():
    with pytest.raises(DataError, match="there is no such record"):
        of(["march"], {"elsewhere": DAYS["march"]})


def test_the_slopes_follow_a_shared_course(start, records):
    dates = {"at_25": DAYS["march"], "at_0": DAYS["june"]}
    model = problem(start, records, None, {}, dates=dates)[0]
    model_back = problem(start, records[::-1], None, {}, dates=dates)[0]
    for each in (model, model_back):
        x = 0.1 * np.sin(np.arange(each.layout.size))
        jacobian = each.jacobian(x)
        for j in each.layout.ages:
            step = np.zeros_like(x)
            step[j] = 1e-3
            slope = (each.residual(x + step) - each.residual(x - step)) / 2e-3
            assert np.abs(jacobian[:, j] - slope).max() < 0.05 * np.abs(slope).max()
