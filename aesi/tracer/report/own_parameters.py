"""The declared parameters of the cell after a fit: how far each moved, and which ended on its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.tracer.case.free_parameter import CAPACITY_SHARE, STATE_OF_CHARGE, FreeParameter
from aesi.tracer.likelihood.model_state import ModelState

LIMIT_SHARE = 0.01
"""Share of the range, at either end of it, within which a parameter counts as on its limit."""


@dataclass(frozen=True)
class OwnParameter:
    """A declared parameter after a fit.

    owner : id of the effect that restates it, or one of RECORD_OWNERS; `name` is then that of the record.
    declared, value : in `unit`; a factor is declared as 1, a state of charge as this model reads it from the voltage.
    deviations : value - declared, in prior standard deviations of that fit.  one_sd : size of one standard deviation on
    the side to which it moved, in `unit`.
    at_limit : whether it ended at the end of its range.
    """

    owner: str
    name: str
    declared: float
    value: float
    unit: str
    deviations: float
    one_sd: float
    at_limit: bool


def own_parameters(state: ModelState) -> tuple[OwnParameter, ...]:
    """The declared parameters that a fit moved, largest deviation first; empty where nothing was fitted."""
    if state.values is None:
        return ()
    found = []
    for free in state.problem.free(state.hypothesis):
        if not free.own or free.name not in state.values.get(free.owner, {}):
            continue
        one = _own_parameter(free, state.values[free.owner][free.name], _name(state, free))
        if free.owner == STATE_OF_CHARGE:
            index = int(free.name)
            one = replace(one, declared=_read_soc(state, index), value=state.fitted_soc(index, state.values))
        found.append(one)
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


def starts_told(state: ModelState) -> list[str]:
    """A sentence for each record whose first voltage reads as another state of charge in this model than in the
    declared cell, beyond the uncertainty of that reading."""
    read = [(record, _read_soc(state, i)) for i, record in enumerate(state.problem.records)]
    return [
        f"in the written model the first voltage of {record.name} is that of a state of charge of {soc:.3f}; the "
        f"declared cell reads it as {record.soc0:.3f}."
        for record, soc in read
        if abs(soc - record.soc0) > record.soc0_sd
    ]


def _read_soc(state: ModelState, index: int) -> float:
    """State of charge that the first voltage of a fitted record reads as in this model."""
    read = state.problem.records[index].soc0
    return read if state.values is None else state.fitted_soc(index, {STATE_OF_CHARGE: {str(index): read}})


def ages_told(states: Sequence[ModelState]) -> str:
    """A sentence on the fitted capacity of the cell in each record, from the first state that has them; '' where none
    has."""
    for state in states:
        shares = (state.values or {}).get(CAPACITY_SHARE)
        if shares:
            records = state.problem.records
            told = ", ".join(f"{shares[str(i)]:.3f} in {record.name}" for i, record in enumerate(records))
            return (
                f"the records are explained better if they may be of several ages: the fitted capacity is {told} of "
                "the file's; the written model has the file's capacity, and the errors are those with it."
            )
    return ""


def _name(state: ModelState, free: FreeParameter) -> str:
    return free.name if free.record is None else state.problem.records[free.record].name


def _own_parameter(free: FreeParameter, value: float, name: str) -> OwnParameter:
    x, (low, high) = free.coordinate(value), free.bounds
    near = LIMIT_SHARE * (high - low)
    at_limit = not low + near < x < high - near
    return OwnParameter(free.owner, name, free.centre, value, free.unit, x, _one_sd(free, x), at_limit)


def _one_sd(free: FreeParameter, x: float) -> float:
    """Size of one standard deviation from the declared value, on the side of `x`, in the parameter's unit."""
    return free.centre * abs(np.expm1(np.copysign(free.sd, x))) if free.log else free.sd
