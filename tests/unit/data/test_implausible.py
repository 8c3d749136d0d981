"""Signs and units that were lost on the way are told from the columns together."""

import numpy as np
import pytest

from aesi.data import read_measurement
from aesi.errors import DataError

TIME = np.arange(0.0, 7200.0, 4.0)
rng = np.random.default_rng(3)
DRIVE = np.repeat(rng.normal(1.5, 3.0, len(TIME) // 5), 5)
CYCLE = np.where(TIME < 3600.0, 3.0, -3.0)


def voltage(current):
    """Of a 5 Ah cell with 20 mohm, whose potential falls by 0.9 V from full to empty."""
    charge = np.cumsum(current) * 4.0 / 3600.0
    return 4.1 - 0.18 * charge - 0.02 * current


def written(folder, time, current, volts):
    path = folder / "drive.csv"
    rows = zip(*(column.tolist() for column in (time, current, volts)), strict=True)
    body = "\n".join(",".join(map(repr, row)) for row in rows)
    path.write_text(f"time_s,current_a,voltage_v\n{body}\n")
    return path


def refusal(folder, time, current, volts):
    with pytest.raises(DataError) as caught:
        read_measurement(written(folder, time, current, volts))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("current", [DRIVE, CYCLE], ids=["drive", "cycle"])
def test_a_current_without_its_sign_is_told_and_with_it_is_taken(tmp_path, current):
    read_measurement(written(tmp_path, TIME, current, voltage(current)))
    message = refusal(tmp_path, TIME, np.abs(current), voltage(current))
    assert "holds magnitudes" in message
    assert "--state" in message


def test_a_discharge_alone_is_no_magnitude(tmp_path):
    pulses = np.where((TIME % 400) < 40, 4.0, 0.0)
    read_measurement(written(tmp_path, TIME, pulses, voltage(pulses)))
    read_measurement(written(tmp_path, TIME, np.abs(DRIVE), voltage(np.abs(DRIVE))))


def test_warming_in_the_cold_is_no_charge(tmp_path):
    """The voltage of a cold cell first rises under a held current: 0.37 V at most in the records that set the limit."""
    current = np.full_like(TIME, 3.0)
    warming = voltage(current) - 0.45 * np.exp(-TIME / 600.0)
    read_measurement(written(tmp_path, TIME, current, warming))


@pytest.mark.parametrize(
    ("current", "factor", "words"),
    [
        (CYCLE, 1 / 3600, "--unit time_s=h"),
        (DRIVE, 1 / 3600, "--unit time_s=h"),
        (DRIVE, 1e3, "--unit time_s=ms"),
    ],
)
def test_a_time_in_another_unit_is_told(tmp_path, current, factor, words):
    assert words in refusal(tmp_path, factor * TIME, current, voltage(current))


def test_a_current_in_milliamperes_is_not_taken_for_a_time(tmp_path):
    message = refusal(tmp_path, TIME, 1e3 * DRIVE, voltage(DRIVE))
    assert "--unit current_a=mA" in message
    assert "time_s=ms" not in message


def test_a_voltage_that_stood_still_from_the_middle_on_was_taken(tmp_path):
    stuck = voltage(DRIVE)
    stuck[900:] = stuck[900]
    message = refusal(tmp_path, TIME, DRIVE, stuck)
    assert "row 901 (line 902), column voltage_v: the voltage stands still at" in message
    assert "--to-s 3600 " in message


def test_a_voltage_that_is_held_is_no_sensor_that_stands_still(tmp_path):
    """The end of a charge: the cycler holds 4.2 V, and the current falls."""
    pulses = np.where(TIME < 3600.0, np.where((TIME % 400) < 40, 4.0, 0.0), 0.0)
    current = np.where(TIME < 3600.0, pulses, -3.0 * np.exp(-(TIME - 3600.0) / 900.0))
    volts = np.where(TIME < 3600.0, voltage(pulses), 4.2)
    read_measurement(written(tmp_path, TIME, current, np.round(volts, 3)))


def test_a_short_record_in_milliseconds_was_taken(tmp_path):
    """It moves too little charge to be beyond any cell's, and yet too much for its resistance and its voltage."""
    short = slice(0, 150)
    read_measurement(written(tmp_path, TIME[short], DRIVE[short], voltage(DRIVE)[short]))
    message = refusal(tmp_path, 1e3 * TIME[short], DRIVE[short], voltage(DRIVE)[short])
    assert "Ah would have moved while the voltage slides by" in message
    assert message.endswith("declare it: --unit time_s=ms.")


def test_a_flat_potential_is_no_time_in_milliseconds(tmp_path):
    flat = 3.3 - 0.004 * np.cumsum(DRIVE) * 4.0 / 3600.0 - 0.02 * DRIVE
    read_measurement(written(tmp_path, TIME, DRIVE, flat))
