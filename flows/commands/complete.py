"""What a shell offers where a name is expected; each imports only what knows the names."""

from __future__ import annotations

from collections.abc import Iterable


def effects(incomplete: str) -> list[str]:
    """Effects of the catalogue."""
    from aesi.physics.effects import CATALOGUE

    return _starting(CATALOGUE, incomplete)


def benchmarks(incomplete: str) -> list[str]:
    """Benchmarks."""
    from flows.benchmarks import BENCHMARKS

    return _starting(BENCHMARKS, incomplete)


def data_sets(incomplete: str) -> list[str]:
    """Data sets of the catalogue."""
    from aesi.data.catalogue import SETS

    return _starting([each.name for each in SETS], incomplete)


def _starting(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
