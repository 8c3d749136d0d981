"""What a batch comes to: a table of its cells, and for check-ups the trends of resistance, inventory and material."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.pipeline.report.page import write_page

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

SCHEMA = "aesi.batch/1"
HEADER = (
    "name",
    "specimen",
    "at",
    "status",
    "verdict",
    "effects",
    "finding",
    "before_test_mv",
    "recalibrated_test_mv",
    "after_test_mv",
    "resistance_mohm",
    "inventory_ah",
    "negative_ah",
    "positive_ah",
    "capacity_ah",
    "seconds",
    "report",
    "reason",
)
TRENDS = {
    "resistance_mohm": ("Resistance of contacts and films", "mohm"),
    "inventory_ah": ("Cyclable lithium", "Ah"),
    "negative_ah": ("Active material, negative", "Ah"),
    "positive_ah": ("Active material, positive", "Ah"),
    "capacity_ah": ("Capacity", "Ah"),
}
CellRow = Mapping[str, Any]


def write_summary(out: Path, rows: Sequence[CellRow], title: str) -> Path:
    """Write summary.csv, summary.json and index.html to `out`; returns the page."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.csv").write_text(_csv(rows), encoding="utf-8")
    content = {"schema": SCHEMA, "jobs": list(rows), "trends": trends(rows)}
    (out / "summary.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    specimens = trends(rows)
    figures = {"trends": _figure(specimens)} if specimens else {}
    return write_page(
        out / "index.html",
        "batch.html",
        figures,
        title=title,
        rows=[{key: row.get(key) for key in HEADER} for row in rows],
        specimens=specimens,
        names={key: f"{words}, {unit}" for key, (words, unit) in TRENDS.items()},
        done=sum(row["status"] == "done" for row in rows),
    )


def trends(rows: Sequence[CellRow]) -> dict[str, list[dict[str, float]]]:
    """Check-ups by specimen in the order of `at`, for specimens with two or more of them."""
    found: dict[str, list[dict[str, float]]] = {}
    for row in rows:
        if row.get("specimen") and row.get("at") is not None and row.get("inventory_ah") is not None:
            kept = {"at": row["at"], **{key: row[key] for key in TRENDS}}
            found.setdefault(row["specimen"], []).append(kept)
    return {name: sorted(each, key=lambda r: r["at"]) for name, each in found.items() if len(each) > 1}


def _csv(rows: Sequence[CellRow]) -> str:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, HEADER, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _figure(specimens: Mapping[str, Sequence[Mapping[str, float]]]) -> Figure:
    """One panel a quantity, one line a specimen."""
    from plotly.subplots import make_subplots

    from aesi.pipeline.report.style import MODEL_COLOURS, framed

    titles = [words for words, _ in TRENDS.values()]  # above each panel: beside it they would not fit
    fig = make_subplots(
        rows=len(TRENDS), cols=1, shared_xaxes=True, vertical_spacing=0.07, subplot_titles=titles
    )
    for line, (name, each) in enumerate(specimens.items()):
        for panel, key in enumerate(TRENDS, start=1):
            fig.add_scatter(
                x=[row["at"] for row in each],
                y=[row[key] for row in each],
                name=name,
                legendgroup=name,
                showlegend=panel == 1,
                mode="lines+markers",
                line={"color": MODEL_COLOURS[line % len(MODEL_COLOURS)]},
                row=panel,
                col=1,
            )
    for panel, (_, unit) in enumerate(TRENDS.values(), start=1):
        fig.update_yaxes(title_text=unit, row=panel, col=1)
    fig.update_xaxes(title_text="at", row=len(TRENDS), col=1)
    return framed(
        fig, "Ageing", "Each check-up calibrated on its own from the same cell file.", 170 * len(TRENDS)
    )
