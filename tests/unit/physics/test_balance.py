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


@pytest.mark.parametrize(("negative", "positive"), [(0.9, 1.0), (1.0, 0.85)])
def test_material_that_went_at_half_charge_took_its_lithium_of_then(request, negative, positive):
    cell = aesi.Cell.from_bpx(request.config.rootpath / "experiments/cells/lg_m50_chen2020.bpx.json")
    aged = with_active_material(cell, negative, positive, lost_at_soc=0.5)
    q_n = negative * cell.electrode_capacity_ah(cell.negative)
    q_p = positive * cell.electrode_capacity_ah(cell.positive)
    x_n, x_p = cell.stoichiometries(0.5)
    kept_ah = q_n * x_n + q_p * x_p  # what is left of either electrode holds what it held at half charge
    for theta_n, theta_p in (
        (aged.negative.theta_max, aged.positive.theta_min),
        (aged.negative.theta_min, aged.positive.theta_max),
    ):
        assert q_n * theta_n + q_p * theta_p == pytest.approx(kept_ah, rel=1e-9)
    ends = np.array([0.0, 1.0])
    np.testing.assert_allclose(aged.rest_voltage_v(ends), cell.rest_voltage_v(ends), atol=1e-6)
    assert aged.capacity_ah == pytest.approx(q_n * (aged.negative.theta_max - aged.negative.theta_min))
