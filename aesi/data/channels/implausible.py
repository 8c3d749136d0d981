"""Checks of units and signs that need current, voltage and time together.

The limits hold for one lithium cell. Shares and voltages were set on 342 measured and virtual records, or parts of
them, with and without the sign of their current. Records of one direction show at most 1.4 % of contradicting steps and
a rise of 0.20 V under a constant current. Of the 75 records of both directions without their sign, 52 show 4 % of such
steps or more, and ten others a rise of 1.0 V or more; the rest, nearly all cold drives with little braking, are not
detected.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.optimize import nnls
from scipy.special import betainc

from aesi.constants import MILLI, SECONDS_PER_HOUR
from aesi.data import units
from aesi.data.channels.checks import MOST_RELAXED_V, Columns, Context
from aesi.data.channels.gaps import find_gaps
from aesi.data.channels.headers import nearest
from aesi.data.channels.stamps import longer_unit
from aesi.errors import DataError
from aesi.numerics.typing import Array

HIGHEST_CHARGE_AH = 1_500.0
"""More charge in one direction means a current in mA: the largest cells sold hold about 1,000 Ah."""
LOWEST_RESISTANCE_OHM = 30e-6
"""A smaller resistance at steps means a current in mA: cells of 1,000 Ah have about 150 microohm."""
HIGHEST_CHARGE_RESISTANCE_OHM_AH = 10.0
"""A larger charge moved x resistance means time in ms, which makes it a thousand times too large: capacity x resistance
is 0.05 to 0.8 ohm Ah for 46 of those records."""
LEAST_CHARGE_RESISTANCE_AH_A = 3e-3
"""Least charge moved x resistance over the slide of the voltage (its range without the ohmic drop). It is 0.042 or more
for the 140 of 210 measured records that show both, and 0.0018 or more for 210 pieces of them of 5 and 10 min, two of
which are below this limit; with time in hours it is 3,600 times less."""
MOST_CHARGE_RESISTANCE_AH_A = 20.0
"""Most charge moved x resistance over the slide of the voltage (at least FLAT_V). It is 0.022 to 0.62 in the 34
measured and virtual records whose steps show a resistance, and a thousand times that with time in ms. A completely flat
potential of a cell of 0.8 ohm Ah makes 16."""
FLAT_V = 0.05
"""Slide that is assumed at least, for flat potentials."""
USUAL_RESISTANCE_OHM_AH = (0.02, 0.9)
"""Range of (resistance at steps of the current) x (capacity of the cell): 0.024 to 0.85 in those records."""
CLEAR_SLIDE_V = 0.15
"""Smallest slide that is used: range of the voltage without its ohmic drop, between its 2 % and 98 % quantiles. It is
0.22 V or more in those records."""
CONTRADICTING_SHARE = 0.04
"""Share of contradicting steps above which the sign is missing: correct records have at most 1.4 %. Fewer than
CONTRADICTING_STEPS of them are ignored."""
CONTRADICTING_STEPS = 5
RISE_V = 0.5
"""Rise under a constant current from which the sign is missing: between the 0.20 V and the 1.0 V above."""
RELAXED_S = 30.0
"""Time ignored at the beginning of a constant current: after a larger one the voltage recovers by up to 0.45 V in 5
s."""
ENOUGH_ROWS = 10
"""Rows that a stretch of constant current needs to distinguish a trend from noise."""
SMALL_SHARE = 0.02
"""Share of the largest current below which the cell rests."""
FASTEST_SLIDE_S = 30.0
"""No cell's voltage slides by more than SLIDE_V faster than this under a constant current: time is then in minutes or
hours. Only records of at most SHORT_RECORD_S are checked."""
SLIDE_V = 0.5
SHORT_RECORD_S = 200.0
STEP_SHARE = 0.05
"""A step of the current counts where it is above this share of the largest step; ENOUGH_STEPS of them are needed."""
ENOUGH_STEPS = 5
CLEAR_CORRELATION = 0.5
"""Magnitude of the correlation of current and voltage steps above which they determine the sign of the current. The
voltage falls with the current, so measured records are near -1."""
STRIDES = (1, 3, 10)
"""Distances in rows over which steps are taken. Where a logger writes current and voltage a row apart, the step from
row to row shows only the slide of the voltage."""
VOLTAGE_TREND_V = 0.05
"""A voltage that changes by less than this over the test has no trend."""
TREND_POINTS = 200
"""Number of strides into which a record is divided, so that noise averages out over each."""
EXPLAINED_SHARE, UNEXPLAINED_SHARE = 0.25, 0.1
"""Shares of the change of voltage between the means of these strides. The sign is wrong where the opposite sign
explains more than the first and the declared sign less than the second. Both hold for none of 296 measured and virtual
records and 440 simulated ones of smooth currents written to 0.1 to 10 mV. With the opposite sign they hold for 329 of
the latter; the rest are currents that only fall, and some that change the voltage by less than its noise."""
RELAXING_FOR = (0.01, 0.03, 0.1, 0.3, 1.0, 10.0)
"""Time constants of a relaxation that goes on throughout a record, as shares of its length; with the last it goes on
evenly, as under a constant current. A sign is wrong only where the opposite one explains the voltage better than that:
without it 270 of 900 simulated rests whose current is an offset of 1 to 20 mA were refused, with it none. Of 1,151
measured records and pieces of 10 min and 1 h with the opposite sign, 929 are refused with it and 972 without; the 43
are short pieces, all of the records are among the 929 as before."""
CHANCE = 1e-3
"""Probability with which noise may explain as much of a voltage as the evidence for a sign. Of 300 simulated rests each
of 18, 60 and 500 rows, with a current of single steps of 1 to 8 uA, 31, 33 and 21 were refused as of the wrong sign and
8, 180 and 300 as magnitudes without this limit; with it none, and one of 900."""
LEAST_CHARGE_AH = 1e-5
"""Charge below which no slide of a voltage is the current's: 1 % of a coin cell of a laboratory, of 1 mAh. An offset of
1 uA needs ten hours for it."""


def check_scale(columns: Columns, context: Context) -> None:
    """Refuse a current in mA and a time in ms, hours or minutes: read as A and s, no cell has such a charge, resistance
    or rate of change of the voltage."""
    time, current = columns["time_s"], columns["current_a"]
    moved = _moved_ah(columns)
    resistance = step_resistance_ohm(columns)
    row = int(np.argmax(np.abs(current)))
    if resistance is not None and resistance < LOWEST_RESISTANCE_OHM:
        raise DataError(
            f"{context.at('current_a', row)}: {current[row]:.6g} A would show {resistance * 1e6:.3g} microohm at its "
            f"steps: {unit_clause(context, 'it is plainly in mA', current_a='mA')}."
        )
    if moved > HIGHEST_CHARGE_AH:
        if resistance is not None and moved * resistance > HIGHEST_CHARGE_RESISTANCE_OHM_AH:
            raise DataError(
                f"{context.at('time_s', len(time) - 1)}: {moved:.4g} Ah would have moved, which "
                f"a cell that shows {MILLI * resistance:.3g} mohm at the steps of its current does not hold: "
                f"{unit_clause(context, 'the time is in ms', time_s='ms')}."
            )
        if resistance is not None:
            raise DataError(
                f"{context.at('current_a', row)}: at {current[row]:.6g} A {moved:.4g} Ah would have moved: "
                f"{unit_clause(context, 'it is plainly in mA', current_a='mA')}."
            )
        raise DataError(
            f"{context.at('current_a', row)}: at {current[row]:.6g} A {moved:.4g} Ah would have moved: "
            f"{unit_clause(context, 'it is plainly in mA, or the time in ms', current_a='mA', time_s='ms')}."
        )
    if resistance is not None:
        _check_slide(columns, context, moved, resistance)
    _check_pace(columns, context)


def _charge_as(columns: Columns) -> Array:
    """(n,) A s, charge since the first row, with the current constant since the row before."""
    return np.append(0.0, np.cumsum(columns["current_a"][1:] * np.diff(columns["time_s"])))


def _moved_ah(columns: Columns) -> float:
    """Range of the charge over the record, Ah."""
    return float(np.ptp(_charge_as(columns))) / SECONDS_PER_HOUR


def _check_slide(columns: Columns, context: Context, moved_ah: float, resistance_ohm: float) -> None:
    """Refuse a charge moved that is far too small for the slide of the voltage and the resistance of the cell, or so
    large that it would have emptied the cell many times.

    Too small is judged with the largest resistance over STRIDES. In dense rows, or where current and voltage are some
    rows apart, the resistance from row to row is only a part of it, and the rest of the drop looks like a slide.
    """
    slower = max(filter(None, (step_resistance_ohm(each) for each in _strides(columns))))
    slide, last = _slide_v(columns, slower), len(columns["time_s"]) - 1
    if slide > CLEAR_SLIDE_V and moved_ah * slower < LEAST_CHARGE_RESISTANCE_AH_A * slide:
        raise DataError(
            f"{context.at('time_s', last)}: the voltage slides by {slide:.2f} V while {MILLI * moved_ah:.3g} mAh move "
            f"in {columns['time_s'][last] - columns['time_s'][0]:.3g} s, of a cell that shows {MILLI * slower:.3g} "
            f"mohm at the steps of its current: {_longer_unit_clause(columns, context)}."
        )
    slide = _slide_v(columns, resistance_ohm)
    if moved_ah * resistance_ohm > MOST_CHARGE_RESISTANCE_AH_A * max(slide, FLAT_V):
        raise DataError(
            f"{context.at('time_s', last)}: {moved_ah:.4g} Ah would have moved while the voltage slides by {slide:.2f} "
            f"V, of a cell that shows {MILLI * resistance_ohm:.3g} mohm at the steps of its current: "
            f"{unit_clause(context, 'the time is in ms', time_s='ms')}."
        )


def _slide_v(columns: Columns, resistance_ohm: float) -> float:
    """Slide of the voltage, V: its range without the ohmic drop, between the 2 % and 98 % quantiles."""
    low, high = np.quantile(columns["voltage_v"] + resistance_ohm * columns["current_a"], [0.02, 0.98])
    return float(high - low)


def unit_clause(context: Context, claim: str, **units_of: str) -> str:
    """The end of a message on implausible numbers: `claim` and the options that declare the unit; where a column was
    not read as SI, its declared unit in place of the claim.

    units_of : quantity -> the unit that its numbers more likely have.
    """
    taken = {quantity: context.unit.get(quantity, units.SI[quantity]) for quantity in units_of}
    other = [
        f"{quantity} was taken in {unit}" for quantity, unit in taken.items() if unit != units.SI[quantity]
    ]
    if other:
        return f"{' and '.join(other)}, as declared or as its header says; check that first"
    wanted = " and ".join(units.SI[quantity] for quantity in units_of)
    options = ", or ".join(f"--unit {quantity}={unit}" for quantity, unit in units_of.items())
    return f"{claim}; give {wanted}, or declare it: {options}"


def _longer_unit_clause(columns: Columns, context: Context) -> str:
    """The end of a message on times that are too close for seconds."""
    return unit_clause(context, "the time is in another unit", time_s=longer_unit(columns["time_s"]))


def step_resistance_ohm(columns: Columns) -> float | None:
    """Resistance at the steps of the current, ohm, > 0; None where their correlation with the voltage is not clear."""
    found = step_response(columns)
    return -found[0] if found is not None and found[1] < -CLEAR_CORRELATION else None


def check_signed(columns: Columns, context: Context, header: Sequence[str]) -> None:
    """Refuse a current without its sign: it only discharges (or charges), but the voltage also responds as to the other
    direction."""
    current = columns["current_a"]
    largest = float(np.max(np.abs(current)))
    if largest == 0 or (np.min(current) < -SMALL_SHARE * largest and np.max(current) > SMALL_SHARE * largest):
        return
    evidence = _contradicting_steps_clause(columns) or _wrong_way_clause(columns, context)
    if not evidence:
        return
    state = nearest("state", header)
    option = f'--state "{state}"' if state else "--state COLUMN"
    way = "discharges" if np.max(current) > 0 else "charges"
    raise DataError(
        f"{context.file}: the current ({context.header['current_a']!r}) never changes its sign, so the cell only "
        f"{way}, and yet {evidence}: the file holds magnitudes. Name the column that says which way the current "
        f"flows: {option}; without such a column, export the current with its sign."
    )


def check_sign(columns: Columns, context: Context, advice: str) -> None:
    """Refuse a current of the wrong sign: the voltage rises on discharge, at steps of the current, or else along the
    test, or over its strides, where no relaxation explains it as well.

    advice : end of the message, from '; ' on, on what the user can do.
    """
    found = clearest_step_response(columns) if _follows_steps(columns) else None
    right, other = _explained_share(columns, -1.0), _explained_share(columns, 1.0)
    if found is not None and _response_is_clear(found, right, other):
        contradicts, evidence = found[1] > 0, "at its steps"
    elif _moved_ah(columns) < LEAST_CHARGE_AH:
        return
    else:
        trend = _trend(columns)
        contradicts, evidence = trend > CLEAR_CORRELATION, "along the test"
        if abs(trend) <= CLEAR_CORRELATION:
            contradicts = other > EXPLAINED_SHARE and right < UNEXPLAINED_SHARE
        contradicts = contradicts and other >= _relaxation_share(columns)
    if contradicts:
        row = int(np.argmax(np.abs(np.diff(columns["current_a"])))) + 1
        raise DataError(
            f"{context.at('current_a', row)}: the voltage rises with the current {evidence}, so its sign "
            f"contradicts the one declared{advice}."
        )


def _response_is_clear(answer: tuple[float, float], right: float, other: float) -> bool:
    """True where the response to steps of the current determines its sign: it is clear, and agrees with what resistance
    and capacity together explain. (At constant voltage the current falls in steps, though charge moved the voltage.)

    right, other : `_explained_share` for the declared and for the opposite sign; 0 where there are too few rows.
    """
    clear = abs(answer[1]) > CLEAR_CORRELATION
    return clear and (right == other or (answer[1] > 0) == (other > right))


def _check_pace(columns: Columns, context: Context) -> None:
    """Refuse a voltage of a short record that moves faster under a constant current than that of any cell."""
    time, voltage = columns["time_s"], columns["voltage_v"]
    if time[-1] - time[0] > SHORT_RECORD_S:
        return
    for rows in _constant_stretches(columns):
        slide, seconds = float(np.ptp(voltage[rows])), float(np.ptp(time[rows]))
        if slide > SLIDE_V and seconds < FASTEST_SLIDE_S:
            raise DataError(
                f"{context.at('time_s', rows.start)}: the voltage moves by {slide:.2f} V in {seconds:.3g} s of one "
                f"held current, faster than any cell's: {_longer_unit_clause(columns, context)}."
            )


def _contradicting_steps_clause(columns: Columns) -> str:
    """Text on steps where the voltage moves against the current, by their weight; '' where their share is small."""
    size = np.abs(columns["current_a"])
    rise, answer = np.diff(size), np.diff(columns["voltage_v"])
    clear = np.abs(rise) > STEP_SHARE * np.max(size)
    weight = rise[clear] * answer[clear] * np.sign(np.median(columns["current_a"]) or 1.0)
    wrong = weight > 0
    total = float(np.sum(np.abs(weight)))
    if int(np.sum(wrong)) < CONTRADICTING_STEPS or total == 0:
        return ""
    sizes, moves = _ranks(np.abs(rise)), _ranks(np.abs(answer))
    alike = float(sizes @ moves)
    if alike <= 0 or not _beyond_chance(alike**2 / float(sizes @ sizes * (moves @ moves)), 1, len(rise)):
        return ""  # the voltage moves no further at the steps than between them
    share = float(np.sum(weight[wrong])) / total
    if not CONTRADICTING_SHARE < share < 1 - CONTRADICTING_SHARE:
        return ""  # above 1 - share, the whole record has the opposite sign, which `check_sign` reports
    return f"{int(np.sum(wrong)):,} of its {int(np.sum(clear)):,} steps move the voltage the other way"


def _wrong_way_clause(columns: Columns, context: Context) -> str:
    """Text on a constant current under which the voltage moves the wrong way by more than RISE_V; '' without one."""
    voltage = columns["voltage_v"] * np.sign(np.sum(columns["current_a"]) or 1.0)
    right, wrong, last = 0.0, 0.0, 0
    for rows in _constant_stretches(columns):
        piece: Array = voltage[rows]
        right = max(right, float(np.max(np.maximum.accumulate(piece) - piece)))
        time = columns["time_s"][rows]
        relaxed = int(np.searchsorted(time, time[0] + RELAXED_S))
        up = piece[relaxed:] - np.minimum.accumulate(piece[relaxed:])
        if float(np.max(up, initial=0.0)) > wrong:
            wrong, last = float(np.max(up)), rows.start + relaxed + int(np.argmax(up))
    if wrong < RISE_V or right < RISE_V:
        return ""
    return (
        f"the voltage moves the other way by {wrong:.2f} V under a held current, up to {context.where(last)}"
    )


def _constant_stretches(columns: Columns) -> list[slice]:
    """Stretches of more than ENOUGH_ROWS rows, without gaps, of a constant current that is not small: within STEP_SHARE
    of the largest current from that of their first row, which excludes a slowly falling current."""
    size = np.abs(columns["current_a"])
    largest = float(np.max(size))
    same = (np.abs(np.diff(size)) <= STEP_SHARE * largest) & (size[1:] > SMALL_SHARE * largest)
    same[find_gaps(columns)] = False
    ends = np.concatenate([[-1], np.flatnonzero(~same), [len(same)]])
    long = [(int(first) + 1, int(last) + 1) for first, last in pairwise(ends) if last - first > ENOUGH_ROWS]
    cuts = [cut for first, last in long for cut in pairwise(_cuts(size, first, last, STEP_SHARE * largest))]
    return [slice(first, last) for first, last in cuts if last - first > ENOUGH_ROWS]


def _cuts(size: Array, first: int, last: int, band: float) -> list[int]:
    """Limits of pieces of rows `first` to `last`; in each the current is within `band` of that of its first row."""
    cuts, begun = [first], float(size[first])
    for row, here in enumerate(size[first:last].tolist(), first):
        if abs(here - begun) > band:
            cuts.append(row)
            begun = here
    return [*cuts, last]


def step_response(columns: Columns) -> tuple[float, float] | None:
    """(slope dV/dI in ohm, correlation) over the clear steps of the current; None for fewer than ENOUGH_STEPS."""
    rise = np.diff(columns["current_a"])
    answer = np.diff(columns["voltage_v"])
    clear = np.abs(rise) > STEP_SHARE * np.max(np.abs(rise), initial=0.0)
    if int(np.sum(clear)) < ENOUGH_STEPS or np.all(answer[clear] == 0):
        return None
    x, y = rise[clear], answer[clear]
    slope = float(np.sum(x * y) / np.sum(x * x))
    return slope, float(np.sum(x * y) / np.sqrt(np.sum(x * x) * np.sum(y * y)))


def clearest_step_response(columns: Columns) -> tuple[float, float] | None:
    """`step_response` for the one of STRIDES with the strongest correlation: loggers may write current and voltage
    some rows apart."""
    found = [answer for answer in map(step_response, _strides(columns)) if answer is not None]
    return max(found, key=lambda answer: abs(answer[1]), default=None)


def _strides(columns: Columns) -> list[Columns]:
    """The columns with every 1st, 3rd and 10th row (STRIDES)."""
    return [{name: column[::stride] for name, column in columns.items()} for stride in STRIDES]


def _trend(columns: Columns) -> float:
    """Direction in which the voltage moves under a constant current: -1 always as it must, 1 always the wrong way.

    Computed from row to row and over strides of a two-hundredth of the record, where noise averages out. 0 without
    evidence.
    """
    stride = max(1, len(columns["time_s"]) // TREND_POINTS)
    both = (_following(columns, slice(None)), _following(columns, slice(None, None, stride)))
    return max(both, key=abs)


def _following(columns: Columns, rows: slice) -> float:
    """`_trend` over these rows, without steps and rests: after a pulse the voltage recovers."""
    current, voltage = columns["current_a"][rows], columns["voltage_v"][rows]
    size = STEP_SHARE * float(np.max(np.abs(current)))
    held = (np.abs(np.diff(current)) <= size) & (np.abs(current[1:]) > size)
    moved = np.diff(voltage)[held]
    along = float(np.sum(np.sign(current[1:][held]) * moved))
    if int(np.sum(held)) < ENOUGH_ROWS or abs(along) < VOLTAGE_TREND_V:
        return 0.0
    return along / float(np.sum(np.abs(moved)))


def _explained_share(columns: Columns, sign: float) -> float:
    """Share of the change of voltage between means of strides that a resistance and a capacity >= 0 explain, with the
    current in this sign (-1 as declared).

    For currents without steps: from row to row they change the voltage by less than its last digit.
    """
    causes = columns["current_a"], _charge_as(columns)
    moved = [_over_strides(each) for each in (*causes, columns["voltage_v"])]
    if len(moved[0]) < ENOUGH_ROWS or not all(map(np.any, moved)):
        return 0.0
    share = _share([sign * each for each in moved[:2]], moved[2])
    return share if _beyond_chance(share, 2, len(moved[2]) / 2) else 0.0


def _relaxation_share(columns: Columns) -> float:
    """Share of the change of voltage between means of strides that a relaxation explains which goes on throughout the
    record, whatever its current; 0 where the voltage moves by more than a relaxation does."""
    since_s, voltage = columns["time_s"] - columns["time_s"][0], columns["voltage_v"]
    answer = _over_strides(voltage)
    if np.ptp(voltage) > MOST_RELAXED_V or not answer.any():
        return 0.0
    decays = [_over_strides(np.exp(-since_s / (share * since_s[-1]))) for share in RELAXING_FOR]
    return max(_share([way * decay for decay in decays], answer) for way in (-1.0, 1.0))


def _over_strides(values: Array) -> Array:
    """(m - 1,) changes of values (n,) between their means over m strides, of a TREND_POINTS-th of the record."""
    stride = max(1, len(values) // TREND_POINTS)
    whole = len(values) // stride * stride
    return np.diff(values[:whole].reshape(-1, stride).mean(axis=1))


def _share(causes: Sequence[Array], answer: Array) -> float:
    """Share of the squares of an answer (n,) that causes (n,) explain, each with a factor >= 0; none of them is 0
    throughout."""
    unit = np.column_stack([cause / np.linalg.norm(cause) for cause in causes])
    _, left = nnls(unit, answer / np.linalg.norm(answer))
    return 1.0 - float(left) ** 2


def _follows_steps(columns: Columns) -> bool:
    """Whether the voltage answers to the steps of the current, either way, by more than noise does; the rows between
    the steps tell how much that is."""
    for each in _strides(columns):
        x, y = np.diff(each["current_a"]), np.diff(each["voltage_v"])
        sizes = float(np.sum(x * x) * np.sum(y * y))
        if sizes and _beyond_chance(float(np.sum(x * y)) ** 2 / sizes, 1, len(x) / 2):
            return True
    return False


def _beyond_chance(share: float, terms: int, values: float) -> bool:
    """Whether so many terms explain by chance less than this share of independent values of a noise, but for CHANCE.

    values : half as many as there are differences of a noise, each value of which is in two of them.
    """
    free = values - terms
    return free > 0 and bool(betainc(free / 2, terms / 2, 1.0 - share) < CHANCE)


def _ranks(values: Array) -> Array:
    """(n,) ranks of values about their mean; those of equal values are alike."""
    _, where, count = np.unique(values, return_inverse=True, return_counts=True)
    ranks: Array = (np.cumsum(count) - 0.5 * count)[where]
    return ranks - np.mean(ranks)
