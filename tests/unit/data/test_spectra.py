"""Impedance spectra on disk: which rows are one spectrum, and what is refused."""

import pytest

from aesi.data import read_spectra
from aesi.errors import DataError

COLUMNS = "frequency_hz,z_real_ohm,z_imag_ohm"
POINTS = ("100,0.010,-0.001", "10,0.011,-0.002")


def written(folder, header, *rows):
    path = folder / "cell.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_rows_of_one_state_are_one_spectrum(tmp_path):
    rows = [f"{point},{soc}" for soc in (0.5, 0.4) for point in POINTS]
    high, low = read_spectra(written(tmp_path, f"{COLUMNS},soc", *rows))
    assert (high.soc, low.soc) == (0.5, 0.4)
    assert high.frequency_hz.tolist() == low.frequency_hz.tolist() == [100.0, 10.0]
    assert high.z_ohm.tolist() == [0.01 - 0.001j, 0.011 - 0.002j]


@pytest.mark.parametrize("names", [("1", "2"), ("cold", "warm")])
def test_spectra_of_one_state_are_told_apart_by_their_names(tmp_path, names):
    rows = [
        f"{name},{point},0.5,{degc}" for name, degc in zip(names, (0, 25), strict=True) for point in POINTS
    ]
    cold, warm = read_spectra(written(tmp_path, f"spectrum,{COLUMNS},soc,temperature_degc", *rows))
    assert (cold.temperature_degc, warm.temperature_degc) == (0.0, 25.0)
    assert len(cold.frequency_hz) == len(warm.frequency_hz) == 2


@pytest.mark.parametrize("again", [(), ("10,0.011,-0.002",)], ids=["a sweep", "with a frequency twice"])
def test_a_state_that_is_counted_cut_a_spectrum_into_one_a_row(tmp_path, again):
    points = [*POINTS, *again, "1,0.012,-0.003", "0.1,0.013,-0.004"]
    rows = [f"{p},{ah + 1e-6 * k}" for ah in (0.5, 0.7) for k, p in enumerate(points)]
    high, low = read_spectra(written(tmp_path, f"{COLUMNS},discharged_ah", *rows))
    assert (high.discharged_ah, low.discharged_ah) == (0.5, 0.7)
    assert len(high.frequency_hz) == len(low.frequency_hz) == len(points)


@pytest.mark.parametrize("state", ["soc", "discharged_ah"])
def test_rows_of_several_spectra_that_alternate_are_refused(tmp_path, state):
    rows = [f"{point},{at}" for point in POINTS for at in (0.5, 0.4)]
    with pytest.raises(
        DataError, match=rf"row 3 \(line 4\), column {state}: 0.5, .* began at 0.4; put the rows"
    ):
        read_spectra(written(tmp_path, f"{COLUMNS},{state}", *rows))


def test_spectra_of_several_temperatures_were_taken_for_one_of_their_mean(tmp_path):
    rows = [f"{point},0.5,{degc}" for degc in (0, 25) for point in POINTS]
    with pytest.raises(
        DataError, match=r"row 3 \(line 4\): 100 Hz is there a second time .* column spectrum"
    ):
        read_spectra(written(tmp_path, f"{COLUMNS},soc,temperature_degc", *rows))


@pytest.mark.parametrize(
    "rest", [("99,0.012,-0.001", "9.9,0.013,-0.002"), ("9.9,0.013,-0.002", "99,0.012,-0.001")]
)
def test_spectra_of_two_temperatures_were_merged_where_their_frequencies_differ_slightly(tmp_path, rest):
    rows = [f"{point},0.5,{degc}" for degc, points in ((25, POINTS), (10, rest)) for point in points]
    row = 3 if rest[0].startswith("99") else 4
    with pytest.raises(
        DataError, match=rf"row {row} .*: the frequencies turn back .* name each in a column spectrum"
    ):
        read_spectra(written(tmp_path, f"{COLUMNS},soc,temperature_degc", *rows))


def test_a_frequency_out_of_order_is_still_of_one_sweep(tmp_path):
    rows = [f"{hz},0.010,-0.001,0.5" for hz in (100, 10, 12, 1, 0.1)]
    (one,) = read_spectra(written(tmp_path, f"{COLUMNS},soc", *rows))
    assert one.frequency_hz.tolist() == [100.0, 10.0, 12.0, 1.0, 0.1]


def test_a_spectrum_in_kelvin_ended_a_calibration_after_its_fit_with_nothing_written(tmp_path):
    rows = [f"{point},0.5,{kelvin}" for point, kelvin in zip(POINTS, (25, 298.15), strict=True)]
    with pytest.raises(
        DataError, match=r"row 2 \(line 3\), column temperature_degc: 298.15 degC .*in kelvin"
    ):
        read_spectra(written(tmp_path, f"{COLUMNS},soc,temperature_degc", *rows))


def test_a_file_without_a_row_is_one_sentence(tmp_path):
    with pytest.raises(DataError, match="no row below its header"):
        read_spectra(written(tmp_path, f"{COLUMNS},soc"))


@pytest.mark.parametrize(
    ("header", "row", "told"),
    [
        (COLUMNS, POINTS[0], "no column soc or discharged_ah"),
        (f"{COLUMNS},soc", "0,0.01,-0.001,0.5", "a frequency has to be positive"),
        (f"{COLUMNS},soc", "10,,-0.001,0.5", r"row 1 \(line 2\), column z_real_ohm: not a number"),
    ],
)
def test_what_is_no_spectrum_is_refused(tmp_path, header, row, told):
    with pytest.raises(DataError, match=told):
        read_spectra(written(tmp_path, header, row))


