"""Figures of the resistance within seconds of a step of the current: measured, and of each state of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from aesi.pipeline.report import style
from aesi.pipeline.report.views import Row
from aesi.tracer.report.step_resistance import WITHIN_S

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

READS = {
    "soc": (
        "A model whose resistance rises towards empty or full where the cell's does not has kinetics that slow down "
        "too much there."
    ),
    "current_a": (
        "Contacts have the same resistance at any current. A model whose resistance falls with the size of the current "
        "where the cell's does not has kinetics that are too slow, and contacts of too little resistance."
    ),
}
AXES = {
    "soc": ("state of charge", "SOC, %", 100.0),
    "current_a": ("current", "current, A (discharge > 0)", 1.0),
}


def figures(resistance: Mapping[str, Sequence[Row]], labels: Mapping[str, str]) -> dict[str, Figure]:
    """`step_by_soc` and `step_by_current`, of the rows of `step_resistance` in discovery.json; none without rows."""
    return {
        f"step_{key}": _figure(rows, variable, labels)
        for key, variable in (("by_soc", "soc"), ("by_current", "current_a"))
        if (rows := resistance.get(key))
    }


def _figure(rows: Sequence[Row], variable: str, labels: Mapping[str, str]) -> Figure:
    by, axis, scale = AXES[variable]
    caption = (
        f"Change of the voltage within {WITHIN_S:g} s of a step of the current, over that step, in bins of {by}. "
        f"{READS[variable]} Bins with few steps are left out."
    )
    fig = style.figure(f"Resistance within seconds, by {by}", caption, 340, hovermode="x unified")
    colours = {"measured": style.MEASURED, **style.STATE_COLOURS}
    for state, label in {"measured": "measured", **labels}.items():
        fig.add_scatter(
            x=[scale * row[variable] for row in rows],
            y=[row[f"{state}_mohm"] for row in rows],
            mode="lines+markers",
            name=label,
            marker={"size": 6},
            line={"color": colours[state], "width": style.MEASURED_WIDTH if state == "measured" else 1.0},
            hovertemplate="%{y:.3g} mΩ",
        )
    fig.update_xaxes(title_text=axis)
    fig.update_yaxes(title_text="resistance, mΩ", rangemode="tozero")
    return fig
