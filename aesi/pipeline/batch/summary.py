"""The summary of a batch: a table of its cells, and for check-ups the trends of resistance, inventory and material."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.calibration.uncertainty.health import HEALTH_WORDS
from aesi.numerics.files.whole import write_whole
from aesi.pipeline.report.page import write_page
from aesi.pipeline.written import SUMMARY, SUMMARY_PAGE, SUMMARY_TABLE

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
    *(f"{name}{end}" for name in HEALTH_WORDS for end in ("", "_low", "_high")),
    "seconds",
    "report",
    "reason",
)
CellRow = Mapping[str, Any]


def write_summary(out: Path, rows: Sequence[CellRow], title: str) -> Path:
    """Write summary.csv, summary.json and index.html to `out`; returns the page."""
    write_whole(out / SUMMARY_TABLE, _csv_text(rows))
    specimens = trends(rows)
    content = {"schema": SCHEMA, "jobs": list(rows), "trends": specimens}
    write_whole(out / SUMMARY, json.dumps(content, indent=1) + "\n")
    figures = {"trends": _figure(specimens)} if specimens else {}
    return write_page(
        out / SUMMARY_PAGE,
        "batch.html",
        figures,
        title=title,
        rows=[{key: row.get(key) for key in HEADER} for row in rows],
        specimens=specimens,
        names=HEALTH_WORDS,
        done=sum(row["status"] == "done" for row in rows),
    )


def trends(rows: Sequence[CellRow]) -> dict[str, list[dict[str, float]]]:
    """Check-ups by specimen in the order of `at`, for specimens with two or more of them."""
    found: dict[str, list[dict[str, float]]] = {}
    for row in rows:
        if row.get("specimen") and row.get("at") is not None and row.get("inventory_ah") is not None:
            kept = {
                "at": row["at"],
                **{key: row[key] for key in HEADER if key.startswith(tuple(HEALTH_WORDS))},
            }
            found.setdefault(row["specimen"], []).append(kept)
    return {name: sorted(each, key=lambda r: r["at"]) for name, each in found.items() if len(each) > 1}


def _csv_text(rows: Sequence[CellRow]) -> str:
    stream = io.StringIO()
    writer = csv.DictWriter(stream, HEADER, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def _error_bar(upper: float | None, lower: float | None) -> float | None:
    """Length of one half of an error bar; None where a quantity was not fitted."""
    return None if upper is None or lower is None else upper - lower


def _figure(specimens: Mapping[str, Sequence[Mapping[str, float]]]) -> Figure:
    """One panel a quantity, one line a specimen."""
    from plotly.subplots import make_subplots

    from aesi.pipeline.report.style import MODEL_COLOURS, framed

    quantities = [words.rpartition(", ") for words in HEALTH_WORDS.values()]
    titles = [
        words[:1].upper() + words[1:] for words, _, _ in quantities
    ]  # beside a panel they would not fit
    fig = make_subplots(
        rows=len(titles), cols=1, shared_xaxes=True, vertical_spacing=0.07, subplot_titles=titles
    )
    for panel, key in enumerate(HEALTH_WORDS, start=1):
        for line, (name, each) in enumerate(specimens.items()):
            fig.add_scatter(
                x=[row["at"] for row in each],
                y=[row[key] for row in each],
                error_y={
                    "type": "data",
                    "array": [_error_bar(row[f"{key}_high"], row[key]) for row in each],
                    "arrayminus": [_error_bar(row[key], row[f"{key}_low"]) for row in each],
                    "thickness": 1,
                },
                name=name,
                legendgroup=name,
                showlegend=panel == 1,
                mode="lines+markers",
                line={"color": MODEL_COLOURS[line % len(MODEL_COLOURS)]},
                row=panel,
                col=1,
            )
        fig.update_yaxes(title_text=quantities[panel - 1][2], row=panel, col=1)
    fig.update_xaxes(title_text="at, as in the plan", row=len(titles), col=1)
    caption = "Each check-up calibrated on its own from the same cell file, with 95 % intervals."
    return framed(fig, "State of health", caption, 170 * len(titles))
