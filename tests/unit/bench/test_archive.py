"""Records of the published archives: found by their names there, none of the sets, judged by chamber."""

from pathlib import PurePath

import pytest

from aesi.bench.physics import cells
from aesi.bench.physics.archive import ARCHIVE, CHARGES, archive_day, chamber, chamber_degc
from aesi.bench.physics.cells import RECORDS
from aesi.bench.physics.cells_table import archive_table
from aesi.bench.physics.tested import TESTED
from aesi.data import catalogue
from aesi.errors import DataError, InputError

PUBLISHED = {
    ("panasonic_ncr18650pf", "-20degC Trise/06-30-17_19.27 n20degC_trise_Cycle_1_Pan18650PF.mat"): (
        "n20degC_trise_cycle_1"
    ),
    (
        "panasonic_ncr18650pf",
        "Panasonic 18650PF Data/25degC/Drive cycles/03-20-17_19.27 25degC_HWFTb_Pan18650PF.mat",
    ): ("25degC_hwftb"),
    ("lg_18650hg2", "LG_HG2/n20degC/611_Mixed3.csv"): "n20degC_611_mixed3",
    ("lg_18650hg2", "n10degC/602_Cap_1C.csv"): "n10degC_602_cap_1c",
    ("panasonic_ncr18650pf", "-10degC/Charges and Pauses/06-10-17_13.07 3740_Charge1.mat"): (
        "n10degC_06-10-17_13.07_charge1"
    ),
}


@pytest.mark.parametrize(("data", "path"), PUBLISHED)
def test_a_record_is_named_as_its_file_in_the_archive(data, path):
    assert catalogue.find_set(data).record_of(PurePath(path)) == PUBLISHED[data, path]
    assert archive_day(data, PUBLISHED[data, path]) is not None


@pytest.mark.parametrize(
    "path",
    [
        "0degC/5 pulse/05-20-17_12.07 3619_dis5_10p.mat",
        "0degC/Charges and Pauses/06-01-17_13.37 3686_Pause3.mat",
        "README.md",
        "25degC_us06.csv.gz",
    ],
)
def test_other_files_of_an_archive_are_no_records(path):
    assert all(catalogue.find_set(data).record_of(PurePath(path)) is None for data in ARCHIVE)


def test_a_record_is_found_in_an_unpacked_archive(tmp_path, monkeypatch):
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    inside = tmp_path / "lg_18650hg2" / "LG_HG2" / "n20degC"
    inside.mkdir(parents=True)
    (inside / "611_Mixed3.csv").write_text("")
    assert catalogue.locate("lg_18650hg2", "n20degC_611_mixed3") == inside / "611_Mixed3.csv"
    with pytest.raises(DataError, match="there are: n20degC_611_mixed3"):
        catalogue.locate("lg_18650hg2", "n20degC_611_mixed4")
    out = catalogue.get("lg_18650hg2", tmp_path / "out")
    assert (out / "LG_HG2" / "n20degC" / "611_Mixed3.csv").is_file()


def test_no_record_of_an_archive_is_one_of_the_sets_or_entered_a_calibration():
    known = {(record.data, record.name) for record in RECORDS}
    for kind in (ARCHIVE, CHARGES):
        assert not known & {(data, name) for data, days in kind.items() for name in days}
        assert all(not set(days) & set(TESTED[data]) for data, days in kind.items())


def test_the_day_of_a_charge_is_in_the_name_of_its_file():
    for days in CHARGES.values():
        for name, day in days.items():
            year, month, of_month = day.split("-")
            assert name.split("_")[1] == f"{month}-{of_month}-{year[2:]}"


