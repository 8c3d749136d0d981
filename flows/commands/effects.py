"""`aesi effects`: the catalogue of physics, wrong parameters and instrument faults."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aesi.errors import InputError
from flows.commands import complete

if TYPE_CHECKING:
    from aesi.physics.effects import Effect


def effects(
    name: Annotated[
        str | None, typer.Argument(help="One effect; without it, the list.", autocompletion=complete.effects)
    ] = None,
    own: Annotated[
        list[Path] | None, typer.Option("--effect-file", help="A Python file of yours with an EFFECT in it.")
    ] = None,
) -> None:
    """The catalogue of effects: equation, parameters with units and bounds, source."""
    from aesi.physics.effects import CATALOGUE, load_effect

    known = dict(CATALOGUE)
    for path in own or []:
        effect = load_effect(path)
        known[effect.id] = effect
    if name is None:
        for effect in known.values():
            typer.echo(f"{effect.id:36s} {effect.kind:11s} {effect.summary}")
        return
    if name not in known:
        near = get_close_matches(name, list(known), n=1)
        hint = f"; did you mean {near[0]!r}?" if near else "."
        raise InputError(f"there is no effect {name!r} in the catalogue{hint} `aesi effects` lists them.")
    typer.echo(_page(known[name]))


def _page(effect: Effect) -> str:
    lines = [f"{effect.id} ({effect.kind})", "", effect.equation, "", effect.validity]
    lines += [f"Source: {effect.source}", "", "Parameters:"]
    for name, parameter in effect.parameters.items():
        low, high = parameter.bounds
        scale = ", logarithmic" if parameter.log else ""
        lines.append(
            f"  {name} = {parameter.default:g} {parameter.unit}, between {low:g} and {high:g}{scale} "
            f"({parameter.source})"
        )
    return "\n".join(lines)
