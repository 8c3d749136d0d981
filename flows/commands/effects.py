"""`aesi effects`: show the catalogue of effects (missing physics, wrong parameters, instrument faults)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flows.commands import complete


def effects(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Id of an effect, such as series_resistance. Default: list all.",
            autocompletion=complete.effects,
        ),
    ] = None,
    own: Annotated[
        list[Path] | None,
        typer.Option(
            "--effect-file",
            help="Python file of your own that defines an EFFECT, to be shown as well. It is run: give only files that "
            "you trust. May be repeated.",
        ),
    ] = None,
) -> None:
    """List the effects, or describe one: equation, parameters with units and bounds, source."""
    from aesi.physics.effects import describe, known_effects, listing, named_effect

    known = known_effects(own or ())
    typer.echo(listing(known.values()) if name is None else describe(named_effect(name, known)))
