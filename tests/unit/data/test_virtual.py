"""The virtual laboratory: measurements by seed, notes, roles."""

import numpy as np
import pytest

from aesi.data.profiles.profile import ProfileBuilder
from aesi.data.virtual import DEFAULT_MIX, STRENGTHS, Laboratory, paper_experiment, voltage_window_v
from aesi.errors import DataError

pytestmark = pytest.mark.usefixtures("laboratory_cache")

BUILDER = ProfileBuilder(30.0, 1.0)


def profile(soc0=0.6, pulse=-1.0):
    return BUILDER.profile("short", [BUILDER.rest(20), BUILDER.pulse(pulse, 30), BUILDER.rest(30)], soc0)


def test_a_seed_gives_one_measurement(nmc):
    first = Laboratory(nmc, "SPMe", seed=3).measure(profile())
    again = Laboratory(nmc, "SPMe", seed=3).measure(profile())
    other = Laboratory(nmc, "SPMe", seed=4).measure(profile())
    assert first.digest == again.digest
    assert first.digest != other.digest
    # Two draws of 1 mV of noise on the same trace.
    assert np.std(first.voltage_v - other.voltage_v) == pytest.approx(np.sqrt(2) * 1e-3, rel=0.4)


def test_it_says_what_it_is_and_when_the_voltage_leaves_the_window(nmc):
    inside = Laboratory(nmc, "SPMe").measure(profile())
    assert len(inside.notes) == 1
    assert all(name in inside.notes[0] for name in DEFAULT_MIX)
    outside = Laboratory(nmc, "SPMe").measure(profile(soc0=0.95, pulse=-5.0))
    assert any("outside 2.7 to 4.2 V" in note for note in outside.notes)
    assert voltage_window_v(nmc) == (2.7, 4.2)


def test_the_temperature_is_written_where_it_changes(nmc):
    assert Laboratory(nmc, "SPMe").measure(profile()).temperature_degc is None
    warm = Laboratory(nmc, "SPMe", ("self_heating",)).measure(profile())
    assert warm.temperature_degc is not None
    withheld = Laboratory(nmc, "SPMe", ("self_heating",), thermocouple=False).measure(profile())
    assert withheld.temperature_degc is None
    np.testing.assert_array_equal(withheld.voltage_v, warm.voltage_v)


def test_a_magnitude_scales_the_effect(nmc):
    def rms(magnitude):
        changed = Laboratory(nmc, "SPMe", ("series_resistance",), magnitude).measure(profile())
        base = Laboratory(nmc, "SPMe", ()).measure(profile())
        return np.sqrt(np.mean((changed.voltage_v - base.voltage_v) ** 2))

    assert rms(4.0) == pytest.approx(4 * rms(1.0), rel=0.3)


def test_every_strength_belongs_to_a_change(nmc):
    for name in STRENGTHS:
        assert Laboratory(nmc, "SPMe", (name,)).setup().changes()
    with pytest.raises(DataError, match="ocv_hysteresis"):
        Laboratory(nmc, "SPMe", ("hysteresis",)).setup().changes()


@pytest.mark.slow
def test_the_papers_experiment_on_the_full_model(nmc):
    experiment = paper_experiment(Laboratory(nmc), dt_s=1.0)
    assert len(experiment.train[0]) == 8820
    assert [m.name for m in experiment.test] == ["sc03", "japan_10_15", "nedc"]
    low, high = voltage_window_v(nmc)
    for record in (*experiment.train, *experiment.valid, *experiment.test):
        assert low < record.voltage_v.min()
        assert record.voltage_v.max() < high + 0.01


def test_values_of_an_effect_stand_in_for_the_typical_ones(nmc):
    lab = Laboratory(
        nmc,
        "SPMe",
        ("self_heating", "particle_size_distribution"),
        2.0,
        {"self_heating": {"cooling_w_m2_k": 7.0}},
    )
    values = {applied.change: dict(applied.values) for applied in lab.setup().applied}
    assert values["self_heating"] == {"cooling_w_m2_k": 7.0}
    assert values["particle_size_distribution"]["negative_spread"] == pytest.approx(0.6)


def test_self_heating_of_magnitude_0_ended_in_a_division_by_zero(nmc):
    with pytest.raises(DataError, match="self_heating has no value at magnitude 0; give another magnitude"):
        Laboratory(nmc, effects=("self_heating",), magnitude=0).setup()


def test_values_of_a_misspelt_effect_were_ignored(nmc):
    lab = Laboratory(nmc, effects=("self_heating",), values={"self_heatin": {"cooling_w_m2_k": 7.0}})
    with pytest.raises(DataError, match=r"'self_heatin', .* did you mean 'self_heating'"):
        lab.setup()
