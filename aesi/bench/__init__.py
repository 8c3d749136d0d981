"""Benchmarks against the peers, by name: each yields one JSON-ready dict a line, peer and ours in one run."""

from typing import Any

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
