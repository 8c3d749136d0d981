"""`aesi batch`: one discovery for each of many cells."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from aesi.errors import InputError
from aesi.logins import without_login
from aesi.pipeline.written import (
    BATCH_SUMMARIES,
    ROW,
    SUMMARY,
    batch_files,
    cell_files,
    discovery_marks,
)
from flows.commands import options, outputs, record_options


@record_options.reads_files
def batch(
    source: Annotated[
        Path,
        typer.Argument(
            help="Folder with one subfolder of records per cell, or CSV with the columns name and data (several files "
            "separated by ;) and, if needed, cell, test, soc0, soh, specimen and at."
        ),
    ],
    *,
    reading: Any,
    out: Annotated[
        Path,
        typer.Option(help="Folder to write: one subfolder per cell with its discovery, and the summary."),
    ],
    cell: Annotated[
        Path | None,
        typer.Option(
            "--cell",
            help="Cell file (BPX, or a saved model's folder) of all cells that have none of their own.",
        ),
    ] = None,
    soh: options.SohOption = None,
    holdout: Annotated[
        float,
        typer.Option(
            min=0.05,
            max=0.9,
            help="Share of the data, at their end, that is held out for a cell without test data.",
        ),
    ] = 0.3,
    max_effects: options.MaxEffects = 3,
    seed: options.Seed = 0,
    workers: Annotated[
        int, typer.Option(min=1, help="Number of cells that are worked on at the same time.")
    ] = 2,
    runner: Annotated[
        Literal["local", "dask"],
        typer.Option(help="Where cells are worked on: in processes of this machine, or on a Dask cluster."),
    ] = "local",
    address: Annotated[
        str | None,
        typer.Option(
            help="Address of the Dask scheduler, such as tcp://HOST:8786, with --runner dask. Default: a cluster on "
            "this machine."
        ),
    ] = None,
) -> None:
    """Run one discovery per cell and summarise all of them. Several check-ups of one specimen are shown as a trend.

    A batch that was interrupted continues where it ended when the same command is given again.
    """
    outputs.check_folder(out)
    outputs.check_beside(out, source)
    if address is not None and runner != "dask":
        raise InputError(
            f"--address {without_login(address)} names a Dask scheduler; give --runner dask beside it, or leave it out."
        )
    record_options.say_reading([source])
    from aesi.pipeline.batch.job import Settings
    from aesi.pipeline.batch.plan import read_plan
    from flows.jobs.batch import batch as run

    health = options.state_of_health(soh)
    jobs = read_plan(source, cell, health)
    read = [file for job in jobs for file in job.files]
    outputs.check_folder(out, [source, *read], batch_files(out, [job.name for job in jobs]))
    folders = [out / job.name for job in jobs]
    outputs.check_own(
        out,
        [out / name for name in BATCH_SUMMARIES],
        [out / SUMMARY, *(folder / ROW for folder in folders)],
    )
    for folder in folders:
        outputs.check_own(out, cell_files(folder), [folder / ROW, *discovery_marks(folder)])
    run(
        source,
        out,
        cell,
        Settings(holdout, max_effects, seed, reading),
        workers,
        runner,
        address,
        health,
    )
