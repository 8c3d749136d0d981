"""Figures of a discovery: how the hypotheses rank, what the effect brings, what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from aesi.pipeline.report import style
from aesi.pipeline.report.views import KIND_ORDER, Row
from aesi.pipeline.report.words.discoveries import hypothesis_title
from aesi.tracer.search.plausible import ALIKE_NATS

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MOST_HYPOTHESES = 30
"""Most rows: beyond, they are too narrow to read."""
LEAST_NATS = 0.1
"""Least distance behind the best hypothesis that is drawn, in nats, since a logarithmic axis has no zero."""


def ranking_figure(candidates: Sequence[Row], titles: Mapping[str, str], chosen: Sequence[str]) -> Figure:
    """Distance of each hypothesis, and of the one without effects, behind the best; a star marks the added effects."""
    rows = sorted(candidates, key=lambda row: -row["score"])[:MOST_HYPOTHESES]
    best = max(rows[0]["score"], 0.0)
    starred = any(row["effect"] in chosen for row in rows)
    caption = (
        "Log-likelihood of unseen data under each hypothesis, as the distance behind the best one in nats: 2.3 nats "
        f"are odds of ten to one. In the shaded part, up to {ALIKE_NATS:g} nats, the score does not distinguish "
        "hypotheses. A further effect is added only where it gains more than chance would at its step, so that a "
        f"hypothesis with more effects may lie ahead of {'the chosen one (star)' if starred else 'what was chosen'}. "
        "An effect that is shown beside another has the score of both together."
    )
    fig = style.figure(
        "Score of each hypothesis, behind the best", caption, max(240, 130 + 20 * (len(rows) + 1))
    )
    behind = {_label(row, titles, chosen): best - row["score"] for row in rows} | {NO_EFFECT: best}
    kinds = {row["kind"] for row in rows}
    for kind in (*KIND_ORDER, *sorted(kinds - set(KIND_ORDER))):
        shown = [row for row in rows if row["kind"] == kind]
        if shown:
            labels = [_label(row, titles, chosen) for row in shown]
            _add_dots(fig, kind, labels, behind, [_test_rmse_words(row) for row in shown])
    _add_dots(fig, "no effect", [NO_EFFECT], behind, [""])
    order = sorted(behind, key=lambda label: -behind[label])
    fig.update_yaxes(categoryorder="array", categoryarray=order)
    fig.add_vrect(x0=LEAST_NATS / 2.0, x1=ALIKE_NATS, fillcolor=style.GREY, opacity=0.12, line_width=0)
    most = max(*behind.values(), 10.0 * LEAST_NATS)
    fig.update_xaxes(
        title_text="score behind the best, nats",
        type="log",
        range=[float(np.log10(LEAST_NATS / 2.0)), float(np.log10(2.0 * most))],
        dtick=1,
    )
    return fig


def _test_rmse_words(row: Row) -> str:
    """The error on the test part; '' where the hypothesis cannot be simulated there."""
    error_mv = row.get("test_rmse_mv")
    return "" if error_mv is None else f", test RMSE {error_mv:.2f} mV"


NO_EFFECT = "no effect: own parameters alone"
"""The hypothesis that gains are counted from: the file's parameters are fitted in it, as beside every effect."""


def _add_dots(
    fig: Figure, kind: str, labels: Sequence[str], behind: Mapping[str, float], tests: Sequence[str]
) -> None:
    fig.add_scatter(
        x=[max(behind[label], LEAST_NATS) for label in labels],
        y=list(labels),
        mode="markers",
        name=kind,
        marker={
            "color": style.KIND_COLOURS.get(kind, style.GREY),
            "symbol": style.KIND_SYMBOLS.get(kind, "circle-open"),
            "size": 11,
        },
        customdata=[[behind[label], test] for label, test in zip(labels, tests, strict=True)],
        hovertemplate="%{y}<br>%{customdata[0]:.3g} nats behind%{customdata[1]}<extra></extra>",
    )


def files_figure(files: Sequence[Row], labels: Mapping[str, str]) -> Figure:
    """RMSE of each file before, recalibrated and after."""
    caption = (
        "RMSE of the voltage on each file; files marked test are held out: no fit and no choice used them."
    )
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


def dependence_bars(rows: Sequence[Row], labels: Mapping[str, str]) -> Figure:
    """Bars of what the residual depends on, as declared and, where another model is written, with that."""
    caption = "Share of the residual's variance on the fit part that each variable explains by itself."
    fig = style.figure(
        "What the residual depends on", caption, max(220, 110 + 34 * len(rows)), barmode="group"
    )
    rows = sorted(rows, key=lambda row: -row["before"])
    names = [row["variable"] for row in rows][::-1]
    for state in ("after", "before"):
        if state not in labels:
            continue
        fig.add_bar(
            x=[100 * row[state] for row in rows][::-1],
            y=names,
            orientation="h",
            name=labels[state],
            marker={"color": style.STATE_COLOURS[state]},
            hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
        )
    fig.update_xaxes(title_text="variance explained, %", range=[0, 100])
    fig.update_layout(legend={"traceorder": "reversed"})
    return fig


def _label(row: Row, titles: Mapping[str, str], chosen: Sequence[str]) -> str:
    title = hypothesis_title(row, titles)
    return f"★ {title}" if row["effect"] in chosen else title
