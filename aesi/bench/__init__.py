"""Benchmarks against the peers, by name: each yields one JSON-ready dict a line, peer and ours in one run."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from aesi.errors import InputError

CaseRow = dict[str, Any]
"""What is told of one case: JSON-ready values by name."""

BENCHMARKS = {
    "espm": "aesi.bench.physics.espm",
    "dfn": "aesi.bench.physics.dfn",
    "start": "aesi.bench.physics.start",
    "calibrate": "aesi.bench.physics.calibrate",
    "ensemble": "aesi.bench.hybrid.ensemble",
    "design": "aesi.bench.hybrid.design",
    "spci": "aesi.bench.intervals.spci",
    "bands": "aesi.bench.intervals.bands",
    "drift": "aesi.bench.intervals.drift",
    "cells": "aesi.bench.physics.cells",
}
"""Name -> module with a function `run(**options) -> Iterator[dict]`."""

Chosen = TypeVar("Chosen")


def some_chosen(name: str, cases: Sequence[Chosen], names: Iterable[str]) -> Sequence[Chosen]:
    """The cases of a benchmark that its options chose.  Raises InputError where there is none: a summary of no case
    would look like a result.

    names : what its option `only` can be.
    """
    if not cases:
        there = ", ".join(dict.fromkeys(names))
        raise InputError(
            f"no case of `aesi bench {name}` is left by these options; without them it runs all. "
            f"For only=... there are: {there}."
        )
    return cases
