"""`aesi data`: list, fetch and convert measured data."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from flows.commands import complete, outputs, record_options
from flows.commands.command import App

app = App(no_args_is_help=True, rich_markup_mode=None)


@app.command("list")
def list_() -> None:
    """List the bundled and the downloadable data sets, and say which are on this machine."""
    from aesi.data import catalogue

    for line in catalogue.catalogue_lines():
        typer.echo(line)


@app.command("get")
def get(
    name: Annotated[
        str,
        typer.Argument(
            help="Name of a data set, as `aesi data list` shows it.", autocompletion=complete.data_sets
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write the data set to. Default: the cache folder of this user."),
    ] = None,
) -> None:
    """Fetch a data set, verify its checksums, and convert it to CSV files in SI units. Prints the folder."""
    if out is not None:
        outputs.check_folder(out)
    from aesi.data import catalogue

    typer.echo(str(catalogue.get(name, out)))


@app.command("convert")
@record_options.reads_files
def convert(
    file: Annotated[
        Path,
        typer.Argument(help="Measurement: a cycler's export or native file, CSV, Excel, Parquet or BDF."),
    ],
    *,
    reading: Any,
    out: Annotated[Path, typer.Option(help="CSV to write.")],
    cell: Annotated[
        Path | None,
        typer.Option(
            "--cell",
            help="Cell file (BPX, or a saved model's folder). A record that cannot be of this cell is refused, for "
            "example one in another unit of time or current.",
        ),
    ] = None,
    to: Annotated[
        Literal["aesi", "bdf"],
        typer.Option(
            help="Columns to write: aesi (this project's, current positive on discharge) or bdf (Battery Data Format, "
            "positive on charge)."
        ),
    ] = "aesi",
) -> None:
    """Write a measurement as CSV in SI units. Messages say how its columns, signs and rows were understood."""
    read = [file] if not file.is_dir() else []  # a folder is no input; the reader refuses it with a sentence
    inputs = [*read, *([cell] if cell else [])]
    outputs.check_table(out, inputs, bdf=to == "bdf", advice=", or --to bdf")
    from aesi.data.convert import convert_file, record_lines

    admit = None
    if cell is not None:
        from aesi.pipeline.product.declared import check_of_cell

        admit = partial(check_of_cell, cell)
    record = convert_file(file, out, reading, to, admit)
    record_options.say_notes(record.notes)
    for line in record_lines(record, of_cell=cell is not None):
        typer.echo(line, err=True)
    typer.echo(str(out))
