"""Check that a record can belong to the cell of a file, for every command that simulates or fits one.

A voltage far beyond the file's limits belongs to another cell. At every row the voltage bounds the state of charge: the
rest voltage differs from it by at most a drop d that no cell exceeds. The state of charge therefore lies between
z- = z(V - d) and z+ = z(V + d), with z(U) the inverse of the open-circuit voltage of the file:

    d = (DROP_V + DROP_V_PER_C i + v) (1 + (COLD_FACTOR - 1) c)                    (1)
    i = max(|I|, AFTER_SHARE I') / C_nominal       1/h; I' the largest current of the AFTER_S before          (2)
    c = (COLD_DEGC - T) / COLD_SPAN_K, held within 0 and MOST_SPANS                (3)

v is the voltage drop over the contacts and films of the file beyond OHMIC_V_PER_C: in a cell that was calibrated with
its leads they cause most of the drop. |I| is the largest within ROWS_APART. (A current of the opposite sign reduces the
after-effect of I', on its side only.) The charge Q_ij that leaves the cell between two rows bounds the capacity C from
both sides. Where the declared capacity is well outside these bounds, the file is of another cell, or current or time of
the record are in another unit:

    Q_ij / max(z+_i - z-_j, FEWEST_SOC) <= C <= Q_ij / (z-_i - z+_j)               (4)

the upper one where z-_i - z+_j > TELLING_SOC, both where Q_ij is more than TELLING_SHARE of the charge moved.

The effect of each limit was measured on 36 records of four cells (-10 to 40 degC, from C/20 to drives and pulses), each
with its own cell's file and with those of the three others, with one limit changed at a time. With the present limits
the bounds of the records require 1/1.06 to 1.06 times the capacity of their own file, and 51 of the 108 pairs with
another cell's file are refused.
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
from aesi.records.checked import check_plain_volts, row_words

VOLTAGE_MARGIN_V = 0.3
"""How far a record may go beyond the voltage limits of the file, V: fast pulses and old cells do."""
SOC_MARGIN = 0.12
"""How far a record may go beyond full and empty, as a share of the declared capacity: new cells exceed their nominal
capacity."""
ROWS = 300
"""Rows of a record that are used, evenly spread: each pair of them bounds the capacity."""
TELLING_SHARE = 0.3
"""Least charge between two rows, as a share of the charge moved in the record: less is within hysteresis and
relaxation. With 0.2 a record requires 1.24 times the capacity of its own file, with 0.1 two are refused by theirs."""
TELLING_SOC = 0.1
"""Least difference in state of charge of two voltages for an upper bound: less is within the error of the file's
open-circuit voltage. Of 6,075 records and pieces of them, 10 min to 5 h long, with their own cell's file it
bounds 315, and allows at least 0.53 of the capacity; 0.07 allows 0.47, which is refused, and 0.25 bounds 195 and
accepted time in minutes for a discharge by a quarter between two rests."""
FEWEST_SOC = 0.02
"""Least difference in state of charge that is assumed of two voltages for a lower bound, which would otherwise be
infinite for equal ones. A convention: from 0.005 to 0.1 no measured record is judged otherwise."""
DROP_V = 0.06
"""Drop of a warm cell without a current, V: hysteresis, slow diffusion and the error of the file's open-circuit
voltage. The measured records stay within 0.05 V; with 0.03 a C/20 discharge is refused by its own file."""
DROP_V_PER_C = 0.25
"""Drop of a warm cell per C-rate, V h. The measured records stay within 0.2 V; with 0.15 the pulses of an LG M50T are
refused by their own file."""
OHMIC_V_PER_C = 0.06
"""Drop over a file's contacts and films that DROP_V_PER_C includes, V h per C-rate: 0.053 at most in the files that the
measured records were judged by. A cell on two wires of 0.15 ohm has 0.35."""
LEADS_V_PER_C = 0.35
"""Drop over leads that a record may hold and its file not, V h per C-rate: those of the cell on two wires."""
COLD_DEGC = 15.0
"""Temperature above which a cell counts as warm: with 5 a drive at 0 degC requires 1/1.11 times the capacity of its own
file, with 10 or 25 no measured record more than now."""
COLD_SPAN_K = 25.0
"""K below COLD_DEGC at which the drop is COLD_FACTOR times that of a warm cell: at -10 degC, the coldest of the
records. From 15 to 50 no measured record is judged otherwise."""
COLD_FACTOR = 4.0
"""Ratio of the drop one span below COLD_DEGC to that of a warm cell; the measured records stay within it. With 1 a
discharge of an LG 18650HG2 at -10 degC is refused by its own file; with 8 two more pairs with another cell's file
pass."""
MOST_SPANS = 2.0
"""Most spans below COLD_DEGC that count, down to -35 degC. A convention: the measured records reach one span."""
AFTER_S = 1800.0
"""Time for which a current has an after-effect, by slow diffusion, s. With 0 a drive at 0 degC is refused by its own
file, from 300 to 3600 no measured record is judged otherwise."""
ROWS_APART = 1
"""Rows by which loggers may write a current apart from its voltage; the largest current within them counts, and a rest
ends so many rows before a load. With 0 the pulses of an 18650 are refused by its own file for one row, of 0 A beside
the voltage under 4.6 A, and four drives of it at -20 degC that begin full are read as loads, to 0.02 to 0.06. Of 146
measured starts at rest the others move by 0.0013 of the charge at most."""
AFTER_SHARE = 0.3
"""Share of the largest current within that time that counts as if it still flowed. With 0 a drive at 0 degC is refused
by its own file, with 0.15 a record requires 1.1 times the capacity of its own; from 0.3 to 1 none is judged
otherwise."""
TOO_LARGE = 2.0
"""Largest ratio of the declared capacity to the upper bound of a record: a cell may have lost half of its capacity. A
convention; the measured records allow at least 1/1.06 of the capacity of their own file."""
TOO_SMALL = 1.25
"""Largest ratio of the lower bound of a record to the declared capacity: batches differ by less. The measured records
require at most 1.06 times the capacity of their own cell's file, the drive of an LG M50T 1.31 times that of a Panasonic
NCR18650PF."""
ABOVE_FULL_V = 0.1
"""How far a rest voltage may exceed that of a full cell, V; more belongs to another chemistry."""
MOST_C_RATE = 100.0
"""Largest C-rate of a current without a voltage in every row: cells are rated for pulses of 50C at most, a drive in mA
has 1000C and more."""
MOST_CAPACITIES = 10.0
"""Most charge in one direction, in capacities of the cell: a schedule with a wrong start or capacity has several, one
with time in ms a thousand times the right value."""
SMALL_C_RATE = 0.1
"""C-rate below which a cell counts as nearly at rest."""
CONVERTED, DECLARED = " was converted from ", " as declared"
"""Words in a reader's note on a unit that the user gave, which is the first suspect where a charge fits no cell."""
SOC_GRID = 1201
"""Number of states of charge in the table of rest voltages."""
BEYOND_SOC = 0.1
"""State of charge beyond full or empty that a voltage outside the window is taken for."""


