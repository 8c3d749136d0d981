"""Blind cases: labels, sizes, and nothing of the finder's own code."""

import sys
from collections import Counter

import numpy as np
import pytest

from aesi.data.blind import CaseSpec, cells_in, generate, plan, small_plan
from aesi.data.blind.recipes import RECIPES, Written
from aesi.data.blind.strangers import STRANGERS
from aesi.data.laboratory.simulator import TrueRun
from aesi.errors import DataError

LABELS = {
    "self_heating",
    "ambient_temperature",
    "series_resistance",
    "film_growth",
    "ocv_hysteresis",
    "ocp_shape",
    "double_layer",
    "concentration_dependent_diffusivity",
    "solid_diffusivity",
    "particle_size_distribution",
    "electrolyte_transport",
    "charge_transfer_kinetics",
    "asymmetric_kinetics",
    "lithium_inventory_loss",
    "active_material_loss_negative",
    "active_material_loss_positive",
    "leakage_current",
    "lithium_plating",
    "current_sensor_gain",
    "current_sensor_offset",
    "voltage_sensor_offset",
    "clock_skew",
}


@pytest.fixture
def short_duty(monkeypatch, laboratory_cache):
    """Duties of a few minutes instead of two hours."""
    from aesi.data.blind import duty

    monkeypatch.setattr(duty, "SHORTEST_S", 600.0)
    monkeypatch.setattr(duty, "SCHEDULES", ("us06",))


def test_the_plan_covers_both_cells_and_every_effect():
    cases = plan(0)
    assert len(cases) >= 100
    assert len({case.name for case in cases}) == len(cases)
    assert {RECIPES[name].label for case in cases for name in case.recipes if name in RECIPES} == LABELS
    assert {name for case in cases for name in case.recipes if name in STRANGERS} == set(STRANGERS)
    kinds = Counter((case.cell, len(case.recipes)) for case in cases)
    for cell in ("nmc", "lg_m50"):
        assert kinds[cell, 0] >= 5
        assert kinds[cell, 1] >= 25
        assert kinds[cell, 2] >= 4
    assert {case.temperature for case in cases} == {True, False}
    assert {case.model for case in cases} == {"SPMe", "DFN"}
    assert plan(0) == cases
    assert plan(1) != cases


def test_the_small_plan_is_small_and_mixed():
    cases = small_plan()
    assert len(cases) == 6
    assert () in [case.recipes for case in cases]


@pytest.mark.parametrize(
    "recipe", ["series_resistance", "ocv_hysteresis", "current_sensor_gain", "voltage_lag"]
)
def test_an_effect_has_the_size_asked_for(short_duty, cells, recipe):
    spec = CaseSpec("c", "nmc", (recipe,), target_mv=4.0, soc0=0.6, tolerance=0.05, seed=1)
    case = generate(spec, cells_in(cells))
    assert case.label == RECIPES[recipe].label
    assert case.effects == (case.label,)
    # The size is found on a coarse mesh to 20 %.
    assert case.truth["rms_mv"] == pytest.approx(4.0, rel=0.3)
    assert case.soc0 == 0.6
    record = case.measurements[0]
    assert np.all(np.diff(record.time_s) == 1.0)
    assert record.temperature_degc is None


def test_nothing_is_nothing_and_the_noise_is_what_was_said(short_duty, cells):
    case = generate(CaseSpec("c", "nmc", soc0=0.6, seed=2, temperature=True), cells_in(cells))
    assert (case.label, case.effects, case.also) == ("none", (), ())
    assert case.truth["rms_mv"] == 0.0
    record = case.measurements[0]
    assert record.temperature_degc is not None
    # The first rest: 121 samples, the deviation of whose deviation is 6 %.
    assert np.std(record.voltage_v[:120]) == pytest.approx(1e-3, rel=0.25)
    assert np.std(record.current_a[:120]) == pytest.approx(4e-3, rel=0.25)


