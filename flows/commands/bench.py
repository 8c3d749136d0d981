"""`aesi bench`: run the benchmarks, and compare their figures with recorded ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aesi.errors import AesiError, InputError
from flows.commands import complete, options, outputs

if TYPE_CHECKING:
    from flows.benchmarks.history import Entry


def bench(
    name: Annotated[
        str | None,
        typer.Argument(help="Name of a benchmark. Default: all.", autocompletion=complete.benchmarks),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print each row of figures as one line of JSON.")
    ] = False,
    given: Annotated[
        list[str] | None,
        options.key_value(
            "Option of the benchmark as KEY=VALUE, the value in JSON; may be repeated. Examples: seed=1, "
            "'of_cells=[\"nmc\"]'. An unknown key lists those of the benchmark."
        ),
    ] = None,
    compare: Annotated[
        Path | None,
        typer.Option(
            help="File with recorded figures (docs/benchmarks.json). If a figure is worse than recorded, it is named, "
            "and the exit code is 1."
        ),
    ] = None,
) -> None:
    """Measure accuracy and processor time on this machine, beside those of other programs. Some take hours."""
    from flows.benchmarks import run
    from flows.benchmarks.history import not_compared, regressions

    chosen = _chosen(name)
    keywords = dict(_pair(option) for option in given or [])
    history = _recorded(compare, keywords) if compare else []
    runs = [(each, run(each, **keywords)) for each in chosen]
    lines = []
    for each, found in runs:
        for line in found:
            lines.append({"bench": each, **line})
            typer.echo(json.dumps(lines[-1]) if as_json else _plain(each, line))
    apart = not_compared(history, lines) if compare else []
    if apart:
        typer.echo(
            f"{compare} holds no figure of the same cases of {', '.join(apart)}: not compared.", err=True
        )
    worse = regressions(history, lines)
    if worse:
        raise Regressed(f"worse than recorded: {'; '.join(worse)}.")


class Regressed(AesiError):
    """A figure of a benchmark is worse than the recorded one."""


def _chosen(name: str | None) -> list[str]:
    """The benchmark of that name, or all for None.

    Raises InputError for an unknown name, and if a program that it compares with is not installed.
    """
    from flows.benchmarks import BENCHMARKS, missing

    if name is not None and name not in BENCHMARKS:
        raise InputError(f"there is no benchmark {name!r}; there are: {', '.join(BENCHMARKS)}.")
    chosen = [name] if name else list(BENCHMARKS)
    lacking = missing(chosen)
    if lacking:
        command = " ".join(f"'{source}'" for source in lacking.values())
        raise InputError(
            f"`aesi bench {name or ''}`".replace(" `", "`")
            + f" compares with {', '.join(lacking)}, not installed here: pip install {command}."
        )
    return chosen


def _recorded(file: Path, keywords: dict[str, object]) -> list[Entry]:
    """The recorded figures in a file.

    keywords : options of the benchmark.  Raises InputError if the file has no figures, or if the benchmark would write
    to it.
    """
    from flows.benchmarks.history import read_history

    if not file.exists():
        raise InputError(f"--compare {file}: there is no such file.")
    history = read_history(file)
    if not history:
        raise InputError(f"{file} holds no recorded benchmarks to compare with.")
    for option in ("write", "report"):
        if option in keywords:
            outputs.check_file(Path(str(keywords[option])), [file], option=f"--set {option}")
    return history


def _pair(option: str) -> tuple[str, object]:
    key, equals, text = option.partition("=")
    if not equals:
        raise InputError(f"--set {option}: has to read key=value.")
    try:
        return key.strip(), json.loads(text)
    except json.JSONDecodeError:
        return key.strip(), text


def _plain(name: str, line: dict[str, object]) -> str:
    return f"{name}: " + ", ".join(f"{key} {_short(value)}" for key, value in line.items() if key != "bench")


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
