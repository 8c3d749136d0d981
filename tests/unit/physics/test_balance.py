"""Where an aged cell rests at the voltage of the declared one."""

import numpy as np
import pytest

import aesi
from aesi.physics.balance import same_rest, with_active_material
from aesi.physics.cell.relations import LookupTable, Sum


@pytest.mark.parametrize("soc", [1.0, 0.6])
def test_a_potential_that_turns_beyond_its_window_does_not_move_a_known_state_of_charge(request, soc):
    cell = aesi.Cell.from_bpx(request.config.rootpath / "experiments/cells/lg_m50_chen2020.bpx.json")
    p = cell.positive
    span = p.theta_max - p.theta_min
    places = p.theta_min - span * np.array([0.05, 0.035, 0.01, -1.0])  # fuller than full, down to empty
    dip = LookupTable(tuple(places.tolist()), (0.0, -0.2, 0.0, 0.0))
    turning = cell.with_positive(ocp=Sum(p.ocp, dip))
    aged = with_active_material(turning, 1.0 - 1e-5, 1.0)
    beyond = aged.rest_voltage_v(np.linspace(1.0, 1.05, 51)) - turning.rest_voltage_v(soc)
    assert soc < 1.0 or (np.diff(np.sign(beyond)) != 0).sum() >= 2  # it rests there again beyond full
    assert same_rest(turning, aged, soc) == pytest.approx(soc, abs=1e-4)
