"""Figures over time: profiles, voltage traces and the error beneath them, records end to end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.plots.timeline import (
    Placed,
    band,
    end_to_end,
    line,
    mark_outside,
    mark_records,
    stack,
    time_title,
)
from aesi.pipeline.report.views import DiscoveryTrace, RecordTrace
from aesi.records import Hold

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

BESIDE_SERIES = 0.1
"""Room above and below the series that an axis is made for, as a share of their span."""
BAND = "band"
"""Beginning of the name of a band, by which its traces are told from lines."""
ROLE_NAMES = {"train": "I training", "valid": "II validation", "test": "III test"}
ROLE_WORDS = {"train": "training", "valid": "validation", "test": "test"}


def profile_figure(traces: Sequence[RecordTrace], quantity: str, hold: Hold = "linear") -> Figure:
    """Current or voltage of every record by role; `quantity` is `current` or `voltage`.

    hold : how the current runs between rows.
    """
    fig = stack(1)
    label = {"current": "current, A (discharge > 0)", "voltage": "voltage, V"}[quantity]
    placed, unit = end_to_end(traces)
    colours = {"train": style.BLUE, "valid": style.ORANGE, "test": style.GREEN}
    seen: set[str] = set()
    for item in placed:
        trace = item.trace
        assert isinstance(trace, RecordTrace)
        y, course = (trace.current_a, hold) if quantity == "current" else (trace.measured_v, "linear")
        role = ROLE_NAMES[trace.role]
        line(fig, item.x, y, role, colours[trace.role], in_legend=role not in seen, hold=course)
        seen.add(role)
    mark_records(fig, placed)
    fig.update_xaxes(title_text=time_title(placed, unit))
    fig.update_yaxes(title_text=label)
    caption = f"Measured {quantity} of the training (I), validation (II) and test (III) records."
    return style.framed(fig, f"{quantity.capitalize()} profile", caption, 320, hovermode="x unified")


def voltage_figure(traces: Sequence[RecordTrace], chosen: str, physics: str) -> Figure:
    """Measured, physics and hybrid voltage in free run, and the error of both beneath, with its band."""
    fig = stack(2)
    placed, unit = end_to_end(traces)
    for i, item in enumerate(placed):
        trace = item.trace
        assert isinstance(trace, RecordTrace)
        first = i == 0
        line(fig, item.x, trace.physics_v, physics, style.PHYSICS, in_legend=first)
        line(fig, item.x, _error(trace, trace.physics_v), physics, style.PHYSICS, 2, in_legend=False)
        _add_free_run(fig, item, chosen, in_legend=first)
        line(
            fig,
            item.x,
            trace.measured_v,
            "measured",
            style.MEASURED,
            in_legend=first,
            width=style.MEASURED_WIDTH,
        )
    mark_outside(fig, placed, chosen)
    mark_records(fig, placed)
    fig.update_yaxes(title_text="voltage, V", row=1)
    fig.update_yaxes(title_text="error, mV", row=2, zeroline=True)
    fig.update_xaxes(title_text=time_title(placed, unit), row=2)
    role = traces[0].role
    caption = (
        f"Top: measured voltage, {physics} alone, and {chosen} in free run (no measured voltage after the "
        "first sample of a record). Bottom: measured minus model."
    )
    caption += _fit_error_axis(fig)
    return style.framed(
        fig, f"Voltage on the {ROLE_WORDS[role]} records", caption, 560, hovermode="x unified"
    )


def _add_free_run(fig: Figure, item: Placed, model: str, in_legend: bool) -> None:
    """Add the voltage of a model in free run (panel 1), and its error with the band (panel 2), mV, where it has one."""
    trace = item.trace
    assert isinstance(trace, RecordTrace)
    prediction = trace.predictions.get(model)
    if prediction is None:
        return
    if prediction.free_run_lower_v is not None and prediction.free_run_upper_v is not None:
        # The band of the voltage, seen from the measurement: e = V_measured - V, so its edges swap.
        low = _error(trace, prediction.free_run_upper_v)
        high = _error(trace, prediction.free_run_lower_v)
        band(fig, item.x, low, high, f"{BAND} of {model}", style.BLUE, 2, in_legend)
    line(fig, item.x, prediction.free_run_v, model, style.BLUE, in_legend=in_legend)
    line(fig, item.x, _error(trace, prediction.free_run_v), model, style.BLUE, 2, in_legend=False)


def _fit_error_axis(fig: Figure) -> str:
    """Let the axis of panel 2 span the errors rather than a wider band. Returns sentences for the caption, '' without a
    band."""
    bands = [trace.y for trace in fig.data if trace.name.startswith(BAND)]
    if not bands:
        return ""
    caption = " The measurement lies inside the band where the band contains zero."
    errors = [trace.y for trace in fig.data if trace.yaxis == "y2" and not trace.name.startswith(BAND)]
    low, high = _roomy(errors)
    if any(np.nanmin(y) < low or np.nanmax(y) > high for y in bands):
        fig.update_yaxes(range=(low, high), row=2)
        caption += (
            " The axis spans the errors, and the band goes on beyond it: a double click shows all of it."
        )
    return caption


def residual_figure(traces: Sequence[DiscoveryTrace], labels: Mapping[str, str]) -> Figure:
    """Voltage measured and in the first and last state of the model, current, and the residuals, over time."""
    fig = stack(3, (0.3, 0.2, 0.5))
    placed, unit = end_to_end(traces)
    first_and_last = list(dict.fromkeys((next(iter(labels)), list(labels)[-1])))
    for i, item in enumerate(placed):
        trace = item.trace
        assert isinstance(trace, DiscoveryTrace)
        for state in first_and_last:
            voltage = getattr(trace, f"{state}_v")
            line(fig, item.x, voltage, labels[state], style.STATE_COLOURS[state], 1, in_legend=False)
        line(fig, item.x, trace.measured_v, "measured", style.MEASURED, 1, i == 0, style.MEASURED_WIDTH)
        line(fig, item.x, trace.current_a, "current", style.GREY, 2, i == 0, 1.0, trace.hold)
        for state, label in labels.items():
            error = (trace.measured_v - getattr(trace, f"{state}_v")) * MV_PER_V
            line(fig, item.x, error, label, style.STATE_COLOURS[state], 3, i == 0)
    mark_records(fig, placed)
    low, high = _roomy([t.measured_v for t in traces])
    fig.update_yaxes(title_text="voltage, V", row=1)
    fig.update_yaxes(title_text="current, A", row=2)
    fig.update_yaxes(title_text="residual, mV", zeroline=True, row=3)
    fig.update_xaxes(title_text=time_title(placed, unit), row=3)
    part = "held-out data" if traces[0].part == "test" else "the fitted data"
    caption = (
        f"Voltage measured, {' and '.join(dict.fromkeys(labels[state] for state in first_and_last))}; "
        f"current, positive on discharge; residual (measured minus model), on {part}."
    )
    drawn = [getattr(t, f"{state}_v") for t in traces for state in first_and_last]
    if any(np.nanmin(v) < low or np.nanmax(v) > high for v in drawn if np.isfinite(v).any()):
        fig.update_yaxes(range=(low, high), row=1)
        caption += " The axis of the voltage spans what was measured: a double click shows the rest."
    return style.framed(
        fig, f"Voltage and residual over time, {traces[0].part} part", caption, 600, hovermode="x unified"
    )


def _roomy(series: Sequence[Array]) -> tuple[float, float]:
    """(low, high) of an axis that spans these series, with some room; what else is drawn does not flatten them."""
    low = min(float(np.nanmin(y)) for y in series)
    high = max(float(np.nanmax(y)) for y in series)
    room = BESIDE_SERIES * (high - low)
    return low - room, high + room


def interval_figure(traces: Sequence[RecordTrace], model: str, zoom_s: float | None = None) -> Figure | None:
    """Error, its one-step prediction and interval; with `zoom_s`, the liveliest stretch of that length."""
    usable = [t for t in traces if _has_intervals(t, model)]
    if not usable:
        return None
    if zoom_s is not None:
        usable = [_liveliest(usable, zoom_s)]
    fig = stack(2)
    placed, unit = end_to_end(usable)
    for i, item in enumerate(placed):
        _add_interval(fig, item, model, in_legend=i == 0)
    mark_records(fig, placed)
    fig.update_xaxes(title_text=time_title(placed, unit), row=2)
    fig.update_yaxes(title_text="voltage error, mV", row=1)
    fig.update_yaxes(title_text="minus prediction, mV", zeroline=True, row=2)
    title = f"Prediction intervals of {model}"
    caption = (
        "Regime: one step ahead, the measured voltage of the step before is given. Test records. Top: "
        "measured error of the physics model, its prediction and interval. Bottom: the same with the "
        "prediction taken off. An interval follows the errors of the rows before it, so that the prediction may lie "
        "outside: the middle of the interval is the better estimate there."
    )
    if zoom_s is not None:
        title += ", zoom"
        caption += f" The {zoom_s:g} s in which the current changes most ({usable[0].name})."
    return style.framed(fig, title, caption, 480, hovermode="x unified")


def _add_interval(fig: Figure, item: Placed, model: str, in_legend: bool) -> None:
    """Add the error, its one-step prediction and interval (panel 1), and these minus the prediction (panel 2), mV."""
    trace = item.trace
    assert isinstance(trace, RecordTrace)
    prediction = trace.predictions[model]
    edges = (prediction.one_step_lower_v, prediction.one_step_upper_v)
    low, high, centre = (_estimate(trace, v) for v in (*edges, prediction.one_step_v))
    error = _error(trace, trace.physics_v)
    band(fig, item.x, low, high, "interval", style.INTERVAL, in_legend=in_legend)
    line(fig, item.x, error, "measured error", style.MEASURED, in_legend=in_legend, width=1.0)
    line(fig, item.x, centre, "predicted error", style.BLUE, in_legend=in_legend)
    line(fig, item.x, error - centre, "measured error", style.MEASURED, 2, False, 0.8)
    band(fig, item.x, low - centre, high - centre, "interval", style.INTERVAL, 2, False, edge=1.2)


def _error(trace: RecordTrace, model_v: Array) -> Array:
    return (trace.measured_v - model_v) * MV_PER_V


def _estimate(trace: RecordTrace, hybrid_v: Array | None) -> Array:
    """The error that a hybrid voltage stands for, mV."""
    assert hybrid_v is not None
    return (hybrid_v - trace.physics_v) * MV_PER_V


def _has_intervals(trace: RecordTrace, model: str) -> bool:
    prediction = trace.predictions.get(model)
    return prediction is not None and not (
        prediction.one_step_v is None
        or prediction.one_step_lower_v is None
        or prediction.one_step_upper_v is None
    )


def _liveliest(traces: Sequence[RecordTrace], window_s: float) -> RecordTrace:
    """The stretch of `window_s` in which the current travels furthest."""
    windows = ((trace, rows) for trace in traces for rows in _windows(trace, window_s))
    return cut(*max(windows, key=lambda found: float(np.abs(np.diff(found[0].current_a[found[1]])).sum())))


def _windows(trace: RecordTrace, window_s: float) -> Iterator[slice]:
    """Half-overlapping windows over a record; the whole record where it is shorter."""
    start, last = float(trace.time_s[0]), float(trace.time_s[-1])
    while True:
        low, high = np.searchsorted(trace.time_s, [start, start + window_s], side="left")
        yield slice(int(low), max(int(high), int(low) + 2))
        start += window_s / 2
        if start + window_s > last:
            return


def cut(trace: RecordTrace, rows: slice) -> RecordTrace:
    """A piece of a record, predictions included."""

    def piece(record: object) -> dict[str, Array]:
        values = {f.name: getattr(record, f.name) for f in fields(record)}  # type: ignore[arg-type]
        return {name: value[rows] for name, value in values.items() if isinstance(value, np.ndarray)}

    predictions = {name: replace(p, **piece(p)) for name, p in trace.predictions.items()}  # type: ignore[arg-type]
    return replace(trace, predictions=predictions, **piece(trace))  # type: ignore[arg-type]