@dataclass(frozen=True)
class CapacityBounds:
    """low_ah, high_ah : bounds of the capacity of any cell with these open-circuit potentials, Ah.
    low_rows, high_rows : the two rows, the fuller one first, that give each bound; None where no pair does.
    """

    low_ah: float
    high_ah: float
    low_rows: tuple[int, int] | None = None
    high_rows: tuple[int, int] | None = None


def check_voltage(cell: Cell, data: Measurement) -> None:
    """Raises DataError where the voltage is in mV, or leaves the range of the cell file by more than
    `VOLTAGE_MARGIN_V`."""
    check_plain_volts(data.voltage_v, lambda row: f"{data.name}, row {row + 1}, column voltage_v")
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
    """`check_belongs` and `check_voltage` for records to which a model is fitted or compared; a simulation needs only
    their current.

    known : numbers of the records whose full discharge gave the cell its capacity. Where their bounds still require
    another capacity, the file's potentials are wrong, which a fit corrects. All records are allowed the same deviation,
    except records without a temperature for which cold would explain it.
    """
    slack = CapacitySlack()
    for number in known:
        record = records[number]
        if not (record.temperature_degc is None and _fits_if_cold(cell, record)):
            slack = slack.widened_to(cell, record)
    for record in records:
        _check_window(cell, record)
        check_voltage(cell, record)
        if np.all(np.isfinite(record.voltage_v)):
            _check_capacity(cell, record, slack)


