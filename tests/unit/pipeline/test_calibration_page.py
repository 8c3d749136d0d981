"""The page of a calibration: the finding first, every record and parameter, spectra where there are any."""

import json
import re
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.calibration.records.thinning import SPACING
from aesi.data.thinning import condensed
from aesi.physics import Cell, simulate
from aesi.pipeline.calibrate import calibrate_files, fit_traces
from aesi.pipeline.impedance import SpectrumError
from aesi.pipeline.report.calibration import (
    CalibrationView,
    courses,
    finding,
    pulse_figure,
    write_calibration_report,
)
from aesi.pipeline.report.views import DiscoveryTrace
from aesi.records import Measurement, Spectrum

START = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
HEALTH = {"resistance_mohm": "resistance of contacts and films, mohm", "capacity_ah": "capacity, Ah"}


def parameter(of_prior=0.3, **more):
    return {
        "value": 1.0, "low": 0.5, "high": 2.0, "unit": "factor", "prior_from": "a convention",
        "of_prior": of_prior, **more,
    }  # fmt: skip


def record(name, **more):
    return {
        "name": name, "temperature_degc": None, "before_rmse_mv": 30.0, "after_rmse_mv": 2.0,
        "as_simulated_rmse_mv": 4.0, "ran_out_s": None, "until_ran_out_rmse_mv": None, "capacity_share": 0.99, **more,
    }  # fmt: skip


def pulse_row(degc, fitted, *mohm):
    low, high = ([None if v is None else factor * v for v in mohm] for factor in (0.9, 1.1))
    row = {"temperature_degc": degc, "fitted": fitted, "mohm": list(mohm)}
    return row | {"low_mohm": low, "high_mohm": high}


@pytest.fixture
def content():
    return {
        "cell": "a <cell>",
        "declared_degc": 25.0,
        "files": [record("pulses"), record("slow", temperature_degc=9.5, as_simulated_rmse_mv=6.0)],
        "parameters": {
            "negative.rate": parameter(of_prior=0.9),
            "positive.rate": parameter(of_prior=0.1, posterior_low=0.4, posterior_high=2.1),
            **{f"negative.rate_at_{place}_percent": parameter() for place in (0, 50, 100)},
        },
        "health": {
            "resistance_mohm": {"value": 12.0, "low": 10.0, "high": 14.0},
            "capacity_ah": {"value": 3.0, "low": None, "high": None},
        },
        "pulse_resistance": {
            "seconds": 10.0,
            "soc": [0.8, 0.2],
            "rows": [
                pulse_row(-20.0, False, 200.0, None),
                pulse_row(0.0, False, 90.0, 110.0),
                pulse_row(25.0, True, 42.0, 45.0),
            ],
            "measured": [
                {"record": "pulses", "temperature_degc": 24.0, "soc": soc, "mohm": 44.0}
                for soc in (0.24, 0.5)
            ],
            "model_error_pct": 2.34,
        },
        "size_assumed": "",
        "undetermined": [{"weights": {}, "narrowed": 1.0, "sentence": "the data do not determine it"}],
        "impedance": [],
        "at_bounds": ["negative.film"],
        "warnings": ["slow: started <elsewhere>."],
        "notes": ["pulses: no temperature."],
        "seconds": 3.0,
    }


def traces(names):
    time_s = np.arange(400.0)
    current_a = np.sign(np.sin(time_s / 30))
    flat = np.full(len(time_s), 3.7)
    return tuple(
        DiscoveryTrace(
            name, "fit", time_s, current_a, 0.9 - 1e-3 * time_s, flat + 1e-3, flat, flat, flat + 9e-4
        )
        for name in names
    )


def page(path, view):
    html = write_calibration_report(path / "report.html", view).read_text("utf-8")
    placed = re.findall(r'data-figure="([^"]+)"', html)
    payload = json.loads(re.search(r'id="payload">(.*?)</script>', html, re.DOTALL)[1])
    assert sorted(placed) == sorted(payload["figures"])
    return html[: html.index("<script>")]


