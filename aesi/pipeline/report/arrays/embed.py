"""A figure as the page carries it: thinned for display, with every sample in a store that zooming reads.

Series marked with `meta = {"keep": ...}` are replaced by their envelope of at most DISPLAYED points a figure
and row; their full arrays go once into the page's store, and report.js draws the envelope of what is visible
whenever the axis changes.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from aesi.numerics.typing import AnyArray
from aesi.pipeline.report.arrays.decimate import Keep, envelope

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

DISPLAYED = 4000
"""Points drawn for one series over all records of a figure."""
STORED = 200_000
"""Samples kept for zooming into one series; longer ones are thinned to this before."""


@dataclass(eq=False)
class ArrayStore:
    """Arrays of a page, each once: id -> {dtype, data} with base64 data."""

    arrays: dict[str, dict[str, str]] = field(default_factory=dict)

    def add(self, array: AnyArray) -> str:
        """Keep the array and return its id, the same for the same content."""
        data, dtype = np.ascontiguousarray(array).tobytes(), array.dtype.str[1:]
        key = hashlib.sha256(dtype.encode() + data).hexdigest()[:12]
        self.arrays.setdefault(key, {"dtype": dtype, "data": base64.b64encode(data).decode("ascii")})
        return key


@dataclass(frozen=True)
class Embedded:
    """A figure ready for the page.

    data : plotly's JSON.  samples, kept, drawn : rows of its series as they were, as stored for zooming, and as drawn.
    """

    data: dict[str, Any]
    samples: int
    drawn: int
    kept: int


def embed(fig: Figure, store: ArrayStore) -> Embedded:
    """Thin the series of `fig` for display and put their samples into `store`."""
    names = [(trace.name, trace.yaxis, _keep(trace)) for trace in fig.data if _keep(trace)]
    limit = max(DISPLAYED // max((names.count(name) for name in names), default=1), 200)
    content = json.loads(_without_long_series(fig))
    samples = drawn = kept = 0
    for trace, entry in zip(fig.data, content["data"], strict=True):
        keep = _keep(trace)
        if keep is None:
            continue
        x, y = np.asarray(trace.x, dtype=float), np.asarray(trace.y, dtype=float)
        samples = max(samples, len(y))
        stored = envelope(y, STORED, keep)
        x, y = x[stored], y[stored]
        shown = envelope(y, limit, keep)
        kept, drawn = max(kept, len(y)), max(drawn, len(shown))
        entry["x"], entry["y"] = _rounded(x[shown]), _rounded(y[shown])
        if len(shown) < len(y):
            entry["meta"] |= {"x": store.add(x), "y": store.add(y.astype("f4")), "limit": limit}
    return Embedded(content, samples, drawn, kept)


def _keep(trace: Any) -> Keep | None:
    """Which side of its envelope a series asks for; None for what is drawn as it is."""
    keep: Keep | None = (trace.meta or {}).get("keep")
    return keep


def _without_long_series(fig: Figure) -> str:
    """Plotly's JSON with the marked series empty: they would be by far the most of it."""
    from plotly.graph_objects import Figure

    light = Figure(fig)
    for trace in light.data:
        if _keep(trace):
            trace.x = trace.y = None
    return str(light.to_json())


def _rounded(values: AnyArray) -> list[float | None]:
    """Seven significant digits, null where not finite: what JSON and a screen can hold."""
    return [float(f"{v:.7g}") if math.isfinite(v) else None for v in values.tolist()]
