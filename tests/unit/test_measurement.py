"""What a record says of itself."""

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.records import Measurement


def test_the_charge_of_a_pulse_between_far_rows_depends_on_how_the_current_runs():
    """6 A for the first 10 min or as a triangle over 20 min, then 3 A of charge for half an hour."""
    record = Measurement([0.0, 600.0, 1200.0, 1201.0, 3001.0], [0.0, 6.0, 0.0, -3.0, -3.0], np.full(5, 3.7))
    held = record.discharged_ah("backward")
    straight = record.discharged_ah("linear")
    assert held[[1, 2]] == pytest.approx([1.0, 1.0])
    assert straight[[1, 2]] == pytest.approx([0.5, 1.0])
    assert held[-1] == pytest.approx(1.0 - 3.0 / 3600.0 - 1.5)
    assert straight[-1] == pytest.approx(record.charge_ah)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"hold": "Backward"}, "drive: hold = 'Backward' is not known; give 'linear' or 'backward'"),
        ({"voltage_v": None}, "drive: voltage_v is None; give one row of numbers, NaN for unknown voltages"),
        ({"time_s": None}, "drive: time_s is None"),
        ({"current_a": [[1.0], [2.0, 3.0]]}, "drive: current_a holds rows of several lengths"),
    ],
)
def test_a_record_that_cannot_be_was_made_and_failed_where_it_was_used(changes, sentence):
    columns = {"time_s": [0.0, 1.0], "current_a": [1.0, 1.0], "voltage_v": [3.7, 3.6], "name": "drive"}
    with pytest.raises(DataError, match=sentence):
        Measurement(**(columns | changes))


@pytest.mark.parametrize(("offset", "told"), [(0.0, "2.5 s"), (1.7e9, "1700000002.5 s")])
def test_a_row_stamped_since_1970_was_told_by_six_digits_which_all_rows_share(offset, told):
    time = offset + np.array([0.0, 2.5, 2.5])
    with pytest.raises(DataError, match=f"time_s does not increase at {told}"):
        Measurement(time, np.ones(3), np.full(3, 3.7))
