"""Options that several commands share, and their reading into plain values."""

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

_CELL = typer.Option("--cell", help="BPX file, or a model folder that `discover` wrote.")
CellOption = Annotated[Path, _CELL]
CellUnlessExperiment = Annotated[Path | None, _CELL]


A_STATE = "a state of charge is a share of the capacity, from 0 (empty) to 1 (full); 90 % is 0.9"
ITS_DEVIATION = (
    "how far a state of charge may be off is a share of the capacity, from 0 (exact) to 1; 1 % is 0.01"
)


def share(option: str, of: str = A_STATE) -> Callable[[float | None], float | None]:
    """What lets a share of the capacity through, and raises InputError, naming the option, for what is none.

    of : what the share is of, for the sentence.
    """

    def checked(value: float | None) -> float | None:
        if value is not None and not 0.0 <= value <= 1.0:
            raise InputError(f"{option} {value:g}: {of}.")
        return value

    return checked


def _known_health(text: str | None) -> str | None:
    """Lets a state of health through.  Raises InputError, naming the option, for one that is none."""
    state_of_health(text)
    return text


def state_of_health(text: str | None) -> Soh | None:
    """`--soh SHARE` or `--soh YYYY-MM-DD`.  Raises InputError, naming the option, for what is neither."""
    if text is None:
        return None
    from aesi.physics.cell.health import read_soh

    try:
        return read_soh(text)
    except CellError as error:
        raise InputError(f"--soh {text}: {error}") from None


Soc0 = Annotated[
    float | None,
    typer.Option("--soc0", callback=share("--soc0"), help="State of charge at the first row, from 0 to 1."),
]
SohOption = Annotated[
    str | None,
    typer.Option(
        "--soh",
        callback=_known_health,
        metavar="<share|YYYY-MM-DD>",
        help="State of health: share of the cell file's capacity that the cell had when this was measured, or the day "
        "of that, where the file was calibrated with dates.",
    ),
]
Effects = Annotated[
    list[str] | None, typer.Option("--effect", help="An effect to add: id or id:parameter=value,...")
]
EffectFiles = Annotated[
    list[Path] | None, typer.Option("--effect-file", help="A Python file of yours with an EFFECT in it.")
]
HoldOption = Annotated[
    Literal["linear", "backward"] | None,
    typer.Option(
        "--hold",
        help="How the current runs between rows. linear: straight; backward: constant since the row before, as loggers "
        "write. Without it that of a saved model; elsewhere backward where rows come more than 5 s apart, but linear "
        "for a profile without a voltage. A message states which was used.",
    ),
]


def _no_key_twice(pairs: list[str] | None) -> list[str] | None:
    """Lets KEY=VALUE pairs through.  Raises InputError for a key that is there twice: of two values the last would
    count, and nobody be told."""
    seen = set()
    for pair in pairs or []:
        key = pair.partition("=")[0].strip()
        if key in seen:
            raise InputError(f"--set is there twice for {key}; give it once.")
        seen.add(key)
    return pairs


def key_value(told: str) -> Any:
    """The option `--set`, with its help."""
    return typer.Option("--set", callback=_no_key_twice, help=told)


SelfHeating = Annotated[
    bool,
    typer.Option(
        "--self-heating",
        help="Let the cell warm itself, by its file's thermal data; a measured temperature is used as it is.",
    ),
]

ModelOption = Annotated[
    Literal["espm", "dfn"] | None,
    typer.Option(
        "--model",
        help="Single particle or porous electrode; without it that of a saved model, or that the cell's file was "
        "fitted with, else espm.",
    ),
]

MaxEffects = Annotated[int, typer.Option("--max-effects", min=0, max=10, help="Most effects that are added.")]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Random seed.")]
StoreUri = Annotated[str | None, typer.Option("--uri", help="Tracking store; the workspace's without it.")]

PrefectOption = Annotated[
    bool,
    typer.Option("--prefect/--no-prefect", envvar="AESI_PREFECT", help="Run the stages as a Prefect flow."),
]

