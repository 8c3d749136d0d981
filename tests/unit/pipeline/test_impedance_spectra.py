"""Measured spectra held against a cell: what is left out or assumed is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import aesi
from aesi.calibration.records.spectra import check_spectra
from aesi.errors import DataError, InputError
from aesi.physics.cell.relations import Constant
from aesi.physics.effects import activated
from aesi.physics.impedance import slowest_diffusion_hz
from aesi.pipeline.distinct import check_distinct_spectra
from aesi.pipeline.impedance import compared_spectra, impedance_file, read_frequencies
from aesi.records import Spectrum

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
FREQUENCY_HZ = np.geomspace(1e-2, 1e3, 11)


@pytest.fixture(scope="module")
def cell():
    return aesi.Cell.from_bpx(CELLS / "lg_m50_chen2020.bpx.json")


def spectrum(cell, hz=FREQUENCY_HZ, **state):
    return Spectrum("s", hz, aesi.impedance(cell, hz, soc=0.5), **state)


def test_the_models_own_spectrum_is_not_off(cell):
    (one,), told = compared_spectra(cell, [spectrum(cell, soc=0.5, temperature_degc=25.0)])
    assert one.ratio_error == pytest.approx(0.0, abs=1e-12)
    assert told == ()


def test_a_spectrum_beyond_100_hz_ended_a_calibration_without_its_report(cell):
    (one,), _ = compared_spectra(
        cell, [spectrum(cell, np.array([200.0, 1000.0]), soc=0.5, temperature_degc=25.0)]
    )
    assert one.ratio_error is None


def test_a_spectrum_below_empty_was_left_out_in_silence(cell):
    kept, told = compared_spectra(cell, [spectrum(cell, soc=50.0), spectrum(cell, discharged_ah=9.0)])
    assert kept == ()
    assert [sentence.split(" is not between 0 and 1")[0] for sentence in told] == [
        "s: left out, since its state of charge of 50",
        f"s: left out, since its state of charge of {1.0 - 9.0 / cell.capacity_ah:.4g}",
    ]


def test_spectra_in_milliohm_were_held_against_a_cell_in_ohm(cell):
    cold = Spectrum(
        "s", FREQUENCY_HZ, aesi.impedance(cell, FREQUENCY_HZ, soc=0.5, temperature_degc=-20.0), soc=0.5
    )
    check_spectra(cell, [spectrum(cell, soc=0.5), cold])
    with pytest.raises(DataError, match=r"s: \|Z\| is .* as of no cell of 5 A.h; .* 30 mOhm is 0.03"):
        check_spectra(
            cell, [spectrum(cell, soc=0.5), replace(spectrum(cell, soc=0.5), z_ohm=1e3 * cold.z_ohm)]
        )


def test_a_calibration_went_on_to_its_end_where_no_spectrum_could_be_used(cell):
    check_spectra(cell, [])
    check_spectra(cell, [spectrum(cell, soc=1.05), spectrum(cell, soc=0.5)])
    with pytest.raises(DataError, match=r"s: its state of charge of 1.05 is not .* there is no other"):
        check_spectra(cell, [spectrum(cell, soc=1.05)])


def test_an_assumed_temperature_is_said_and_a_state_is_not_assumed(cell):
    (one,), told = compared_spectra(cell, [spectrum(cell, soc=0.5)])
    assert told == ("s: no temperature; the model is taken at 25 degC.",)
    assert one.ratio_error == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(DataError, match="s: the state of the cell is not known; give soc or discharged_ah"):
        compared_spectra(cell, [spectrum(cell)])


def test_a_spectrum_without_an_arc_was_written_without_a_word(tmp_path):
    said = []
    for effects, frequencies in (
        ((), "1:100:3"),
        ((), "0.01:1:4"),
        (activated([("double_layer", {})]), "1:100:3"),
    ):
        impedance_file(
            CELLS / "lg_m50_chen2020.bpx.json",
            0.5,
            frequencies,
            tmp_path / "z.csv",
            effects=effects,
            say_notes=said.extend,
        )
    (note,) = said
    assert "double layers (--effect double_layer does)" in note


def test_frequencies_at_which_the_model_says_nothing_of_a_cell_were_written_without_a_word(cell, tmp_path):
    said = []
    layer = activated([("double_layer", {})])
    file = CELLS / "lg_m50_chen2020.bpx.json"
    impedance_file(file, 0.5, "1e-9:1e9:5", tmp_path / "z.csv", effects=layer, say_notes=said.extend)
    low, high = said
    hz = slowest_diffusion_hz(cell, 0.5)
    assert low.startswith(f"2 of the frequencies lie below {hz:.2g} Hz, where the slowest diffusion")
    assert high.startswith("2 of the frequencies lie above 100 Hz")
    assert "no inductance" in high
    impedance_file(file, 0.5, "0.001:100:9", tmp_path / "z.csv", effects=layer, say_notes=said.extend)
    assert said == [low, high]
    impedance_file(file, 0.5, "0.001:1000:2", tmp_path / "z.csv", effects=layer, say_notes=said.extend)
    assert said[-1].startswith("1 of the frequencies lies above 100 Hz")


def test_spectra_of_several_states_were_computed_at_one_without_a_word(tmp_path):
    rows = "".join(f"{soc},{hz}\n" for soc in (0.2, 0.8) for hz in (10.0, 1.0, 0.1))
    (tmp_path / "eis.csv").write_text("soc,frequency_hz\n" + rows)
    said = []
    layer = activated([("double_layer", {})])
    file = CELLS / "lg_m50_chen2020.bpx.json"
    z = impedance_file(
        file, 0.5, str(tmp_path / "eis.csv"), tmp_path / "z.csv", effects=layer, say_notes=said.extend
    )
    np.testing.assert_array_equal(z[:3], z[3:])
    assert said == [
        "the file has 6 rows and 3 different frequencies: if it holds spectra of several states, the impedance of all "
        "rows is that at a state of charge of 0.5 and 25 degC."
    ]


def test_the_slowest_diffusion_is_that_of_the_larger_of_two_slow_particles(cell):
    """Rate x**2 D/R**2 with the first root x of tan x = x, 4.4934; slower in the cold by an activation energy."""
    slow = cell.with_positive(particle_radius_m=20e-6, diffusivity=Constant(1e-15), diffusivity_ea_j_mol=20e3)
    rate = 4.4934**2 * 1e-15 / (20e-6) ** 2
    assert slowest_diffusion_hz(slow, 0.5) == pytest.approx(rate / (2.0 * np.pi), rel=1e-4)
    factor = np.exp(20e3 / 8.314462618 * (1.0 / 298.15 - 1.0 / 273.15))
    assert slowest_diffusion_hz(slow, 0.5, 0.0) == pytest.approx(factor * rate / (2.0 * np.pi), rel=1e-4)
    below = slowest_diffusion_hz(slow, 0.5) / np.array([100.0, 1000.0])
    z = aesi.impedance(slow, below, 0.5)
    assert np.abs(z[1] / z[0]) == pytest.approx(10.0, rel=0.02)  # a capacity


def test_a_shift_of_the_temperature_was_left_out_of_an_impedance_without_a_word(tmp_path):
    said = []
    effects = activated([("ambient_temperature", {"shift_k": -20.0}), ("double_layer", {})])
    cell = CELLS / "nmc_30ah.bpx.json"
    impedance_file(cell, 0.5, "1:10:4", tmp_path / "z.csv", effects=effects, say_notes=said.extend)
    assert "ambient_temperature: not in the impedance, which is at the temperature that is given." in said


def test_what_an_effect_on_the_voltage_answers_later_was_left_out_without_a_word(tmp_path):
    said = []
    effects = activated([("ocv_hysteresis", {}), ("film_growth", {}), ("double_layer", {})])
    cell = CELLS / "nmc_30ah.bpx.json"
    impedance_file(cell, 0.5, "0.01:10:4", tmp_path / "z.csv", effects=effects, say_notes=said.extend)
    assert (
        "ocv_hysteresis, film_growth: only what it answers to a current at once is in the impedance." in said
    )


@pytest.mark.parametrize("text", ["1:1000:100000000", "1:1e30:10"])
def test_frequencies_without_end_killed_the_process(text):
    with pytest.raises(InputError, match=f"--frequencies {text}: at most 100,000 frequencies up to 1e.09 Hz"):
        read_frequencies(text)


@pytest.mark.parametrize(
    ("rows", "words"), [("1\n-3\n", "row 2: frequency_hz is -3"), ("", "no row below its header")]
)
def test_a_frequency_that_is_none_was_refused_without_its_file_and_row(tmp_path, rows, words):
    path = tmp_path / "f.csv"
    path.write_text(f"frequency_hz\n{rows}")
    with pytest.raises(DataError, match=f"f.csv, {words}; give positive numbers in Hz"):
        read_frequencies(str(path))


def test_a_charge_in_milliamp_hours_left_all_spectra_out_but_the_first(cell):
    full, half = spectrum(cell, discharged_ah=0.0), spectrum(cell, discharged_ah=2.5)
    check_spectra(cell, [full, half])
    with pytest.raises(
        DataError, match=r"s: 2500 A\.h were discharged of a cell of 5 A\.h; .* 500 mA\.h are 0\.5"
    ):
        check_spectra(cell, [full, replace(half, discharged_ah=2500.0)])


def test_a_file_of_spectra_was_fitted_and_was_its_own_witness(cell):
    one = spectrum(cell, soc=0.5)
    other = replace(one, name="other", z_ohm=1.01 * one.z_ohm)
    check_distinct_spectra([one], [other])
    with pytest.raises(
        DataError, match="s is there twice among the spectra to fit and those to hold the result"
    ):
        check_distinct_spectra([one, other], [one])
    with pytest.raises(
        DataError, match="s and copy hold the same rows and are both among the spectra to fit; give"
    ):
        check_distinct_spectra([one, replace(one, name="copy")])
    with pytest.raises(
        DataError, match="s is there twice among the spectra to hold the result against; give it"
    ):
        check_distinct_spectra([], [one, one])


@pytest.mark.parametrize(
    ("name", "factor"), [("freq/Hz", 1.0), ("Frequency (kHz)", 1e3), ("frequency_hz", 1.0)]
)
def test_an_instruments_frequencies_were_refused(tmp_path, name, factor):
    path = tmp_path / "f.csv"
    path.write_text(f"{name},Re(Z)/Ohm\n0.1,0.02\n10,0.01\n")
    assert read_frequencies(str(path)) == pytest.approx(factor * np.array([0.1, 10.0]))
    path.write_text("Hertz,Re(Z)/Ohm\n0.1,0.02\n")
    with pytest.raises(DataError, match="as instruments name it with its unit"):
        read_frequencies(str(path))


@pytest.mark.parametrize(
    ("of", "soc", "how", "words"),
    [
        ("lg_m50.bpx.json", 0.5, {}, "cell is the text 'lg_m50.bpx.json', not a Cell"),
        (None, 50.0, {}, "soc = 50.0 is not a state of charge"),
        (None, None, {}, "soc = None is no state of charge"),
        (None, 0.5, {"temperature_degc": 298.15}, "in kelvin? 298.15 K is 25 degC"),
        (None, 0.5, {"temperature_degc": [25.0, 26.0]}, "a cell at rest is at one temperature"),
        (None, 0.5, {"effects": ("double_layer",)}, "'double_layer'"),
    ],
)
def test_the_slowest_diffusion_refuses_what_the_impedance_does(cell, of, soc, how, words):
    sentences = []
    for asked in (
        lambda: slowest_diffusion_hz(of or cell, soc, **how),
        lambda: aesi.impedance(of or cell, [1.0], soc, **how),
    ):
        with pytest.raises(InputError) as caught:
            asked()
        sentences.append(str(caught.value))
    assert words in sentences[0]
    assert sentences[0] == sentences[1]
