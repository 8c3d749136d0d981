"""Records of other days: one course of ageing, a file in the state of a stated day, and dates that fit no record."""

from datetime import date, datetime
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.calibration.ageing import LOADED_SD, LOSS_SD, SLOW_SD, Ageing
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions
from aesi.errors import DataError

DAYS = {"march": date(2017, 3, 11), "april": date(2017, 4, 11), "june": date(2017, 6, 7)}


def of(names, dates, slow=(), as_of=None):
    records = [SimpleNamespace(name=n, slow=n in slow) for n in names]
    return Ageing.of(records, dates, as_of)


def shares(ageing, z):
    return np.array([ageing.share(i, z) for i in range(len(z))])


@pytest.mark.parametrize("as_of", DAYS)
@pytest.mark.parametrize("order", [1, -1])
def test_a_cell_only_loses(as_of, order):
    names = list(DAYS)[::order]
    ageing = of(names, DAYS, as_of=DAYS[as_of])
    for z in np.random.default_rng(0).standard_normal((20, 3)):
        found = dict(zip(names, shares(ageing, z), strict=True))
        assert found["march"] > found["april"] > found["june"]
        assert found[as_of] == 1.0


def test_losses_are_the_sizes_of_normal_deviates_and_grow_with_the_root_of_the_days():
    ageing = of(["march", "june"], {name: DAYS[name] for name in ("march", "june")})
    drawn = [np.log(ageing.share(0, z)) for z in np.random.default_rng(1).standard_normal((4000, 2))]
    sd = LOSS_SD * 88**0.5
    assert min(drawn) > 0.0
    assert np.sqrt(np.mean(np.square(drawn))) == pytest.approx(sd, rel=0.05)
    assert np.median(drawn) == pytest.approx(0.6745 * sd, rel=0.05)


def test_records_of_one_day_are_in_one_state():
    ageing = of(["a", "b", "later"], {"a": DAYS["march"], "b": DAYS["march"], "later": DAYS["june"]})
    found = shares(ageing, np.array([0.7, -0.4, 0.1]))
    assert found[0] == found[1] > found[2] == 1.0


def test_moments_of_one_day_were_taken_for_two_and_beside_dates_ended_in_an_error_of_python():
    hours = {"a": datetime(2017, 3, 11, 8), "b": datetime(2017, 3, 11, 20), "later": DAYS["june"]}
    ageing = of(list(hours), hours, as_of=datetime(2017, 6, 7, 12))
    found = shares(ageing, np.array([0.7, -0.4, 0.1]))
    assert found[0] == found[1] > found[2] == 1.0
    assert ageing.day == DAYS["june"]


def test_the_file_as_simulated_is_that_of_every_record():
    ageing = of(list(DAYS), DAYS)
    assert shares(ageing, ageing.z_of_file_state) == pytest.approx(np.ones(3), abs=0.0)


def test_the_file_is_in_the_state_of_the_last_day_with_a_load_or_of_a_given_one():
    assert of(list(DAYS), DAYS, slow=["june"]).day == DAYS["april"]
    assert of(["march"], {"march": DAYS["march"]}, slow=["march"]).day == DAYS["march"]
    given = of(list(DAYS), DAYS, as_of=DAYS["march"])
    assert "2017-03-11" in given.sentences[0]
    assert given.share(0, np.ones(3)) == 1.0
    with pytest.raises(DataError, match="no record has a date"):
        of(["march"], {}, as_of=DAYS["march"])


@pytest.mark.parametrize("as_of", [date(2017, 3, 10), date(2027, 3, 11)])
def test_a_day_outside_those_of_the_records_was_taken_without_a_word(as_of):
    with pytest.raises(DataError, match=f"as of {as_of}: the dated records are of 2017-03-11 to 2017-06-07"):
        of([*DAYS, "undated"], DAYS, as_of=as_of)


def test_records_without_a_date_differ_from_the_file_alone():
    ageing = of(["slow", "loaded"], {}, slow=["slow"])
    assert np.log(shares(ageing, np.array([1.0, -2.0]))) == pytest.approx([SLOW_SD, -2.0 * LOADED_SD])
    assert ageing.day is None
    assert ageing.sentences == ()


def test_what_a_slow_record_tells_of_silicon_is_of_its_day_and_of_those_between():
    days = {"first": 1, "file": 5, "between": 9, "slow": 13, "last": 20}
    dates = {name: date(2018, 11, day) for name, day in days.items()}
    names = ["last", "slow", "file", "first", "between", "undated"]
    weights = of(names, dates, slow=["first", "slow"], as_of=dates["file"]).silicon_weights
    lost = dict(zip(names, weights @ np.array([9.0, -0.4, 9.0, 0.1, 9.0, 9.0]), strict=True))
    expected = {"first": 0.1, "file": 0.0, "between": -0.2, "slow": -0.4, "last": -0.4, "undated": 0.0}
    assert lost == pytest.approx(expected, abs=1e-12)
    same = {**dates, "undated": dates["slow"]}  # two slow records of one day, and one of the file's
    alike = of(names, same, slow=["undated", "file", "slow"], as_of=dates["file"]).silicon_weights
    assert alike[names.index("last")] == pytest.approx([0.0, 0.5, 0.0, 0.0, 0.0, 0.5])
    assert not alike[names.index("file")].any()
    without = of(names, {}, slow=["first", "slow"]).silicon_weights
    assert without == pytest.approx(np.diag([0.0, 1.0, 0.0, 1.0, 0.0, 0.0]))


def test_a_record_of_years_before_the_file_s_state_ended_the_fit(start, records):
    dates = {"at_25": date(2015, 3, 11), "at_0": DAYS["june"]}
    model = prepared_model(start, records, Conditions(dates=dates))[0]
    x = np.zeros(model.layout.size)
    x[model.layout.ages] = model.high[model.layout.ages]
    assert model.material(0, x) > 2.0  # it had lost half since, at the end of the box
    assert np.isfinite(model.residual(x)).all()


def test_a_date_of_no_record_is_refused():
    with pytest.raises(DataError, match="there is no such record"):
        of(["march"], {"elsewhere": DAYS["march"]})


def test_the_slopes_follow_a_shared_course(start, records):
    dates = {"at_25": DAYS["march"], "at_0": DAYS["june"]}
    model = prepared_model(start, records, Conditions(dates=dates))[0]
    model_back = prepared_model(start, records[::-1], Conditions(dates=dates))[0]
    for each in (model, model_back):
        x = 0.1 * np.sin(np.arange(each.layout.size))
        jacobian = each.jacobian(x)
        for j in each.layout.ages:
            step = np.zeros_like(x)
            step[j] = 1e-2  # residuals jump by some 1e-5 where the solver takes another step
            slope = (each.residual(x + step) - each.residual(x - step)) / 2e-2
            assert np.abs(jacobian[:, j] - slope).max() < 0.01 * np.abs(slope).max()
