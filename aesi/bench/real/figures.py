"""The figures of the report: the confusion matrix, sizes found against true ones, and residuals of the worst cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from aesi.bench import CaseRow
from aesi.constants import SECONDS_PER_HOUR
from aesi.pipeline.report import style

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

WORST = 5
LINE_PX = 17
"""Height of a name beside the confusion matrix, px."""
RATIO = (-1.0, 3.0)
"""Range of the ratio of found to true size that is drawn; what lies beyond is drawn at the edge."""
STATES = {"before": "as declared", "recalibrated": "recalibrated", "after": "after"}


def confusion_figure(matrix: Mapping[str, Mapping[str, int]]) -> Figure:
    """Right answers down, what was said across, cases in each field."""
    asked = sorted(matrix)
    said = sorted({name for counts in matrix.values() for name in counts})
    counts = [[matrix[a].get(s, 0) for s in said] for a in asked]
    shares = [[n / max(1, sum(row)) for n in row] for row in counts]
    rows = [a.replace("_", " ").replace(" or ", " or<br>") for a in asked]
    tallest = max(row.count("<br>") for row in rows) + 1
    fig = style.figure(
        "What was there, and what was said",
        "Rows: the right name, or one of several; columns: what the loop said, names that it is not sure of after "
        "'unknown'. Numbers are cases, shades their share of the row.",
        220 + max(30, LINE_PX * tallest) * len(asked),
    )
    fig.add_heatmap(
        z=shares,
        x=[s.replace("_", " ") for s in said],
        y=rows,
        text=[[str(n) if n else "" for n in row] for row in counts],
        texttemplate="%{text}",
        colorscale=[[0, "rgba(0,114,178,0)"], [1, "rgba(0,114,178,0.7)"]],
        zmin=0,
        zmax=1,
        showscale=False,
        xgap=1,
        ygap=1,
        hovertemplate="right: %{y}<br>said: %{x}<br>%{text} cases<extra></extra>",
    )
    fig.update_xaxes(tickangle=-35)
    fig.update_yaxes(autorange="reversed")
    return fig


def sizes_figure(rows: Sequence[CaseRow]) -> Figure:
    """Found over true distance from 'no effect', one point a case, with its 90 % interval, by parameter."""
    fig = style.figure(
        "Sizes found against true ones",
        "Distance of the found value from 'no effect', over that of the true one, with its 90 % interval: 1 is right, "
        "0 is nothing found. What lies beyond the frame is drawn at its edge.",
        420,
    )
    for colour, chose, words in ((style.BLUE, False, "chose nothing"), (style.GREY, True, "development")):
        shown = [r for r in rows if bool(r["development"]) == chose]
        if not shown:
            continue
        middle = [_ratio(r, "size_found") for r in shown]
        low, high = ([_ratio(r, key) for r in shown] for key in ("size_low", "size_high"))
        ends = np.sort(np.array([low, high]), axis=0)  # a negative true size turns the interval round
        fig.add_scatter(
            x=[r["parameter"].partition(".")[0].replace("_", " ") for r in shown],
            y=middle,
            error_y={
                "type": "data",
                "array": (ends[1] - middle).tolist(),
                "arrayminus": (middle - ends[0]).tolist(),
                "thickness": 1,
            },
            mode="markers",
            name=words,
            marker={"color": colour, "size": 9},
            customdata=[[r["case"], r["size_found"], r["size_true"]] for r in shown],
            hovertemplate="%{customdata[0]}<br>%{customdata[1]:.4g} of %{customdata[2]:.4g}<extra></extra>",
        )
    fig.add_hline(y=1.0, line={"color": style.INK, "width": 1})
    fig.update_yaxes(title_text="found / true", range=RATIO)
    return fig


def _ratio(row: CaseRow, key: str) -> float:
    value = row["size_found"] if row.get(key) is None else row[key]
    ratio = (value - row["size_neutral"]) / (row["size_true"] - row["size_neutral"])
    return float(np.clip(ratio, *RATIO))


def worst_of(rows: Sequence[CaseRow]) -> list[CaseRow]:
    """The cases with the largest error left on unseen data."""
    told = [row for row in rows if row.get("after_test_mv") is not None and "residual" in row]
    return sorted(told, key=lambda row: -float(row["after_test_mv"]))[:WORST]


def residual_figure(row: CaseRow) -> Figure:
    """Residual over the record, in the three states of the model; the last part chose nothing."""
    said = " + ".join(row["effects"]) or "no name"
    answer = " or ".join(row["answer"]) or "no name"
    errors = ", ".join(f"{row[f'{state}_test_mv']:.1f} mV {words}" for state, words in STATES.items())
    fig = style.figure(
        str(row["case"]),
        f"{row['verdict']}: {said}; right: {answer}. RMSE on unseen data: {errors}.".replace("_", " "),
        260,
    )
    kept = row["residual"]
    hours = np.array(kept["time_s"]) / SECONDS_PER_HOUR
    for state, words in STATES.items():
        fig.add_scatter(
            x=hours.tolist(),
            y=kept[f"{state}_mv"],
            mode="lines",
            name=words,
            line={"color": style.STATE_COLOURS[state], "width": 1.2},
        )
    fig.update_xaxes(title_text="time, h")
    fig.update_yaxes(title_text="measured - model, mV")
    return fig
