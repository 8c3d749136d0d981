"""Figures of the search and of the model it chose: front, terms, coefficients, bootstrap."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from aesi.numerics.blocks import record_shares
from aesi.numerics.typing import Array
from aesi.pipeline.report import style
from aesi.pipeline.report.views import BootstrapView, Row

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MOST_TERMS = 30
"""Bars beyond this many are too thin to read; the rest is in coefficients.json."""
VARIABLES = {
    "e": "the voltage error fed back",
    "I": "the current",
    "I_next": "the current of the next row",
    "c_sp": "concentration at the surface of the positive particles",
    "c_sn": "concentration at the surface of the negative particles",
    "c_e0": "electrolyte concentration at the negative collector",
    "c_eL": "electrolyte concentration at the positive collector",
    "soc": "state of charge",
}
"""Inputs of the sparse model -> what a caption calls them."""
ENSEMBLE_LOOKS = {
    "bagging": ("circle", style.BLUE, "AESI I, bagging"),
    "stability": ("diamond-open", style.GREEN, "AESI II, stability selection"),
}
"""Column of a term -> symbol, colour and name in the legend of the coefficients."""
VARIABLE, FILTERED = re.compile(r"\(([\w.]+)\)"), re.compile(r"I_[\d.]+s")
POWERS_FROM = 30.0
"""From this ratio of the largest to the smallest loss on, an axis shows enough powers of ten to be read by."""


def front_figure(candidates: Sequence[Row]) -> Figure:
    """Every candidate of the search: validation against out-of-bag loss, terms as colour."""
    caption = (
        "One point a candidate. Diamonds form the Pareto front over the three losses; stars are what was "
        "chosen, several being averaged; crosses miss the correlation constraints."
    )
    fig = style.figure("Candidates of the search", caption, 400)
    groups = (
        ("infeasible", "x-thin", 6, [c for c in candidates if not c.get("feasible", True)]),
        ("feasible", "circle", 6, [c for c in candidates if c.get("feasible", True) and not c.get("front")]),
        ("Pareto front", "diamond", 9, [c for c in candidates if c.get("front") and not c.get("chosen")]),
        ("chosen", "star", 16, [c for c in candidates if c.get("chosen")]),
    )
    for name, symbol, size, rows in groups:
        if rows:
            _add_candidates(fig, name, symbol, size, rows)
            _legend_entry(fig, name, symbol)
    bar = {"title": {"text": "terms"}, "thickness": 12}
    fig.update_layout(coloraxis={"colorscale": style.SEQUENTIAL, "colorbar": bar})
    fig.update_xaxes(
        title_text="out-of-bag loss, MSE over that of the physics",
        **_log_axis([c["oob"] for c in candidates]),
    )
    fig.update_yaxes(
        title_text="validation loss, MSE over that of the physics",
        **_log_axis([c["valid"] for c in candidates]),
    )
    return fig


def _add_candidates(fig: Figure, name: str, symbol: str, size: int, rows: Sequence[Row]) -> None:
    """One group of candidates, coloured by their terms."""
    fig.add_scatter(
        x=[c["oob"] for c in rows],
        y=[c["valid"] for c in rows],
        mode="markers",
        name=name,
        showlegend=False,
        customdata=[[c.get("number", ""), c["terms"], _fitness(c)] for c in rows],
        hovertemplate="candidate %{customdata[0]}: %{customdata[1]} terms, fitness %{customdata[2]}"
        "<br>out of bag %{x:.4g}, validation %{y:.4g}<extra></extra>",
        marker={
            "symbol": symbol,
            "size": size,
            "color": [c["terms"] for c in rows],
            "line": {"width": 1, "color": style.INK if symbol in ("star", "x-thin") else style.GREY},
            "coloraxis": "coloraxis",
        },
    )


def importance_figure(terms: Sequence[Row]) -> Figure | None:
    """SVD ranking of the terms of the chosen model."""
    rows = [row for row in terms if row.get("importance") is not None]
    if not rows:
        return None
    rows = sorted(rows, key=lambda row: -abs(row["importance"]))
    caption = (
        "Importance of each term by singular value decomposition of the columns term times coefficient; "
        f"the intercept is left out.{_cut_note(len(rows))}{_symbols(rows)}"
    )
    shown = rows[:MOST_TERMS][::-1]
    fig = style.figure("Ranking of the terms", caption, _tall(len(shown)), showlegend=False)
    fig.add_bar(
        x=[abs(row["importance"]) for row in shown],
        y=[row["term"] for row in shown],
        orientation="h",
        marker={"color": style.BLUE},
        hovertemplate="%{y}: %{x:.4g}<extra></extra>",
    )
    fig.update_xaxes(title_text="importance, -")
    return fig


def coefficient_figure(terms: Sequence[Row]) -> Figure | None:
    """Coefficients of bagging and stability selection, coloured by inclusion."""
    rows = [row for row in terms if row.get("bagging") is not None or row.get("stability") is not None]
    if not rows:
        return None
    rows = sorted(rows, key=lambda row: -abs(row.get("bagging") or row.get("stability") or 0.0))
    caption = (
        "Coefficients on scaled variables. The colour is the share of the best resampled models that keep "
        f"the term.{_cut_note(len(rows))}"
    )
    rows = rows[:MOST_TERMS][::-1]
    fig = style.figure("Coefficients", caption, _tall(len(rows)))
    for key, (symbol, colour, label) in ENSEMBLE_LOOKS.items():
        shown = [row for row in rows if row.get(key) is not None]
        _add_coefficients(fig, shown, key, {"symbol": symbol, "size": 9, "color": colour}, label)
        if shown:
            _legend_entry(fig, label, symbol)
    bar = {"title": {"text": "kept by<br> "}, "thickness": 12, "tickformat": ".0%"}
    fig.update_layout(coloraxis={"colorscale": style.SEQUENTIAL, "cmin": 0, "cmax": 1, "colorbar": bar})
    fig.update_xaxes(title_text="coefficient, -", zeroline=True)
    return fig


def _add_coefficients(fig: Figure, rows: Sequence[Row], key: str, marker: dict[str, Any], label: str) -> None:
    """Those of one ensemble; of bagging coloured by inclusion, where all rows have one."""
    if key == "bagging" and all(row.get("inclusion") is not None for row in rows):
        marker = marker | {"color": [row["inclusion"] for row in rows], "coloraxis": "coloraxis"}
    fig.add_scatter(
        x=[row[key] for row in rows],
        y=[row["term"] for row in rows],
        mode="markers",
        name=label,
        showlegend=False,
        marker=marker,
        customdata=[row.get("inclusion", float("nan")) for row in rows],
        hovertemplate="%{y}: %{x:.4g}, kept by %{customdata:.0%}<extra></extra>",
    )


def bootstrap_figure(bootstrap: BootstrapView) -> Figure:
    """Share of distinct samples in every resample of the moving block bootstrap."""
    share = 100 * np.sort(bootstrap.unique_fraction)
    expected = 100 * expected_unique_fraction(bootstrap.lengths, bootstrap.block)
    caption = (
        f"Share of distinct samples in each of {len(share)} resamples of {sum(bootstrap.lengths):,} samples in blocks "
        f"of {bootstrap.block}; mean (full line) {share.mean():.1f} %, expected (dashed) {expected:.1f} %."
    )
    fig = style.figure("Coverage of the moving block bootstrap", caption, 300, showlegend=False)
    fig.add_scatter(
        x=np.arange(1, len(share) + 1),
        y=share,
        mode="markers",
        marker={"color": style.BLUE, "size": 6},
        hovertemplate="%{y:.2f} %<extra></extra>",
    )
    fig.add_hline(y=float(share.mean()), line={"color": style.BLUE, "width": 1.5})
    fig.add_hline(y=expected, line={"color": style.VERMILLION, "width": 1.5, "dash": "dash"})
    fig.update_xaxes(title_text="resample, in order")
    fig.update_yaxes(title_text="distinct samples, %")
    return fig


def expected_unique_fraction(lengths: Sequence[int], block: int) -> float:
    """Expected share of distinct samples in one resample of records of these lengths (`moving_block_weights`), in the
    mean number of blocks that have the samples of all, of which the last one is cut.

    A sample near an edge lies in fewer blocks, so the mean runs over all samples.
    """
    rows = np.array(lengths)
    shares, whole = record_shares(rows, block), np.minimum(rows, block)
    blocks = float(np.round(rows.sum() / (shares @ whole), 9))
    missing = (
        (1.0 - _holding(n, own, own, share)) ** int(blocks)
        * (1.0 - _holding(n, own, blocks % 1 * own, share))
        for n, own, share in zip(lengths, whole, shares, strict=True)
    )
    return 1.0 - float(np.mean(np.concatenate(list(missing))))


def _holding(n: int, whole: int, drawn: float, share: float) -> Array:
    """(n,) probability that a block holds each sample of a record.

    whole : samples of a block, at whose starts it is drawn.  drawn : those that are left where it is cut.  share :
    probability that the block lies in this record.
    """
    sample, starts = np.arange(n), n - whole + 1
    last, first = np.minimum(sample, starts - 1), np.maximum(sample - drawn + 1.0, 0.0)
    return np.asarray(share * np.maximum(last - first + 1.0, 0.0) / starts)


def _legend_entry(fig: Figure, name: str, symbol: str) -> None:
    """A symbol in one grey, because a legend cannot show a colour that varies by point."""
    marker = {"symbol": symbol, "size": 9, "color": style.GREY, "line": {"width": 1, "color": style.GREY}}
    fig.add_scatter(x=[None], y=[None], mode="markers", name=name, marker=marker)


def _log_axis(values: Sequence[float]) -> dict[str, Any]:
    """Powers of ten where the axis spans several; within one decade plotly's own ticks, or there would be none."""
    known = np.array([value for value in values if value is not None and 0 < value < np.inf])
    if known.size == 0 or known.max() < POWERS_FROM * known.min():
        return {"type": "log"}
    minor = {"dtick": "D1", "ticks": "outside"}
    return {"type": "log", "dtick": 1, "exponentformat": "power", "minor": minor}


def _tall(bars: int) -> int:
    return max(220, 110 + 18 * bars)


def _symbols(terms: Sequence[Row]) -> str:
    """Sentences on what the names of these terms mean; empty where nothing has to be said."""
    text = " ".join(row["term"] for row in terms)
    used = dict.fromkeys(VARIABLE.findall(text))
    words = [f"{name}, {VARIABLES[name]}" for name in VARIABLES if name in used]
    words += [
        f"{name}, the current smoothed over {name[2:-1]} s" for name in used if FILTERED.fullmatch(name)
    ]
    polynomials = " T1, T2, ...: Chebyshev polynomials." if "T1(" in text else ""
    return polynomials + (f" Variables, scaled to their trained range: {'; '.join(words)}." if words else "")


def _cut_note(n: int) -> str:
    return f" The first {MOST_TERMS} of {n}." if n > MOST_TERMS else ""


def _fitness(candidate: Row) -> str:
    value = candidate.get("fitness")
    return "-" if value is None else f"{value:.4g}"
