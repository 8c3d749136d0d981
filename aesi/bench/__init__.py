"""Benchmarks against other programs, by name; each yields one JSON-ready dict per line."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from aesi.errors import InputError

CaseRow = dict[str, Any]
"""Row of one case: name -> JSON-ready value."""

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
    """The chosen cases of a benchmark.  Raises InputError where there is none: a summary without cases would look like
    a result.

    names : possible values of its option `only`.
    """
    if not cases:
        there = ", ".join(dict.fromkeys(names))
        raise InputError(
            f"no case of `aesi bench {name}` is left by these options; without them it runs all. "
            f"For only=... there are: {there}."
        )
    return cases
