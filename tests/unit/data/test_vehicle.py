"""Speed to cell current."""

import numpy as np
import pytest

from aesi.data.profiles.drive import TITLES, Schedule, schedule
from aesi.data.profiles.profile import AFTER_PULSE_S, ProfileBuilder, paper_profiles
from aesi.data.profiles.vehicle import Pack, Vehicle
from aesi.errors import DataError


def steady(speed):
    return Schedule("steady", "steady", np.arange(4.0), np.full(4, speed))


def test_hand_worked_power_at_steady_speed():
    # 20 m/s: rolling 1800 * 9.81 * 0.01 = 176.58 N, drag 0.6 * 0.65 * 400 = 156 N; 332.58 N * 20 m/s = 6651.6 W
    # at the wheels, / 0.88 = 7558.6 W, and 500 W of auxiliaries.
    current = Vehicle().cell_current_a(steady(20.0), 1.0)
    np.testing.assert_allclose(current, (6651.6 / 0.88 + 500.0) / (96 * 3 * 3.65))


def test_standing_still_draws_the_auxiliaries():
    np.testing.assert_allclose(Vehicle().cell_current_a(steady(0.0), 0.5), 500.0 / (96 * 3 * 3.65))


def test_braking_gives_back_no_more_than_the_limit_and_nothing_when_slow():
    vehicle = Vehicle()
    hard = vehicle.power_w(np.array([30.0]), np.array([-8.0]))
    assert hard[0] == pytest.approx(500.0 - vehicle.regen_power_w)
    slow = vehicle.power_w(np.array([1.0]), np.array([-1.0]))
    assert slow[0] == pytest.approx(500.0)
    gentle = vehicle.power_w(np.array([20.0]), np.array([-0.5]))
    wheels = (1800 * 1.05 * -0.5 + 176.58 + 156.0) * 20.0
    assert gentle[0] == pytest.approx(0.7 * wheels + 500.0)


@pytest.mark.parametrize("name", TITLES)
def test_consumption_is_that_of_a_compact_car(name):
    one = schedule(name)
    current = Vehicle().cell_current_a(one, 1.0)
    energy_wh = np.sum(current) * Vehicle().pack.volt_cells / 3600.0
    distance_km = np.trapezoid(one.speed_m_s, one.time_s) / 1000.0
    assert 100.0 < energy_wh / distance_km < 220.0


@pytest.mark.parametrize(
    ("name", "seconds", "kilometres"),
    [
        ("udds", 1369, 11.99),
        ("hwfet", 765, 16.51),
        ("us06", 600, 12.89),
        ("sc03", 600, 5.76),
        ("wltc_3b", 1800, 23.27),
        ("nedc", 1200, 10.93),
        ("artemis_urban", 993, 4.87),
        ("japan_10_15", 660, 4.17),
    ],
)
def test_bundled_schedules_have_the_published_length(name, seconds, kilometres):
    one = schedule(name)
    assert one.duration_s == seconds
    assert np.all(np.diff(one.time_s) == 1.0)
    assert np.trapezoid(one.speed_m_s, one.time_s) / 1000 == pytest.approx(kilometres, abs=0.01)


def test_an_unknown_schedule_names_the_nearest():
    with pytest.raises(DataError, match="'udds'"):
        schedule("uds")


def test_another_cell_size_sees_the_same_c_rates():
    small = ProfileBuilder(12.5, 1.0).drive("us06") / 12.5
    large = ProfileBuilder(30.0, 1.0).drive("us06") / 30.0
    np.testing.assert_allclose(small, large)
    assert Pack.for_capacity(30.0) == Pack()


def test_the_papers_profile_has_its_rows_currents_and_ranges():
    profiles = paper_profiles(30.0, 0.1)
    train = profiles["train"][0]
    assert len(train) == 88_200
    assert 85 < train.current_a.max() < 105
    assert train.current_a.min() == pytest.approx(-150.0)

    def soc(profile):
        taken = np.cumsum(profile.current_a) * 0.1 / 3600.0 / 30.0
        return profile.soc0 - taken

    low, high = soc(train).min(), soc(train).max()
    assert low > 0.2
    assert high < 0.8
    for role in ("valid", "test"):
        for profile in profiles[role]:
            assert low < soc(profile).min()
            assert soc(profile).max() < high
            # It ends at rest, as every piece does.
            assert not np.any(profile.current_a[-round(AFTER_PULSE_S / 0.1) :])
