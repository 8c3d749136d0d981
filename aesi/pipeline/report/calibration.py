"""The page of a calibration: what is left of each record, what the records tell of the parameters, and spectra."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aesi.calibration.result import NOTABLY
from aesi.constants import MV_PER_V
from aesi.over_time import range_words
from aesi.pipeline.report import style
from aesi.pipeline.report.nyquist import nyquist_figures
from aesi.pipeline.report.page import write_page
from aesi.pipeline.report.plots import maps, records
from aesi.pipeline.report.views import DiscoveryTrace, Row
from aesi.pipeline.report.words.calibrations import as_simulated, best_known_first, pulse_sentence

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

    from aesi.pipeline.impedance import SpectrumError

STATES = {"before": "start file", "recalibrated": "as the file is simulated", "after": "as fitted"}
"""State of the model in a trace -> what the page calls it."""
COURSES = {"diffusivity": "solid diffusivity", "rate": "reaction rate", "film": "film resistance"}
"""Quantities that follow a course over stoichiometry: in the name of a knot -> in words."""
SIDES = {"negative": style.BLUE, "positive": style.VERMILLION}
SHOWN = 0.999
"""Share of the fit's residuals that the figure over time shows. On five calibrations its axis then reaches 4 to 9 times
their root mean square, and their largest is 1.1 to 1.9 times beyond; the start files' are 2 to 40 times beyond."""
BESIDE = 0.05
"""Largest distance of a measured pulse from a state of charge at which it is drawn beside the model's. A convention:
half of what pulse tests step by."""
KNOT, PLACE_ENDS = "_at_", "_percent"


@dataclass(frozen=True, eq=False)
class CalibrationView:
    """Everything the page shows.

    content : of the report in JSON (see `aesi.pipeline.calibrate.calibration_content`).  model : its name in words.
    traces : each record as it was fitted; `before_v` is of the start file, `recalibrated_v` of the file that was
    written, as it is simulated, `after_v` of the fit, with what the record has of its own.
    health : words for the quantities of `content["health"]`.  left : what the records leave open, in a sentence.
    """

    content: Mapping[str, Any]
    model: str
    traces: tuple[DiscoveryTrace, ...]
    health: Mapping[str, str]
    left: str = ""
    spectra: tuple[SpectrumError, ...] = ()


def write_calibration_report(path: str | Path, view: CalibrationView) -> Path:
    """Write the page of a calibration to `path` and return it."""
    parameters = best_known_first(view.content)
    nyquist = nyquist_figures(view.spectra)
    return write_page(
        path,
        "calibration.html",
        _fit_figures(view.traces) | courses(parameters) | pulse_figure(view.content) | nyquist,
        title=f"Calibration of {view.content['cell']}",
        view=view,
        finding=finding(view.content),
        pulse_sentence=pulse_sentence(view.content),
        as_simulated=as_simulated,
        parameters=[row for row in parameters if KNOT not in row["name"]],
        knots=[row for row in parameters if KNOT in row["name"]],
        nyquist=list(nyquist),
    )


def finding(content: Mapping[str, Any]) -> str:
    """Sentence on how far off the records the fit is, and was the start file, in free run; then the file by itself."""
    files = content["files"]
    after, before = (_range([row[f"{key}_rmse_mv"] for row in files]) for key in ("after", "before"))
    simulated = [
        row["as_simulated_rmse_mv" if row["until_ran_out_rmse_mv"] is None else "until_ran_out_rmse_mv"]
        for row in files
    ]
    ran_out = [row["name"] for row in files if row["until_ran_out_rmse_mv"] is not None]
    until = f", until it runs out on {', '.join(ran_out)}" if ran_out else ""
    on = files[0]["name"] if len(files) == 1 else f"the {len(files)} records that it was fitted to"
    worse = [
        row["name"]
        for row in files
        if max(row["after_rmse_mv"], row["as_simulated_rmse_mv"]) > NOTABLY * row["before_rmse_mv"]
    ]
    against = f" On {', '.join(worse)} the start file has the lower error." if worse else ""
    return (
        f"In free run the calibrated model errs by {after} mV RMSE on {on}, where the start file erred by {before} mV. "
        "With the written file alone, without each record's own initial state, capacity and current offset, the error "
        f"is {_range(simulated)} mV{until}.{against}"
    )


def _range(values: Sequence[float]) -> str:
    least, most = (f"{each:.1f}" for each in (min(values), max(values)))
    return range_words(least, most)


def _fit_figures(traces: Sequence[DiscoveryTrace]) -> dict[str, Figure]:
    """Voltage and residual over time, and the residual against current and state of charge."""
    if not traces:
        return {}
    over_time = records.residual_figure(traces, STATES)
    over_time.update_layout(
        meta={
            "title": "Voltage and residual over time",
            "caption": "Voltage measured, of the start file and as fitted; current, positive on discharge; residual "
            "(measured minus model) in free run, on the rows that were fitted. The axes span what was measured and "
            "what the fit leaves: a double click shows the rest.",
        }
    )
    current, soc = (np.concatenate([getattr(t, key) for t in traces]) for key in ("current_a", "soc"))
    error_v = np.concatenate([t.measured_v - t.after_v for t in traces])
    most_mv = MV_PER_V * float(np.nanquantile(np.abs(error_v), SHOWN))
    over_time.update_yaxes(range=(-most_mv, most_mv), row=3)
    errors = {"after": error_v}
    return {
        "residual": over_time,
        "against_current": maps.dependence_figure(current, errors, STATES, "current, A (discharge > 0)"),
        "against_soc": maps.dependence_figure(100.0 * soc, errors, STATES, "state of charge, %"),
    }


