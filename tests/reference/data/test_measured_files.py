"""Every public measurement at hand is read as it is, and its charge and signs are those of its description."""

import numpy as np
import pytest

from aesi.data import read_measurement, to_even
from aesi.errors import DataError

SECONDS_PER_HOUR = 3600.0


NOT_ONE_RECORD = ("_eis.csv", "n10degC_hppc.csv.gz")
"""Spectra are tables of another kind; the pulses at -10 degC hold a charge that nobody wrote down."""


def every_file(folder):
    measured = [path for path in folder.glob("measured/*/*.csv*") if not path.name.endswith(NOT_ONE_RECORD)]
    return sorted(measured) + sorted(folder.glob("virtual/*.csv"))


def test_all_are_read_and_both_signs_are_not(shared_data):
    files = every_file(shared_data)
    assert files
    for path in files:
        measurement = read_measurement(path)
        assert len(measurement) > 300
        with pytest.raises(DataError, match="sign"):
            read_measurement(path, sign="charge-positive")


def test_only_the_stray_row_of_one_file_is_dropped(shared_data):
    dropped = [
        path.name
        for path in every_file(shared_data)
        if any("dropped" in note for note in read_measurement(path).notes)
    ]
    assert dropped == ["25degC_c20_ocv.csv"]


def test_a_record_with_a_charge_that_nobody_wrote_down_is_refused_at_the_gap(shared_data):
    path = shared_data / "measured" / "panasonic_ncr18650pf" / "n10degC_hppc.csv.gz"
    with pytest.raises(DataError, match=r"a gap of 31154\.6 s after 78610\.144 s"):
        read_measurement(path)


def test_the_slow_discharge_is_a_twentieth_of_the_nominal_capacity_an_hour(shared_data):
    # C/20 of 12.5 Ah is 0.625 A, from the first row to the last.
    record = read_measurement(shared_data / "measured" / "about_energy_nmc" / "C20.csv")
    charge = np.sum(record.current_a[1:] * np.diff(record.time_s)) / SECONDS_PER_HOUR
    assert charge == pytest.approx(0.625 * record.time_s[-1] / SECONDS_PER_HOUR, rel=0.01)


def test_resampling_keeps_the_charge_of_a_ten_hertz_record(shared_data):
    record = read_measurement(shared_data / "measured" / "lg_18650hg2" / "25degC_us06.csv.gz")
    even = to_even(record, 1.0)
    whole = np.sum(record.current_a[1:] * np.diff(record.time_s))
    part = np.sum(even.current_a[1:] * np.diff(even.time_s))
    # Less than one step is left over at the end, at rest.
    assert part == pytest.approx(whole, abs=1e-6)