_LIST = list[str] | None
READING: dict[str, Any] = {
    "column": Annotated[
        _LIST,
        typer.Option(
            "--column",
            help='quantity=name, for other headers: current_a="I[A]", or its number, #2, where there are none; also '
            "cycle=, step=; temperature_degc=40 states it for every row, as that of the case (a winding with a thermal "
            "conductivity in its file is warmer under load), temperature_degc= leaves it out.",
        ),
    ],
    "unit": Annotated[
        _LIST,
        typer.Option(
            "--unit",
            help="quantity=unit where a column is not in s, A, V, degC: current_a=mA, time_s=h:m:s or =date.",
        ),
    ],
    "sign": Annotated[
        Literal["discharge-positive", "charge-positive"] | None,
        typer.Option(
            "--sign",
            help="Which direction of the current is positive; without it as the export has it, or discharge.",
        ),
    ],
    "state": Annotated[
        str | None,
        typer.Option("--state", help="Column that says which way a current without a sign flows."),
    ],
    "state_word": Annotated[
        _LIST,
        typer.Option("--state-word", help="WORD=charge, discharge or rest, for a word of that column."),
    ],
    "cycle": Annotated[str | None, typer.Option("--cycle", help="Rows of this cycle alone: 3, or 3:5.")],
    "step": Annotated[str | None, typer.Option("--step", help="Rows of this step alone: 7, or 7:9.")],
    "from_s": Annotated[float | None, typer.Option("--from-s", help="Rows from this time on.")],
    "to_s": Annotated[float | None, typer.Option("--to-s", help="Rows up to this time.")],
    "duplicates": Annotated[
        Literal["refuse", "first", "last"] | None,
        typer.Option("--duplicates", help="Which row of several with one stamp to keep."),
    ],
}
"""What can be said of files, in every command that reads them."""


def reads_files(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say how its files are read, handed to it as `reading`."""
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
    """Raises InputError where an option is given beside an experiment file that would not be looked at."""
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
    """The files as measurements, with how the current was declared to run between their rows.

    until : seconds up to which single records are read, by their names.
    """
    from aesi.data.read import read
    from aesi.data.reading import record_names

    out = []
    for path, name in zip(paths, record_names(paths), strict=True):
        end = (until or {}).get(name)
        told = reading if end is None else reading.but(stop_s=end)
        out.append(
            read(path, told, None, name).held(hold)
        )  # with all rows, as in Python: a fit thins them itself
    return tuple(out)


def check_once(option: str, paths: list[Path]) -> None:
    """Raises InputError for a file that is given twice."""
    seen = set()
    for path in paths:
        if path.resolve() in seen:
            raise InputError(f"{option} {path} is there twice; give it once.")
        seen.add(path.resolve())


def by_file(option: str, pairs: list[str] | None, paths: list[Path]) -> dict[str, float]:
    """`FILE=NUMBER` pairs as numbers by record of the files `paths`."""
    return _by_file(option, pairs, paths, _finite, "NUMBER")


def dates(pairs: list[str] | None, paths: list[Path]) -> dict[str, date]:
    """`--date FILE=YYYY-MM-DD` pairs as days by record of the files `paths`."""
    return _by_file("--date", pairs, paths, date.fromisoformat, "YYYY-MM-DD")


def priors(pairs: list[str] | None) -> dict[str, tuple[float, float]]:
    """`--prior NAME=VALUE:SD` as value and standard deviation by name."""
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
    """`--cut-offs LOWER:UPPER` as two voltages."""
    if text is None:
        return None
    try:
        lower, upper = map(_finite, text.split(":"))
    except ValueError:
        raise InputError(f"--cut-offs {text}: has to read LOWER:UPPER, in V, such as 2.5:4.2.") from None
    return lower, upper


def body(text: str | None) -> tuple[float, ...] | None:
    """`--body DIAMETERxHEIGHT` or `--body AxBxC` as two or three lengths."""
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
    """A day that an option gives."""
    try:
        return None if text is None else date.fromisoformat(text)
    except ValueError:
        raise InputError(f"{option} {text}: has to read YYYY-MM-DD.") from None


def _finite(text: str) -> float:
    """Raises ValueError for a text that is no number, or no finite one."""
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
    """What the record is called that an option means by `file`: a path as in --data, a file's name, or a record's."""
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
    """The spectra of impedance files."""
    from aesi.data import read_spectra

    return tuple(spectrum for path in paths or [] for spectrum in read_spectra(path))


def say_reading(paths: Iterable[Path]) -> None:
    """The first line of a long command, before the libraries load."""
    typer.echo(f"Reading {', '.join(path.name or str(path) for path in paths)} ...", err=True)


def say_notes(notes: Iterable[str]) -> None:
    """What a reader dropped, mapped or averaged, on stderr."""
    from aesi.pipeline.notes import together

    for note in together(notes):
        typer.echo(note, err=True)


def added_effects(texts: list[str] | None, files: list[Path] | None) -> tuple[ActiveEffect, ...]:
    """The effects of `--effect id:parameter=value,...`, of the catalogue and of the user's files.

    Raises InputError also for a file whose effect no `--effect` names: it would not be simulated.
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
    """`id:parameter=value,...` as the id and its values."""
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