def test_pairs_carry_both_labels_and_strangers_are_unknown(short_duty, cells):
    pair = generate(
        CaseSpec("c", "nmc", ("series_resistance", "film_growth"), 4.0, soc0=0.6, seed=1), cells_in(cells)
    )
    assert pair.label == "series_resistance+film_growth"
    assert pair.effects == ("series_resistance", "film_growth")
    assert {"series_resistance.resistance_ohm", "film_growth.growth_ohm_ah"} <= set(pair.truth)
    strange = generate(CaseSpec("c", "nmc", ("wandering",), 4.0, soc0=0.6, seed=1), cells_in(cells))
    assert (strange.label, strange.effects) == ("unknown", ())
    assert strange.truth["rms_mv"] == pytest.approx(4.0, rel=1e-6)


def test_the_same_specification_gives_the_same_case(short_duty, cells):
    spec = CaseSpec("c", "nmc", ("series_resistance",), 4.0, soc0=0.6, seed=1)
    first, again = generate(spec, cells_in(cells)), generate(spec, cells_in(cells))
    assert first.measurements[0].digest == again.measurements[0].digest


def test_faults_of_the_instrument_by_hand():
    time = np.arange(5.0)
    written = Written(time, 2.0 * np.ones(5), 3.0 + 0.1 * time)
    gain = RECIPES["current_sensor_gain"].instrument(written, {"gain": 1.05})
    np.testing.assert_allclose(gain.current_a, 2.1)
    offset = RECIPES["current_sensor_offset"].instrument(written, {"offset_a": 0.5})
    np.testing.assert_allclose(offset.current_a, 2.5)
    volts = RECIPES["voltage_sensor_offset"].instrument(written, {"offset_v": 0.01})
    np.testing.assert_allclose(volts.voltage_v, written.voltage_v + 0.01)
    lag = RECIPES["voltage_lag"].instrument(written, {"lag_s": 0.5})
    np.testing.assert_allclose(lag.voltage_v, [3.0, 3.05, 3.15, 3.25, 3.35])
    fast = RECIPES["clock_rate"].instrument(written, {"skew": 0.25})
    np.testing.assert_allclose(fast.voltage_v, 3.0 + 0.1 * time / 1.25)


@pytest.mark.parametrize("name", STRANGERS)
def test_strangers_are_structured_and_start_at_nothing_they_could_not_know(name, rng):
    time = np.arange(1200.0)
    current = np.where((time // 60) % 3 == 1, 30.0, np.where((time // 60) % 3 == 2, -10.0, 0.0))
    voltage = 3.7 - 2e-3 * current - 1e-4 * time
    trace = TrueRun(time, current, voltage, np.full(1200, 25.0), np.full(1200, 0.5))
    shift = STRANGERS[name].shift(trace, 30.0, rng)
    assert shift.shape == time.shape
    assert 0.5e-3 < np.sqrt(np.mean(shift**2)) < 0.1
    # Structure: neighbours are alike, unlike noise.
    assert np.corrcoef(shift[1:], shift[:-1])[0, 1] > 0.5


def test_unknown_names_are_refused(cells):
    with pytest.raises(DataError, match="no cell"):
        generate(CaseSpec("c", "lfp"), cells_in(cells))
    with pytest.raises(DataError, match="self_heating"):
        generate(CaseSpec("c", "nmc", ("self_heatin",)), cells_in(cells))


def test_the_generator_does_not_load_the_finder():
    import subprocess

    code = (
        "import sys, aesi.data.blind, aesi.data.blind.generate;"
        "print([m for m in sys.modules if m.startswith(('aesi.physics', 'aesi.tracer'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_an_effect_that_does_not_show_at_its_most_is_driven_harder(short_duty, cells):
    weak = CaseSpec("c", "nmc", ("negative_diffusivity",), target_mv=4.0, rate=0.5, soc0=0.6, seed=1)
    strong = CaseSpec("c", "nmc", ("series_resistance",), target_mv=4.0, rate=0.5, soc0=0.6, seed=1)
    assert generate(weak, cells_in(cells)).spec.rate == 1.25 * weak.rate
    assert generate(strong, cells_in(cells)).spec.rate == strong.rate
