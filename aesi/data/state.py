"""The direction of a current that is written as a magnitude, from a column that says what the cycler did."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal, get_args

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array

Direction = Literal["charge", "discharge", "rest"]

DISCHARGE = re.compile(r"^d$|dis|dchg|dch|entl|放电", re.IGNORECASE)
CHARGE = re.compile(r"^c$|chg|cha|lad|充电", re.IGNORECASE)
REST = re.compile(r"^[rpso]?$|rest|paus?|idle|ocv|stop?|wait|ruhe|off|finish|搁置|静置", re.IGNORECASE)
REST_SHARE = 0.01
"""Of the largest current: less, in a row that rests, is the instrument's zero."""


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
