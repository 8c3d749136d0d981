"""Whether a record can be of the cell that a file declares, for every command that simulates or fits one.

A voltage far beyond the file's limits is another cell's. At every row the voltage bounds the state of charge: the cell
rests within a drop d of it that no cell exceeds, so that its state of charge lies between z- = z(V - d) and
z+ = z(V + d), with z(U) the inverse of the open-circuit voltage of the file:

    d = (DROP_V + DROP_V_PER_C i + v) (1 + (COLD_FACTOR - 1) c)                    (1)
    i = max(|I|, AFTER_SHARE I') / C_nominal       1/h; I' the largest current of the AFTER_S before          (2)
    c = (COLD_DEGC - T) / COLD_SPAN_K, held within 0 and MOST_SPANS                (3)

v is what the current drops at the contacts and films of the file beyond OHMIC_V_PER_C: of a cell that was calibrated
with its leads they take most of its drop. |I| is the largest within ROWS_APART. (Where the current is turned, what I'
left counts less by it, on the side that it left alone.) The charge Q_ij that leaves the cell between two rows bounds
the capacity C from both sides, and a declared capacity well outside these bounds is another cell's, or the record's
current or time is in another unit:

    Q_ij / max(z+_i - z-_j, FEWEST_SOC) <= C <= Q_ij / (z-_i - z+_j)               (4)

the upper one where z-_i - z+_j > TELLING_SOC, both where Q_ij is more than TELLING_SHARE of the charge moved.

What a limit decides was measured on 36 records of four cells (-10 to 40 degC, from C/20 to drives and pulses), each
with its own cell's file and with those of the three others, one limit moved at a time. As the limits are, the records
want 1/1.06 to 1.06 times the capacity of their own file, and 51 of the 108 pairs with another's are refused.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d

from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.numerics.typing import Array, IntArray
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.records import Measurement
from aesi.records.checked import row_words

VOLTAGE_MARGIN_V = 0.3
"""Beyond the voltage limits of the file that a record may go: fast pulses and old cells do."""
SOC_MARGIN = 0.12
"""Beyond full and empty, by the declared capacity: new cells hold more than they are sold for."""
ROWS = 300
"""Of a record that are looked at, evenly spread: each pair of them bounds the capacity."""
TELLING_SHARE = 0.3
"""Of the charge moved: less between two rows is within hysteresis and relaxation. With 0.2 a record wants 1.24 times
the capacity of its own file, with 0.1 two are refused by theirs."""
TELLING_SOC = 0.1
"""State of charge that two voltages have to be apart for an upper bound: less is of the size of what the file's
open-circuit voltage is off. Of 6,075 records and pieces of them, 10 min to 5 h long, with their own cell's file it
bounds 315, and allows at least 0.53 of the capacity; 0.07 allows 0.47, which is refused, and 0.25 bounds 195 and let
time in minutes pass of a discharge by a quarter between two rests."""
FEWEST_SOC = 0.02
"""State of charge that two voltages are at least apart for a lower bound, which equal voltages would otherwise make
infinite. A convention: from 0.005 to 0.1 no measured record is judged otherwise."""
DROP_V = 0.06
"""V, of a warm cell without a current: hysteresis, slow diffusion and what the file's open-circuit voltage is off. The
measured records stay within 0.05 V; with 0.03 a C/20 discharge is refused by its own file."""
DROP_V_PER_C = 0.25
"""V h, of a warm cell per C-rate. The measured records stay within 0.2 V; with 0.15 the pulses of an LG M50T are
refused by their own file."""
OHMIC_V_PER_C = 0.06
"""V h, per C-rate, of the contacts and films of a file: DROP_V_PER_C holds so much of them, 0.053 at most in the files
that the measured records were judged by. A cell on two wires of 0.15 ohm has 0.35."""
COLD_DEGC = 15.0
"""Above it a cell is warm: with 5 a drive at 0 degC wants 1/1.11 times the capacity of its own file, with 10 or 25 no
measured record more than now."""
COLD_SPAN_K = 25.0
"""K below COLD_DEGC at which the drop is COLD_FACTOR times that of a warm cell: at -10 degC, the coldest of the
records. From 15 to 50 no measured record is judged otherwise."""
COLD_FACTOR = 4.0
"""Times the drop of a warm cell, within which the measured records stay one span below COLD_DEGC. With 1 a discharge of
an LG 18650HG2 at -10 degC is refused by its own file; with 8 two more pairs with another cell's file pass."""
MOST_SPANS = 2.0
"""Spans below COLD_DEGC that count, down to -35 degC. A convention: the measured records reach one span."""
AFTER_S = 1800.0
"""s that a current is felt after it, by slow diffusion. With 0 a drive at 0 degC is refused by its own file, from 300
to 3600 no measured record is judged otherwise."""
ROWS_APART = 1
"""By which loggers write a current beside another row's voltage: the largest current within them is what flowed. With 0
the pulses of an 18650 are refused by its own file for one row, of 0 A beside the voltage under 4.6 A."""
AFTER_SHARE = 0.3
"""Of the largest current of that time, which counts as if it flowed still. With 0 a drive at 0 degC is refused by its
own file, with 0.15 a record wants 1.1 times the capacity of its own; from 0.3 to 1 none is judged otherwise."""
TOO_LARGE = 2.0
"""Times what the record allows, that the declared capacity may be: a cell may have lost half of it. A convention; the
measured records allow at least 1/1.06 of the capacity of their own file."""
TOO_SMALL = 1.25
"""Times the declared capacity, that the record may want: batches differ by less. The measured records want at most 1.06
times the capacity of their own cell's file, the drive of an LG M50T 1.31 times that of a Panasonic NCR18650PF."""
ABOVE_FULL_V = 0.1
"""A voltage at rest further above that of a full cell belongs to another chemistry."""
MOST_C_RATE = 100.0
"""Of a current without a voltage in every row: the pulses that cells are sold for are of 50C at most, a drive in mA is
of 1000C and more."""
MOST_CAPACITIES = 10.0
"""Of a cell, that may flow one way: a schedule asks for several where a start or a capacity is wrong, one in ms for a
thousand times what it is."""
SMALL_C_RATE = 0.1
"""Below it a cell all but rests."""
CONVERTED, DECLARED = " was converted from ", " as declared"
"""In a reader's note on a unit that the user gave, which is the first suspect where a charge is that of no cell."""
SOC_GRID = 1201
"""States of charge at which a voltage is looked up."""
BEYOND_SOC = 0.1
"""What a voltage beyond the window stands for."""


