"""Times, ranges and durations in a few words, and columns over time drawn by plotly, one panel a quantity.

Plotly is imported where it is used.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import InputError
from aesi.numerics.typing import Array

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

LONGEST_IN_SECONDS = 20_000.0
"""Axes of longer tests are in hours."""
LONGEST_STAMP_S = 1e6
"""From which on six digits leave out whole seconds."""
PANEL_HEIGHT = 190
"""Pixels."""
COLOURS = ("#1f2328", "#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""Ink, then Okabe and Ito's palette, safe for colour-blind readers."""
HELD = "vh"
"""Plotly's name for the line of what a row holds since the row before: up or down there, and then along."""
BAND = "rgba(0,114,178,0.2)"


def time_unit(span_s: float) -> tuple[str, float]:
    """Label and divisor for an axis of that length: seconds, or hours for long tests."""
    return ("h", SECONDS_PER_HOUR) if span_s > LONGEST_IN_SECONDS else ("s", 1.0)


def stamp(time_s: float) -> str:
    """A row's time for a sentence, in s: six digits, of stamps since 1970 all that tell one row from the next."""
    return f"{time_s:.{6 if abs(time_s) < LONGEST_STAMP_S else 12}g}"


def range_words(low: str, high: str) -> str:
    """A range for a sentence, '2.5 to 4.1'; its one figure where both ends, as they are written, are the same."""
    return low if low == high else f"{low} to {high}"


def extent(time_s: Array) -> str:
    """Rows and duration, for a short text."""
    if not len(time_s):
        return "no rows"
    unit, divisor = time_unit(float(time_s[-1] - time_s[0]))
    length = float(time_s[-1] - time_s[0]) / divisor
    return f"{len(time_s):,} rows over {f'{length:,.0f}' if length >= 1000.0 else f'{length:.4g}'} {unit}"


def over_time(
    time_s: Array,
    panels: Mapping[str, Mapping[str, Array]],
    band: tuple[str, Array, Array] | None = None,
    held: Collection[str] = (),
) -> Figure:
    """A plotly figure: panels below one another over a common time, from the first sample.

    time_s : (n,) s.  panels : axis title with unit -> name -> (n,).  band : name, lower and upper (n,), in the first.
    held : names of what a row holds since the row before; all else runs straight between rows.
    Raises InputError where there is no row.
    """
    if not len(time_s):
        raise InputError("there is no row to draw; give a record that has rows.")
    from plotly.graph_objects import Scatter
    from plotly.subplots import make_subplots

    unit, divisor = time_unit(float(time_s[-1] - time_s[0]))
    x = (time_s - time_s[0]) / divisor
    figure = make_subplots(rows=len(panels), cols=1, shared_xaxes=True, vertical_spacing=0.04)
    if band is not None:
        name, low, high = band
        figure.add_trace(Scatter(x=x, y=low, line={"width": 0}, showlegend=False, hoverinfo="skip"), 1, 1)
        figure.add_trace(
            Scatter(x=x, y=high, name=name, line={"width": 0}, fill="tonexty", fillcolor=BAND), 1, 1
        )
    for row, (title, columns) in enumerate(panels.items(), start=1):
        for colour, (name, values) in zip(COLOURS, columns.items(), strict=False):
            line = {"width": 1.2, "color": colour, "shape": HELD if name in held else "linear"}
            figure.add_trace(Scatter(x=x, y=values, name=name, mode="lines", line=line), row, 1)
        figure.update_yaxes(title_text=title, row=row, col=1)
    figure.update_xaxes(title_text=f"time, {unit}", row=len(panels), col=1)
    return figure.update_layout(
        template="plotly_white", height=PANEL_HEIGHT * len(panels) + 80, hovermode="x unified"
    )
