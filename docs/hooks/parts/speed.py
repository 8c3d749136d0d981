"""How fast this package is beside its peers, in a sentence, from lines that `aesi bench` printed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from aesi.conformal.registry import DEFAULT_METHOD

Line = dict[str, Any]
MODELS = {"espm": "The single particle", "dfn": "the porous electrode"}


def speed(lines: Sequence[Line]) -> str:
    """Each model beside PyBaMM's, intervals beside MAPIE and SPCI, and the search beside PySINDy."""
    timed = [line for line in lines if line.get("ratio")]
    parts = [*_models(timed), *_intervals(timed), *_search(timed)]
    return "; ".join(parts) or "No run has been recorded"


def _models(timed: Sequence[Line]) -> list[str]:
    return [
        f"{words} {line['ratio']:.0f} times as fast as PyBaMM's, {line['rmse_mv']:.2g} mV RMSE off a fine mesh"
        for bench, words in MODELS.items()
        for line in timed
        if line["bench"] == bench
    ]


def _intervals(timed: Sequence[Line]) -> list[str]:
    """Replays of a record beside what does the same: a method of MAPIE by its name, SPCI by the default."""
    of_series = [line for line in timed if line["bench"] == "spci"]
    told = [
        f"`{line['method']}` {_round(line['ratio'])} times as fast as {line['peer']}"
        for line in of_series
        if line["peer"].lower() == f"mapie {line['method']}"
    ]
    told += [
        f"the default `{DEFAULT_METHOD}` some {_round(line['ratio'])} times as fast as {line['peer']}, which is "
        f"refitted at every step, with an interval score {line['score_ratio']:.2f} times the best possible"
        for line in of_series
        if line["method"] == DEFAULT_METHOD
    ]
    return [f"intervals one step ahead by {', '.join(told)}"] if told else []


def _search(timed: Sequence[Line]) -> list[str]:
    found = [line for line in timed if line["bench"] == "ensemble"]
    if not found:
        return []
    low, high = (pick(line["ratio"] for line in found) for pick in (min, max))
    return [
        f"a search's ensembles {low:.0f} to {high:.0f} times as fast as {found[0]['peer']} on the same resamples"
    ]


def _round(ratio: float) -> str:
    """To two digits: peers are timed on a few steps, and scaled."""
    return f"{float(f'{ratio:.2g}'):,.0f}"