@dataclass(frozen=True)
class CapacityBounds:
    """low_ah, high_ah : between them lies the capacity of any cell with these open-circuit potentials.
    low_rows, high_rows : the two rows, the fuller first, whose voltages and charge bound it from there, if any do.
    """

    low_ah: float
    high_ah: float
    low_rows: tuple[int, int] | None = None
    high_rows: tuple[int, int] | None = None


def check_voltage(cell: Cell, data: Measurement) -> None:
    """Raises DataError where the voltage leaves what the cell file admits."""
    low, high = cell.lower_voltage_v - VOLTAGE_MARGIN_V, cell.upper_voltage_v + VOLTAGE_MARGIN_V
    outside = np.flatnonzero((data.voltage_v < low) | (data.voltage_v > high))
    if len(outside):
        row = int(outside[0])
        like = f"; rows like it: {len(outside):,}" if len(outside) > 1 else ""
        raise DataError(
            f"{data.name}: {data.voltage_v[row]:.3f} V at {stamp(data.time_s[row])} s ({row_words(row)}{like}) is "
            f"outside the range of {cell.name} ({cell.lower_voltage_v:g} to {cell.upper_voltage_v:g} V): the record "
            "and the cell file are of different cells, or the row is no measurement of the cell."
        )


def check_measured(cell: Cell, records: Sequence[Measurement], known: Collection[int] = ()) -> None:
    """As `check_belongs`, and of every row of its voltage: for what fits a record or is judged on it, where a
    simulation needs only its current.

    known : of the records, the numbers of those whose full discharge the cell has its capacity from. What their
    voltages want beside that is no other size but what the potentials of the file are off, which a fit moves: it is
    allowed to all records, unless nobody said how warm they were and the cold would explain it.
    """
    slack = Slack()
    for number in known:
        record = records[number]
        if not (record.temperature_degc is None and _of_the_cold(cell, record)):
            slack = slack.with_what(cell, record)
    for record in records:
        _check_window(cell, record)
        check_voltage(cell, record)
        if np.all(np.isfinite(record.voltage_v)):
            _check_capacity(cell, record, slack)


