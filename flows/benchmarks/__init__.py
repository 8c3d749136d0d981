"""Every benchmark by name: those of the package, and those that need the tracker, the scheduler or a page of the docs.

Each module has `run(**options)`, which yields one JSON-ready dict a line.
"""

from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from inspect import BoundArguments, signature
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from aesi.bench import BENCHMARKS as OF_THE_PACKAGE
from aesi.errors import InputError, did_you_mean, wanted
from aesi.numerics.files.whole import check_writable
from flows.benchmarks.page import check_marks

BENCHMARKS = OF_THE_PACKAGE | {
    "blind": "flows.benchmarks.blind",
    "cells": "flows.benchmarks.cells",
    "splits": "flows.benchmarks.splits",
    "real": "flows.benchmarks.real",
    "left_out": "flows.benchmarks.left_out",
    "tracking": "flows.benchmarks.tracking",
    "scale": "flows.benchmarks.scale",
    "search": "flows.benchmarks.search",
}
"""Name -> module."""

PEERS = {"spci": {"mapie": "mapie>=1.5"}, "scale": {"distributed": "dask[distributed]"}}
"""Name -> packages beyond those of the project that its peers come from, and what installs each."""


PLACES = ("write", "report", "keep")
"""Options that name what a benchmark writes: a page, a page, and a folder."""

OF_A_CLONE = "experiments"
"""Folder of a clone that the default of an option lies in, where the benchmark reads files of the project."""


def missing(names: Iterable[str]) -> dict[str, str]:
    """Package -> what installs it, of the packages that these benchmarks need and that are not here."""
    needed = {package: source for name in names for package, source in PEERS.get(name, {}).items()}
    return {package: source for package, source in needed.items() if find_spec(package) is None}


AS_WRITTEN = ConfigDict(coerce_numbers_to_str=True)
"""A name may look like a number."""


def run(name: str, **options: Any) -> Iterator[dict[str, Any]]:
    """Lines of one benchmark, as they come; nothing is run before the first is asked for.

    Raises InputError at once, so that of several benchmarks none has run in vain, for an option that this one does not
    have, a value that the option cannot have, files of the project that are not there, and a place that cannot be
    written to.
    """
    module = import_module(BENCHMARKS[name])
    known = get_type_hints(module.run, include_extras=True)
    known.pop("return")
    for option, value in options.items():
        if option not in known:
            near = did_you_mean(option, known)
            begun = "; it has" if near == "." else f"{near} It has"
            there = ", ".join(known) or "none"
            raise InputError(f"--set {option}: `aesi bench {name}` has no such option{begun}: {there}.")
        try:
            options[option] = TypeAdapter(known[option], config=AS_WRITTEN).validate_python(value)
        except ValidationError as error:
            raise InputError(f"--set {option}={value}: it {wanted(error.errors()[0])}.") from None
    _check_places({option: str(options[option]) for option in PLACES if options.get(option) is not None})
    if options.get("write") is not None:
        marks = module.ARCHIVE_MARKS if options.get("archive") else (module.BEGIN, module.END)
        check_marks(str(options["write"]), *marks)
    _check_inputs(name, signature(module.run).bind_partial(**options))
    return iter(module.run(**options))


def _check_inputs(name: str, asked: BoundArguments) -> None:
    """Of the options that name a file or folder of the project.  Raises InputError where there is none of that name."""
    given = set(asked.arguments)
    asked.apply_defaults()
    for option, parameter in asked.signature.parameters.items():
        place, default = asked.arguments[option], parameter.default
        if (
            not (isinstance(default, str) and Path(default).parts[:1] == (OF_A_CLONE,))
            or Path(place).exists()
        ):
            continue
        if option in given:
            raise InputError(
                f"--set {option}={place}: there is no such file or folder; name one that exists."
            )
        raise InputError(
            f"`aesi bench {name}` reads {place} of a clone of the project, and {Path.cwd()} has none; run it in the "
            f"folder of a clone, or name the place with --set {option}=PATH."
        )


def _check_places(places: dict[str, str]) -> None:
    """Of what is written after the work, or through it.  Raises InputError where one cannot be."""
    for option, place in places.items():
        try:
            if option != "keep" and Path(place).is_dir():
                raise InputError(f"--set {option}={place} is a folder; name a file.")
            check_writable(Path(place, "row.json") if option == "keep" else Path(place))
        except OSError as error:
            raise InputError(
                f"--set {option}={place} cannot be written ({error.filename}: {error.strerror}); name another place."
            ) from None
