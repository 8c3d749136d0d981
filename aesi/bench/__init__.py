"""Benchmarks against the peers, by name: each yields one JSON-ready dict a line, peer and ours in one run."""

from typing import Any

CaseRow = dict[str, Any]
"""What is told of one case: JSON-ready values by name."""

BENCHMARKS = {
    "espm": "aesi.bench.espm",
    "dfn": "aesi.bench.dfn",
    "ensemble": "aesi.bench.ensemble",
    "design": "aesi.bench.design",
    "spci": "aesi.bench.spci",
    "bands": "aesi.bench.bands",
    "cells": "aesi.bench.cells",
}
"""Name -> module with a function `run(**options) -> Iterator[dict]`."""
