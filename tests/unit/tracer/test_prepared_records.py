"""Records made ready for fits: the noise of each row, and where the record starts from."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.tracer.case.records import prepare_all


def test_rows_that_stand_for_many_carry_less_noise(cell, make):
    data = make(n=6000)
    steady = replace(data, current_a=np.where(data.time_s < 60, 0.0, 3.0))
    record = prepare_all(cell, [steady], 0.9, 0.0)[0]
    rows = np.round((record.noise_full_v / record.white_v) ** 2)
    assert rows.min() == 1.0
    assert rows.max() > 5.0
    assert rows.sum() == pytest.approx(len(data), rel=0.05)


@pytest.mark.parametrize("kind", ["drive", "drive at 10 Hz", "steady"])
@pytest.mark.parametrize("soc0", [0.9, None])
def test_what_is_kept_back_does_not_move_what_fits_see(cell, make, kind, soc0, rng):
    data = make(n=6000)
    data = replace(data, voltage_v=np.round(data.voltage_v, 3))
    if kind == "steady":
        data = replace(data, current_a=np.where(data.time_s < 60, 0.0, 3.0))
    if kind == "drive at 10 Hz":
        data = replace(data, time_s=0.1 * data.time_s, current_a=np.repeat(data.current_a[::10], 10))
    late = data.time_s >= data.time_s[0] + (1.0 - 0.3) * (data.time_s[-1] - data.time_s[0])
    other = replace(data, voltage_v=data.voltage_v + np.where(late, 0.02 * rng.normal(size=len(data)), 0.0))
    one, two = (prepare_all(cell, [record], soc0, 0.3)[0] for record in (data, other))
    assert one.n_fit == two.n_fit < len(one.thin)
    for column in ("time_s", "current_a", "voltage_v"):
        seen, then = (getattr(record.thin, column)[: one.n_fit] for record in (one, two))
        np.testing.assert_array_equal(seen, then)
    for weights in ("white_v", "equivalent_white_v"):
        np.testing.assert_array_equal(getattr(one, weights)[: one.n_fit], getattr(two, weights)[: one.n_fit])
    assert (one.start, one.noise_full_v) == (two.start, two.noise_full_v)


def test_a_given_state_of_charge_is_taken_and_a_rest_is_read(cell, make):
    data = make()
    given, read = prepare_all(cell, [data], 0.9, 0.0)[0], prepare_all(cell, [data], None, 0.0)[0]
    assert (given.start.basis, given.soc0) == ("given", 0.9)
    assert read.start.basis == "rest"
    assert abs(read.soc0 - 0.9) < 3 * read.soc0_sd
    assert any("state of charge" in note for note in read.notes)
    # Where a record starts was told where it was read, and left out of the report where it was given.
    assert any("starts at a state of charge of 0.9, as given" in note for note in given.notes)


def test_a_voltage_of_no_state_of_this_cell_is_refused(cell, make):
    data = make()
    with pytest.raises(DataError, match="rest voltage"):
        prepare_all(cell, [replace(data, voltage_v=data.voltage_v - 1.5)], None, 0.0)


def test_how_the_current_is_taken_is_told_with_what_takes_it_otherwise_from_the_command_line_and_a_file(
    cell, make
):
    notes = prepare_all(cell, [make()], 0.9, 0.0)[0].notes
    assert any(
        note.endswith("; --hold backward (in an experiment discover.hold: backward) takes it otherwise.")
        for note in notes
    )
