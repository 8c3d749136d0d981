"""Every benchmark by name: those of the package, and those that need the tracker or the scheduler.

Each module has `run(**options)`, which yields one JSON-ready dict a line.
"""

from collections.abc import Iterator
from importlib import import_module
from typing import Any

from aesi.bench import BENCHMARKS as OF_THE_PACKAGE

BENCHMARKS = OF_THE_PACKAGE | {
    "blind": "flows.benchmarks.blind",
    "splits": "flows.benchmarks.splits",
    "tracking": "flows.benchmarks.tracking",
    "scale": "flows.benchmarks.scale",
}
"""Name -> module."""


def run(name: str, **options: Any) -> Iterator[dict[str, Any]]:
    """Lines of one benchmark, as they come."""
    yield from import_module(BENCHMARKS[name]).run(**options)
