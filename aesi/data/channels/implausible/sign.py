"""A current without its sign, and one of the wrong sign.

Of the records with their sign, those of one direction show at most 1.4 % of contradicting steps and a rise of 0.20 V
under a constant current. Of the 75 records of both directions without their sign, 52 show 4 % of such steps or more,
and ten others a rise of 1.0 V or more; the rest, nearly all cold drives with little braking, are not detected.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls
from scipy.special import betainc

from aesi.data.channels.checks import MOST_RELAXED_V, Columns, Context
from aesi.data.channels.headers import nearest
from aesi.data.channels.implausible.responses import (
    CLEAR_CORRELATION,
    ENOUGH_ROWS,
    SMALL_SHARE,
    STEP_SHARE,
    StepResponse,
    charge_as,
    clearest_step_response,
    constant_stretches,
    moved_ah,
    strides_of,
)
from aesi.errors import DataError
from aesi.numerics.typing import Array

CONTRADICTING_SHARE = 0.04
"""Share of contradicting steps above which the sign is missing: correct records have at most 1.4 %. Fewer than
CONTRADICTING_STEPS of them are ignored."""
CONTRADICTING_STEPS = 5
RISE_V = 0.5
"""Rise under a constant current from which the sign is missing: between the 0.20 V and the 1.0 V above."""
RELAXED_S = 30.0
"""Time ignored at the beginning of a constant current: after a larger one the voltage recovers by up to 0.45 V in 5
s."""
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


def check_magnitudes(columns: Columns, context: Context, header: Sequence[str]) -> None:
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
    for rows in constant_stretches(columns):
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


def check_sign(columns: Columns, context: Context, advice: str) -> None:
    """Refuse a current of the wrong sign: the voltage rises on discharge, at steps of the current, or else along the
    test, or over its strides, where no relaxation explains it as well.

    advice : end of the message, from '; ' on, on what the user can do.
    """
    response = clearest_step_response(columns) if _follows_steps(columns) else None
    declared, opposite = _explained_share(columns, -1.0), _explained_share(columns, 1.0)
    if response is not None and _is_clear(response, declared, opposite):
        contradicts, evidence = response.correlation > 0, "at its steps"
    elif moved_ah(columns) < LEAST_CHARGE_AH:
        return
    else:
        trend = _trend(columns)
        contradicts, evidence = trend > CLEAR_CORRELATION, "along the test"
        if abs(trend) <= CLEAR_CORRELATION:
            contradicts = opposite > EXPLAINED_SHARE and declared < UNEXPLAINED_SHARE
        contradicts = contradicts and opposite >= _relaxation_share(columns)
    if contradicts:
        row = int(np.argmax(np.abs(np.diff(columns["current_a"])))) + 1
        raise DataError(
            f"{context.at('current_a', row)}: the voltage rises with the current {evidence}, so its sign "
            f"contradicts the one declared{advice}."
        )


def _is_clear(response: StepResponse, declared: float, opposite: float) -> bool:
    """True where the response to steps of the current determines its sign: it is clear, and agrees with what resistance
    and capacity together explain. (At constant voltage the current falls in steps, though charge moved the voltage.)

    declared, opposite : `_explained_share` for the declared and for the opposite sign; 0 where there are too few rows.
    """
    clear = abs(response.correlation) > CLEAR_CORRELATION
    return clear and (declared == opposite or (response.correlation > 0) == (opposite > declared))


def _follows_steps(columns: Columns) -> bool:
    """Whether the voltage answers to the steps of the current, either way, by more than noise does; the rows between
    the steps tell how much that is."""
    for each in strides_of(columns):
        x, y = np.diff(each["current_a"]), np.diff(each["voltage_v"])
        sizes = float(np.sum(x * x) * np.sum(y * y))
        if sizes and _beyond_chance(float(np.sum(x * y)) ** 2 / sizes, 1, len(x) / 2):
            return True
    return False


def _trend(columns: Columns) -> float:
    """Direction in which the voltage moves under a constant current: -1 always as it must, 1 always the wrong way.

    Computed from row to row and over strides of a two-hundredth of the record, where noise averages out. 0 without
    evidence.
    """
    stride = max(1, len(columns["time_s"]) // TREND_POINTS)
    both = (_trend_over(columns, slice(None)), _trend_over(columns, slice(None, None, stride)))
    return max(both, key=abs)


def _trend_over(columns: Columns, rows: slice) -> float:
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
    causes = columns["current_a"], charge_as(columns)
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
