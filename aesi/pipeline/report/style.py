"""Colours, sizes and the frame of every figure. Okabe and Ito's palette, safe for colour-blind readers.

Okabe & Ito, "Color Universal Design" (2008), jfly.uni-koeln.de/color. The page swaps INK and a few hues for
lighter ones on a dark background.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

INK = "#1f2328"
BLUE, VERMILLION, GREEN = "#0072B2", "#D55E00", "#009E73"
SKY, ORANGE, PURPLE, GREY = "#56B4E9", "#E69F00", "#CC79A7", "#8c8c8c"

MEASURED, PHYSICS, CHOSEN, INTERVAL = "#000000", VERMILLION, BLUE, SKY
MODEL_COLOURS = (BLUE, GREEN, PURPLE, ORANGE, SKY)
MEASURED_WIDTH = 1.6
"""Width of the line of measured values, px; lines of models are thinner."""
STATE_COLOURS = {"before": VERMILLION, "recalibrated": ORANGE, "after": BLUE}
KIND_COLOURS = {"physics": BLUE, "parameter": GREEN, "instrument": ORANGE}
KIND_SYMBOLS = {"physics": "circle", "parameter": "diamond", "instrument": "square"}
"""Kinds differ in shape too, for prints in grey."""

DIVERGING = "PuOr_r"
SEQUENTIAL = "Cividis"

HEADROOM = 58
"""Margin above a plot, px: a line of the legend below the buttons, which cover the uppermost 30."""


def figure(title: str, caption: str, height: int, **layout: Any) -> Figure:
    """An empty figure of a height, px; title and caption travel in its `meta` for the page to set."""
    from plotly.graph_objects import Figure

    return framed(Figure(), title, caption, height, **layout)


def framed(fig: Figure, title: str, caption: str, height: int, **layout: Any) -> Figure:
    """Give a figure the common frame: no title inside, the legend above, room for the units."""
    fig.update_layout(
        template="none",
        meta={"title": title, "caption": caption},
        height=height,
        margin={"l": 64, "r": 16, "t": HEADROOM, "b": 48},
        legend={"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        **layout,
    )
    fig.update_xaxes(automargin=True, title_standoff=8)
    fig.update_yaxes(automargin=True, title_standoff=8)
    return fig


def translucent(colour: str, alpha: float = 0.22) -> str:
    """A colour as rgba, with this opacity."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha:g})"
