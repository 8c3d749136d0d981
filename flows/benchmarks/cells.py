"""`aesi bench cells` with the hybrid beside the physics, and its table for the docs.

The hybrid of a cell is one quick fit of its experiment: the correction learnt on the records that the experiment names
for training and validation (marked `trained`), free run on all others with their measured temperature.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from aesi.bench.hybrid.splits import judged
from aesi.bench.physics import cells as physics
from aesi.bench.physics.cells_table import archive_table, table
from aesi.data.catalogue import HG2, NMC, PANASONIC
from aesi.errors import AesiError
from aesi.pipeline.experiment.config import read_experiment
from flows.benchmarks.page import write_between
from flows.benchmarks.splits import BLOCK_S, QUICK, QUICK_INTERVALS, search_and_fit

EXPERIMENTS = {
    PANASONIC: "panasonic_ncr18650pf.yaml",
    HG2: "lg_18650hg2.yaml",
    NMC: "measured_nmc_drive.yaml",
}
"""Data set -> experiment file of its cell. An experiment that trains on repeats of a record is trained on all of it
here."""
HYBRID = "AESI I"
BEGIN, END = "<!-- table of aesi bench cells -->", "<!-- end -->"
ARCHIVE_MARKS = "<!-- table of aesi bench cells, archive -->", "<!-- end of archive -->"
CHARGES_MARKS = "<!-- table of aesi bench cells, charges -->", "<!-- end of charges -->"


def run(
    cells: str = "experiments/cells",
    only: Sequence[str] | str = (),
    hybrid: bool = False,
    experiments: str = "experiments",
    archive: bool = False,
    charges: bool = False,
    development: bool | None = None,
    porous: bool = False,
    write: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a record, and a last one with `summary`: true.

    cells, only, archive, charges, development, porous : see `aesi.bench.physics.cells.run`.  hybrid : add `hybrid_mv`,
    some minutes.  experiments : folder of the experiment files.  write : a page whose part between the two marks
    becomes the table.
    """
    rows = []
    for row in physics.run(cells, only, archive, charges, development, porous):
        if hybrid and not row.get("summary") and row["cell"] in EXPERIMENTS and "error" not in row:
            row |= hybrid_figures(Path(experiments), row["cell"]).get(row["record"], {})
        rows.append(row)
        yield row
    if write is not None and (archive or charges):
        write_between(write, *(CHARGES_MARKS if charges else ARCHIVE_MARKS), archive_table(rows[:-1]))
    elif write is not None:
        write_between(write, BEGIN, END, table(rows[:-1]))


@cache
def hybrid_figures(experiments: Path, cell: str) -> Mapping[str, dict[str, Any]]:
    """Record -> entries of its row about the hybrid of a cell, fitted once: `hybrid_mv`, its RMS error in free run;
    `trained` for a record that it was trained or validated on; `hybrid_error` where it could not be fitted.

    experiments : folder of the experiment files.  cell : a key of EXPERIMENTS.
    """
    file = experiments / EXPERIMENTS[cell]
    data = read_experiment(file, ()).data
    used = {*data.train, *data.valid} or {data.record}
    whole = () if data.train else ("data.repeats=null", "data.record=null", f"data.train=[{data.record}]")
    drives = [r.name for r in physics.RECORDS if r.data == cell and not r.fitted and r.name not in used]
    overrides = [
        *whole, f"data.test=[{', '.join(drives)}]", f"data.dt_s={QUICK['dt_s']}", f"search.block={round(BLOCK_S)}",
        f"search.candidates={QUICK['candidates']}", f"search.resamples={QUICK['resamples']}",
        f'models=["ESPM", "{HYBRID}"]', *QUICK_INTERVALS,
    ]  # fmt: skip
    out: dict[str, dict[str, Any]] = {str(name): {"trained": True} for name in used}
    try:
        config = read_experiment(file, overrides)
        loaded, _, fitted = search_and_fit(config)
    except AesiError as error:
        return out | {name: {"hybrid_error": str(error)} for name in drives}
    for series in loaded.split.test:
        out[series.name] = {"hybrid_mv": round(judged(fitted, [series])[HYBRID]["rmse_mv"], 2)}
    return out
