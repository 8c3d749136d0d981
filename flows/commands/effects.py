"""`aesi effects`: the catalogue of physics, wrong parameters and instrument faults."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from flows.commands import complete


def effects(
    name: Annotated[
        str | None, typer.Argument(help="One effect; without it, the list.", autocompletion=complete.effects)
    ] = None,
    own: Annotated[
        list[Path] | None, typer.Option("--effect-file", help="A Python file of yours with an EFFECT in it.")
    ] = None,
) -> None:
    """The catalogue of effects: equation, parameters with units and bounds, source."""
    from aesi.physics.effects import describe, known_effects, listing, named_effect

    known = known_effects(own or ())
    typer.echo(listing(known.values()) if name is None else describe(named_effect(name, known)))
