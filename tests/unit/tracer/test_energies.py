"""Activation energies of a measured cell's file that was fitted at one temperature are open at others."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.physics.model import activation_energies
from aesi.tracer.case.energies import ACTIVATION_ENERGIES, energies_of
from aesi.tracer.case.free_parameter import shared_owner
from aesi.tracer.case.trust import MEASURED_CELL
from aesi.tracer.decide.evidence import named_options
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.report.own_parameters import own_parameters
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.forward import forward_search

FILE_K, COLD_DEGC, WARM_DEGC, SOC0 = 298.15, -10.0, 25.0, 0.9
TRIED = {n: CATALOGUE[n] for n in ("series_resistance", "voltage_sensor_offset", "ambient_temperature")}


@pytest.fixture
def fitted(cell):
    """The cell as a file that was fitted at 25 degC."""
    return replace(cell, fitted_at_k=(("drive", FILE_K),))


@pytest.fixture
def recorded(make):
    """measurement(cell, degc, n): a noisy record of a cell whose case had that temperature."""

    def measurement(cell, degc, n=4800):
        drive, course = make(n=n), np.full(n, degc)
        run = simulate(cell, drive.time_s, 0.7 * drive.current_a, SOC0, temperature_degc=course)
        noisy = run.voltage_v + 1e-3 * np.random.default_rng(1).normal(size=n)
        return replace(drive, current_a=run.current_a, voltage_v=noisy, temperature_degc=course)

    return measurement


def open_energies(problem, hypothesis=()):
    """Rate -> the free parameter of its energy."""
    return {f.name: f for f in problem.free(hypothesis) if f.owner.startswith(ACTIVATION_ENERGIES)}


def test_energies_are_open_beyond_the_temperature_of_the_file_and_nowhere_else(cell, fitted, recorded):
    cold, warm = recorded(cell, COLD_DEGC, 400), recorded(cell, WARM_DEGC, 400)
    problem = inverse_problem(fitted, [cold], SOC0, 0.0, TRIED)
    for trust in ("exact", "tight", "loose", *MEASURED_CELL):
        assert bool(open_energies(replace(problem, trust=trust))) == (trust in MEASURED_CELL)
    problem = replace(problem, trust="measured")
    assert len(open_energies(problem)) == np.count_nonzero(activation_energies(fitted))
    at_all = replace(fitted, fitted_at_k=(("cold", 263.15), ("warm", FILE_K)))
    for known in (at_all, cell):  # fitted over temperatures, and of a file that tells nothing
        assert not open_energies(replace(problem, cell=known))
    inside = inverse_problem(fitted, [warm], SOC0, 0.0, TRIED)
    assert not open_energies(replace(inside, trust="measured"))
    both = inverse_problem(fitted, [cold], SOC0, 0.0, TRIED, good=[warm])
    owners = {f.owner for f in open_energies(replace(both, trust="beside")).values()}
    assert owners == {shared_owner(ACTIVATION_ENERGIES)}


def test_a_temperature_that_was_not_measured_is_that_of_the_file_but_where_a_hypothesis_says_another(
    fitted, recorded
):
    untold = replace(recorded(fitted, COLD_DEGC, 400), temperature_degc=None)
    problem = replace(inverse_problem(fitted, [untold], SOC0, 0.0, TRIED), trust="measured")
    assert not open_energies(problem)
    assert not open_energies(problem, ("series_resistance",))
    assert open_energies(problem, ("ambient_temperature",))


def test_other_energies_leave_the_rates_at_the_files_temperature_as_they_are(cell):
    there_degc = 20.0  # not the reference temperature
    file = replace(cell, fitted_at_k=(("drive", there_degc + ZERO_CELSIUS_K),))
    other = energies_of(file).activate_only(negative_rate=80e3, electrolyte_conductivity=25e3)
    time, current = np.arange(600.0), np.full(600, 20.0)

    def moves_v(degc):
        course = np.full(600, degc)
        held, moved = (
            simulate(file, time, current, SOC0, effects, course).voltage_v for effects in ((), [other])
        )
        return np.max(np.abs(held - moved))

    assert moves_v(there_degc) < 1e-6
    assert moves_v(there_degc - 30.0) > 5e-3


def test_a_cold_cell_with_slower_kinetics_than_its_file_expects_gets_no_name(cell, fitted, recorded):
    true = cell.with_negative(rate_ea_j_mol=cell.negative.rate_ea_j_mol + 18e3)
    data = recorded(true, COLD_DEGC)

    def path(file):
        problem = inverse_problem(file, [data], SOC0, 0.0, TRIED)
        return forward_search(replace(problem, trust="measured"), 1, Archive(None, ""))

    known, unknown = path(cell), path(fitted)
    assert known.chosen.hypothesis == ("series_resistance",)  # energies as declared: a false name
    assert unknown.chosen.hypothesis == ()
    assert unknown.base.rmse_v < 0.2 * known.base.rmse_v
    rows = {row.name: row for row in own_parameters(ModelState.of(unknown.problem, unknown.base))}
    assert rows["negative_rate"].declared == pytest.approx(cell.negative.rate_ea_j_mol)
    assert rows["negative_rate"].deviations > 0.5


def test_what_is_written_of_a_temperature_may_have_the_energies_that_the_file_declares(fitted, recorded):
    untold = replace(recorded(fitted, COLD_DEGC), temperature_degc=None)
    problem, archive = inverse_problem(fitted, [untold], SOC0, 0.0, TRIED), Archive(None, "")
    measured = forward_search(replace(problem, trust="measured"), 1, archive)
    assert measured.chosen.hypothesis == ("ambient_temperature",)
    tight = forward_search(problem, 0, archive)
    options = named_options(measured, tight, tight.blocks, archive)
    assert [one.state.problem.energies for one in options] == [True, False, True]
    moved = [ACTIVATION_ENERGIES in one.state.values for one in options]
    assert moved == [True, False, False]  # at the wider trusts they are as declared


def test_an_effect_of_ones_own_cannot_take_their_name(cell, make):
    taken = {ACTIVATION_ENERGIES: replace(CATALOGUE["series_resistance"], id=ACTIVATION_ENERGIES)}
    with pytest.raises(DataError, match=ACTIVATION_ENERGIES):
        inverse_problem(cell, [make(n=400)], SOC0, 0.0, taken)
