"""Checks of the arguments of `simulate`, made before anything is computed; an error is one sentence."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, get_args

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC
from aesi.errors import InputError, in_words
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.records import Measurement
from aesi.records.checked import is_one_number, numbers

FARTHEST_SOC = 1.0
"""Largest distance of a state of charge from [0, 1]: a value beyond it is a percentage or a voltage."""


def check_cell(cell: object) -> None:
    """Raises InputError where `cell` is not a Cell (but the path of its file, for example)."""
    if not isinstance(cell, Cell):
        raise InputError(
            f"cell is {_described(cell)}, not a Cell; read one from its file with aesi.Cell.from_bpx(path)."
        )


def check_measurement(record: object) -> None:
    """Raises InputError where `record` is not a Measurement (but a table or the path of its file, for example)."""
    if not isinstance(record, Measurement):
        raise InputError(
            f"the record is {_described(record)}, not a Measurement; give aesi.Measurement(time_s, current_a, "
            "voltage_v), or what aesi.read_measurement(path) gave."
        )


def checked_effects(effects: object) -> tuple[ActiveEffect, ...]:
    """The effects as a tuple.  Raises InputError for a name, an effect without values, or no collection at all."""
    if isinstance(effects, str | Effect | ActiveEffect) or not isinstance(effects, Iterable):
        raise InputError(
            f"effects is {_described(effects)}; give a list of them, as in effects=[{_activation_code(effects)}]."
        )
    given = tuple(effects)
    for effect in given:
        if not isinstance(effect, ActiveEffect):
            raise InputError(
                f"effects holds {_described(effect)}, which has no values yet; give {_activation_code(effect)}, with "
                "CATALOGUE from aesi.physics.effects."
            )
    return given


def check_choice(name: str, value: object, choices: Any) -> None:
    """Raises InputError where `value` is none of the words of the Literal `choices`."""
    words = get_args(choices)
    if value not in words:
        allowed = " or ".join(repr(word) for word in words)
        raise InputError(f"{name} = {in_words(value)} is not known; give {allowed}.")


def checked_soc(soc: Any, name: str = "soc0", *, farthest: float = FARTHEST_SOC) -> float | None:
    """A state of charge as a float; None for None.  Raises InputError where it is no share of the capacity.

    name : of the argument, for the sentence.  farthest : largest distance from [0, 1] that is admissible.
    """
    if soc is None:
        return None
    if not (is_one_number(soc) and -farthest <= soc <= 1.0 + farthest):  # this way round, NaN fails too
        raise InputError(
            f"{name} = {in_words(soc)} is not a state of charge; give a share of the capacity between 0 (empty) and 1 "
            "(full), as one number, so 90 % is 0.9."
        )
    return float(soc)


def checked_volts(voltage_v: Any, name: str) -> float:
    """A voltage, V, as a float.  Raises InputError for what is no single number.

    name : of the argument, for the sentence.
    """
    if not is_one_number(voltage_v) or np.isnan(voltage_v):
        raise InputError(f"{name} = {in_words(voltage_v)} is not a voltage; give one number, in V.")
    return float(voltage_v)


def check_temperature(temperature_degc: Any, name: str = "temperature_degc") -> None:
    """Raises InputError for a temperature in degC, or an array of them, that no cell can have (one in kelvin).

    name : of the argument, for the sentence.
    """
    given = numbers(temperature_degc, name)
    absurd = given[~((given >= COLDEST_DEGC) & (given <= WARMEST_DEGC))]  # this way round, NaN is absurd too
    if absurd.size:
        kelvin = " (in kelvin? 298.15 K is 25 degC)" if absurd[0] > WARMEST_DEGC else ""
        raise InputError(
            f"{name} = {absurd[0]:g} degC is outside {COLDEST_DEGC:g} to {WARMEST_DEGC:g} degC, where no cell works"
            f"{kelvin}; give degrees Celsius."
        )


def _activation_code(effect: object) -> str:
    """What a user would write in a list of effects for `effect`."""
    if isinstance(effect, ActiveEffect):
        return "effect"
    name = effect.id if isinstance(effect, Effect) else effect if isinstance(effect, str) else "name"
    return f"CATALOGUE[{name!r}].activate()"


def _described(value: object) -> str:
    """A wrong argument in words: its text, or its type."""
    return f"the text {value!r}" if isinstance(value, str) else f"an object of type {type(value).__name__}"