@dataclass(frozen=True)
class Slack:
    """By how much the potentials of a file alone make a record want another capacity than its cell is known to have.

    more, less : times the known capacity, at least 1 and at most 1.
    """

    more: float = 1.0
    less: float = 1.0

    def with_what(self, cell: Cell, record: Measurement) -> Slack:
        """Widened to what a record of a cell of known capacity wants."""
        bounds, known = capacity_bounds(cell, record), _capacity_ah(cell)
        return Slack(max(self.more, bounds.low_ah / known), min(self.less, bounds.high_ah / known))


def unlike(cell: Cell, record: Measurement) -> str:
    """A sentence where the voltages of a full discharge, which the cell has its capacity from, want another one by the
    potentials of its file; '' where they do not."""
    if not np.all(np.isfinite(record.voltage_v)) or _capacity_fault(cell, record) is None:
        return ""
    bounds, known = capacity_bounds(cell, record), _capacity_ah(cell)
    more = bounds.low_ah > TOO_SMALL * known
    wanted = f"{bounds.low_ah:.3g} Ah or more" if more else f"{bounds.high_ah:.3g} Ah or less"
    return (
        f"{record.name}: by the open-circuit potentials of the start file its voltages are those of a cell of "
        f"{wanted}, where a full discharge shows {known:.3g} Ah: these potentials are of other materials, and the fit "
        "has to bend them. Start from a file of the same materials, where there is one, and see what is left over the "
        "state of charge."
    )


def check_belongs(cell: Cell, records: Iterable[Measurement]) -> None:
    """Raises DataError, one sentence, for the first record that cannot be of this cell: of its voltages, before what
    these and its charge say of the capacity, which means nothing where they are another cell's; of a current
    without a voltage in every row, one that is of no cell of this capacity."""
    for record in records:
        if not np.all(np.isfinite(record.voltage_v)):
            _check_current(cell, record)
            continue
        _check_window(cell, record)
        _check_capacity(cell, record)


def _check_current(cell: Cell, record: Measurement) -> None:
    """Of a current without a voltage in every row: one that no cell of this capacity carries, or that moves many times
    what it holds, is in another unit."""
    declared = _capacity_ah(cell)
    row = int(np.argmax(np.abs(record.current_a)))
    rate = float(np.abs(record.current_a[row])) / declared
    head = f"{record.name}, {stamp(record.time_s[row])} s: {record.current_a[row]:.4g} A are {rate:.3g}C of"
    whose = f"{cell.name}, which has {declared:.3g} Ah"
    if rate > MOST_C_RATE:
        raise DataError(
            f"{head} {whose}: the current is in mA, or the cell file is another's; give A, or declare it: --unit "
            "current_a=mA."
        )
    moved = float(np.ptp(record.discharged_ah("linear")))
    if moved > MOST_CAPACITIES * declared:
        raise DataError(
            f"{record.name}: {moved:.4g} Ah would flow one way within {record.time_s[-1] - record.time_s[0]:.6g} s, "
            f"{moved / declared:.3g} times what {whose}, holds: the time is in ms, or the current in mA; give s and A, "
            "or declare it: --unit time_s=ms, or --unit current_a=mA."
        )


def capacity_bounds(cell: Cell, record: Measurement) -> CapacityBounds:
    """What the voltages and the charge of a record say of the capacity, eq. (4): 0 and infinity where they say
    nothing."""
    rows = np.unique(np.linspace(0, len(record) - 1, ROWS).astype(int))
    charge = record.discharged_ah("backward")[rows]  # as loggers write
    voltage = record.voltage_v[rows]
    high = _soc_of(cell, voltage + _largest_drop_v(cell, record, rows, 1.0))
    low = _soc_of(cell, voltage - _largest_drop_v(cell, record, rows, -1.0))
    moved = charge[None, :] - charge[:, None]  # discharged from row i to row j
    at_least = low[:, None] - high[None, :]  # of state of charge lost from i to j
    at_most = np.maximum(high[:, None] - low[None, :], FEWEST_SOC)
    telling = moved > TELLING_SHARE * float(np.ptp(charge))
    most = telling & (at_least > TELLING_SOC)
    largest = np.divide(moved, at_least, out=np.full_like(moved, np.inf), where=most)
    smallest = np.divide(moved, at_most, out=np.zeros_like(moved), where=telling)
    return CapacityBounds(
        float(smallest.max()),
        float(largest.min()),
        _pair(rows, int(smallest.argmax())) if telling.any() else None,
        _pair(rows, int(largest.argmin())) if most.any() else None,
    )


