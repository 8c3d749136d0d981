"""The files that a job leaves, so that a command can refuse a place before its work; light to import."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

MODEL = "model"
"""The folder of the model within a folder of results."""
OF_MODEL = (".json", ".npz")
"""Endings of the files in it."""
FINDING, REPORT, ARCHIVE = "discovery.json", "report.html", "hypotheses.jsonl"
"""Of a discovery: the finding, the page, and the fits that it is taken up again from."""
ROW, CALIBRATED = "row.json", "calibrated.bpx.json"
"""Of a cell of a batch beside that: its row of the summary, and the cell of a check-up."""
SUMMARY_TABLE, SUMMARY, SUMMARY_PAGE = "summary.csv", "summary.json", "index.html"
"""Of a batch."""


def calibration_files(out: Path) -> tuple[Path, Path, Path, Path]:
    """What a calibration writes: the cell's file, and the report beside it as data, as text and as a page."""
    data, text, page = (out.with_suffix(f".report{ending}") for ending in (".json", ".md", ".html"))
    return out, data, text, page


def discovery_files(out: Path) -> tuple[Path, ...]:
    """What a discovery writes below `out`, of the model's files those that are there."""
    there = sorted(path for path in (out / MODEL).glob("*") if path.suffix in OF_MODEL)
    return out / FINDING, out / REPORT, out / ARCHIVE, *there


def batch_files(out: Path, names: Iterable[str]) -> tuple[Path, ...]:
    """What a batch of cells of these names writes below `out`."""
    of_cells = (
        file
        for folder in (out / name for name in names)
        for file in (folder / ROW, *discovery_files(folder), *calibration_files(folder / CALIBRATED))
    )
    return out / SUMMARY_TABLE, out / SUMMARY, out / SUMMARY_PAGE, *of_cells
