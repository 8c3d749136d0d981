"""What `aesi calibrate` says while it fits."""

from pathlib import Path

import pytest

from aesi.errors import DataError
from flows.base import interrupt
from flows.jobs import calibration


def test_a_fit_tells_where_it_stands(monkeypatch, capsys):
    def fitted(cell, measurements, out, request, progress):
        progress(7, 0.034)
        raise DataError("no further.")

    monkeypatch.setattr(calibration, "calibrate_files", fitted)
    with pytest.raises(DataError):
        calibration.calibrate(Path("cell.json"), [], Path("new.json"))
    assert "steps of the fit: 7 in 0 s, at 3.4 % of the starting point's cost" in capsys.readouterr().err


@pytest.mark.parametrize("simulated_mv", [1.0, 29.9])
def test_another_error_of_the_simulated_file_was_told_without_a_reason(simulated_mv, monkeypatch, capsys):
    row = {
        "name": "pulses", "before_rmse_mv": 300.0, "after_rmse_mv": 1.0, "as_simulated_rmse_mv": simulated_mv,
        "ran_out_s": None, "until_ran_out_rmse_mv": None,
    }  # fmt: skip
    empty: dict[str, list[str]] = {
        key: [] for key in ("impedance", "notes", "undetermined", "at_bounds", "warnings")
    }
    monkeypatch.setattr(calibration, "calibrate_files", lambda *_: {"files": [row], **empty})
    calibration.calibrate(Path("cell.json"), [], Path("new.json"))
    told = capsys.readouterr().err
    assert f"1.00 mV after, {simulated_mv:.2f} mV as the file is simulated\n" in told
    assert ("as simulated, the file as it is" in told) == (simulated_mv != 1.0)


def test_a_fit_that_was_stopped_did_not_say_whether_it_goes_on(monkeypatch):
    said: list[str] = []

    def stopped(*_):
        said.extend(interrupt._kept)
        raise KeyboardInterrupt

    monkeypatch.setattr(calibration, "calibrate_files", stopped)
    with pytest.raises(KeyboardInterrupt):
        calibration.calibrate(Path("cell.json"), [], Path("out.json"))
    assert said == ["Nothing of the fit is kept; the same command begins it anew."]
