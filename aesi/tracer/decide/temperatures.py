"""Which records contradict their own temperature, and whether that explains more than what was fitted at it."""

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
"""A fitted model explains less than a change of temperature where it leaves more than this many times what the
declared model leaves at another temperature. A convention: with the zeros of a dead column it leaves 2.8 times that
on a drive of the NMC cell, with nine parameters moved."""


def other_temperatures(problem: InverseProblem) -> dict[int, OtherTemperature]:
    """Number of a record -> the temperature at which the declared model follows what fits see of it, for those
    records that contradict their own column of temperature."""
    pairs = zip(problem.records, problem.seen, strict=True)
    found = {index: _other(problem, record, seen) for index, (record, seen) in enumerate(pairs)}
    return {index: other for index, other in found.items() if other is not None}


def of_unseen(fitted: ModelState, records: Sequence[PreparedRecord]) -> dict[str, OtherTemperature]:
    """Name of a record that no fit has seen -> the same, for those records that a fitted model does not explain at
    their own temperature: they are judged at one that is not theirs."""
    out = {}
    for record in records:
        other = _other(fitted.problem, record, record.thin)
        if other is not None and not _explains(fitted, record, None, other):
            out[record.name] = other
    return out


def _other(problem: InverseProblem, record: PreparedRecord, seen: Measurement) -> OtherTemperature | None:
    """seen : the thinned rows that are looked at."""
    if seen.temperature_degc is None:
        return None
    declared_degc = problem.cell.initial_temperature_k - ZERO_CELSIUS_K
    return other_temperature(seen.temperature_degc, declared_degc, partial(_left_v, problem, record, seen))


def _left_v(problem: InverseProblem, record: PreparedRecord, seen: Measurement, degc: Array) -> float | None:
    there = replace(seen, temperature_degc=degc)
    try:
        run = problem.run(there, record.soc0, problem.fixed, record.thin_hold)
    except AesiError:
        return None
    return rms(there.voltage_v - run.voltage_v)


def left_by_fit(fitted: ModelState, others: Mapping[int, OtherTemperature]) -> dict[int, OtherTemperature]:
    """Those of the records that a fitted model does not explain at their own temperature: it leaves more of them
    than the declared model does at another one, or is not simulated to their end. What it leaves less of, as where
    the kinetics are off, is explained."""
    records = fitted.problem.records
    return {
        index: other for index, other in others.items() if not _explains(fitted, records[index], index, other)
    }


def _explains(fitted: ModelState, record: PreparedRecord, index: int | None, other: OtherTemperature) -> bool:
    try:
        return _left_by_v(fitted, record, index) <= other.there_v
    except AesiError:
        return False


def _left_by_v(fitted: ModelState, record: PreparedRecord, index: int | None) -> float:
    """RMS, V, of what fits see of a record, or of all of one that they do not.  index : among the fitted ones."""
    seen = record.thin.take(slice(0, record.n_fit))
    run = fitted.simulated(replace(record, thin=seen), index, thin=True)
    return rms(np.asarray(seen.voltage_v - run.voltage_v))


def fitted_at_fault(written: ModelState, others: Mapping[int, OtherTemperature]) -> str | None:
    """Why a fitted model is not written: of a record that contradicts its temperature it leaves far more than the
    declared model does at another one, so what it moved only makes up for the temperature. None where there is no
    such record."""
    if written.values is None:
        return None
    for index, other in others.items():
        record = written.problem.records[index]
        left_v = _left_by_v(written, record, index)
        if left_v > LEAVES_TIMES * other.there_v:
            return (
                f"what was fitted at {other.degc:.4g} degC leaves {MV_PER_V * left_v:.1f} mV of {record.name}, the "
                f"declared model at {other.there_degc:.4g} degC {MV_PER_V * other.there_v:.1f}: it makes up for a "
                "temperature that the record contradicts"
            )
    return None
