"""The day on which each measured record was tested, and the state of health of the cell on that day.

The state of health is that of `Cell.soh_on`. A day before the first or after the last one that the cell file knows is
taken as the first or the last. The dates of the Panasonic NCR18650PF are in the names of its published files. Those of
the LG 18650HG2 are the first time stamps of its published files; for 25degC_la92, mixed1 to mixed3, 40degC_la92 and
0degC_mixed1 they are the day of the neighbouring tests of the same series. The dates are part of the data, as
temperatures are; no fit chose them.
"""

from __future__ import annotations

from datetime import date

from aesi.bench.physics.archive import archive_day
from aesi.data.catalogue import HG2, PANASONIC
from aesi.physics import Cell

TESTED = {
    PANASONIC: {
        "25degC_1c_start": "2017-03-09",
        "25degC_hppc": "2017-03-11",
        "25degC_cycle_1": "2017-03-18",
        "25degC_cycle_2": "2017-03-19",
        "25degC_cycle_3": "2017-03-19",
        "25degC_us06": "2017-03-20",
        "25degC_hwfet": "2017-03-20",
        "25degC_la92": "2017-03-21",
        "10degC_hppc": "2017-03-27",
        "10degC_cycle_1": "2017-03-28",
        "25degC_c20_ocv": "2017-05-08",
        "0degC_hppc": "2017-05-20",
        "0degC_cycle_1": "2017-05-30",
        "n10degC_hppc": "2017-06-07",
        "n10degC_cycle_1": "2017-06-10",
    },
    HG2: {
        "25degC_c20_ocv": "2018-10-26",
        "25degC_cap_1c": "2018-10-28",
        "25degC_la92": "2018-10-29",
        "25degC_us06": "2018-10-29",
        "25degC_mixed1": "2018-10-29",
        "25degC_mixed2": "2018-10-29",
        "25degC_cap_1c_b": "2018-10-30",
        "25degC_mixed3": "2018-10-30",
        "40degC_c20_ocv": "2018-11-03",
        "40degC_la92": "2018-11-06",
        "10degC_us06": "2018-11-13",
        "0degC_c20_ocv": "2018-11-27",
        "0degC_mixed1": "2018-11-30",
        "n10degC_cap_1c": "2018-12-07",
    },
}
"""Data set -> record -> day of the test, YYYY-MM-DD."""


def soh_on_its_day(cell: Cell, data: str, record: str) -> float | None:
    """State of health of the cell on the day of a record, as a share of the file's capacity; None if the day of the
    record is unknown or the file has no dated states of health."""
    day = TESTED.get(data, {}).get(record) or archive_day(data, record)
    known = [one for _, one in cell.tested_on]
    if day is None or not known:
        return None
    return cell.soh_on(min(max(date.fromisoformat(day), min(known)), max(known)))
