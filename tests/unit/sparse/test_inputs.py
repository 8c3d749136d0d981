"""Further inputs of the sparse model: by hand, and refused where they cannot be."""

from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import DataError, InputError
from aesi.sparse.terms.inputs import low_pass, with_inputs


def test_a_filtered_current_follows_a_step_exponentially():
    step = np.concatenate([[0.0], np.ones(5)])
    np.testing.assert_allclose(low_pass(step, 2.0, 10.0), 1.0 - np.exp(-0.2 * np.arange(6)), atol=1e-15)
    np.testing.assert_allclose(low_pass(np.full(4, 3.0), 1.0, 60.0), 3.0)  # at rest from the first current


def test_the_next_current_is_that_of_the_row_below():
    record = make_record(5)
    derived = with_inputs(record, ("I", "I_next")).inputs
    np.testing.assert_array_equal(derived[:-1, 1], derived[1:, 0])
    assert derived[-1, 1] == derived[-1, 0]


def test_the_current_stays_known_where_it_is_no_input():
    record = make_record(50)
    for without in (
        with_inputs(record, ("soc",)),
        with_inputs(with_inputs(record, ("soc", "I_next")), ("soc",)),
    ):
        assert without.input_names == ("soc",)
        np.testing.assert_array_equal(without.current_a, record.current_a)
        np.testing.assert_array_equal(without.take(slice(3, 9)).current_a, record.current_a[3:9])
        np.testing.assert_array_equal(with_inputs(without, ("I_next",)).inputs[:-1, 0], record.current_a[1:])


def test_a_record_without_a_current_says_so():
    record = replace(make_record(5), input_names=("x", "soc", "c_e0"))
    with pytest.raises(InputError, match="record has no current: I is none of its inputs"):
        record.current_a


@pytest.mark.parametrize("name", ["I_0s", "I_0.0s", "I_s", "voltage"])
def test_an_input_that_cannot_be_derived_is_refused(name):
    with pytest.raises(DataError, match=f"no input '{name}'"):
        with_inputs(make_record(5), ("I", name))
