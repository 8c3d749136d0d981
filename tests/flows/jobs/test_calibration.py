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


def test_a_fit_that_was_stopped_did_not_say_whether_it_goes_on(monkeypatch):
    said: list[str] = []

    def stopped(*_):
        said.extend(interrupt._kept)
        raise KeyboardInterrupt

    monkeypatch.setattr(calibration, "calibrate_files", stopped)
    with pytest.raises(KeyboardInterrupt):
        calibration.calibrate(Path("cell.json"), [], Path("out.json"))
    assert said == ["Nothing of the fit is kept; the same command begins it anew."]
