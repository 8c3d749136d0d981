"""Checks of a user's own effect, made when its file is read and not in the middle of a search, and messages that locate
a mistake in the file."""

from __future__ import annotations

import ast
import inspect
import re
import traceback
from collections.abc import Iterator, Mapping
from typing import get_args

from aesi.errors import AesiError, InputError
from aesi.parameters import Parameter
from aesi.physics.effect import PLACES, Effect, Kind

Place = tuple[int, int]
"""(line, counted from 1; column) in a source text."""


def check_own(effect: Effect, path: str) -> None:
    """Raises InputError, one sentence naming the file, for an effect that cannot be named, listed or called."""
    if not re.fullmatch(r"\w+", effect.id):
        raise InputError(f"{path}: the id {effect.id!r} has to be letters, digits and `_`: commands name it.")
    if effect.kind not in get_args(Kind):
        known = ", ".join(map(repr, get_args(Kind)))
        raise InputError(f"{path}: the kind {effect.kind!r} is not known; give one of {known}.")
    if not (effect.doc or "").strip():
        raise InputError(
            f"{path}: EFFECT has no docstring; write one at the top of the file, what the effect is in its first line, "
            "its equation indented below."
        )
    declared = effect.parameters
    if not isinstance(declared, Mapping) or not all(
        isinstance(name, str) and isinstance(p, Parameter) for name, p in declared.items()
    ):
        raise InputError(
            f"{path}: the parameters of EFFECT have to be a dict of names and aesi.parameters.Parameter, as "
            '{"lead_ohm": Parameter(1e-3, "ohm", bounds=(0.0, 0.01), source="a lead")}.'
        )
    if not effect.acting:
        raise InputError(f"{path}: EFFECT acts nowhere; give it one of {', '.join(PLACES)}.")
    for place, function in effect.acting.items():
        try:
            inspect.signature(function).bind(None, **dict.fromkeys(declared, 0.0))
        except TypeError as error:
            names = ", ".join(declared) or "none"
            raise InputError(
                f"{path}: {place} cannot be called with what EFFECT declares (parameters: {names}): {error}."
            ) from None


def load_failure(path: str, content: bytes, error: BaseException) -> str:
    """One sentence with the error and the line of the file where it occurred, and the parameter where one is declared
    there."""
    places = [
        (frame.lineno or 0, frame.colno or 0)
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == path
    ]
    where = f" in line {places[-1][0]}" if places else ""
    if places:  # else the file is not valid Python, and the error states the line
        for name, begin, end in _declared_parameters(content, path):
            if any(begin <= place < end for place in places):
                where += f", parameter {name!r}"
    said = str(error).rstrip(".")
    kind = "" if isinstance(error, AesiError) else type(error).__name__
    return f"the effect file {path} fails{where}: {': '.join(filter(None, (kind, said)))}."


def _declared_parameters(content: bytes, path: str) -> Iterator[tuple[str, Place, Place]]:
    """(name, begin, end) of each parameter in the dictionaries of the file."""
    for node in ast.walk(ast.parse(content, path)):
        if not isinstance(node, ast.Dict):
            continue
        for key, value in zip(node.keys, node.values, strict=True):
            if isinstance(key, ast.Constant) and isinstance(value, ast.Call) and _makes_parameter(value):
                end = value.end_lineno or value.lineno, value.end_col_offset or value.col_offset
                yield str(key.value), (value.lineno, value.col_offset), end


def _makes_parameter(call: ast.Call) -> bool:
    return ast.unparse(call.func).split(".")[-1] == Parameter.__name__
