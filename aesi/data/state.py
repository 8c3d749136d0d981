"""The direction of a current that is written as a magnitude, from a column that says what the cycler did."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from aesi.constants import MILLI, SECONDS_PER_HOUR
from aesi.errors import DataError
from aesi.numerics.typing import AnyArray, Array

Direction = Literal["charge", "discharge", "rest"]

DISCHARGE = re.compile(r"^d$|dis|dchg|dch|entl|放电", re.IGNORECASE)
CHARGE = re.compile(r"^c$|chg|cha|lad|充电", re.IGNORECASE)
REST = re.compile(r"^[rpso]?$|rest|paus?|idle|ocv|stop?|wait|ruhe|off|finish|搁置|静置", re.IGNORECASE)
REST_SHARE = 0.01
"""Of the largest current: less may flow in a row that rests, as an instrument's zero or a slow discharge; for more, the
word is asked about. A convention."""


def signs(
    words: Sequence[str], current_a: Array, given: Mapping[str, Direction], file: str, column: str
) -> tuple[Array, str]:
    """(n,) 1 on discharge, -1 on charge, 0 at rest, and a note that says which word was taken for what.

    words : (n,) the column's.  current_a : (n,) A, of any sign.  given : word -> direction, as the user says.
    Raises DataError for a word beside a current whose direction is not known.
    """
    for word, said in given.items():
        if said not in get_args(Direction):
            raise DataError(f"--state-word {word}={said}: has to be charge, discharge or rest.")
    array = np.asarray([word.strip() for word in words], dtype=object)
    sizes = np.abs(current_a)
    small = REST_SHARE * float(np.nanmax(sizes, initial=0.0))
    result = np.zeros(len(array))
    taken: dict[str, list[str]] = {"discharge": [], "charge": [], "rest": []}
    for word in dict.fromkeys(array.tolist()):
        rows = array == word
        meaning: Direction | None = given.get(word) or _meaning(word)
        flows = rows & (sizes > small)
        if meaning in (None, "rest") and np.any(flows):
            row = int(np.argmax(flows))
            raise DataError(
                f"{file}, row {row + 1}: column {column!r} says {word!r} beside a current of {sizes[row]:.4g} A; say "
                f"which way it flows: --state-word {word}=charge or {word}=discharge."
            )
        result[rows] = {"discharge": 1.0, "charge": -1.0}.get(meaning or "", 0.0)
        taken[meaning or "rest"].append(word or "(empty)")
    told = "; ".join(f"{', '.join(names)} as {meaning}" for meaning, names in taken.items() if names)
    return result, f"The sign of the current was taken from column {column!r}: {told}."


def turned(current_a: Array, way: Array, time_s: Array, signed: bool) -> tuple[Array, list[str]]:
    """(n,) A, discharge positive: the sizes of a current with the directions of a column, and notes on what that
    changes beyond a sign.

    current_a : (n,) A, magnitudes, or with a sign of its own where `signed`.  way : (n,) as `signs` gives it.
    time_s : (n,) s.  A current with a sign keeps it at rest, turned as it is elsewhere; magnitudes at rest become 0.
    """
    result = way * np.abs(current_a)  # an empty cell stays one, at rest too
    rest = way == 0
    flows = rest & (np.abs(current_a) > 0)
    notes = []
    if signed:
        own = current_a * (-1.0 if np.nansum(way * current_a) < 0 else 1.0)
        result[rest] = own[rest] + 0.0  # no negative zeros
        against = own * result < 0
        if np.any(against):
            notes.append(
                f"{_flow(against, current_a, time_s)} the column says another direction than the current's own sign; "
                "the column was followed."
            )
        if np.any(flows):
            notes.append(f"{_flow(flows, current_a, time_s)} flows at rest; it was kept with its own sign.")
    elif np.any(flows):
        notes.append(
            f"{_flow(flows, current_a, time_s)} flows at rest, in no direction that is told; it was taken as 0 A."
        )
    return result, notes


def _flow(rows: AnyArray, current_a: Array, time_s: Array) -> str:
    """'In 1,200 rows up to 0.04 A (22.2 mAh in all)': what flows in some rows, each since the row before it."""
    sizes = np.abs(current_a[rows])
    spans_s = np.maximum(np.diff(time_s, prepend=time_s[0]), 0.0)[rows]
    charge_mah = MILLI * float(np.nansum(sizes * spans_s)) / SECONDS_PER_HOUR
    count = "1 row" if len(sizes) == 1 else f"{len(sizes):,} rows"
    return f"In {count} up to {np.max(sizes):.4g} A ({charge_mah:.3g} mAh in all)"


def both_ways(words: Sequence[str], current_a: Array) -> bool:
    """Whether words that are known say charge beside some of the currents and discharge beside others.

    words : (n,) a column's.  current_a : (n,) A, of any sign.
    """
    sizes = np.abs(current_a)
    flows = sizes > REST_SHARE * float(np.nanmax(sizes, initial=0.0))
    said = {word.strip() for word, flow in zip(words, flows, strict=True) if flow}
    return {"charge", "discharge"} <= {_meaning(word) for word in said}


def _meaning(word: str) -> Direction | None:
    if DISCHARGE.search(word):
        return "discharge"
    if CHARGE.search(word):
        return "charge"
    return "rest" if REST.search(word) else None
