"""The declared parameters of the cell after a fit: how far each moved, and which ended on its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.tracer.case.free_parameter import CAPACITY_SHARE, FreeParameter
from aesi.tracer.likelihood.model_state import ModelState

LIMIT_SHARE = 0.01
"""Share of the range, at either end of it, within which a parameter counts as on its limit."""


@dataclass(frozen=True)
class OwnParameter:
    """A declared parameter after a fit.

    owner : id of the effect that restates it, or one of RECORD_OWNERS; `name` is then that of the record.
    declared, value : in `unit`; a factor is declared as 1.  deviations : value - declared, in prior standard deviations
    of that fit.  one_sd : size of one standard deviation on the side to which it moved, in `unit`.
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
    problem = state.problem
    found = [
        _own_parameter(free, state.values[free.owner][free.name], _name(state, free))
        for free in problem.free(state.hypothesis)
        if free.own and free.name in state.values.get(free.owner, {})
    ]
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


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
