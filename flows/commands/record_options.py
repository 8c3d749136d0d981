"""Options about the record files of a command: how they are read, and values that are given for one of them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import typer

from aesi.errors import InputError
from flows.commands.options import finite_number, share

if TYPE_CHECKING:
    from aesi.data.reading import Reading
    from aesi.records import Hold, Measurement, Spectrum

Value = TypeVar("Value")

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
    paths: list[Path],
    reading: Reading,
    hold: Hold | None = None,
    until: dict[str, float] | None = None,
    soc0: dict[str, float] | None = None,
) -> tuple[Measurement, ...]:
    """The measurements in the files, with all their rows.

    reading : how the files are read.  hold : current between rows, None leaves it undeclared.  until : name of a record
    -> time up to which it is read, s.  soc0 : name of a record -> state of charge at its first row.
    """
    from aesi.data.read import read
    from aesi.data.reading import record_names

    out = []
    for path, name in zip(paths, record_names(paths), strict=True):
        end = (until or {}).get(name)
        told = reading if end is None else reading.but(stop_s=end)
        # All rows are read, as in Python: a fit thins them itself.
        out.append(read(path, told, None, name).held(hold).begun_at((soc0 or {}).get(name)))
    return tuple(out)


def check_once(option: str, paths: list[Path]) -> None:
    """Raises InputError, naming the option, for a file that is given twice."""
    seen = set()
    for path in paths:
        if path.resolve() in seen:
            raise InputError(f"{option} {path} is there twice; give it once.")
        seen.add(path.resolve())


def numbers_by_record(option: str, pairs: list[str] | None, paths: list[Path]) -> dict[str, float]:
    """Record -> number, from `FILE=NUMBER` pairs. FILE means one of the files `paths` (`_record_of`).

    Raises InputError for a pair that cannot be read, an unknown file, and a record that is given twice.
    """
    return _values_by_record(option, pairs, paths, finite_number, "NUMBER")


def initial_states(given: list[str] | None, paths: list[Path]) -> tuple[float | None, dict[str, float]]:
    """(state of charge for all records, record -> state of charge of its own), from `--soc0 NUMBER` and
    `--soc0 FILE=NUMBER`; None where no number is for all.

    Raises InputError for what is no state of charge, for two that are for all, and as `numbers_by_record`.
    """
    alone = [text for text in given or [] if "=" not in text]
    if len(alone) > 1:
        raise InputError(f"--soc0 is there twice for all records ({', '.join(alone)}); give it once.")
    try:
        for_all = finite_number(alone[0]) if alone else None
    except ValueError:
        raise InputError(f"--soc0 {alone[0]}: has to read NUMBER or FILE=NUMBER.") from None
    own = numbers_by_record("--soc0", [text for text in given or [] if "=" in text], paths)
    share("--soc0")(for_all)
    for name, value in own.items():
        share(f"--soc0 {name} =")(value)
    return for_all, own


def dates_by_record(pairs: list[str] | None, paths: list[Path]) -> dict[str, date]:
    """Record -> day, from `--date FILE=YYYY-MM-DD` pairs; raises as `numbers_by_record`."""
    return _values_by_record("--date", pairs, paths, date.fromisoformat, "YYYY-MM-DD")


def _values_by_record(
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
    """The name of the record that an option means by `file`: a path as in --data, the name of a record, that of a
    file, or that of a file without its ending, tried in this order.

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
    raise InputError(f"{option} {file}=...: there is no such record among {', '.join(names)}.")


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
