"""Figures of a discovery: how the hypotheses rank, what the effect brings, what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from aesi.pipeline.report import style
from aesi.pipeline.report.views import KIND_ORDER, Row

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MOST_HYPOTHESES = 30
"""Bars beyond are too thin to read."""


def ranking_figure(candidates: Sequence[Row], titles: Mapping[str, str], chosen: Sequence[str]) -> Figure:
    """Score of every hypothesis, best on top, coloured and hatched by kind; a star marks what was added."""
    rows = sorted(candidates, key=lambda row: -row["score"])[:MOST_HYPOTHESES][::-1]
    caption = (
        "Score of each hypothesis: evidence over the declared model, in nats. A difference of 2.3 nats is odds of ten "
        "to one; higher is better, and below zero the declared model explains the data better. What stands beside "
        "another effect shares the score of both."
    )
    if any(row["kind"] == "placebo" for row in rows):
        caption += " The placebo has parameters but no physics."
    fig = style.figure("Hypotheses by score", caption, max(240, 110 + 20 * len(rows)), barmode="overlay")
    others = sorted({row["kind"] for row in rows} - set(KIND_ORDER))
    for kind in (*KIND_ORDER, *others):
        shown = [row for row in rows if row["kind"] == kind]
        if shown:
            fig.add_bar(
                x=[row["score"] for row in shown],
                y=[_label(row, titles, chosen) for row in shown],
                orientation="h",
                name=kind,
                marker={
                    "color": style.KIND_COLOURS.get(kind, style.GREY),
                    "pattern": style.KIND_PATTERNS.get(kind, {}),
                },
                customdata=[row.get("test_rmse_mv", float("nan")) for row in shown],
                hovertemplate="%{y}<br>score %{x:.3g}, test RMSE %{customdata:.2f} mV<extra></extra>",
            )
    order = [_label(row, titles, chosen) for row in rows]
    fig.update_yaxes(categoryorder="array", categoryarray=order)
    fig.update_xaxes(title_text="score, nats", zeroline=True)
    return fig


def files_figure(files: Sequence[Row], labels: Mapping[str, str]) -> Figure:
    """RMSE of each file before, recalibrated and after."""
    caption = "RMSE of the voltage on each file; files marked test chose nothing."
    fig = style.figure("Error by file", caption, max(220, 130 + 46 * len(files)))
    names = [f"{row['name']} ({row['part']})" for row in files][::-1]
    symbols = {"before": "circle", "recalibrated": "square", "after": "diamond"}
    for state, label in labels.items():
        fig.add_scatter(
            x=[row[f"{state}_mv"] for row in files][::-1],
            y=names,
            mode="markers",
            name=label,
            marker={"color": style.STATE_COLOURS[state], "symbol": symbols[state], "size": 11},
            hovertemplate="%{x:.2f} mV<extra>%{y}</extra>",
        )
    fig.update_xaxes(title_text="RMSE, mV", rangemode="tozero")
    return fig


def dependence_bars(rows: Sequence[Row], found: bool) -> Figure:
    """What the residual depends on as declared and, where something was found, with it."""
    caption = "Share of the residual's variance on the fit part that each variable explains by itself."
    fig = style.figure(
        "What the residual depends on", caption, max(220, 110 + 34 * len(rows)), barmode="group"
    )
    rows = sorted(rows, key=lambda row: -row["before"])
    names = [row["variable"] for row in rows][::-1]
    states = {"after": "with the finding", "before": "as declared"}
    if not found:
        del states["after"]
    for state, label in states.items():
        fig.add_bar(
            x=[100 * row[state] for row in rows][::-1],
            y=names,
            orientation="h",
            name=label,
            marker={"color": style.STATE_COLOURS[state]},
            hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
        )
    fig.update_xaxes(title_text="variance explained, %", range=[0, 100])
    fig.update_layout(legend={"traceorder": "reversed"})
    return fig


def hypothesis_title(row: Row, titles: Mapping[str, str]) -> str:
    """An effect as it did best: by itself, or beside the others of its hypothesis, whose score it shares."""
    name, *others = (
        titles.get(effect, effect.replace("_", " "))
        for effect in dict.fromkeys((row["effect"], *row.get("hypothesis", ())))
    )
    return f"{name}, beside {' and '.join(others)}" if others else name


def _label(row: Row, titles: Mapping[str, str], chosen: Sequence[str]) -> str:
    title = hypothesis_title(row, titles)
    return f"★ {title}" if row["effect"] in chosen else title
