"""`aesi bench`: the benchmarks against the peers."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from aesi.errors import InputError


def bench(
    name: Annotated[str | None, typer.Argument(help="One benchmark; all without it.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON line each.")] = False,
    options: Annotated[
        list[str] | None, typer.Option("--set", help="key=value, an option of the benchmark.")
    ] = None,
) -> None:
    """Time and check the project against its peers, in one run on this machine."""
    from flows.benchmarks import BENCHMARKS, run

    if name is not None and name not in BENCHMARKS:
        raise InputError(f"there is no benchmark {name!r}; there are: {', '.join(BENCHMARKS)}.")
    keywords = dict(_pair(option) for option in options or [])
    for each in [name] if name else list(BENCHMARKS):
        for line in run(each, **keywords):
            typer.echo(json.dumps({"bench": each, **line}) if as_json else _plain(each, line))


def _pair(option: str) -> tuple[str, object]:
    key, equals, text = option.partition("=")
    if not equals:
        raise InputError(f"--set {option}: has to read key=value.")
    try:
        return key, json.loads(text)
    except json.JSONDecodeError:
        return key, text


def _plain(name: str, line: dict[str, object]) -> str:
    return f"{name}: " + ", ".join(f"{key} {_short(value)}" for key, value in line.items() if key != "bench")


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
