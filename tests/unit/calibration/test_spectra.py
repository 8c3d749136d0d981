"""Impedance fitted beside the records: it tells what they leave open, and what cannot be fitted is said."""

import numpy as np
import pytest

from aesi.calibration import Conditions, calibrate
from aesi.calibration.parameters import with_parameters
from aesi.calibration.prepared_model import prepared_model
from aesi.calibration.records.spectra import FittedSpectra, fitted_spectra
from aesi.errors import DataError
from aesi.numerics.metrics import rms
from aesi.physics import impedance
from aesi.records import Spectrum

FREQUENCY_HZ = np.geomspace(1e-2, 1e2, 13)
LAYER = {"double_layer_f_m2": 0.5}  # without one a model answers at once, as no spectrum does


def spectrum_of(cell, soc, degc, hz=FREQUENCY_HZ):
    return Spectrum(
        f"{soc:g} at {degc:g}", hz, impedance(cell, hz, soc, degc), soc=soc, temperature_degc=degc
    )


def off(cell, measured):
    z = impedance(cell, measured.frequency_hz, measured.soc, measured.temperature_degc)
    return rms(np.abs(z / measured.z_ohm - 1.0))


def test_spectra_tell_of_other_states_and_temperatures_what_a_record_leaves_open(start, truth, records):
    layered = truth.with_negative(**LAYER).with_positive(**LAYER)
    spectra = tuple(spectrum_of(layered, soc, degc) for soc in (0.4, 0.8) for degc in (5.0, 25.0))
    alone = calibrate(start, records[:1], evaluations=5)
    beside = calibrate(start, records[:1], Conditions(spectra=spectra), evaluations=5)
    for degc in (10.0, 20.0):
        unseen = spectrum_of(layered, 0.6, degc)
        assert off(beside.cell, unseen) < 0.05
        assert off(beside.cell, unseen) < 0.5 * off(alone.cell, unseen)
    assert "negative.film_energy" in beside.parameters
    assert "negative.film_energy" not in alone.parameters  # one record at one temperature tells none
    narrow, wide = (fit.parameters["contact.resistance"] for fit in (beside, alone))
    assert narrow.high - narrow.low < 0.6 * (wide.high - wide.low)


def test_the_slopes_of_spectra_are_those_of_the_residual(start, truth, records):
    spectra = (spectrum_of(truth, 0.5, 15.0), spectrum_of(truth, 0.2, 25.0))
    model = prepared_model(start, records[:1], Conditions(spectra=spectra))[0]
    x = 0.1 * np.sin(np.arange(model.layout.size))
    jacobian = model.jacobian(x)[-model.layout.size - 4 * len(FREQUENCY_HZ) : -model.layout.size]
    for j in range(model.layout.size):
        step = np.zeros_like(x)
        step[j] = 1e-4
        slope = (model.residual(x + step) - model.residual(x - step)) / 2e-4
        of_spectra = slope[-model.layout.size - 4 * len(FREQUENCY_HZ) : -model.layout.size]
        assert np.linalg.norm(jacobian[:, j] - of_spectra) < 0.02 * max(np.linalg.norm(of_spectra), 1e-3), j


def test_more_frequencies_of_one_decade_say_no_more(start, truth, records):
    few, many = (spectrum_of(truth, 0.5, 25.0, np.geomspace(1e-2, 1e2, n)) for n in (41, 401))
    of_few, of_many = (
        prepared_model(start, records[:1], Conditions(spectra=(one,)))[0].spectra.misfits(start)
        for one in (few, many)
    )
    assert of_many @ of_many == pytest.approx(of_few @ of_few, rel=0.03)


def test_of_spectra_in_percent_that_of_1_percent_was_taken_for_a_full_cell(start, truth, records):
    good = spectrum_of(truth, 1.0, 25.0)
    half = Spectrum("half", FREQUENCY_HZ, np.ones(13), soc=50.0)
    with pytest.raises(DataError, match=r"half: its state of charge of 50 .* so are the others of its file"):
        prepared_model(start, records[:1], Conditions(spectra=(good, half)))


def test_a_drawn_start_without_the_state_of_a_spectrum_ended_the_whole_fit(start, truth):
    fitted = FittedSpectra((spectrum_of(truth, 0.02, 25.0),), "espm")
    smaller = with_parameters(start, {"negative.capacity": 0.9})
    assert smaller.stoichiometries(0.02)[0] < 0.0
    assert np.isnan(fitted.misfits(smaller)).all()
    assert np.isfinite(fitted.misfits(start)).all()


def test_a_spectrum_at_a_state_that_the_start_file_lacks_is_refused(start, truth):
    empty = Spectrum("empty", FREQUENCY_HZ, spectrum_of(truth, 0.5, 25.0).z_ohm, soc=0.0)
    with pytest.raises(
        DataError, match=r"empty: .* has no state of charge of 0, where a stoichiometry leaves"
    ):
        fitted_spectra(start.with_negative(theta_min=0.0), (empty,))


def test_a_spectrum_that_cannot_be_fitted_is_told(start, truth, records):
    good, empty = spectrum_of(truth, 0.5, 25.0), Spectrum("low", FREQUENCY_HZ, np.ones(13), soc=-0.1)
    fast = spectrum_of(truth, 0.5, 25.0, np.array([200.0, 1000.0]))
    model, notes = prepared_model(start, records[:1], Conditions(spectra=(good, empty, fast)))
    assert [one.name for one in model.spectra.spectra] == [good.name]
    assert any(note.startswith("low: left out, since its state of charge of -0.1 is not") for note in notes)
    assert f"{fast.name}: not fitted, since it has no frequency from 0.01 to 100 Hz." in notes
    with pytest.raises(DataError, match="no spectrum that was given to be fitted can be; none within"):
        prepared_model(start, records[:1], Conditions(spectra=(fast,)))
    in_milliohm = Spectrum("m", FREQUENCY_HZ, 1e3 * good.z_ohm, soc=0.5)
    with pytest.raises(DataError, match=r"m: \|Z\| is .* as of no cell of 5 A.h"):
        prepared_model(start, records[:1], Conditions(spectra=(in_milliohm,)))
