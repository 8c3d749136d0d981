"""Records of the published archives that were held out of all calibrations and choices: tests of the cell files.

The archive of a cell, as its authors publish it, has more records than the data set of the catalogue: other drives and
other chamber temperatures of the same cell. No record below was looked at when the shipped cell files, the rules of a
calibration and their constants were made, but for the development half of `aesi bench cells`; the file fitted in the
cold was fitted to two of that half.
`aesi.data.catalogue.locate` finds the records in an unpacked archive by the names below. The day of a record is the
first time stamp of its published file.

Beside the drives the archive of the Panasonic has the charges between them, of which none entered a calibration.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime

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

CHARGES: Mapping[str, Mapping[str, str]] = {
    PANASONIC: {
        name: datetime.strptime(name.split("_")[1], "%m-%d-%y").date().isoformat()
        for name in (
            "25degC_03-12-17_11.58_charge_2",
            "25degC_03-19-17_06.31_charge2",
            "25degC_03-19-17_11.59_charge3",
            "25degC_03-19-17_17.53_charge4",
            "25degC_03-20-17_03.05_charge1",
            "25degC_03-20-17_08.04_charge2",
            "25degC_03-20-17_21.35_charge2",
            "25degC_03-21-17_06.44_charge3",
            "25degC_03-21-17_13.34_charge4",
            "25degC_03-21-17_19.43_charge5",
            "25degC_04-29-17_13.07_charge2a",
            "10degC_03-28-17_09.49_charge2a",
            "10degC_03-28-17_15.29_charge1",
            "10degC_04-05-17_14.13_charge2",
            "10degC_04-05-17_19.54_charge3",
            "10degC_04-06-17_01.36_charge4",
            "0degC_05-21-17_09.52_charge2a",
            "0degC_05-30-17_07.44_charge2a",
            "0degC_05-30-17_15.23_charge1",
            "0degC_06-01-17_10.37_charge2",
            "0degC_06-01-17_17.21_charge3",
            "0degC_06-02-17_00.13_charge4",
            "0degC_06-02-17_06.00_charge5",
            "0degC_06-02-17_12.24_charge6",
            "0degC_06-02-17_20.49_charge7",
            "n10degC_06-08-17_10.21_charge1a",
            "n10degC_06-10-17_05.35_charge2a",
            "n10degC_06-10-17_13.07_charge1",
            "n10degC_06-10-17_20.16_charge2",
            "n10degC_06-11-17_03.15_charge3",
            "n20degC_06-24-17_05.54_charge1",
            "n20degC_06-24-17_13.23_charge2",
            "n20degC_06-24-17_20.54_charge3",
            "n20degC_06-25-17_04.26_charge4",
            "n20degC_06-25-17_11.16_charge5",
        )
    },
}
"""Data set -> charge at 1C and then at 4.2 V -> day of the test, YYYY-MM-DD, as the name has it. Those that begin below
3.7 V and can be read whole. The chamber is that of the tests around it; it was warmed for the charge."""


def archive_day(data: str, record: str) -> str | None:
    """Day of the test of a record of an archive, YYYY-MM-DD; None for one that is not of the archives."""
    return ARCHIVE.get(data, {}).get(record) or CHARGES.get(data, {}).get(record)


def for_development(data: str, record: str) -> bool:
    """Whether rules and constants may be chosen on a record of an archive: every second drive or charge of a cell,
    beginning with the first. False for a record that is not of the archives."""
    of_one_kind = (list(kind.get(data, ())) for kind in (ARCHIVE, CHARGES))
    return any(record in names and names.index(record) % 2 == 0 for names in of_one_kind)


def chamber(record: str) -> str:
    """The chamber temperature that the name of a record gives, in words: `-20 degC`, or `-20 degC, rising` if the
    chamber warms up during the test."""
    rising = ", rising" if record.partition("_")[2].startswith("trise") else ""
    return f"{chamber_degc(record):g} degC{rising}"


def chamber_degc(record: str) -> float:
    """The chamber temperature that the name of a record gives, degC (`n20degC_us06`: -20)."""
    number = record.partition("degC")[0]
    return -float(number[1:]) if number.startswith("n") else float(number)
