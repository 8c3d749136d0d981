"""What a parameter of the physics is worth in volts along a record."""

import numpy as np
import pytest
from small_experiment import BPX

from aesi.physics import Cell, simulate
from aesi.physics.cell.relations import Constant
from aesi.pipeline.product.deviations import ENERGIES_J_MOL, FILMS, PRIORS, slopes_v
from aesi.records import Measurement


def test_a_film_is_worth_its_own_drop_and_no_fit_moves_it():
    bare, film = Cell.from_bpx(BPX), 3e-3
    cell = bare.with_negative(film_ohm_m2=Constant(film))
    time = np.arange(0.0, 600.0, 5.0)
    current = np.full(len(time), cell.nominal_capacity_ah)
    record = Measurement(time, current, np.zeros(len(time)), name="made")
    voltage = simulate(cell, time, current, 0.6).voltage_v
    slopes = slopes_v(cell, (), record, 0.6, "linear", "espm", voltage)
    assert slopes.shape[1] == len(PRIORS) + len(FILMS) == len(ENERGIES_J_MOL)
    n = cell.negative
    surface_m2 = n.area_per_volume_1_m * n.thickness_m * cell.total_area_m2
    drop_v = current * film / surface_m2
    np.testing.assert_allclose(slopes[1:, -2], -FILMS[0].prior_sd * drop_v[1:], rtol=1e-2)
    np.testing.assert_array_equal(slopes[:, -1], 0.0)  # the positive electrode has none
    per_kelvin = slopes[-1, -2] * ENERGIES_J_MOL[-2]
    assert per_kelvin == pytest.approx(-drop_v[-1] * FILMS[0].energy_j_mol, rel=1e-2)
