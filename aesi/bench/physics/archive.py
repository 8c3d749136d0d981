"""Records of the published archives that were held out of all calibrations and choices: tests of the cell files.

The archive of a cell, as its authors publish it, has more records than the data set of the catalogue: other drives and
other chamber temperatures of the same cell. No record below was looked at when the shipped cell files, the rules of a
calibration and their constants were made, but for the development half of `aesi bench cells`; the file fitted in the
cold was fitted to two of that half.
`aesi.data.catalogue.locate` finds the records in an unpacked archive by the names below. The day of a record is the
first time stamp of its published file.
"""

from __future__ import annotations

from collections.abc import Mapping

from aesi.data.catalogue import HG2, PANASONIC

ARCHIVE: Mapping[str, Mapping[str, str]] = {
    HG2: {
        "40degC_556_us06": "2018-11-06",
        "40degC_557_cap_1c": "2018-11-07",
        "40degC_562_mixed4": "2018-11-08",
        "40degC_562_mixed5": "2018-11-08",
        "40degC_562_mixed6": "2018-11-08",
        "40degC_562_mixed7": "2018-11-08",
        "40degC_562_mixed8": "2018-11-08",
        "10degC_571_cap_1c": "2018-11-14",
        "10degC_575_c20disch": "2018-11-17",
        "10degC_576_cap_1c": "2018-11-19",
        "0degC_589_cap_1c": "2018-11-29",
        "0degC_589_us06": "2018-11-30",
        "n10degC_593_c20disch": "2018-12-05",
        "n10degC_601_us06": "2018-12-15",
        "n10degC_602_cap_1c": "2018-12-15",
        "n10degC_604_mixed3": "2018-12-18",
        "n10degC_604_mixed6": "2018-12-18",
        "n10degC_604_mixed7": "2018-12-18",
        "n20degC_607_c20disch": "2018-12-22",
        "n20degC_610_cap_1c": "2018-12-24",
        "n20degC_610_la92": "2018-12-24",
        "n20degC_610_mixed1": "2018-12-25",
        "n20degC_610_mixed2": "2018-12-25",
        "n20degC_610_us06": "2018-12-25",
        "n20degC_611_cap_1c": "2018-12-25",
        "n20degC_611_mixed3": "2018-12-25",
        "n20degC_611_mixed4": "2018-12-26",
        "n20degC_611_mixed5": "2018-12-26",
        "n20degC_611_mixed6": "2018-12-26",
        "n20degC_611_mixed7": "2018-12-26",
        "n20degC_611_mixed8": "2018-12-26",
    },
    PANASONIC: {
        "25degC_cycle_4": "2017-03-19",
        "25degC_hwftb": "2017-03-20",
        "25degC_nn": "2017-03-21",
        "10degC_cycle_2": "2017-03-28",
        "10degC_cycle_3": "2017-04-05",
        "10degC_cycle_4": "2017-04-05",
        "10degC_hwfet": "2017-04-06",
        "10degC_la92": "2017-04-06",
        "10degC_nn": "2017-04-09",
        "10degC_trise_cycle_1": "2017-07-09",
        "10degC_trise_cycle_2": "2017-07-10",
        "10degC_trise_cycle_3": "2017-07-10",
        "10degC_trise_cycle_4": "2017-07-10",
        "10degC_us06": "2017-04-06",
        "0degC_cycle_2": "2017-05-30",
        "0degC_cycle_3": "2017-06-01",
        "0degC_cycle_4": "2017-06-01",
        "0degC_hwfet": "2017-06-02",
        "0degC_la92": "2017-06-02",
        "0degC_nn": "2017-06-03",
        "0degC_udds": "2017-06-02",
        "0degC_us06": "2017-06-02",
        "n10degC_cycle_2": "2017-06-10",
        "n10degC_cycle_3": "2017-06-11",
        "n10degC_cycle_4": "2017-06-11",
        "n10degC_hwfet": "2017-06-11",
        "n10degC_la92": "2017-06-12",
        "n10degC_nn": "2017-06-14",
        "n10degC_udds": "2017-06-12",
        "n10degC_us06": "2017-06-11",
        "n20degC_cycle_1": "2017-06-24",
        "n20degC_cycle_2": "2017-06-24",
        "n20degC_cycle_3": "2017-06-24",
        "n20degC_cycle_4": "2017-06-25",
        "n20degC_hwfet": "2017-06-25",
        "n20degC_la92": "2017-06-26",
        "n20degC_nn": "2017-06-26",
        "n20degC_trise_cycle_1": "2017-06-30",
        "n20degC_trise_cycle_2": "2017-07-01",
        "n20degC_trise_cycle_3": "2017-07-01",
        "n20degC_trise_cycle_4": "2017-07-01",
        "n20degC_trise_us06": "2017-07-01",
        "n20degC_udds": "2017-06-25",
        "n20degC_us06": "2017-06-25",
    },
}
"""Data set -> record -> day of the test, YYYY-MM-DD."""


def for_development(data: str, record: str) -> bool:
    """Whether rules and constants may be chosen on a record of an archive: every second one of a cell, beginning with
    the first. False for a record that is not of the archives."""
    names = list(ARCHIVE.get(data, ()))
    return record in names and names.index(record) % 2 == 0


def chamber(record: str) -> str:
    """The chamber temperature that the name of a record gives, in words: `-20 degC`, or `-20 degC, rising` if the
    chamber warms up during the test."""
    rising = ", rising" if record.partition("_")[2].startswith("trise") else ""
    return f"{chamber_degc(record):g} degC{rising}"


def chamber_degc(record: str) -> float:
    """The chamber temperature that the name of a record gives, degC (`n20degC_us06`: -20)."""
    number = record.partition("degC")[0]
    return -float(number[1:]) if number.startswith("n") else float(number)
