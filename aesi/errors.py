"""Errors a user can act on: what was found, where, and what to do.

Every error the package raises on purpose is an `AesiError`, so that the command line turns it into one
sentence and an exit code. An expected failure inside a search is a value, `aesi.records.Failed`.
"""

from __future__ import annotations

import re
import reprlib
from collections.abc import Iterable, Mapping
from typing import Any

from aesi.logins import without_logins


class AesiError(Exception):
    """Root of all errors raised on purpose; `exit_code` is what the command line returns."""

    exit_code = 1


class InputError(AesiError, ValueError):
    """A file, a table or an argument from the user cannot be used as it is."""

    exit_code = 2


class ParameterError(InputError):
    """A parameter lies outside its declared bounds."""


class DataError(InputError):
    """A measurement is malformed, contradicts itself, or does not fit the cell."""


class DataAway(DataError):
    """Data that are not on this machine cannot be fetched now. The request itself was right."""

    exit_code = 1


class CellError(InputError):
    """A cell file fails its schema or lacks a field that is needed."""


class EffectError(InputError, KeyError):
    """The catalogue is asked for an effect that it does not have."""

    __str__ = Exception.__str__  # KeyError puts its message in quotes


class ConfigError(InputError):
    """An experiment file has an unknown key or an inadmissible value."""


class SimulationError(AesiError, RuntimeError):
    """The model cannot be evaluated on this input (a stoichiometry ran out, a solver did not converge)."""


class NoNumberError(SimulationError):
    """A user's own function returns no finite number at these parameter values; a search skips them."""

    exit_code = 2


class OwnEffectError(RuntimeError):
    """A user's own function fails, or returns something unusable.

    It is no AesiError, since a search would skip these; this error has to end the search.
    """

    exit_code = 2


class FitError(AesiError, RuntimeError):
    """An estimation cannot be carried out on these data."""


def first_line(error: BaseException, most: int = 200) -> str:
    """What an exception says, in one line of at most `most` characters, without logins in addresses; its type where it
    says nothing."""
    return without_logins((str(error).strip().splitlines() or [type(error).__name__])[0])[:most]


def not_written(path: object, error: OSError) -> str:
    """A sentence on a file or folder that the system does not let be written, with its reason."""
    return f"{path} cannot be written: {error.strerror or error}."


def nearest_name(name: str, known: Iterable[str]) -> str | None:
    """The known name that is meant by an abbreviated or misspelt one: the one that begins with it, or the
    shortest where they begin with one another; else the most similar spelling; None where nothing is near."""
    from difflib import get_close_matches

    every = list(known)
    begun = [each for each in every if each.startswith(name)] if name else []
    of_all = [each for each in begun if all(other.startswith(each) for other in begun)]
    near = of_all or get_close_matches(name, begun or every, n=1)
    return near[0] if near else None


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """End of a sentence about an unknown name: the nearest known one, or a full stop."""
    near = nearest_name(name, known)
    return f"; did you mean {near!r}?" if near is not None else "."


def in_words(value: object) -> str:
    """A wrong value as a sentence holds it: its repr on one line, without the middle where it is long."""
    return " ".join(reprlib.repr(value).split())


OF_A_LIST = ("list_type", "tuple_type", "sequence_str", "is_instance_of")
"""Pydantic's error types for a value that is no list. Sequences are the only Python type that a schema's fields check
for by "is_instance_of"."""


def wanted(fault: Mapping[str, Any]) -> str:
    """End of a sentence about a value that a schema refuses, such as "has to be less than 1".

    fault : an item of pydantic's ValidationError.errors().
    """
    if fault["type"] in OF_A_LIST:
        return "has to be a list, in [ ]"
    if fault["type"] == "missing":
        return "lacks a value"
    if fault["type"] == "dict_type":
        return "takes keys with a value each, as in {KEY: VALUE}"
    if fault["type"] in ("bool_parsing", "bool_type"):
        return "has to be true or false"
    said = fault["msg"].rstrip(".").split(", unable to ")[0].split(", got ")[0].split(" after validation")[0]
    own = re.sub(r"^\w+ should ", "", said)  # Input, or Tuple, String and other types of Python
    return f"has to {own}" if own != said else said[:1].lower() + said[1:]
