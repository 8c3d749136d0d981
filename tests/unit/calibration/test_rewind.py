"""The age of the cell that is written: that of the record with which all records are met best."""

import numpy as np
import pytest

from aesi.calibration.fit import problem
from aesi.calibration.model import AGEING_SD
from aesi.calibration.parameters import with_interfaces
from aesi.calibration.rewind import capacities, rewound, serving
from aesi.physics import simulate
from aesi.records import Measurement

LOST = 0.03


def discharge(cell, name: str) -> Measurement:
    """At C/2 from full, after a rest, to a tenth above empty."""
    time = np.arange(0.0, 6900.0, 10.0)
    current = np.where(time > 300.0, 0.5 * cell.nominal_capacity_ah, 0.0)
    voltage = simulate(cell, time, current, 1.0, (), None, "backward").voltage_v
    return Measurement(time, current, voltage, None, name)


def test_it_is_the_one_that_serves_most_records(start):
    whole = with_interfaces(start)
    aged = whole.with_soh(1.0 - LOST)
    cells = {"fresh": whole, "aged": aged, "aged_too": aged}
    records = [discharge(cell, name) for name, cell in cells.items()]
    model = problem(whole, records, 1.0, {}, same_cell=True)[0]
    x = np.zeros(model.layout.size)
    x[[model.layout.age(1), model.layout.age(2)]] = np.log(1.0 - LOST) / AGEING_SD
    like = serving(model, x)
    assert like == 1
    shares = capacities(model, x, like)
    assert shares == pytest.approx({"fresh": 1.0 / (1.0 - LOST), "aged": 1.0, "aged_too": 1.0})
    fresh, old = (rewound(model, x, index) for index in (0, 1))
    assert old.capacity_ah == pytest.approx((1.0 - LOST) * fresh.capacity_ah)
