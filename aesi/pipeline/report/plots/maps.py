"""Figures over the operating range: error maps over (current, SOC), error against one variable, violins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.arrays.binning import ErrorMap, error_map, profile

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

QUANTILES = 801
"""A violin is drawn from this many evenly spaced quantiles instead of every sample."""
SMALLEST_SQUARE_MV2 = 1e-6
"""Squared residuals below (1 uV)^2 count as this on a logarithmic axis."""


def map_figure(
    current_a: Array, soc: Array, error_v: Array, title: str, absolute: bool, limit_mv: float
) -> Figure:
    """Mean error, or mean absolute error, in bins over (current, SOC), in mV.

    limit_mv : end of the colours; see `shared_limit`.
    """
    error_mv = (np.abs(error_v) if absolute else error_v) * MV_PER_V
    binned = error_map(current_a, soc, error_mv)
    word = "mean |error|" if absolute else "mean error"
    caption = (
        f"{word.capitalize()} in bins over current and state of charge; bins with few samples are blank."
    )
    if np.nanmax(np.abs(binned.mean), initial=0.0) > limit_mv:
        caption += " A few lie beyond the colours and have the last one; the cursor tells their values."
    fig = style.figure(title, caption, 360)
    fig.add_heatmap(
        x=binned.current_a,
        y=100 * binned.soc,
        z=binned.mean,
        customdata=binned.count,
        colorscale=style.SEQUENTIAL if absolute else style.DIVERGING,
        zmin=0 if absolute else -limit_mv,
        zmax=limit_mv,
        hoverongaps=False,
        colorbar={"title": {"text": "mV"}, "thickness": 12, "outlinewidth": 0},
        hovertemplate="%{x:.3g} A, SOC %{y:.3g} %<br>%{z:.2f} mV from %{customdata} samples<extra></extra>",
    )
    fig.update_xaxes(title_text="current, A (discharge > 0)", showgrid=False)
    fig.update_yaxes(title_text="SOC, %", showgrid=False)
    return fig


def _limit(binned: ErrorMap) -> float:
    """A colour range that a single bin cannot stretch: the 98th percentile of |mean|."""
    values = np.abs(binned.mean[np.isfinite(binned.mean)])
    return float(np.percentile(values, 98)) if len(values) else 1.0


def shared_limit(current_a: Array, soc: Array, errors_v: Sequence[Array], absolute: bool) -> float:
    """One colour range for maps that are to be compared: the widest of theirs, mV."""
    as_drawn = [(np.abs(e) if absolute else e) * MV_PER_V for e in errors_v]
    return max(_limit(error_map(current_a, soc, e)) for e in as_drawn)


def dependence_figure(
    x: Array, errors_v: Mapping[str, Array], labels: Mapping[str, str], axis: str
) -> Figure:
    """Median and quartiles of the residual against one variable, one band a state of the model."""
    name = axis.split(",")[0]
    caption = f"Median (line) and quartiles (band) of the residual in bins of {name}."
    fig = style.figure(f"Residual against {name}", caption, 340, hovermode="x unified")
    for state, error_v in errors_v.items():
        binned = profile(x, error_v * MV_PER_V)
        colour = style.STATE_COLOURS[state]
        edge = {"x": binned.x, "mode": "lines", "line": {"width": 0, "color": colour}, "hoverinfo": "skip"}
        fig.add_scatter(y=binned.low, showlegend=False, legendgroup=state, **edge)
        fill = {"fill": "tonexty", "fillcolor": style.translucent(colour, 0.18)}
        fig.add_scatter(y=binned.high, showlegend=False, legendgroup=state, **fill, **edge)
        fig.add_scatter(
            x=binned.x,
            y=binned.median,
            mode="lines+markers",
            marker={"size": 4},
            name=labels[state],
            legendgroup=state,
            line={"color": colour, "width": 2},
        )
    fig.update_xaxes(title_text=axis)
    fig.update_yaxes(title_text="residual, mV", zeroline=True)
    return fig


def violin_figure(residuals_v: Mapping[str, Array], colours: Mapping[str, str]) -> Figure:
    """Distribution of squared residuals in free run, one violin a model on a logarithmic axis, the one that errs least
    on top."""
    caption = (
        "Squared residuals of the voltage in free run on the test records, logarithmic axis, the model of the least "
        f"RMSE on top; the box spans the quartiles. Drawn from {QUANTILES} quantiles of all samples."
    )
    squares = {
        name: np.maximum((residual * MV_PER_V) ** 2, SMALLEST_SQUARE_MV2)
        for name, residual in residuals_v.items()
    }
    fig = style.figure("Squared residuals by model", caption, 110 + 62 * len(squares), showlegend=False)
    for name in sorted(squares, key=lambda one: float(np.mean(squares[one])), reverse=True):
        square = squares[name]
        exponents = np.log10(np.quantile(square[np.isfinite(square)], np.linspace(0, 1, QUANTILES)))
        fig.add_violin(
            x=exponents,
            name=name,
            orientation="h",
            box={"visible": True},
            meanline={"visible": False},
            points=False,
            line={"color": colours[name]},
            fillcolor=style.translucent(colours[name]),
            hoverinfo="skip",
            spanmode="hard",
        )
    powers = list(range(-6, 8, 2))
    fig.update_xaxes(
        title_text="squared residual, mV²", tickvals=powers, ticktext=[f"10<sup>{p}</sup>" for p in powers]
    )
    return fig
