"""`aesi data`: what measured data there are, and how to get them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from flows.commands import complete, options, outputs
from flows.commands.command import App

app = App(no_args_is_help=True, rich_markup_mode=None)


@app.command("list")
def list_() -> None:
    """Bundled and downloadable data sets, and whether they are on this machine."""
    from aesi.data import catalogue

    for line in catalogue.catalogue_lines():
        typer.echo(line)


@app.command("get")
def get(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of a data set, as `aesi data list` gives it.", autocompletion=complete.data_sets
        ),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder to put it in; the cache without it.")] = None,
) -> None:
    """Fetch a data set, check it against its checksums and convert it."""
    if out is not None:
        outputs.check_folder(out)
    from aesi.data import catalogue

    typer.echo(str(catalogue.get(name, out)))


@app.command("convert")
@options.reads_files
def convert(
    file: Annotated[Path, typer.Argument(help="A cycler's export or own file, CSV, Excel, Parquet or BDF.")],
    *,
    reading: Any,
    out: Annotated[Path, typer.Option(help="CSV to write.")],
    cell: Annotated[
        Path | None,
        typer.Option(
            "--cell",
            help="BPX file, or a saved model, of the cell: a record that cannot be of it, as in another unit of time "
            "or current, is refused.",
        ),
    ] = None,
    to: Annotated[
        Literal["aesi", "bdf"],
        typer.Option(
            help="This project's columns (current positive on discharge), or BDF (positive on charge)."
        ),
    ] = "aesi",
) -> None:
    """Write a measurement as CSV in SI units, and say what was done to it."""
    read = [file] if not file.is_dir() else []  # a folder is none that is read, which the reader says
    outputs.check_table(out, [*read, *([cell] if cell else [])])
    from aesi.data.convert import convert_file, record_lines

    admit = None
    if cell is not None:
        from aesi.pipeline.product.declared import check_of_cell

        admit = partial(check_of_cell, cell)
    record = convert_file(file, out, reading, to, admit)
    options.say_notes(record.notes)
    for line in record_lines(record, of_cell=cell is not None):
        typer.echo(line, err=True)
    typer.echo(str(out))
