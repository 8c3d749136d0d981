"""Registry of the benchmarks that compare this package with other programs or with what a virtual cell is known to be.

Each benchmark is a module with a generator `run`, whose rows `aesi bench NAME --json` prints, one JSON object per line.
Those whose cases are tracked, spread over processes or written into a page of the docs have their `run` in
`flows.benchmarks`.
"""

from collections.abc import Collection, Iterable, Sequence
from typing import Annotated, Any, TypeVar

from pydantic import Field

from aesi.errors import InputError, did_you_mean

CaseRow = dict[str, Any]
"""One row of a benchmark: key -> value that JSON can hold. The last part of a key is the unit (`rmse_mv`, `ours_s`)."""

BENCHMARKS = {
    "espm": "aesi.bench.physics.espm",
    "dfn": "aesi.bench.physics.dfn",
    "start": "aesi.bench.physics.start",
    "calibrate": "aesi.bench.physics.calibrate",
    "resistance": "aesi.bench.physics.resistance",
    "ensemble": "aesi.bench.hybrid.ensemble",
    "design": "aesi.bench.hybrid.design",
    "spci": "aesi.bench.intervals.spci",
    "bands": "aesi.bench.intervals.bands",
    "drift": "aesi.bench.intervals.drift",
}
"""Name of a benchmark -> module with a generator `run(**options)` of rows (`CaseRow`)."""

Chosen = TypeVar("Chosen")
AtLeastOne = Annotated[Sequence[Chosen], Field(min_length=1)]
"""Values of a benchmark's option, of which none would leave nothing to print."""
AtLeastTwo = Annotated[int, Field(ge=2)]
"""Value of a benchmark's option of which one is too few to compute anything."""


def some_chosen(name: str, cases: Sequence[Chosen], names: Iterable[str]) -> Sequence[Chosen]:
    """The cases that the options of a benchmark have selected, unchanged.

    name : of the benchmark.  cases : the selection.  names : values that its option `only` can take.
    Raises InputError if the selection is empty, since a summary of no cases would look like a result.
    """
    if not cases:
        there = ", ".join(dict.fromkeys(names))
        raise InputError(
            f"no case of `aesi bench {name}` is left by these options; without them it runs all. "
            f"For only=... there are: {there}."
        )
    return cases


def check_listed(option: str, given: Iterable[str], known: Collection[str]) -> None:
    """Raises InputError for the first value of a benchmark's option that is none of those it knows."""
    for name in given:
        if name not in known:
            raise InputError(
                f"{option}: there is no {name!r}{did_you_mean(name, known)} There are: {', '.join(known)}."
            )
