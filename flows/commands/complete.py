"""Completions that a shell offers where a name is expected.

incomplete : what has been typed so far. Each function imports only the module that knows the names, so that a shell
does not wait for the libraries.
"""

from __future__ import annotations

from collections.abc import Iterable


def effects(incomplete: str) -> list[str]:
    """Ids of the effects in the catalogue that begin so."""
    from aesi.physics.effects import CATALOGUE

    return _starting(CATALOGUE, incomplete)


def benchmarks(incomplete: str) -> list[str]:
    """Names of the benchmarks that begin so."""
    from flows.benchmarks import BENCHMARKS

    return _starting(BENCHMARKS, incomplete)


def data_sets(incomplete: str) -> list[str]:
    """Names of the data sets in the catalogue that begin so."""
    from aesi.data.catalogue import SETS

    return _starting([each.name for each in SETS], incomplete)


def _starting(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
