"""Common parts of figures over time: records end to end on one axis, lines, bands and marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from aesi.numerics.typing import Array
from aesi.over_time import HELD, time_unit
from aesi.pipeline.report import style
from aesi.pipeline.report.views import DiscoveryTrace, RecordTrace
from aesi.records import Hold

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

SHAPES: Mapping[Hold, str] = {"linear": "linear", "backward": HELD}
"""Plotly's name for the line."""
OUTSIDE = "outside the trained range"
WHOLE_S = 10.0
"""Seconds from which on the start of a part is told to the second."""
SHARE_A_LETTER = 0.008
"""Width of a letter of a record's name, as a share of the axis of a wide page."""


@dataclass(frozen=True)
class Placed:
    """A record on the common time axis.  x : (n,) time of its rows there, in the unit of the axis."""

    trace: RecordTrace | DiscoveryTrace
    x: Array


def end_to_end(traces: Sequence[RecordTrace | DiscoveryTrace]) -> tuple[list[Placed], str]:
    """Records one after the other on one axis, and that axis's unit."""
    spans = [float(t.time_s[-1] - t.time_s[0]) for t in traces]
    unit, divisor = time_unit(sum(spans))
    starts = np.concatenate([[0.0], np.cumsum(spans)])
    placed = [Placed(t, (t.time_s - t.time_s[0] + s) / divisor) for t, s in zip(traces, starts, strict=False)]
    return placed, unit


def line(
    fig: Figure,
    x: Array,
    y: Array,
    name: str,
    colour: str,
    row: int = 1,
    in_legend: bool = True,
    width: float = 1.2,
    hold: Hold = "linear",
) -> None:
    """Add a series over time to panel `row`; the page thins it for display and refines it on zoom.

    in_legend : once for each name. The lines of one name, of several records or panels, are switched together.
    width : px.  hold : how the series runs between its rows.
    """
    fig.add_scatter(
        x=x,
        y=y,
        mode="lines",
        name=name,
        legendgroup=name,
        showlegend=in_legend,
        line={"color": colour, "width": width, "shape": SHAPES[hold]},
        meta={"keep": "minmax"},
        row=row,
        col=1,
    )


def band(
    fig: Figure,
    x: Array,
    low: Array,
    high: Array,
    name: str,
    colour: str,
    row: int = 1,
    in_legend: bool = True,
    edge: float = 0.0,
) -> None:
    """Add a shaded band between two series in panel `row`.  in_legend : as `line`.  edge : width of the outline, px."""
    look = {
        "mode": "lines",
        "line": {"width": edge, "color": colour},
        "legendgroup": name,
        "hoverinfo": "skip",
    }
    fig.add_scatter(x=x, y=low, name=name, showlegend=False, meta={"keep": "min"}, row=row, col=1, **look)
    fig.add_scatter(
        x=x,
        y=high,
        name=name,
        showlegend=in_legend,
        fill="tonexty",
        fillcolor=style.translucent(colour),
        meta={"keep": "max"},
        row=row,
        col=1,
        **look,
    )


def stack(rows: int, heights: tuple[float, ...] | None = None) -> Figure:
    """Panels above each other on one time axis."""
    from plotly.subplots import make_subplots

    return make_subplots(rows=rows, cols=1, shared_xaxes=True, vertical_spacing=0.04, row_heights=heights)


def mark_records(fig: Figure, placed: Sequence[Placed]) -> None:
    """A dotted line where a record begins, and its name on top where there is room."""
    for item in placed[:-1]:
        fig.add_vline(x=float(item.x[-1]), line={"width": 1, "dash": "dot", "color": style.GREY})
    if len(placed) > 1:
        length = float(placed[-1].x[-1] - placed[0].x[0])
        for item in placed:
            if float(item.x[-1] - item.x[0]) < SHARE_A_LETTER * len(item.trace.name) * length:
                continue  # it would run into the next
            fig.add_annotation(
                x=float(item.x[0]),
                y=1,
                xref="x",
                yref="y domain",
                text=item.trace.name,
                showarrow=False,
                xanchor="left",
                yanchor="top",
                xshift=3,
                font={"size": 10, "color": style.GREY},
            )


def mark_outside(fig: Figure, placed: Sequence[Placed], model: str) -> None:
    """A thick line along zero error where an input lies outside the range that this model was trained on."""
    in_legend = True
    for item in placed:
        assert isinstance(item.trace, RecordTrace)
        prediction = item.trace.predictions.get(model)
        if prediction is not None and prediction.outside is not None and prediction.outside.any():
            y = np.where(prediction.outside, 0.0, np.nan)
            line(fig, item.x, y, OUTSIDE, style.ORANGE, 2, in_legend, 5.0)
            in_legend = False


def time_title(placed: Sequence[Placed], unit: str) -> str:
    """Title of the time axis, which starts at zero; where a part of a record is shown, with the time at which it
    starts there."""
    if len(placed) > 1:
        return f"time, records end to end, {unit}"
    first = float(placed[0].trace.time_s[0])
    if not first:
        return f"time, {unit}"
    shown = f"{first:.0f}" if abs(first) >= WHOLE_S else f"{first:.3g}"
    return f"time after {shown} s of the record, {unit}"
