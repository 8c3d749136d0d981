"""What a record says of itself."""

import numpy as np
import pytest

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