@dataclass(frozen=True)
class CapacitySlack:
    """How far capacity bounds may be off a known capacity, because the potentials of the file are wrong.

    more, less : ratios to the known capacity that bounds may require, more >= 1 and less <= 1.
    """

    more: float = 1.0
    less: float = 1.0

    def widened_to(self, cell: Cell, record: Measurement) -> CapacitySlack:
        """The slack that also admits the bounds of this record, whose cell has a known capacity."""
        bounds, known = capacity_bounds(cell, record), _capacity_ah(cell)
        return CapacitySlack(max(self.more, bounds.low_ah / known), min(self.less, bounds.high_ah / known))


def other_materials_sentence(cell: Cell, record: Measurement) -> str:
    """A sentence where a full discharge gave the cell its capacity, but the voltages require another one by the file's
    potentials; '' otherwise."""
    if not np.all(np.isfinite(record.voltage_v)) or _capacity_fault(cell, record) is None:
        return ""
    bounds, known = capacity_bounds(cell, record), _capacity_ah(cell)
    more = bounds.low_ah > TOO_SMALL * known
    wanted = f"{bounds.low_ah:.3g} Ah or more" if more else f"{bounds.high_ah:.3g} Ah or less"
    return (
        f"{record.name}: with the open-circuit potentials of the start file its voltages are those of a cell of "
        f"{wanted}, but a full discharge shows {known:.3g} Ah: the start file is of other electrode materials, and the "
        "fit has to distort its potentials. Start from a file of the same materials, where there is one, and check the "
        "residual over the state of charge."
    )


def check_belongs(cell: Cell, records: Iterable[Measurement]) -> None:
    """Raises DataError, one sentence, for the first record that cannot be of this cell. The voltages are checked first,
    then the capacity by voltages and charge, which means nothing for another cell's voltages. Without a voltage in
    every row, the current is checked against the capacity."""
    for record in records:
        if not np.all(np.isfinite(record.voltage_v)):
            _check_current(cell, record)
            continue
        _check_window(cell, record)
        _check_capacity(cell, record)


