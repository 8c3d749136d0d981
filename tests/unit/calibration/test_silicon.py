"""Lost silicon: the end of the negative potential, and its share of two C/20 discharges."""

from dataclasses import replace
from datetime import date

import numpy as np
import pytest

from aesi.calibration.fit import calibrate
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.conditions import Conditions
from aesi.calibration.silicon import SILICON_V, may_have_silicon, silicon_edge, with_silicon
from aesi.physics import Cell, simulate
from aesi.physics.effects.lithium_inventory_loss import lose_lithium
from aesi.physics.model import EspmModel
from aesi.records import Measurement

from .conftest import CELLS


def discharge(cell, name: str) -> Measurement:
    """C/20 from full to the lower voltage, after a rest."""
    time = np.arange(0.0, 24.0 * 3600.0, 240.0)
    current = np.where(time > 3600.0, cell.nominal_capacity_ah / 20.0, 0.0)
    voltage = simulate(cell, time, current, 1.0, (), None, "backward", on_depletion="clip").voltage_v
    end = int(np.argmax(voltage < cell.lower_voltage_v))
    return Measurement(time, current, voltage, None, name).take(slice(0, end))


@pytest.fixture(scope="module")
def records(start) -> tuple[Measurement, ...]:
    edge = silicon_edge(start.negative)
    old = replace(start, negative=with_silicon(start.negative, edge, 0.7))
    return discharge(start, "new"), discharge(old, "old")


def test_graphite_keeps_its_potential_and_silicon_a_share_of_its_charge(start):
    edge = silicon_edge(start.negative)
    old = with_silicon(start.negative, edge, 0.6)
    above = np.linspace(edge, 0.95, 50)
    assert old.ocp(above) == pytest.approx(start.negative.ocp(above), abs=1e-4)
    assert start.negative.ocp(np.array([edge])) == pytest.approx(SILICON_V, abs=1e-3)
    for volts in (0.3, 0.5, 0.8):
        x = np.linspace(1e-4, edge, 4000)
        as_new, now = (x[int(np.argmax(e.ocp(x) < volts))] for e in (start.negative, old))
        assert (edge - now) / (edge - as_new) == pytest.approx(0.6, abs=0.01)
    assert np.all(np.diff(old.ocp(np.linspace(0.0, 1.0, 500))) < 0.0)


def test_of_two_slow_discharges_the_silicon_that_one_has_lost_is_found(start, records):
    found = calibrate(start, records, evaluations=15)
    new, old = (found.model.silicon(i, found.x) for i in (0, 1))
    assert old / new == pytest.approx(0.7, abs=0.07)
    lost = records[1].time_s[-1] - 3600.0, records[0].time_s[-1] - 3600.0
    assert found.capacities["old"] / found.capacities["new"] == pytest.approx(lost[0] / lost[1], abs=0.01)
    assert any(
        "old: fits with" in note and "above 0.22 V (silicon, if it has any)" in note for note in found.notes
    )


def test_one_slow_discharge_does_not_tell_silicon(start, records):
    assert not prepared_model(start, records[:1], Conditions())[0].layout.has_silicon


def test_silicon_was_told_of_a_cell_whose_file_has_graphite_alone():
    """Two C/20 of that very cell, the second with 8 % of its lithium lost: 81 and 115 % of its silicon were told."""
    cell = Cell.from_bpx(CELLS / "nca_kim2011.bpx.json")
    old = lose_lithium(EspmModel(cell), loss=0.08).cell
    records = discharge(cell, "new"), discharge(old, "old")
    model = prepared_model(cell, records, Conditions(same_cell=True))[0]
    assert not model.layout.has_silicon


@pytest.mark.parametrize(
    ("file", "may"),
    [
        ("lg_m50_chen2020", True),
        ("lg_18650hg2", True),
        ("lg_18650hg2_25degc", True),
        ("lg_18650hg2_cold", True),
        ("nca_kim2011", False),
        ("nmc_30ah", False),
        ("panasonic_ncr18650pf", False),
        ("panasonic_ncr18650pf_25degc", False),
    ],
)
def test_a_potential_that_may_be_of_silicon_is_told_from_that_of_graphite(file, may):
    assert may_have_silicon(Cell.from_bpx(CELLS / f"{file}.bpx.json").negative) == may


DAYS = {"new": date(2018, 10, 26), "loaded": date(2018, 11, 11), "old": date(2018, 11, 27)}


@pytest.mark.parametrize("conditions", [Conditions(), Conditions(dates=DAYS, as_of=DAYS["new"])])
def test_slopes_are_those_of_differences_with_silicon_too(start, records, conditions):
    time, current = np.arange(0.0, 3400.0, 10.0), np.full(340, start.nominal_capacity_ah)
    voltage = simulate(start, time, current, 1.0, on_depletion="clip").voltage_v
    model = prepared_model(
        start, [*records, Measurement(time, current, voltage, None, "loaded")], conditions
    )[0]
    x = 0.3 * np.random.default_rng(3).standard_normal(model.layout.size)
    x = np.clip(x, model.low + 0.1, model.high - 0.1)
    slopes = model.jacobian(x)
    own = model.layout.own(1)
    for j in (model.layout.shapes.start + 30, own[0], own[2]):
        h = 1e-3
        up, down = x.copy(), x.copy()
        up[j] += h
        down[j] -= h
        expected = (model.residual(up) - model.residual(down)) / (2.0 * h)
        scale = np.abs(expected).max()
        assert np.median(np.abs(slopes[:, j] - expected)) < 0.02 * scale
    of_loaded = slice(sum(len(r.rows) for r in model.records[:2]), sum(len(r.rows) for r in model.records))
    moves = np.abs(slopes[of_loaded, own[2]])
    assert (moves.max() > 0.0) == model.ageing.dated
    assert slopes[of_loaded, own[2]] == pytest.approx(expected[of_loaded], abs=0.02 * max(moves.max(), 1e-12))
