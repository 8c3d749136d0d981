"""Records that share a name are told apart before anything is kept by it."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.records.named import uniquely_named
from aesi.calibration.written_cell import capacities
from aesi.errors import DataError
from aesi.records import Measurement


def record(name: str) -> Measurement:
    return Measurement(np.arange(3.0), np.ones(3), np.full(3, 4.0), name=name)


def test_only_those_that_share_a_name_are_numbered():
    given = tuple(record(name) for name in ("us06", "c20", "us06"))
    assert [one.name for one in uniquely_named(given, {})] == ["us06 (1)", "c20", "us06 (2)"]
    assert uniquely_named(given[:2], {})[1] is given[1]


def test_what_is_said_of_a_name_that_two_share_is_refused():
    given = tuple(record(name) for name in ("us06", "c20", "us06"))
    with pytest.raises(DataError, match="the temperature of us06: 2 records have this name"):
        uniquely_named(given, {"temperature": {"us06": 10.0}})
    assert len(uniquely_named(given, {"temperature": {"c20": 10.0}})) == 3


def test_two_records_of_one_name_each_have_their_own_share_of_the_capacity(start, records):
    model, _ = prepared_model(start, [replace(one, name="drive") for one in records], Conditions())
    assert len(capacities(model, np.zeros(model.layout.size))) == len(records)


def test_a_number_that_another_record_has_in_its_name_is_not_given_twice():
    given = [record(name) for name in ("p", "p", "p (1)")]
    assert [one.name for one in uniquely_named(given, {})] == ["p (2)", "p (3)", "p (1)"]
