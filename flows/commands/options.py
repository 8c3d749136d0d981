"""Options that several commands share, and functions that turn their texts into values."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable
from datetime import date
from math import inf, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import typer

from aesi.errors import CellError, InputError

if TYPE_CHECKING:
    from aesi.data.reading import Reading
    from aesi.physics import ActiveEffect
    from aesi.physics.cell import Soh
    from aesi.records import Hold, Measurement, Spectrum

Value = TypeVar("Value")

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


SOC0_HELP = "State of charge at the first row, 0 (empty) to 1 (full). Default: read from the measured voltage"
Soc0 = Annotated[
    float | None,
    typer.Option(
        "--soc0",
        callback=share("--soc0"),
        help=f"{SOC0_HELP}; a profile without a voltage takes that of a saved model.",
    ),
]
RecordSoc0 = Annotated[
    float | None,
    typer.Option("--soc0", callback=share("--soc0"), help=f"{SOC0_HELP}."),
]
"""`Soc0` of a command whose records all have a voltage."""
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
    typer.Option("--hold", help=HOLD_HELP.format("that of a saved model; else ")),
]
RecordHold = Annotated[
    Literal["linear", "backward"] | None, typer.Option("--hold", help=HOLD_HELP.format(""))
]
"""`HoldOption` of a command that fits: the rows of a record tell, also where --cell is a saved model."""


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
Seed = Annotated[int, typer.Option("--seed", min=0, help="Random seed.")]
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

_LIST = list[str] | None
READING: dict[str, Any] = {
    "column": Annotated[
        _LIST,
        typer.Option(
            "--column",
            help='Column of a quantity in the file, as QUANTITY=NAME, such as current_a="I[A]"; without headers by its '
            "number, such as current_a=#2. Quantities: time_s, current_a, voltage_v, temperature_degc, cycle, step. "
            "temperature_degc=40 states the temperature of the case for every row (under load the winding is warmer if "
            "the cell file has a thermal conductivity); temperature_degc= leaves the column out. May be repeated.",
        ),
    ],
    "unit": Annotated[
        _LIST,
        typer.Option(
            "--unit",
            help="Unit of a column that is not in s, A, V or degC, as QUANTITY=UNIT: current_a=mA, temperature_degc=K, "
            "time_s=h:m:s, time_s=date. May be repeated.",
        ),
    ],
    "sign": Annotated[
        Literal["discharge-positive", "charge-positive"] | None,
        typer.Option(
            "--sign",
            help="Direction in which the current of the file is positive. Default: that of a known cycler's export, "
            "else discharge.",
        ),
    ],
    "state": Annotated[
        str | None,
        typer.Option(
            "--state", help="Column that gives the direction of a current without a sign, in words or codes."
        ),
    ],
    "state_word": Annotated[
        _LIST,
        typer.Option(
            "--state-word",
            help="Meaning of a word in the column of --state, as WORD=charge, WORD=discharge or WORD=rest; may be "
            "repeated.",
        ),
    ],
    "cycle": Annotated[
        str | None,
        typer.Option("--cycle", help="Use only the rows of this cycle, such as 3, or 3:5 for 3 to 5."),
    ],
    "step": Annotated[
        str | None,
        typer.Option("--step", help="Use only the rows of this step, such as 7, or 7:9 for 7 to 9."),
    ],
    "from_s": Annotated[
        float | None,
        typer.Option("--from-s", help="Use only the rows from this time on, s, in the file's clock."),
    ],
    "to_s": Annotated[
        float | None,
        typer.Option("--to-s", help="Use only the rows up to this time, s, in the file's clock."),
    ],
    "duplicates": Annotated[
        Literal["refuse", "first", "last"] | None,
        typer.Option(
            "--duplicates",
            help="Which of several rows with the same time is used; refuse stops with an error. Default: first in a "
            "known cycler's export, else refuse.",
        ),
    ],
}
"""Keyword -> option that says how files are read, in every command that reads measurements."""


def reads_files(command: Callable[..., None]) -> Callable[..., None]:
    """The command with the options of READING added. It gets them together as its keyword `reading`, a `Reading`."""
    signature = inspect.signature(command, eval_str=True)
    keyword = inspect.Parameter.KEYWORD_ONLY
    own = [p.replace(kind=keyword) for p in signature.parameters.values() if p.name != "reading"]
    added = [
        inspect.Parameter(name, keyword, default=None, annotation=option) for name, option in READING.items()
    ]

    def reading_command(**given: Any) -> None:
        said = {name: given.pop(name) for name in READING}
        command(**given, reading=_reading(**said))

    reading_command.__name__, reading_command.__doc__ = command.__name__, command.__doc__
    parameters = [*own, *added]
    reading_command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    reading_command.__annotations__ = {p.name: p.annotation for p in parameters}
    return reading_command


def check_unsaid(context: typer.Context, admissible: Iterable[str]) -> None:
    """Raises InputError if an option is given beside an experiment file and would be ignored.

    admissible : names of the parameters that may be given.
    """
    for name in context.params:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE" and name not in admissible:
            option = "--" + name.replace("_", "-")
            raise InputError(
                f"{option} is not read beside an experiment file; say it there, or with --set KEY=VALUE."
            )


def _reading(
    column: list[str] | None,
    unit: list[str] | None,
    sign: Any,
    state: str | None,
    state_word: list[str] | None,
    cycle: str | None,
    step: str | None,
    from_s: float | None,
    to_s: float | None,
    duplicates: Any,
) -> Reading:
    from aesi.data.reading import Reading

    columns: dict[str, str | None] = {key: value or None for key, value in _pairs("--column", column).items()}
    if state is not None:
        columns["state"] = state
    words: dict[str, Any] = _pairs("--state-word", state_word)
    return Reading(columns, _pairs("--unit", unit), sign, words, cycle, step, from_s, to_s, duplicates)


def _pairs(option: str, pairs: list[str] | None) -> dict[str, str]:
    mapping: dict[str, str] = {}
    for pair in pairs or []:
        name, equals, value = pair.partition("=")
        if not equals:
            raise InputError(f"{option} {pair}: has to read name=value.")
        if name.strip() in mapping:
            raise InputError(f"{option} is there twice for {name.strip()}; give it once.")
        mapping[name.strip()] = value
    return mapping


def measurements(
    paths: list[Path], reading: Reading, hold: Hold | None = None, until: dict[str, float] | None = None
) -> tuple[Measurement, ...]:
    """The measurements in the files, with all their rows.

    reading : how the files are read.  hold : current between rows, None leaves it undeclared.  until : name of a record
    -> time up to which it is read, s.
    """
    from aesi.data.read import read
    from aesi.data.reading import record_names

    out = []
    for path, name in zip(paths, record_names(paths), strict=True):
        end = (until or {}).get(name)
        told = reading if end is None else reading.but(stop_s=end)
        out.append(
            read(path, told, None, name).held(hold)
        )  # all rows are read, as in Python: a fit thins them itself
    return tuple(out)


def check_once(option: str, paths: list[Path]) -> None:
    """Raises InputError, naming the option, for a file that is given twice."""
    seen = set()
    for path in paths:
        if path.resolve() in seen:
            raise InputError(f"{option} {path} is there twice; give it once.")
        seen.add(path.resolve())


def by_file(option: str, pairs: list[str] | None, paths: list[Path]) -> dict[str, float]:
    """Record -> number, from `FILE=NUMBER` pairs. FILE means one of the files `paths` (`_record_of`).

    Raises InputError for a pair that cannot be read, an unknown file, and a record that is given twice.
    """
    return _by_file(option, pairs, paths, _finite, "NUMBER")


def dates(pairs: list[str] | None, paths: list[Path]) -> dict[str, date]:
    """Record -> day, from `--date FILE=YYYY-MM-DD` pairs; raises as `by_file`."""
    return _by_file("--date", pairs, paths, date.fromisoformat, "YYYY-MM-DD")


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
        lower, upper = map(_finite, text.split(":"))
    except ValueError:
        raise InputError(f"--cut-offs {text}: has to read LOWER:UPPER, in V, such as 2.5:4.2.") from None
    return lower, upper


def body(text: str | None) -> tuple[float, ...] | None:
    """The two or three lengths of `--body DIAMETERxHEIGHT` or `--body AxBxC`, mm.  Raises InputError if they cannot be
    read."""
    if text is None:
        return None
    try:
        edges = tuple(map(_finite, re.split("[xX×]", text)))
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


def _finite(text: str) -> float:
    """The number in a text.  Raises ValueError if it is none, or not finite."""
    value = float(text)
    if not isfinite(value):
        raise ValueError(text)
    return value


def _by_file(
    option: str, pairs: list[str] | None, paths: list[Path], read: Callable[[str], Value], form: str
) -> dict[str, Value]:
    out: dict[str, Value] = {}
    for pair in pairs or []:
        file, equals, text = pair.rpartition("=")
        try:
            value = read(text)
        except ValueError:
            equals = ""
        if not equals or not file:
            raise InputError(f"{option} {pair}: has to read FILE={form}.")
        name = _record_of(option, file, paths)
        if name in out:
            raise InputError(f"{option} is there twice for {name}; give it once.")
        out[name] = value
    return out


def _record_of(option: str, file: str, paths: list[Path]) -> str:
    """The name of the record that an option means by `file`: a path as in --data, the name of a file, or that of a
    record, tried in this order.

    Raises InputError if it means none of the files `paths`, or several.
    """
    from aesi.data.reading import record_name, record_names

    names = record_names(paths)
    ways: list[list[object]] = [
        [path.resolve() for path in paths],
        [*names],
        [path.name for path in paths],
        [record_name(path) for path in paths],
    ]
    for wanted, there in zip((Path(file).resolve(), file, file, file), ways, strict=True):
        found = [name for name, one in zip(names, there, strict=True) if one == wanted]
        if len(found) == 1:
            return found[0]
        if found:
            raise InputError(
                f"{option} {file}=...: {len(found)} --data files are called so; give the path of one."
            )
    raise InputError(f"{option} {file}=...: there is no such record; there are {', '.join(names)}.")


def spectra(paths: list[Path] | None) -> tuple[Spectrum, ...]:
    """All spectra in the impedance files."""
    from aesi.data import read_spectra

    return tuple(spectrum for path in paths or [] for spectrum in read_spectra(path))


def say_reading(paths: Iterable[Path]) -> None:
    """Print the first line of a long command, on stderr, before the libraries are loaded."""
    typer.echo(f"Reading {', '.join(path.name or str(path) for path in paths)} ...", err=True)


def say_notes(notes: Iterable[str]) -> None:
    """Print the notes of a reader (dropped, renamed or averaged rows and columns) on stderr, similar ones together."""
    from aesi.pipeline.notes import together

    for note in together(notes):
        typer.echo(note, err=True)


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