def _pair(rows: IntArray, entry: int) -> tuple[int, int]:
    """Rows of the record of an entry of the table of pairs."""
    return int(rows[entry // len(rows)]), int(rows[entry % len(rows)])


def _check_window(cell: Cell, record: Measurement) -> None:
    """Of a voltage at rest, or in discharge, where it is lower still: more than that of a full cell is another's."""
    calm = np.abs(record.current_a) < SMALL_C_RATE * cell.nominal_capacity_ah
    full_v = max(float(cell.rest_voltage_v(np.array([1.0]))[0]), cell.upper_voltage_v)
    first_v = float(record.voltage_v[0])
    if calm[0] and first_v < cell.lower_voltage_v - VOLTAGE_MARGIN_V:
        raise DataError(
            f"{record.name} starts at {first_v:.3f} V at {record.current_a[0]:.3g} A, but {cell.name} is empty at "
            f"{cell.lower_voltage_v:g} V: leave rows out that are no measurement of the cell (--from-s), or take the "
            "file of this cell."
        )
    above = (calm | (record.current_a > 0.0)) & (record.voltage_v > full_v + ABOVE_FULL_V)
    if np.any(above):
        row = int(np.argmax(above))
        raise DataError(
            f"{record.name}, {stamp(record.time_s[row])} s: {record.voltage_v[row]:.3f} V at "
            f"{record.current_a[row]:.3g} A, but {cell.name} is full at {full_v:.3f} V: the record and the "
            "cell file are of different cells, or the row is no measurement of the cell."
        )


def _check_capacity(cell: Cell, record: Measurement, slack: Slack | None = None) -> None:
    fault = _capacity_fault(cell, record, slack)
    if fault is None:
        return
    check_voltage(cell, record)
    if record.temperature_degc is None and _of_the_cold(cell, record):
        fault += (
            f". Or it was far colder than the {_declared_degc(cell):.4g} degC that the cell's file declares: give its "
            "temperature in a column temperature_degc, or declare another in that file (Initial temperature [K])"
        )
    declared = [note.rstrip(".") for note in record.notes if CONVERTED in note and DECLARED in note]
    if declared:
        fault += f". First look at what was declared: {'; '.join(declared)}"
    raise DataError(f"{fault}.")


def _of_the_cold(cell: Cell, record: Measurement) -> bool:
    """Whether a record that the cell's capacity does not explain would be of it in the cold."""
    coldest = replace(record, temperature_degc=np.full(len(record), COLD_DEGC - MOST_SPANS * COLD_SPAN_K))
    return _capacity_fault(cell, record) is not None and _capacity_fault(cell, coldest) is None


def _capacity_ah(cell: Cell) -> float:
    return max(cell.nominal_capacity_ah, cell.capacity_ah)


def _capacity_fault(cell: Cell, record: Measurement, slack: Slack | None = None) -> str | None:
    """What is moved between two voltages and which capacity that is of, where it is not the cell's, and why."""
    bounds, allowed = capacity_bounds(cell, record), slack or Slack()
    declared = _capacity_ah(cell)
    if bounds.low_rows is not None and bounds.low_ah > TOO_SMALL * allowed.more * declared:
        return (
            f"{_moved(record, bounds.low_rows)}, as in a cell of {bounds.low_ah:.3g} Ah or more, but {cell.name} has "
            f"{declared:.3g} Ah: {_cause(bounds.low_ah / declared, record)}"
        )
    if bounds.high_rows is not None and allowed.less * declared > TOO_LARGE * bounds.high_ah:
        return (
            f"{_moved(record, bounds.high_rows)}, as in a cell of {bounds.high_ah:.3g} Ah or less, but {cell.name} has "
            f"{declared:.3g} Ah: {_cause(bounds.high_ah / declared, record)}"
        )
    return None


def _moved(record: Measurement, rows: tuple[int, int]) -> str:
    """What flows between two rows, the fuller first, and the voltages there: one of them may be what is wrong."""
    first, last = sorted(rows)
    charge = record.discharged_ah("backward")
    amount, way = abs(charge[last] - charge[first]), "leave" if rows[0] == first else "enter"
    ends = " and ".join(
        f"{stamp(record.time_s[row])} s ({record.voltage_v[row]:.3f} V)" for row in (first, last)
    )
    return f"{record.name}: {amount:.4g} Ah {way} the cell between {ends}"


def _cause(ratio: float, record: Measurement) -> str:
    """What the ratio of capacities rather says: units differ by factors that cells do not."""
    if ratio > 200.0:
        return (
            "the current is in mA or the time in ms; give A and s, or declare it: --unit current_a=mA, or --unit "
            "time_s=ms"
        )
    if ratio < 1.0 / 1000.0:
        return (
            "the time is in hours or days or the current in kA (give s and A, or declare it: --unit time_s=h or d, or "
            "--unit current_a=kA), or the sensor of the current failed"
        )
    if ratio < 1.0 / 15.0:
        return (
            "the time is in minutes or hours (give s, or declare it: --unit time_s=min or h), the current is a C-rate "
            "(give A), or the cell file is another's"
        )
    if ratio > 15.0:
        return (
            "the current is in mA or the time in ms (give A and s, or declare it: --unit current_a=mA, or --unit "
            "time_s=ms), or the cell file is another's"
        )
    if ratio < 1.0:
        return "the cell file is another cell's, or the cell holds much less than when it was new (--soh)"
    one_way = np.min(record.current_a) >= 0.0 or np.max(record.current_a) <= 0.0
    if one_way:
        return (
            "the cell file is another cell's, the sign of the current is the other one (discharge is positive here), "
            "or the current is written without its sign (--state COLUMN names the column that says which way it flows)"
        )
    return (
        "the cell file is another cell's, the current is that of several cells in parallel, or its sign is the other "
        "one (discharge is positive here)"
    )


def _largest_drop_v(cell: Cell, record: Measurement, rows: IntArray, sign: float) -> Array:
    """(n_rows,) V, eq. (1): how far no cell is below its rest voltage, or above it, under its current, or after that of
    the half hour before. A smaller current the other way does not undo what came before it: after pulses of 12 A an LG
    18650HG2 at -7 degC is 0.5 V below rest while a drive puts 0.6 A back. A record without a temperature is as warm as
    the cell's file declares.

    sign : 1 for below it, where discharge leaves a cell; -1 for above it.
    """
    flows = sign * record.current_a
    since = np.searchsorted(record.time_s, record.time_s[rows] - AFTER_S)
    turned = flows[rows] < -SMALL_C_RATE * cell.nominal_capacity_ah
    before_a = np.array(
        [
            np.max(flows[first : row + 1] if other else np.abs(flows[first : row + 1]))
            for first, row, other in zip(since, rows, turned, strict=True)
        ]
    )
    after_a = AFTER_SHARE * before_a
    beside_a = maximum_filter1d(np.abs(flows), 1 + 2 * ROWS_APART, mode="nearest")[rows]
    here_a = np.where(turned, after_a + flows[rows], np.maximum(beside_a, after_a))
    further_v_per_c = max(cell.contacts_and_films_ohm * cell.nominal_capacity_ah - OHMIC_V_PER_C, 0.0)
    c_rate = np.maximum(here_a, 0.0) / cell.nominal_capacity_ah
    drop = DROP_V + (DROP_V_PER_C + further_v_per_c) * c_rate
    measured = record.temperature_degc
    degc = np.asarray(_declared_degc(cell)) if measured is None else measured[rows]
    cold = np.clip((COLD_DEGC - degc) / COLD_SPAN_K, 0.0, MOST_SPANS)
    return drop * (1.0 + (COLD_FACTOR - 1.0) * cold)


def _declared_degc(cell: Cell) -> float:
    return cell.initial_temperature_k - ZERO_CELSIUS_K


def _soc_of(cell: Cell, voltage_v: Array) -> Array:
    """(n,) state of charge at which the cell rests at these voltages, held at a little beyond empty and full."""
    soc = np.linspace(0.0, 1.0, SOC_GRID)
    ocv = np.maximum.accumulate(cell.rest_voltage_v(soc))
    inside = np.interp(voltage_v, ocv, soc)
    return np.where(voltage_v < ocv[0], -BEYOND_SOC, np.where(voltage_v > ocv[-1], 1.0 + BEYOND_SOC, inside))
