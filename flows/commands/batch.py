"""`aesi batch`: many cells at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from aesi.errors import InputError
from aesi.pipeline.written import SUMMARY_TABLE, batch_files
from flows.commands import options, outputs


@options.reads_files
def batch(
    source: Annotated[
        Path,
        typer.Argument(help="A folder with one subfolder a cell, or a CSV with the columns name and data."),
    ],
    *,
    reading: Any,
    out: Annotated[Path, typer.Option(help="Folder for one discovery a cell and the summary.")],
    cell: Annotated[
        Path | None, typer.Option("--cell", help="BPX file of every cell that names none of its own.")
    ] = None,
    soh: options.SohOption = None,
    holdout: Annotated[
        float,
        typer.Option(min=0.05, max=0.9, help="Last share of the data kept back, where no test is named."),
    ] = 0.3,
    max_effects: options.MaxEffects = 3,
    seed: options.Seed = 0,
    workers: Annotated[int, typer.Option(min=1, help="Cells at a time.")] = 2,
    runner: Annotated[
        Literal["local", "dask"], typer.Option(help="Processes here, or a Dask cluster.")
    ] = "local",
    address: Annotated[
        str | None,
        typer.Option(help="Dask scheduler, with --runner dask; without it a cluster on this machine."),
    ] = None,
) -> None:
    """One discovery a cell, a summary of all; check-ups of one specimen as a trend. Goes on where it was stopped."""
    outputs.check_folder(out)
    outputs.check_beside(out, source)
    if address is not None and runner != "dask":
        raise InputError(
            f"--address {address} names a Dask scheduler; give --runner dask beside it, or leave it out."
        )
    options.say_reading([source])
    from aesi.pipeline.batch.job import Settings
    from aesi.pipeline.batch.plan import read_plan
    from flows.jobs.batch import batch as run

    health = options.state_of_health(soh)
    jobs = read_plan(source, cell, health)
    read = [file for job in jobs for file in job.files]
    outputs.check_folder(out, [source, *read], batch_files(out, [job.name for job in jobs]))
    rows = run(
        source,
        out,
        cell,
        Settings(holdout, max_effects, seed, reading),
        workers,
        runner,
        address,
        health,
    )
    if all(row["status"] == "failed" for row in rows):
        raise InputError(f"no cell of {source} could be used; {out / SUMMARY_TABLE} says why.")
