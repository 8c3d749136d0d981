"""Figures of the report: confusion matrix, estimated against true sizes, and residuals of the worst cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from aesi.bench import CaseRow
from aesi.constants import SECONDS_PER_HOUR
from aesi.pipeline.report import style
from aesi.tracer.report.outcome import State

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

WORST = 5
"""Number of cases whose residual is drawn."""
LINE_PX = 17
"""Height of a line of text beside the confusion matrix, px."""
RATIO = (-1.0, 3.0)
"""Range of the drawn ratio of estimated to true size; values beyond are drawn at its ends."""
LEGENDS: Mapping[State, str] = {
    "before": "declared model",
    "recalibrated": "recalibrated model",
    "after": "written model",
}
"""State of the model -> its name in the figures."""


def confusion_figure(matrix: Mapping[str, Mapping[str, int]]) -> Figure:
    """The confusion matrix: a row per right answer, a column per given answer, and the number of cases in each field.

    matrix : right answer -> given answer -> number of cases; not empty.
    """
    right = sorted(matrix)
    given = sorted({name for counts in matrix.values() for name in counts})
    counts = [[matrix[a].get(s, 0) for s in given] for a in right]
    shares = [[n / max(1, sum(row)) for n in row] for row in counts]
    rows = [a.replace("_", " ").replace(" or ", " or<br>") for a in right]
    tallest = max(row.count("<br>") for row in rows) + 1
    fig = style.figure(
        "Right and given answers",
        "Rows: the right effect, or several of which each is right. Columns: the answer of the tracer; effects named "
        "with the verdict 'unknown' follow this word. Numbers count cases; the shade is their share of the row.",
        220 + max(30, LINE_PX * tallest) * len(right),
    )
    fig.add_heatmap(
        z=shares,
        x=[s.replace("_", " ") for s in given],
        y=rows,
        text=[[str(n) if n else "" for n in row] for row in counts],
        texttemplate="%{text}",
        colorscale=[[0, "rgba(0,114,178,0)"], [1, "rgba(0,114,178,0.7)"]],
        zmin=0,
        zmax=1,
        showscale=False,
        xgap=1,
        ygap=1,
        hovertemplate="right: %{y}<br>answer: %{x}<br>%{text} cases<extra></extra>",
    )
    fig.update_xaxes(tickangle=-35)
    fig.update_yaxes(autorange="reversed")
    return fig


def sizes_figure(rows: Sequence[CaseRow]) -> Figure:
    """Estimated size over true size by parameter, one point per case, with its 90 % interval.

    A size is the distance of the parameter from the value at which its effect vanishes.  rows : with `size_*` entries.
    """
    fig = style.figure(
        "Estimated against true sizes",
        "Estimated over true distance of the parameter from the value without an effect, with the 90 % interval: 1 is "
        "right, 0 means that no effect was found. Values beyond the frame are drawn at its edge.",
        420,
    )
    for colour, chose, words in ((style.BLUE, False, "test"), (style.GREY, True, "development")):
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
    fig.update_yaxes(title_text="estimated / true", range=RATIO)
    return fig


def _ratio(row: CaseRow, key: str) -> float:
    """Ratio to the true size of the estimate (`size_found`) or of an end of its interval, limited to RATIO. Without an
    interval its ends are the estimate."""
    value = row["size_found"] if row.get(key) is None else row[key]
    ratio = (value - row["size_neutral"]) / (row["size_true"] - row["size_neutral"])
    return float(np.clip(ratio, *RATIO))


def worst_of(rows: Sequence[CaseRow]) -> list[CaseRow]:
    """The cases with a residual whose written model has the largest error on held-out data, the largest first; at most
    WORST."""
    known = [row for row in rows if row.get("after_test_mv") is not None and "residual" in row]
    return sorted(known, key=lambda row: -float(row["after_test_mv"]))[:WORST]


def case_figure(row: CaseRow) -> Figure:
    """Residual of one case over time, measured minus model, mV, with the declared, the recalibrated and the written
    model. The last part of the record is held out."""
    said = " + ".join(row["effects"]) or "no name"
    answer = " or ".join(row["answer"]) or "no name"
    known = {words: row[f"{state}_test_mv"] for state, words in LEGENDS.items()}
    errors = ", ".join(f"{error:.1f} mV {words}" for words, error in known.items() if error is not None)
    fig = style.figure(
        str(row["case"]),
        f"{row['verdict']}: {said}; right: {answer}. RMSE on held-out data: {errors}.".replace("_", " "),
        260,
    )
    kept = row["residual"]
    hours = np.array(kept["time_s"]) / SECONDS_PER_HOUR
    for state, words in LEGENDS.items():
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