def courses(parameters: Sequence[Row]) -> dict[str, Figure]:
    """The factors at the knots over stoichiometry, both electrodes, a panel a quantity; none without knots."""
    from plotly.subplots import make_subplots

    found = _knots(parameters)
    shown = [what for what in COURSES if any(key[0] == what for key in found)]
    if not shown:
        return {}
    fig = make_subplots(rows=1, cols=len(shown), horizontal_spacing=0.08)
    for (what, side), knots in sorted(found.items()):
        rows = [row for _, row in knots]
        fig.add_scatter(
            x=[place for place, _ in knots],
            y=[row["value"] for row in rows],
            error_y={
                "type": "data",
                "array": [row["high"] - row["value"] for row in rows],
                "arrayminus": [row["value"] - row["low"] for row in rows],
                "thickness": 1,
                "width": 3,
            },
            mode="lines+markers",
            name=f"{side} electrode",
            legendgroup=side,
            showlegend=what == shown[0],
            line={"color": SIDES[side]},
            row=1,
            col=1 + shown.index(what),
        )
    for column, what in enumerate(shown, start=1):
        fig.update_xaxes(title_text="place in the stoichiometry window, %", row=1, col=column)
        fig.update_yaxes(title_text=f"{COURSES[what]}, factor", type="log", dtick=1, row=1, col=column)
    caption = (
        "Factors over stoichiometry with 95 % intervals; each multiplies the factor of the whole electrode in the "
        "table. 0 % is the lowest stoichiometry of the electrode's window. Where an interval spans a decade, the "
        "records hardly determine the factor."
    )
    return {"courses": style.framed(fig, "Dependence on stoichiometry", caption, 340)}


def pulse_figure(content: Mapping[str, Any]) -> dict[str, Figure]:
    """The resistance of a pulse over temperature, a line and a band a state of charge, on a logarithmic axis."""
    told = content["pulse_resistance"]
    fig = style.figure(
        "Resistance of a pulse over temperature",
        "Lines: as the file predicts. Bands: 95 % intervals. A dotted line: no record is near. Crosses: "
        f"measured, pulses in the records within {100.0 * BESIDE:g} points of that charge.",
        400,
    )
    for k, (soc, colour) in enumerate(zip(told["soc"], style.MODEL_COLOURS, strict=False)):
        rows = [row for row in told["rows"] if row["mohm"][k] is not None]
        degc = [row["temperature_degc"] for row in rows]
        name = f"{100 * soc:.0f} % charge"
        fig.add_scatter(
            x=[*degc, *degc[::-1]],
            y=[row["high_mohm"][k] for row in rows] + [row["low_mohm"][k] for row in rows[::-1]],
            mode="none", fill="toself", fillcolor=style.translucent(colour), hoverinfo="skip",
            legendgroup=name, showlegend=False,
        )  # fmt: skip
        fig.add_scatter(
            x=degc, y=[row["mohm"][k] for row in rows], mode="lines", legendgroup=name, showlegend=False,
            line={"color": colour, "dash": "dot"}, hoverinfo="skip",
        )  # fmt: skip
        near = [row for row in rows if row["fitted"]]
        fig.add_scatter(
            x=[row["temperature_degc"] for row in near], y=[row["mohm"][k] for row in near],
            mode="lines+markers", name=name, legendgroup=name, line={"color": colour},
        )  # fmt: skip
        beside = [pulse for pulse in told["measured"] if abs(pulse["soc"] - soc) <= BESIDE]
        fig.add_scatter(
            x=[pulse["temperature_degc"] for pulse in beside], y=[pulse["mohm"] for pulse in beside],
            mode="markers", legendgroup=name, showlegend=False, text=[pulse["record"] for pulse in beside],
            marker={"color": colour, "symbol": "x", "size": 9},
        )  # fmt: skip
    fig.update_xaxes(title_text="temperature, °C")
    fig.update_yaxes(title_text="resistance, mohm", type="log", dtick="D2")
    return {"pulse_resistance": fig}


def _knots(parameters: Sequence[Row]) -> dict[tuple[str, str], list[tuple[float, Row]]]:
    """(quantity, electrode) -> place in the window, %, and row of each knot, in order of the places."""
    found: dict[tuple[str, str], list[tuple[float, Row]]] = {}
    for row in parameters:
        course, is_knot, place = row["name"].partition(KNOT)
        side, _, what = course.partition(".")
        if is_knot and what in COURSES and side in SIDES:
            found.setdefault((what, side), []).append((float(place.removesuffix(PLACE_ENDS)), row))
    return {key: sorted(knots, key=lambda knot: knot[0]) for key, knots in found.items()}