def test_the_finding_comes_first_and_the_best_known_parameter_before_the_others(tmp_path, content):
    view = CalibrationView(
        content, "the single particle", traces(["pulses", "slow"]), HEALTH, "these tell 1 of 5"
    )
    html = page(tmp_path, view)
    assert "a &lt;cell&gt;" in html
    assert (
        html.index("by 2.0\u00a0mV RMSE")
        < html.index("4.0 to 6.0")
        < html.index("slow: started &lt;elsewhere&gt;.")
        < html.index("On a bound")
        < html.index("These tell 1 of 5.")
    )
    assert html.index("<code>positive.rate</code>") < html.index("<code>negative.rate</code>")
    assert html.index("<code>negative.rate</code>") < html.index("The 3 knots over stoichiometry")
    assert "25.0, as declared" in html
    assert html.count("sampled [") == 1
    assert 'data-figure="nyquist_0"' not in html


def test_a_size_that_no_record_told_stood_among_the_notes_alone(tmp_path, content):
    """A drive of a cell of 2.9 Ah, fitted from a file of one of 5 Ah, came out as a state of health of 5.17 Ah."""
    view = CalibrationView(content, "the single particle", traces(["pulses"]), HEALTH, "")
    assert "size of the cell" not in page(tmp_path, view)
    content["size_assumed"] = (
        "no record holds it: the size of the cell is taken from the start file, 5.15 Ah."
    )
    html = page(tmp_path, view)
    assert "No record holds it" in html[: html.index("</header>")]


def test_spectra_are_drawn_by_temperature(tmp_path, content):
    z = 1e-3 * np.exp(1j * np.linspace(0.0, -1.0, 5))
    hz = np.geomspace(0.01, 100.0, 5)
    spectra = tuple(
        SpectrumError(Spectrum(name, hz, z, soc=0.5, temperature_degc=degc), 0.5, 1.1 * z, 0.1, name == "a")
        for name, degc in (("a", 25.0), ("b", 25.2), ("c", 10.0))
    )
    row = {"name": "a", "soc": 0.5, "temperature_degc": 25.0, "rms_pct": 10.0, "band_hz": [0.01, 100.0]}
    row["fitted"] = True
    content["impedance"] = [row, row | {"temperature_degc": None, "rms_pct": None, "fitted": False}]
    html = page(tmp_path, CalibrationView(content, "", traces(["pulses"]), HEALTH, spectra=spectra))
    assert "Nyquist plot at 25 degC" in html
    assert "Nyquist plot at 10 degC" in html
    assert "the model was fitted to 1 of 2 spectra" in html
    assert "nothing was fitted to them" in html
    assert "<td>10.0</td><td>yes</td>" in html
    assert "<td>no</td>" in html


def test_the_resistance_is_told_over_temperature_with_what_the_records_leave_open(tmp_path, content):
    html = page(tmp_path, CalibrationView(content, "", traces(["pulses"]), HEALTH))
    assert "Resistance of a discharge at 1C for 10\u00a0s" in html
    assert re.search(r'<th scope="row">25</th><td>42 <small>\[37.8, 46.2\]</small></td>', html)
    assert html.count("none near: by the priors") == 2
    assert html.count("cannot give the pulse") == 1
    bands, dotted, near, measured = pulse_figure(content)["pulse_resistance"].data[4:]  # of 20 % charge
    assert list(bands.x) == [0.0, 25.0, 25.0, 0.0]
    assert list(dotted.y) == [110.0, 45.0]
    assert list(near.y) == [45.0]
    assert list(zip(measured.x, measured.y, strict=True)) == [(24.0, 44.0)]


def test_one_record_is_named_and_its_error_is_no_range(content):
    content["files"] = content["files"][:1]
    assert finding(content) == (
        "In free run the calibrated model errs by 2.0 mV RMSE on pulses, where the start file erred by 30.0 mV. "
        "With the written file alone, without each record's own initial state, capacity and current offset, the error "
        "is 4.0 mV."
    )


def test_a_record_that_the_fit_made_worse_is_named_first(content):
    content["files"][0]["before_rmse_mv"] = 1.0
    assert finding(content).endswith(" On pulses the start file has the lower error.")


def test_a_record_that_the_written_file_is_worse_on_was_not_named(content):
    content["files"][1] |= {"before_rmse_mv": 5.0, "after_rmse_mv": 2.0, "as_simulated_rmse_mv": 6.0}
    assert finding(content).endswith(" On slow the start file has the lower error.")


def test_the_error_of_a_file_was_that_of_the_hours_after_it_had_run_out(content):
    content["files"][1] |= {
        "as_simulated_rmse_mv": 830.65,
        "ran_out_s": 74520.0,
        "until_ran_out_rmse_mv": 12.3,
    }
    assert "the error is 4.0 to 12.3 mV, until it runs out on slow. On slow the start file" in finding(
        content
    )


