"""Benchmarks against the peers, by name: each yields one JSON-ready dict a line, peer and ours in one run."""

from collections.abc import Iterator
from importlib import import_module
from typing import Any

BENCHMARKS = {
    "espm": "aesi.bench.espm",
    "ensemble": "aesi.bench.ensemble",
    "spci": "aesi.bench.spci",
    "blind": "aesi.bench.blind",
}
"""Name -> module with a function `run(**options) -> Iterator[dict]`."""


def run(name: str, **options: Any) -> Iterator[dict[str, Any]]:
    """Lines of one benchmark, as they come."""
    yield from import_module(BENCHMARKS[name]).run(**options)
