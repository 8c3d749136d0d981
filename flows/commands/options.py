"""Options about the cell, its simulation and the run that several commands share, and functions that turn their texts
into values. Those about record files are in `flows.commands.record_options`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from datetime import date
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from aesi.constants import LARGEST_SEED
from aesi.errors import CellError, InputError

if TYPE_CHECKING:
    from aesi.physics import ActiveEffect
    from aesi.physics.cell import Soh

_CELL = typer.Option("--cell", help="Cell file: BPX, or the folder of a saved model, such as found/model.")
CellOption = Annotated[Path, _CELL]
CellUnlessExperiment = Annotated[Path | None, _CELL]
CurrentOption = Annotated[
    Path,
    typer.Option(
        help="Current profile: CSV with time_s (s) and current_a (A, discharge positive) and, if measured, voltage_v "
        "(V) and temperature_degc (degC)."
    ),
]


A_STATE = "a state of charge is a share of the capacity, from 0 (empty) to 1 (full); 90 % is 0.9"
ITS_DEVIATION = (
    "how far a state of charge may be off is a share of the capacity, from 0 (exact) to 1; 1 % is 0.01"
)


def share(option: str, of: str = A_STATE) -> Callable[[float | None], float | None]:
    """A callback that returns a share of the capacity unchanged, and raises InputError, naming the option, for a value
    outside 0 to 1.

    of : end of that sentence, which says what the value means.
    """

    def checked(value: float | None) -> float | None:
        if value is not None and not 0.0 <= value <= 1.0:
            raise InputError(f"{option} {value:g}: {of}.")
        return value

    return checked


def _known_health(text: str | None) -> str | None:
    """The text of --soh unchanged.  Raises InputError, naming the option, if it is no state of health."""
    state_of_health(text)
    return text


def state_of_health(text: str | None) -> Soh | None:
    """The value of `--soh SHARE` or `--soh YYYY-MM-DD`.  Raises InputError, naming the option, if it is neither."""
    if text is None:
        return None
    from aesi.physics.cell.health import read_soh

    try:
        return read_soh(text)
    except CellError as error:
        raise InputError(f"--soh {text}: {error}") from None


SOC0_HELP = (
    "State of charge of the cell file at the first row, 0 (empty) to 1 (full). Default: read from the measured "
    "voltage"
)
Soc0 = Annotated[
    float | None,
    typer.Option(
        "--soc0",
        callback=share("--soc0"),
        help=f"{SOC0_HELP}; a profile without a voltage takes that of a saved model.",
    ),
]
RecordSoc0 = Annotated[
    list[str] | None,
    typer.Option(
        "--soc0",
        metavar="<soc|FILE=soc>",
        help=f"{SOC0_HELP}. One number is for all records whose voltage does not contradict it; FILE=NUMBER, such as "
        "drive.csv=0.8, is for that record and may be repeated.",
    ),
]
"""`--soc0` of a command whose records may be several, and all have a voltage."""
SohOption = Annotated[
    str | None,
    typer.Option(
        "--soh",
        callback=_known_health,
        metavar="<share|YYYY-MM-DD>",
        help="State of health: capacity of the cell when it was measured, as a share of the cell file's capacity "
        "(0.96), or the day of the measurement if the file was calibrated with dates. Default: the file's capacity.",
    ),
]
Effects = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        help="Effect to add, as ID or ID:PARAMETER=VALUE,... in the units that `aesi effects ID` lists; may be "
        "repeated. Example: series_resistance:resistance_ohm=1e-3.",
    ),
]
EffectFiles = Annotated[
    list[Path] | None,
    typer.Option(
        "--effect-file",
        help="Python file of your own that defines an EFFECT; may be repeated. It is run: give only files that you "
        "trust.",
    ),
]
HOLD_HELP = (
    "Current between two rows. linear: a straight line; backward: constant since the row before, as loggers record it. "
    "Default: {}backward for a measurement with rows more than 5 s apart, and linear otherwise. A message says which "
    "was used."
)
HoldOption = Annotated[
    Literal["linear", "backward"] | None,
    typer.Option("--hold", help=HOLD_HELP.format("that of a saved model, if it has one; else ")),
]
RecordHold = Annotated[
    Literal["linear", "backward"] | None, typer.Option("--hold", help=HOLD_HELP.format(""))
]
"""`HoldOption` of a command that fits: the rows of a record tell, also where --cell is a saved model."""
SoughtHold = Annotated[
    Literal["linear", "backward"] | None,
    typer.Option("--hold", help=HOLD_HELP.format("what explains the data better, and where neither does, ")),
]
"""`RecordHold` of a command that seeks what explains the data."""


def _no_key_twice(pairs: list[str] | None) -> list[str] | None:
    """The KEY=VALUE pairs unchanged.  Raises InputError for a key that is given twice: the last value would count
    without a message."""
    seen = set()
    for pair in pairs or []:
        key = pair.partition("=")[0].strip()
        if key in seen:
            raise InputError(f"--set is there twice for {key}; give it once.")
        seen.add(key)
    return pairs


def key_value(told: str) -> Any:
    """The option `--set KEY=VALUE`.  told : its help text."""
    return typer.Option("--set", callback=_no_key_twice, help=told)


SelfHeating = Annotated[
    bool,
    typer.Option(
        "--self-heating",
        help="Simulate the heating of the cell by its losses, with the thermal data of its file. A measured "
        "temperature is used as it is. Default: the temperature is that of the file, or as measured.",
    ),
]

ModelOption = Annotated[
    Literal["espm", "dfn"] | None,
    typer.Option(
        "--model",
        help="Physics model: espm (single particle) or dfn (porous electrode). Default: that of a saved model, or the "
        "one that the cell file was fitted with, else espm.",
    ),
]

MaxEffects = Annotated[
    int, typer.Option("--max-effects", min=0, max=10, help="Largest number of effects that are added.")
]
Seed = Annotated[
    int,
    typer.Option(
        "--seed",
        min=0,
        max=LARGEST_SEED,
        help="Random seed of the intervals of what a record gains; verdict and sizes are the same with any.",
    ),
]
StoreUri = Annotated[
    str | None,
    typer.Option(
        "--uri",
        help="Address of the tracking store (MLflow), such as http://HOST:5000 or sqlite:///FILE. Default: the store "
        "of the workspace.",
    ),
]

PrefectOption = Annotated[
    bool,
    typer.Option(
        "--prefect/--no-prefect",
        envvar="AESI_PREFECT",
        help="Run the stages as a Prefect flow, which records them, or as plain functions.",
    ),
]


def check_unsaid(context: typer.Context, admissible: Iterable[str], keys: Mapping[str, str]) -> None:
    """Raises InputError if an option is given beside an experiment file and would be ignored.

    admissible : names of the parameters that may be given.  keys : name of any other parameter -> the key of an
    experiment file with the same meaning, for those that have one.
    """
    for name in context.params:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in admissible:
            option, key = "--" + name.replace("_", "-"), keys.get(name)
            advice = (
                f"give {key} there, or --set {key}=VALUE"
                if key
                else f"no key of such a file means the same: give {option} beside --cell and --data instead of the file"
            )
            raise InputError(f"{option} is not read beside an experiment file; {advice}.")


def priors(pairs: list[str] | None) -> dict[str, tuple[float, float]]:
    """Parameter -> (value, standard deviation), from `--prior NAME=VALUE:SD`.

    Raises InputError for a pair that cannot be read, and for a parameter that is given twice.
    """
    out: dict[str, tuple[float, float]] = {}
    for pair in pairs or []:
        name, _, told = (part.strip() for part in pair.partition("="))
        try:
            value, sd = map(float, told.split(":"))
        except ValueError:
            raise InputError(f"--prior {pair}: has to read NAME=VALUE:SD.") from None
        if not isfinite(value) or not 0.0 < sd < inf:
            raise InputError(
                f"--prior {pair}: VALUE has to be a finite number, and SD, its standard deviation, one above 0."
            )
        if name in out:
            raise InputError(f"--prior is there twice for {name}; give it once.")
        out[name] = value, sd
    return out


def cut_offs(text: str | None) -> tuple[float, float] | None:
    """The two voltages of `--cut-offs LOWER:UPPER`, V.  Raises InputError if they cannot be read."""
    if text is None:
        return None
    try:
        lower, upper = map(finite_number, text.split(":"))
    except ValueError:
        raise InputError(f"--cut-offs {text}: has to read LOWER:UPPER, in V, such as 2.5:4.2.") from None
    return lower, upper


def body(text: str | None) -> tuple[float, ...] | None:
    """The two or three lengths of `--body DIAMETERxHEIGHT` or `--body AxBxC`, mm.  Raises InputError if they cannot be
    read."""
    if text is None:
        return None
    try:
        edges = tuple(map(finite_number, re.split("[xX×]", text)))
    except ValueError:
        edges = ()
    if len(edges) not in (2, 3):
        raise InputError(
            f"--body {text}: has to read DIAMETERxHEIGHT of a cylinder or AxBxC of a box, in mm, such as 18.4x65.0."
        )
    return edges


def day(option: str, text: str | None) -> date | None:
    """The day that an option gives as YYYY-MM-DD; None for None.  Raises InputError, naming the option."""
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise InputError(f"{option} {text}: has to read YYYY-MM-DD.") from None


def finite_number(text: str) -> float:
    """The number in a text.  Raises ValueError if it is none, or not finite."""
    value = float(text)
    if not isfinite(value):
        raise ValueError(text)
    return value


def added_effects(texts: list[str] | None, files: list[Path] | None) -> tuple[ActiveEffect, ...]:
    """The effects of `--effect ID:PARAMETER=VALUE,...`, from the catalogue and from the user's files.

    Raises InputError for an unknown effect or parameter, and for a file whose effect no `--effect` names, since that
    effect would not be simulated.
    """
    from aesi.physics.effects import activated, load_effect

    active = activated([_effect_values(text) for text in texts or []], files or [])
    for file in files or []:
        own = load_effect(file)
        if own.id not in {one.id for one in active}:
            raise InputError(
                f"--effect-file {file}: its effect is not simulated unless it is named; add --effect {own.id}, or "
                "leave the file out."
            )
    return active


def _effect_values(text: str) -> tuple[str, dict[str, float]]:
    """(id, parameter -> value) of a text `ID:PARAMETER=VALUE,...`.  Raises InputError if it cannot be read."""
    name, colon, rest = text.partition(":")
    values: dict[str, float] = {}
    for item in rest.split(",") if colon else ():
        parameter, _, value = (part.strip() for part in item.partition("="))
        if parameter in values:
            raise InputError(f"--effect {text}: {parameter} is there twice; give it once.")
        try:
            values[parameter] = float(value)
        except ValueError:
            raise InputError(
                f"--effect {text}: {item!r} has to read parameter=number, as in series_resistance:resistance_ohm=1e-3."
            ) from None
    return name, values
