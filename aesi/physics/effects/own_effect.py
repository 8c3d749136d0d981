"""What a user's own effect has to be, checked when its file is read and not in the middle of a search."""

from __future__ import annotations

import inspect
import re
from typing import get_args

from aesi.errors import InputError
from aesi.physics.effect import Effect, Kind

PLACES = ("on_model", "on_record", "on_voltage", "on_reading")


def check_own(effect: Effect, path: str) -> None:
    """Raises InputError, one sentence naming the file, for an effect that could not be named, shown or called."""
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
    acting = {place: getattr(effect, place) for place in PLACES if getattr(effect, place) is not None}
    if not acting:
        raise InputError(f"{path}: EFFECT acts nowhere; give it one of {', '.join(PLACES)}.")
    for place, function in acting.items():
        try:
            inspect.signature(function).bind(None, **dict.fromkeys(effect.parameters, 0.0))
        except TypeError as error:
            names = ", ".join(effect.parameters) or "none"
            raise InputError(
                f"{path}: {place} cannot be called with what EFFECT declares (parameters: {names}): {error}."
            ) from None