def _check_current(cell: Cell, record: Measurement) -> None:
    """Raises DataError for a current in a wrong unit, in a record without a voltage in every row: one that no cell of
    this capacity can carry, or that moves many times its capacity in one direction."""
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
    """Bounds of the capacity from the voltages and the charge of a record, eq. (4); 0 and infinity where there are
    none."""
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
    """The two rows of the record that belong to an entry of the table of pairs."""
    return int(rows[entry // len(rows)]), int(rows[entry % len(rows)])


def _check_window(cell: Cell, record: Measurement) -> None:
    """Raises DataError for a first voltage below empty, and for a voltage at rest or on discharge (where it is even
    lower) above that of a full cell."""
    nearly_at_rest = np.abs(record.current_a) < SMALL_C_RATE * cell.nominal_capacity_ah
    full_v = max(float(cell.rest_voltage_v(np.array([1.0]))[0]), cell.upper_voltage_v)
    first_v = float(record.voltage_v[0])
    if nearly_at_rest[0] and first_v < cell.lower_voltage_v - VOLTAGE_MARGIN_V:
        raise DataError(
            f"{record.name} starts at {first_v:.3f} V at {record.current_a[0]:.3g} A, but {cell.name} is empty at "
            f"{cell.lower_voltage_v:g} V: leave rows out that are no measurement of the cell (--from-s), or take the "
            "file of this cell."
        )
    above = (nearly_at_rest | (record.current_a > 0.0)) & (record.voltage_v > full_v + ABOVE_FULL_V)
    if np.any(above):
        row = int(np.argmax(above))
        raise DataError(
            f"{record.name}, {stamp(record.time_s[row])} s: {record.voltage_v[row]:.3f} V at "
            f"{record.current_a[row]:.3g} A, but {cell.name} is full at {full_v:.3f} V: the record and the "
            "cell file are of different cells, or the row is no measurement of the cell."
        )


def _check_capacity(cell: Cell, record: Measurement, slack: CapacitySlack | None = None) -> None:
    """Raises DataError where the charge between two voltages fits no cell of this capacity. Where the voltages do not
    fit either, the error is on them (`check_voltage`); else it names the capacity and what may explain it."""
    fault = _capacity_fault(cell, record, slack)
    if fault is None:
        return
    check_voltage(cell, record)
    if record.temperature_degc is None and _fits_if_cold(cell, record):
        fault += (
            f". Or it was far colder than the {_declared_degc(cell):.4g} degC that the cell's file declares: give its "
            "temperature in a column temperature_degc, or declare another in that file (Initial temperature [K])"
        )
    if _fits_behind_leads(cell, record):
        fault += (
            ". Or its voltage holds the drop of leads, as on two wires (`aesi data convert` prints the resistance that "
            "the steps of its current show): a file that was calibrated with them has it"
        )
    declared = [note.rstrip(".") for note in record.notes if CONVERTED in note and DECLARED in note]
    if declared:
        fault += f". First look at what was declared: {'; '.join(declared)}"
    raise DataError(f"{fault}.")


def _fits_if_cold(cell: Cell, record: Measurement) -> bool:
    """Whether a record does not fit the cell's capacity, and would if the cell had been as cold as (1) knows."""
    coldest = replace(record, temperature_degc=np.full(len(record), COLD_DEGC - MOST_SPANS * COLD_SPAN_K))
    return _capacity_fault(cell, record) is not None and _capacity_fault(cell, coldest) is None


def _fits_behind_leads(cell: Cell, record: Measurement) -> bool:
    """Whether a record does not fit the cell's capacity, and would if its voltage held the drop of leads as well."""
    leads_ohm = LEADS_V_PER_C / cell.nominal_capacity_ah
    wired = replace(cell, contact_resistance_ohm=cell.contact_resistance_ohm + leads_ohm)
    return _capacity_fault(cell, record) is not None and _capacity_fault(wired, record) is None


def _capacity_ah(cell: Cell) -> float:
    """The larger of the nominal capacity and that between the stoichiometry limits, Ah."""
    return max(cell.nominal_capacity_ah, cell.capacity_ah)


def _capacity_fault(cell: Cell, record: Measurement, slack: CapacitySlack | None = None) -> str | None:
    """A clause on the charge between two voltages, the capacity that this requires and the likely cause; None where it
    fits the cell's capacity."""
    bounds, allowed = capacity_bounds(cell, record), slack or CapacitySlack()
    declared = _capacity_ah(cell)
    if bounds.low_rows is not None and bounds.low_ah > TOO_SMALL * allowed.more * declared:
        rows, needed_ah, way = bounds.low_rows, bounds.low_ah, "more"
    elif bounds.high_rows is not None and allowed.less * declared > TOO_LARGE * bounds.high_ah:
        rows, needed_ah, way = bounds.high_rows, bounds.high_ah, "less"
    else:
        return None
    return (
        f"{_charge_clause(record, rows)}, as in a cell of {needed_ah:.3g} Ah or {way}, but {cell.name} has "
        f"{declared:.3g} Ah: {_cause_clause(needed_ah / declared, record)}"
    )


def _charge_clause(record: Measurement, rows: tuple[int, int]) -> str:
    """A clause on the charge between two rows, the fuller one first, and the voltages there."""
    first, last = sorted(rows)
    charge = record.discharged_ah("backward")
    amount, way = abs(charge[last] - charge[first]), "leave" if rows[0] == first else "enter"
    ends = " and ".join(
        f"{stamp(record.time_s[row])} s ({record.voltage_v[row]:.3f} V)" for row in (first, last)
    )
    return f"{record.name}: {amount:.4g} Ah {way} the cell between {ends}"


def _cause_clause(ratio: float, record: Measurement) -> str:
    """The likely cause of a ratio of capacities, a clause: units differ by larger factors than cells."""
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
    """(n_rows,) V, eq. (1): largest distance of the voltage below the rest voltage, or above it, with the present
    current and those of the half hour before. A smaller current in the other direction does not undo the after-effect:
    after pulses of 12 A an LG 18650HG2 at -7 degC is 0.5 V below rest while a drive charges with 0.6 A. A record
    without a temperature has the one of the cell's file.

    sign : 1 for below the rest voltage (discharge); -1 for above it.
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
    """(n,) state of charge at these rest voltages, clipped to `BEYOND_SOC` beyond empty and full."""
    soc = np.linspace(0.0, 1.0, SOC_GRID)
    ocv = np.maximum.accumulate(cell.rest_voltage_v(soc))
    inside = np.interp(voltage_v, ocv, soc)
    return np.where(voltage_v < ocv[0], -BEYOND_SOC, np.where(voltage_v > ocv[-1], 1.0 + BEYOND_SOC, inside))
