"""The direction of a current that is written as a magnitude, from a column with the cycler's state in words."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
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
"""Largest current in a row at rest, as a share of the record's largest: an instrument's zero or a slow discharge. A
larger current makes the word for rest doubtful, which a note says. A convention."""


def directions(
    words: Sequence[str],
    current_a: Array,
    given: Mapping[str, Direction],
    file: str,
    column: str,
    where: Callable[[int], str],
) -> tuple[Array, str]:
    """((n,) 1 on discharge, -1 on charge, 0 at rest; a note on the meaning that each word was given).

    words : (n,) cells of the column.  current_a : (n,) A, of any sign.  given : word -> direction, as the user states.
    where : row index -> its place in the file.
    Raises DataError for a word of unknown meaning in a row with a current.
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
                f"{file}, {where(row)}: column {column!r} says {word!r} beside a current of {sizes[row]:.4g} A; say "
                f"which way it flows: --state-word {word}=charge or {word}=discharge."
            )
        result[rows] = {"discharge": 1.0, "charge": -1.0}.get(meaning or "", 0.0)
        taken[meaning or "rest"].append(word or "(empty)")
    meanings = "; ".join(f"{', '.join(names)} as {meaning}" for meaning, names in taken.items() if names)
    return result, f"The sign of the current was taken from column {column!r}: {meanings}."


def with_directions(current_a: Array, way: Array, time_s: Array, signed: bool) -> tuple[Array, list[str]]:
    """((n,) A, discharge positive: the magnitudes of a current with the directions of a column; notes on changes beyond
    a sign).

    current_a : (n,) A, magnitudes, or with its own sign where `signed`.  way : (n,) from `directions`.
    time_s : (n,) s.  A signed current keeps its value at rest, with its sign changed as elsewhere; magnitudes at rest
    become 0.
    """
    result = way * np.abs(current_a)  # NaN (an empty cell) stays NaN, also at rest
    rest = way == 0
    flows = rest & (np.abs(current_a) > 0)
    notes = []
    if signed:
        own = current_a * (-1.0 if np.nansum(way * current_a) < 0 else 1.0)
        result[rest] = own[rest] + 0.0  # no negative zeros
        against = own * result < 0
        if np.any(against):
            notes.append(
                f"{_flow_clause(against, current_a, time_s)} the column says another direction than the current's own "
                "sign; the column was followed."
            )
        if np.any(flows):
            notes.append(
                f"{_flow_clause(flows, current_a, time_s)} flows at rest; it was kept with its own sign."
            )
    elif np.any(flows):
        notes.append(
            f"{_flow_clause(flows, current_a, time_s)} flows at rest, in no direction that is told; it was taken as 0 "
            "A."
        )
    return result, notes


def _flow_clause(rows: AnyArray, current_a: Array, time_s: Array) -> str:
    """'In 1,200 rows up to 0.04 A (22.2 mAh in all)': current and charge of some rows, each since the row before it."""
    sizes = np.abs(current_a[rows])
    spans_s = np.maximum(np.diff(time_s, prepend=time_s[0]), 0.0)[rows]
    charge_mah = MILLI * float(np.nansum(sizes * spans_s)) / SECONDS_PER_HOUR
    count = "1 row" if len(sizes) == 1 else f"{len(sizes):,} rows"
    return f"In {count} up to {np.max(sizes):.4g} A ({charge_mah:.3g} mAh in all)"


def has_both_directions(words: Sequence[str], current_a: Array) -> bool:
    """True where known words state charge in some rows with a current, and discharge in others.

    words : (n,) cells of a column.  current_a : (n,) A, of any sign.
    """
    sizes = np.abs(current_a)
    flows = sizes > REST_SHARE * float(np.nanmax(sizes, initial=0.0))
    said = {word.strip() for word, flow in zip(words, flows, strict=True) if flow}
    return {"charge", "discharge"} <= {_meaning(word) for word in said}


def _meaning(word: str) -> Direction | None:
    """The direction that a word of a cycler states; None for an unknown word."""
    if DISCHARGE.search(word):
        return "discharge"
    if CHARGE.search(word):
        return "charge"
    return "rest" if REST.search(word) else None