def test_spectra_of_two_files_were_called_alike_by_what_is_before_the_first_point(tmp_path):
    for name in ("W8_0.2.csv", "W8_0.5.csv"):
        (tmp_path / name).write_text(f"{COLUMNS},soc\n{POINTS[0]},0.5\n")
    names = [read_spectra(tmp_path / name)[0].name for name in ("W8_0.2.csv", "W8_0.5.csv")]
    assert names == ["W8_0.2 1", "W8_0.5 1"]


@pytest.mark.parametrize(
    ("header", "rows"),
    [
        ("freq/Hz\tRe(Z)/Ohm\t-Im(Z)/Ohm\tsoc", ("100\t0.010\t0.001\t0.5", "10\t0.011\t0.002\t0.5")),
        ("soc,Frequency (kHz),Z' (mOhm),Z'' (mOhm)", ("0.5,0.1,10,-1", "0.5,0.01,11,-2")),
        ("frequency_hz,z_real_mohm,z_imag_mohm,soc", ("100,10,-1,0.5", "10,11,-2,0.5")),
        ("Freq,Zreal,Zimag,soc", ("Hz,mOhm,mOhm,-", "100,10,-1,0.5", "10,11,-2,0.5")),
    ],
)
def test_instruments_names_are_taken_with_their_units(tmp_path, header, rows):
    (one,) = read_spectra(written(tmp_path, header, *rows))
    assert one.frequency_hz.tolist() == pytest.approx([100.0, 10.0])
    assert one.z_ohm.tolist() == pytest.approx([0.01 - 0.001j, 0.011 - 0.002j])


@pytest.mark.parametrize(
    ("name", "cell"),
    [("Temperature/°C", "0.5"), ("T1 (K)", "273.65"), ("Temp [degF]", "32.9"), ("Temperature_degC", "0.5")],
)
def test_a_temperature_under_an_instruments_name_was_passed_over_and_25_degc_taken(tmp_path, name, cell):
    rows = [f"{point},0.5,{cell}" for point in POINTS]
    (one,) = read_spectra(written(tmp_path, f"{COLUMNS},soc,{name}", *rows))
    assert one.temperature_degc == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("Temperature", "'Temperature' says no known unit; write it behind the name"),
        (
            "T1/°C,T2/°C",
            "'T1/°C', 'T2/°C' may be the cell's temperature; call the one that is temperature_degc",
        ),
        ("T_chamber/°C", "'T_chamber/°C' may be the cell's temperature"),
    ],
)
def test_a_temperature_of_a_spectrum_that_cannot_be_told_is_asked_about(tmp_path, names, told):
    rows = [f"{point},0.5{',5' * len(names.split(','))}" for point in POINTS]
    with pytest.raises(DataError, match=told):
        read_spectra(written(tmp_path, f"{COLUMNS},soc,{names}", *rows))


@pytest.mark.parametrize("name", ["Zreal1", "Zreal1/MOhm"])
def test_an_impedance_without_a_unit_is_told_where_it_belongs(tmp_path, name):
    """As Digatron writes it, below a line of units that names the test."""
    rows = ("[Hz];[EIS];[EIS];[1]", "100;10;-1;0.5", "10;11;-2;0.5")
    with pytest.raises(DataError, match=f"'{name}', 'Zimg1' say no known unit; write it behind the name"):
        read_spectra(written(tmp_path, f"ActFreq;{name};Zimg1;soc", *rows))


def test_what_a_spectrum_lacks_is_told_with_what_is_there(tmp_path):
    with pytest.raises(
        DataError, match=r"no column frequency_hz; .* It has: 'Hertz', 'Re\(Z\)/Ohm', '-Im\(Z\)/Ohm'\."
    ):
        read_spectra(written(tmp_path, "Hertz,Re(Z)/Ohm,-Im(Z)/Ohm", *POINTS))
    with pytest.raises(DataError, match=r"'freq/Hz' and 'Freq \(Hz\)'; rename all but one of them"):
        read_spectra(written(tmp_path, "freq/Hz,Freq (Hz),Re(Z)/Ohm,-Im(Z)/Ohm", f"1,{POINTS[0]}"))


def test_of_a_column_that_is_there_twice_the_first_was_taken_without_a_word(tmp_path):
    with pytest.raises(DataError, match="has 2 columns named 'soc'; rename all but one"):
        read_spectra(written(tmp_path, f"{COLUMNS},soc,soc", f"{POINTS[0]},0.5,0.6"))


def test_an_imaginary_part_as_nyquist_plots_have_it_was_drawn_the_wrong_way_up(tmp_path):
    rows = ("100,0.010,-0.001,0.5", "0.1,0.011,0.002,0.5", "0.01,0.012,0.004,0.5")
    with pytest.raises(DataError, match=r"row 2 \(line 3\), column z_imag_ohm: .* turn its sign"):
        read_spectra(written(tmp_path, f"{COLUMNS},soc", *rows))


def test_an_imaginary_part_with_the_wrong_sign_was_read_where_the_sweep_ends_at_1_hz(tmp_path):
    rows = ("100,0.010,-0.001,0.5", "10,0.011,0.002,0.5", "1,0.012,0.004,0.5")
    with pytest.raises(
        DataError, match=r"row 2 \(line 3\), column z_imag_ohm: .* up to 10 Hz, .* turn its sign"
    ):
        read_spectra(written(tmp_path, f"{COLUMNS},soc", *rows))
