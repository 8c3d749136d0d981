"""Names of the files that commands write, to a folder or to the tracking store, and which of them a command writes.

A command asks here before its work whether it may write at all, so this module has to be light to import.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal

MODEL = "model"
"""The folder of the model within a folder of results."""
OF_MODEL = (".json", ".npz", ".py")
"""Endings of the files in the model's folder."""
HEAD, ARRAYS, EFFECTS = "model.json", "arrays.npz", "effects"
"""Files of a saved model: its head, its arrays, and the part (a JSON file of that name) that tells its effects."""
REPORT = "report.html"
"""The page of a run or of a discovery."""
SUMMARY = "summary.json"
"""The results of a run or a batch."""
TABLES: Mapping[Literal["md", "tex"], str] = {"md": "tables.md", "tex": "tables.tex"}
"""Format -> the file of a run's tables."""
FIGURES, PAPER_FIGURES = "figures", "paper.html"
"""Folder of a run's figures, and the page of them in it."""
FINDING, ARCHIVE = "discovery.json", "hypotheses.jsonl"
"""Files of a discovery: the finding, and the fits that an interrupted search goes on from."""
ROW, CALIBRATED = "row.json", "calibrated.bpx.json"
"""Further files for a cell of a batch: its row of the summary, and the cell of a check-up."""
EARLIER = "earlier"
"""Folder, in that of a cell of a batch that failed, of what an earlier run found there."""
SUMMARY_TABLE, SUMMARY_PAGE = "summary.csv", "index.html"
"""Files of a batch."""
BATCH_SUMMARIES = (SUMMARY_TABLE, SUMMARY, SUMMARY_PAGE)
"""Files of a batch beside the folders of its cells, which are called by their names."""
CANDIDATE = "candidate.json"
"""File of a rebuilt candidate, beside its model: its genome and its figures, then and now."""
EXPERIMENT, COMPARISON, COEFFICIENTS = "experiment.json", "comparison.json", "coefficients.json"
"""Files in the tracking store alone: the settings of a run, what `aesi compare` draws of it, the terms of a
candidate."""
COMPARISON_MARK = '<meta name="generator" content="aesi compare">'
"""Line of a page by which `aesi compare` knows its own."""


def calibration_files(out: Path) -> tuple[Path, Path, Path, Path]:
    """The files that a calibration writes: the cell's, and the report beside it as data, as text and as a page."""
    data, text, page = (out.with_suffix(f".report{ending}") for ending in (".json", ".md", ".html"))
    return out, data, text, page


def discovery_files(out: Path) -> tuple[Path, ...]:
    """The files that a discovery writes below `out`; of the model's files those that are there."""
    return out / FINDING, out / REPORT, out / ARCHIVE, *_model_files(out)


def _model_files(out: Path) -> list[Path]:
    return sorted(path for path in (out / MODEL).glob("*") if path.suffix in OF_MODEL)


def discovery_marks(out: Path) -> tuple[Path, ...]:
    """The files of which every discovery below `out` leaves one, one that was interrupted too."""
    return out / FINDING, out / ARCHIVE


def cell_files(folder: Path) -> tuple[Path, ...]:
    """The files that a batch writes to the folder of a cell."""
    return folder / ROW, *discovery_files(folder), *calibration_files(folder / CALIBRATED)


def candidate_files(out: Path) -> tuple[Path, ...]:
    """The files that a rebuilt candidate writes below `out`; of the model's files those that are there."""
    return out / CANDIDATE, *_model_files(out)


def batch_files(out: Path, names: Iterable[str]) -> tuple[Path, ...]:
    """The files that a batch of cells of these names writes below `out`."""
    of_cells = (file for name in names for file in cell_files(out / name))
    return *(out / name for name in BATCH_SUMMARIES), *of_cells
