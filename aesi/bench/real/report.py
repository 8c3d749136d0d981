"""The report of a run over measured cells: one HTML file that opens without a network."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench import CaseRow

WIDTH, HEIGHT, MARGIN = 760, 220, 48
WORST = 5
COLOURS = {"before": "#999999", "recalibrated": "#d98c1f", "after": "#1f6fb2"}
STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "table{border-collapse:collapse}td,th{padding:.2rem .6rem;border-bottom:1px solid #ddd;text-align:left}"
)


def write_report(path: Path, rows: Sequence[CaseRow], summary: Mapping[str, Any]) -> Path:
    """Write the page; rows as `judged` gives them, with their residuals."""
    worst = sorted((r for r in rows if r.get("after_test_mv") is not None), key=lambda r: -r["after_test_mv"])
    parts = [
        f"<!doctype html><meta charset='utf-8'><title>aesi bench real</title><style>{STYLE}</style>",
        "<h1>Findings on measured cells</h1>",
        _figures(summary),
        "<h2>What was there, and what was said</h2>",
        _confusion(summary["confusion"]),
        "<h2>Sizes found against true ones</h2>",
        "<p>Each divided by the true size; the line is the truth.</p>",
        _scatter([r for r in rows if r.get("size_error") is not None]),
        f"<h2>The {WORST} cases with the largest error left on unseen data</h2>",
        *(_residual(row) for row in worst[:WORST]),
        "<h2>Every case</h2>",
        _table(rows),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(parts), encoding="utf-8")
    return path


def _figures(summary: Mapping[str, Any]) -> str:
    reported = summary["reported"]
    lines = [
        f"<tr><td>{escape(key)}</td><td>{escape(_text(summary.get(key)))}</td><td>{escape(_text(value))}</td></tr>"
        for key, value in reported.items()
    ]
    head = "<tr><th>figure</th><th>all cases</th><th>cases that chose nothing</th></tr>"
    missing = ", ".join(summary["not_run"]) or "none"
    return f"<table>{head}{''.join(lines)}</table><p>Not run: {escape(missing)}.</p>"


def _confusion(matrix: Mapping[str, Mapping[str, int]]) -> str:
    lines = [
        f"<tr><td>{escape(asked)}</td><td>{escape(', '.join(f'{said} ({n})' for said, n in counts.items()))}</td></tr>"
        for asked, counts in matrix.items()
    ]
    return f"<table><tr><th>right</th><th>said (cases)</th></tr>{''.join(lines)}</table>"


def _scatter(rows: Sequence[CaseRow]) -> str:
    """One point a case at (number, found / true), the parameter in its title."""
    if not rows:
        return "<p>No size was found.</p>"
    ratio = np.clip([r["size_found"] / r["size_true"] for r in rows], -1.0, 3.0)
    x = np.linspace(MARGIN, WIDTH - MARGIN, len(rows)) if len(rows) > 1 else np.array([WIDTH / 2])
    y = HEIGHT - MARGIN - (ratio + 1.0) / 4.0 * (HEIGHT - 2 * MARGIN)
    truth = HEIGHT - MARGIN - 0.5 * (HEIGHT - 2 * MARGIN)
    dots = "".join(
        f"<circle cx='{a:.1f}' cy='{b:.1f}' r='4' fill='{COLOURS['after']}'><title>{escape(r['case'])}: "
        f"{r['size_found']:.4g} of {r['size_true']:.4g} ({escape(r['parameter'])})</title></circle>"
        for a, b, r in zip(x, y, rows, strict=True)
    )
    line = f"<line x1='{MARGIN}' x2='{WIDTH - MARGIN}' y1='{truth}' y2='{truth}' stroke='#444'/>"
    return _svg(line + dots)


def _residual(row: CaseRow) -> str:
    name = escape(row["case"])
    if "residual" not in row:
        return f"<p>{name}</p>"
    kept = row["residual"]
    time = np.array(kept["time_s"])
    x = MARGIN + (time - time[0]) / max(float(np.ptp(time)), 1.0) * (WIDTH - 2 * MARGIN)
    series = {state: np.array(kept[f"{state}_mv"]) for state in COLOURS}
    top = max(float(np.percentile(np.abs(v), 99)) for v in series.values()) or 1.0
    lines = "".join(
        f"<polyline fill='none' stroke='{COLOURS[state]}' points='{_points(x, values, top)}'/>"
        for state, values in series.items()
    )
    errors = ", ".join(f"{state} {row[f'{state}_test_mv']:.1f} mV" for state in COLOURS)
    said = escape("+".join(row["effects"]) or row["verdict"])
    return f"<h3>{name}: {said}</h3><p>On unseen data: {errors}. Height ±{top:.0f} mV.</p>{_svg(lines)}"


def _points(x: Any, values: Any, top: float) -> str:
    y = HEIGHT / 2 - np.clip(values / top, -1, 1) * (HEIGHT / 2 - 10)
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))


def _svg(content: str) -> str:
    return f"<svg viewBox='0 0 {WIDTH} {HEIGHT}' width='100%' role='img'>{content}</svg>"


def _table(rows: Sequence[CaseRow]) -> str:
    keys = (
        "case",
        "answer",
        "verdict",
        "effects",
        "named",
        "size_true",
        "size_found",
        "after_test_mv",
        "source",
    )
    head = "".join(f"<th>{key}</th>" for key in keys)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(row.get(key)))}</td>" for key in keys) + "</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _text(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value)
