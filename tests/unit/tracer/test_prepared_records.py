"""Records made ready for fits: the noise of each row, and where the record starts from."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.tracer.case.records import prepare


def test_rows_that_stand_for_many_carry_less_noise(cell, make):
    data = make(n=6000)
    steady = replace(data, current_a=np.where(data.time_s < 60, 0.0, 3.0))
    record = prepare(cell, steady, 0.9, 0.0)
    rows = np.round((record.noise_full_v / record.white_v) ** 2)
    assert rows.min() == 1.0
    assert rows.max() > 5.0
    assert rows.sum() == pytest.approx(len(data), rel=0.05)


def test_a_given_state_of_charge_is_taken_and_a_rest_is_read(cell, make):
    data = make()
    given, read = prepare(cell, data, 0.9, 0.0), prepare(cell, data, None, 0.0)
    assert (given.start.basis, given.soc0) == ("given", 0.9)
    assert read.start.basis == "rest"
    assert abs(read.soc0 - 0.9) < 3 * read.soc0_sd
    assert any("state of charge" in note for note in read.notes)


def test_a_voltage_of_no_state_of_this_cell_is_refused(cell, make):
    data = make()
    with pytest.raises(DataError, match="rest voltage"):
        prepare(cell, replace(data, voltage_v=data.voltage_v - 1.5), None, 0.0)


def test_how_the_current_is_taken_is_told_with_what_takes_it_otherwise_from_the_command_line_and_a_file(
    cell, make
):
    notes = prepare(cell, make(), 0.9, 0.0).notes
    assert any(
        note.endswith("; --hold backward (in an experiment discover.hold: backward) takes it otherwise.")
        for note in notes
    )
