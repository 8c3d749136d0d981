"""Every benchmark by name: those of the package, and those that need the tracker or the scheduler.

Each module has `run(**options)`, which yields one JSON-ready dict a line.
"""

from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from inspect import signature
from typing import Any

from aesi.bench import BENCHMARKS as OF_THE_PACKAGE
from aesi.errors import InputError

BENCHMARKS = OF_THE_PACKAGE | {
    "blind": "flows.benchmarks.blind",
    "cells": "flows.benchmarks.cells",
    "splits": "flows.benchmarks.splits",
    "real": "flows.benchmarks.real",
    "left_out": "flows.benchmarks.left_out",
    "tracking": "flows.benchmarks.tracking",
    "scale": "flows.benchmarks.scale",
    "search": "flows.benchmarks.search",
}
"""Name -> module."""

PEERS = {"spci": {"mapie": "mapie>=1.5"}, "scale": {"distributed": "dask[distributed]"}}
"""Name -> packages beyond those of the project that its peers come from, and what installs each."""


def missing(names: Iterable[str]) -> dict[str, str]:
    """Package -> what installs it, of the packages that these benchmarks need and that are not here."""
    needed = {package: source for name in names for package, source in PEERS.get(name, {}).items()}
    return {package: source for package, source in needed.items() if find_spec(package) is None}


def run(name: str, **options: Any) -> Iterator[dict[str, Any]]:
    """Lines of one benchmark, as they come.

    Raises InputError for an option that it does not have.
    """
    benchmark = import_module(BENCHMARKS[name]).run
    known = signature(benchmark).parameters
    for option in options:
        if option not in known:
            there = ", ".join(known) or "none"
            raise InputError(f"--set {option}: `aesi bench {name}` has no such option; it has: {there}.")
    yield from benchmark(**options)