def test_the_error_over_all_rows_was_said_to_be_smaller_also_where_the_fitted_rows_average_noise(
    tmp_path, content
):
    """Pulses that the file fits to the noise of the sensor: averages have less of it than single rows."""
    time_s = np.arange(0.0, 7200.0)
    current_a = np.where(time_s % 1800.0 < 20.0, 5.0, 0.0)
    noise_v = 1e-3 * np.random.default_rng(0).standard_normal(len(time_s))
    measured = Measurement(time_s, current_a, 3.7 + noise_v, name="pulses", hold="backward")
    thinned, _ = condensed(measured, 5.0, 900.0, SPACING)
    rms_mv = [1e3 * np.std(record.voltage_v) for record in (measured, thinned)]
    assert rms_mv[0] > 1.2 * rms_mv[1]
    view = CalibrationView(
        content, "the single particle", traces(["pulses", "slow"]), HEALTH, "these tell 1 of 5"
    )
    assert "and larger where sensor noise is much of it" in page(tmp_path, view)


def test_no_knots_are_no_figure():
    assert courses([{"name": "contact.resistance", **parameter()}]) == {}


def pulses(cell):
    time_s = np.arange(0.0, 1200.0)
    current_a = np.repeat([0.0, 5.0, -3.0, 8.0, 0.0], 240)
    voltage_v = simulate(cell, time_s, current_a, 0.8).voltage_v - 1e-3 * current_a
    return Measurement(time_s, current_a, voltage_v, name="pulses")


def drawn_rms_v(trace):
    voltages = (trace.before_v, trace.recalibrated_v, trace.after_v)
    return tuple(np.sqrt(np.mean((trace.measured_v - voltage) ** 2)) for voltage in voltages)


def test_the_start_file_was_drawn_with_a_loss_on_a_record_of_another_day():
    """The table said what it errs by as a cell that has lost nothing."""
    cell = Cell.from_bpx(START)
    data, days = pulses(cell), {"pulses": date(2024, 1, 1), "before": date(2023, 1, 1)}
    before = replace(data, name="before")
    found = calibrate(cell, [data, before], Conditions(dates=days, as_of=days["before"]), evaluations=1)
    (trace, _), (error, _) = fit_traces(found), found.errors
    assert drawn_rms_v(trace) == pytest.approx((error.before_v, error.simulated_v, error.after_v), rel=1e-9)


def test_a_calibration_writes_its_page_with_the_errors_that_it_tells(tmp_path, monkeypatch):
    cell = Cell.from_bpx(START)
    data = pulses(cell)
    found = calibrate(cell, [data], evaluations=2)
    monkeypatch.setattr("aesi.pipeline.calibrate.calibrate", lambda *_, **__: found)
    calibrate_files(START, [data], tmp_path / "new.json")
    assert "pulses" in (tmp_path / "new.report.html").read_text("utf-8")
    (trace,), (error,) = fit_traces(found), found.errors
    assert drawn_rms_v(trace) == pytest.approx((error.before_v, error.simulated_v, error.after_v), rel=1e-9)
    assert trace.soc[-1] == pytest.approx(trace.soc[0] - data.charge_ah / found.cell.capacity_ah, abs=0.01)


def test_the_state_of_charge_was_begun_in_other_windows_than_it_was_counted_in():
    """The start file is empty below its lower voltage, the file that is written at it: between full, which both have,
    and the start there is the same charge, of another capacity."""
    cell = replace(Cell.from_bpx(START), lower_voltage_v=3.0)
    found = calibrate(cell, [pulses(cell)], evaluations=2)
    (trace,), model = fit_traces(found), found.model
    fitted = model.cell_at(found.x)
    start = model.records[0].start.soc + model.records[0].soc_sd * found.x[model.layout.soc(0)]
    assert found.cell.capacity_ah < 0.97 * fitted.capacity_ah
    assert trace.soc[0] == pytest.approx(
        1.0 - (1.0 - start) * fitted.capacity_ah / found.cell.capacity_ah, abs=1e-6
    )
    assert found.cell.rest_voltage_v(trace.soc[:1]) == pytest.approx(
        fitted.rest_voltage_v(np.array([start])), abs=1e-6
    )
