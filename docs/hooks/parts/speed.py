"""How fast this package is beside its peers, in a sentence a subject, from lines that `aesi bench` printed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from aesi.conformal.registry import DEFAULT_METHOD

Line = dict[str, Any]
MODELS = {"espm": "The single particle", "dfn": "the porous electrode"}


def physics(lines: Sequence[Line]) -> str:
    """Each model beside PyBaMM's."""
    return _joined(
        f"{words} {line['ratio']:.0f} times as fast as PyBaMM's, {line['rmse_mv']:.2g} mV RMSE off a fine mesh"
        for bench, words in MODELS.items()
        for line in _timed(lines, bench)
    )


def intervals(lines: Sequence[Line]) -> str:
    """Replays of a record beside what does the same: a method of MAPIE by its name, SPCI by the default."""
    timed = _timed(lines, "spci")
    same = [line for line in timed if line["peer"].lower() == f"mapie {line['method']}"]
    return _joined(
        [
            *(f"`{line['method']}` {_round(line['ratio'])} times as fast as {line['peer']}" for line in same),
            *(
                f"the default `{DEFAULT_METHOD}` some {_round(line['ratio'])} times as fast as {line['peer']}, "
                f"which is refitted at every step, with an interval score {line['score_ratio']:.2f} times the best "
                "possible"
                for line in timed
                if line["method"] == DEFAULT_METHOD
            ),
        ]
    )


def search(lines: Sequence[Line]) -> str:
    """The ensembles of a search beside the peer's."""
    timed = _timed(lines, "ensemble")
    if not timed:
        return _joined([])
    low, high = (pick(line["ratio"] for line in timed) for pick in (min, max))
    return f"Its ensembles {low:.0f} to {high:.0f} times as fast as {timed[0]['peer']} on the same resamples"


def costs(lines: Sequence[Line]) -> str:
    """What a candidate costs beside its evaluation, and what a second worker brings."""
    return _joined(
        [
            *(
                f"The search {line['ours_ms']:.2g} ms a candidate, Optuna's NSGA-II {line['peer_ms']:.2g}"
                for line in _timed(lines, "search")
                if line["storage"] == "memory"
            ),
            *(
                f"tracking {line['overhead_pct']:.0f} % on the smallest library"
                for line in lines
                if line["bench"] == "tracking"
            ),
            *(
                f"{line['workers']} workers are {line['ratio']:.1f} times as fast as one"
                for line in _timed(lines, "scale")
            ),
        ]
    )


def _timed(lines: Sequence[Line], bench: str) -> list[Line]:
    return [line for line in lines if line["bench"] == bench and line.get("ratio")]


def _joined(parts: Iterable[str]) -> str:
    return "; ".join(parts) or "No run has been recorded"


def _round(ratio: float) -> str:
    """To two digits: peers are timed on a few steps, and scaled."""
    return f"{float(f'{ratio:.2g}'):,.0f}"