@pytest.mark.parametrize("kind", ["archive", "charges"])
def test_rules_are_chosen_on_one_half_of_an_archive_and_judged_on_the_other(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("AESI_DATA", str(tmp_path))  # no record is here, and each gets its row all the same

    def names(development):
        return [
            (row["cell"], row["record"])
            for row in cells.run(**{kind: True}, development=development)
            if not row.get("summary")
        ]

    half, other = names(True), names(False)
    assert not set(half) & set(other)
    assert set(half) | set(other) == set(names(None))
    first, second = {
        "archive": (("lg_18650hg2", "40degC_556_us06"), ("panasonic_ncr18650pf", "25degC_hwftb")),
        "charges": (
            ("panasonic_ncr18650pf", "25degC_03-12-17_11.58_charge_2"),
            ("panasonic_ncr18650pf", "25degC_03-19-17_06.31_charge2"),
        ),
    }[kind]
    assert first in half
    assert second in other
    with pytest.raises(InputError, match="two sets of records"):
        next(cells.run(archive=True, charges=True))
    with pytest.raises(InputError, match="add --set archive=true"):
        next(cells.run(development=True))


def test_files_fitted_to_other_records_of_a_cell_stand_beside_its_own(tmp_path, monkeypatch):
    row = {"cell": "c", "record": "0degC_us06", "mean_degc": 1.0, "ran_out": {}, "with_temperature_mv": 20.0}
    lines = archive_table([{**row, "declared_mv": 90.0, "aged_mv": 10.0, "alone_mv": 40.0}])
    shown = "declared | fitted at 25 °C alone | with temperature | aged"
    assert lines[0] == f"| cell | chamber | records | {shown} | ran out |"
    assert lines[2] == "| c | 0 degC | 1 | 90.0 / 90.0 | 40.0 / 40.0 | 20.0 / 20.0 | 10.0 / 10.0 |  |"
    monkeypatch.setattr(cells, "judged", lambda *_: judged.pop(0))
    judged = [
        {"with_temperature_mv": 10.0, "cold_mv": 3.0, "fitted": False, "fitted_mv": ["cold_mv"]},
        {"with_temperature_mv": 40.0, "cold_mv": 8.0, "fitted": False},
    ]
    *_, summary = cells.run(only=["10degC_hppc", "0degC_hppc"])
    assert summary["geometric_mean_mv"] == {"with_temperature_mv": 20.0, "cold_mv": 8.0}


def test_the_table_holds_median_and_worst_of_each_chamber_coldest_first():
    def row(record, mv, **more):
        figures = {"declared_mv": 10 * mv, "with_temperature_mv": mv, "aged_mv": mv - 1.0}
        return {"cell": "c", "record": record, "mean_degc": -5.0, "ran_out": {}, **figures, **more}

    rows = [
        row("0degC_us06", 20.0),
        row("n20degC_la92", 30.0, ran_out={"with_temperature": 7.0}),
        row("n20degC_udds", 50.0),
        row("n20degC_trise_cycle_1", 5.0),
        {"cell": "c", "record": "n20degC_nn", "error": "not here"},
    ]
    lines = archive_table(rows)
    assert lines[2:5] == [
        "| c | -20 degC | 2 | 400.0 / 500.0 | 40.0 / 50.0 | 39.0 / 49.0 | 1 |",
        "| c | -20 degC, rising | 1 | 50.0 / 50.0 | 5.0 / 5.0 | 4.0 / 4.0 |  |",
        "| c | 0 degC | 1 | 200.0 / 200.0 | 20.0 / 20.0 | 19.0 / 19.0 |  |",
    ]
    assert "    | c | n20degC_la92 | -5.0 | 300.0 | 30.0 (ran out at 7 s) | 29.0 |" in lines
    cold = archive_table(
        [
            row("n20degC_la92", 30.0, cold_mv=9.0, fitted_mv=["cold_mv"]),
            row("n20degC_udds", 50.0, cold_mv=20.0, fitted_mv=[]),
        ]
    )
    assert cold[2] == "| c | -20 degC | 2 | 400.0 / 500.0 | 40.0 / 50.0 | 39.0 / 49.0 | 20.0 / 20.0 |  |"
    assert "    | c | n20degC_la92 | -5.0 | 300.0 | 30.0 | 29.0 | 9.0 (fitted) |" in cold
    assert not any("n20degC_nn" in line for line in lines)
    assert (chamber("n20degC_trise_us06"), chamber_degc("n20degC_trise_us06"), chamber_degc("10degC_nn")) == (
        "-20 degC, rising",
        -20.0,
        10.0,
    )
