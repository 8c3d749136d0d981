"""Cases for the tracer: files that are longer than a hypothesis can afford are thinned, and it is said."""

import numpy as np
import pandas as pd
import pytest

from aesi.pipeline import cases


@pytest.fixture
def drive(tmp_path):
    def write(name, rows):
        time_s = np.arange(rows) * 1.0
        current_a = np.where(time_s % 40 < 20, 3.0, -2.0)
        table = pd.DataFrame({"time_s": time_s, "current_a": current_a, "voltage_v": 3.7 - 0.01 * current_a})
        table.to_csv(tmp_path / name, index=False)
        return tmp_path / name

    return write


def test_long_files_share_the_rows_and_keep_their_charge(drive, monkeypatch, tmp_path):
    monkeypatch.setattr(cases, "MOST_ROWS", 1000)
    case = cases.case_of_files(tmp_path / "cell.json", [drive("a.csv", 4000)], [drive("b.csv", 100)])
    (long,), (short,) = case.measurements, case.tests
    assert len(long) <= 500
    assert any("Decimated from 4000" in note for note in long.notes)
    assert len(short) == 100
    assert not short.notes
    charge = float(np.sum(long.current_a[1:] * np.diff(long.time_s)))
    whole = np.where(np.arange(4000) % 40 < 20, 3.0, -2.0)[1:]
    assert charge == pytest.approx(whole[: int(long.time_s[-1])].sum())
