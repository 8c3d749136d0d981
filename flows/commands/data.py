"""`aesi data`: what measured data there are, and how to get them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flows.commands import complete

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)


@app.command("list")
def list_() -> None:
    """Bundled and downloadable data sets, and whether they are on this machine."""
    from aesi.data import catalogue

    for line in catalogue.listing():
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
    from aesi.data import catalogue

    typer.echo(str(catalogue.get(name, out)))
