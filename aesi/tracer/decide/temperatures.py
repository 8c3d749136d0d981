"""Which records contradict their own temperature, and whether another temperature explains more than a fit does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.start.temperature import OtherTemperature, other_temperature
from aesi.records import Measurement
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import PreparedRecord
from aesi.tracer.likelihood.model_state import ModelState

LEAVES_TIMES = 2.0
"""Ratio of the error of a fitted model to that of the declared model at another temperature, above which the change of
temperature explains more. A convention: with the zeros of a dead temperature column the ratio is 2.8 on a drive of the
NMC cell, with nine parameters moved."""


def other_temperatures(problem: InverseProblem) -> dict[int, OtherTemperature]:
    """Number of a record -> the temperature at which the declared model follows its fitted rows, for records that
    contradict their own temperature column."""
    pairs = zip(problem.records, problem.fit_parts, strict=True)
    found = {index: _other(problem, record, seen) for index, (record, seen) in enumerate(pairs)}
    return {index: other for index, other in found.items() if other is not None}


def contradicting_unseen(
    fitted: ModelState, records: Sequence[PreparedRecord]
) -> dict[str, OtherTemperature]:
    """Name of a record that was not fitted -> the temperature at which the declared model follows it, for records that
    contradict their own temperature and that the fitted model does not explain at it."""
    out = {}
    for record in records:
        other = _other(fitted.problem, record, record.thin)
        if other is not None and not _explains(fitted, record, None, other):
            out[record.name] = other
    return out


def _other(problem: InverseProblem, record: PreparedRecord, seen: Measurement) -> OtherTemperature | None:
    """The temperature that a record indicates in place of its own, if any.  seen : the thinned rows to compare."""
    if seen.temperature_degc is None:
        return None
    declared_degc = problem.cell.initial_temperature_k - ZERO_CELSIUS_K
    return other_temperature(
        seen.temperature_degc, declared_degc, partial(_declared_rmse_v, problem, record, seen)
    )


def _declared_rmse_v(
    problem: InverseProblem, record: PreparedRecord, seen: Measurement, degc: Array
) -> float | None:
    there = replace(seen, temperature_degc=degc)
    try:
        run = problem.run(there, record.soc0, problem.fixed, record.thin_hold)
    except AesiError:
        return None
    return rms(there.voltage_v - run.voltage_v)


def still_contradicting(
    fitted: ModelState, others: Mapping[int, OtherTemperature]
) -> dict[int, OtherTemperature]:
    """Those of `others` that a fitted model does not explain at their own temperature: its error is larger than that of
    the declared model at another temperature, or it cannot be simulated to the end. With a smaller error (the kinetics
    were off) the record is explained."""
    records = fitted.problem.records
    return {
        index: other for index, other in others.items() if not _explains(fitted, records[index], index, other)
    }


def _explains(fitted: ModelState, record: PreparedRecord, index: int | None, other: OtherTemperature) -> bool:
    try:
        return _fitted_rmse_v(fitted, record, index) <= other.there_v
    except AesiError:
        return False


def _fitted_rmse_v(fitted: ModelState, record: PreparedRecord, index: int | None) -> float:
    """RMS residual, V, on the fitted rows of a record, or on all thinned rows of one that was not fitted.
    index : number among the fitted records, or None."""
    seen = record.thin.take(slice(0, record.n_fit))
    run = fitted.simulated(replace(record, thin=seen), index, thin=True)
    return rms(np.asarray(seen.voltage_v - run.voltage_v))


def temperature_fault(written: ModelState, others: Mapping[int, OtherTemperature]) -> str | None:
    """Why a fitted model is not written, a clause: on a record that contradicts its temperature it errs far more than
    the declared model at another temperature, so that its fit only makes up for the temperature. None where there is no
    such record."""
    if written.values is None:
        return None
    for index, other in others.items():
        record = written.problem.records[index]
        try:
            left_v = _fitted_rmse_v(written, record, index)
        except AesiError:  # `range_fault` and the report tell of what cannot be simulated
            continue
        if left_v > LEAVES_TIMES * other.there_v:
            return (
                f"the error on {record.name} is {MV_PER_V * left_v:.1f} mV with the fit at {other.degc:.4g} degC and "
                f"{MV_PER_V * other.there_v:.1f} mV with the declared model at {other.there_degc:.4g} degC: the fit "
                "compensates for a temperature that the record contradicts"
            )
    return None
