"""Options that several commands share, and their reading into plain values."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from aesi.errors import InputError

if TYPE_CHECKING:
    from aesi.records import Measurement

Cell = Annotated[Path, typer.Option("--cell", help="BPX file, or a model folder that `discover` wrote.")]
Columns = Annotated[
    list[str] | None,
    typer.Option("--column", help='quantity=name, for other headers: current_a="I[A]".'),
]
Sign = Annotated[
    Literal["discharge-positive", "charge-positive"],
    typer.Option("--sign", help="Which direction of the current is positive."),
]
Soc0 = Annotated[
    float | None, typer.Option("--soc0", min=0.0, max=1.0, help="State of charge at the first row.")
]
Effects = Annotated[
    list[str] | None, typer.Option("--effect", help="An effect to add: id or id:parameter=value,...")
]
EffectFiles = Annotated[
    list[Path] | None, typer.Option("--effect-file", help="A Python file of yours with an EFFECT in it.")
]
Hold = Annotated[
    Literal["linear", "backward"], typer.Option("--hold", help="How the current runs between rows.")
]

Model = Annotated[
    Literal["espm", "dfn"],
    typer.Option(
        "--model", help="Single particle with electrolyte, or porous electrode (Doyle-Fuller-Newman)."
    ),
]


def columns(pairs: list[str] | None) -> dict[str, str | None]:
    """`quantity=name` pairs as a mapping; an empty name leaves the quantity out."""
    mapping: dict[str, str | None] = {}
    for pair in pairs or []:
        quantity, equals, name = pair.partition("=")
        if not equals:
            raise InputError(f"--column {pair}: has to read quantity=name.")
        mapping[quantity.strip()] = name or None
    return mapping


def measurements(
    paths: list[Path], pairs: list[str] | None, sign: Literal["discharge-positive", "charge-positive"]
) -> tuple[Measurement, ...]:
    """The files as measurements."""
    from aesi.data import read_measurement

    return tuple(read_measurement(path, columns=columns(pairs), sign=sign) for path in paths)


def say_notes(notes: Iterable[str]) -> None:
    """What a reader dropped, mapped or averaged, on stderr."""
    from aesi.pipeline.notes import together

    for note in together(notes):
        typer.echo(note, err=True)


def effect_values(text: str) -> tuple[str, dict[str, float]]:
    """`id:parameter=value,...` as the id and its values."""
    name, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for item in filter(None, rest.split(",")):
        parameter, equals, value = item.partition("=")
        try:
            values[parameter.strip()] = float(value)
        except ValueError:
            raise InputError(
                f"--effect {text}: {item!r} has to read parameter=number, as in series_resistance:resistance_ohm=1e-3."
            ) from None
        if not equals:
            raise InputError(f"--effect {text}: {item!r} has to read parameter=number.")
    return name, values
