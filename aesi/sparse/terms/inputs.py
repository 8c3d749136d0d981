"""Further inputs of the sparse model, derived from those that a record has.

The paper's inputs at sample k are I, c_sp, c_sn, c_e0 and c_eL. In addition there are, by name:

    soc       the state of charge of the record
    I_next    I[k + 1], the current at the predicted sample; a simulation knows it, and at 1 Hz it differs a lot
              from I[k]
    I_60s     the current through a first-order low-pass of 60 s (any number of seconds), x' = (I - x) / tau,
              steady at the first current of the record: a memory without feedback
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.records import ErrorSeries

_FILTERED = re.compile(r"^I_(\d+(?:\.\d+)?)s$")


def low_pass(x: Array, dt_s: float, tau_s: float) -> Array:
    """First-order low-pass of (n,) samples held over each interval, steady at the first of them."""
    from scipy.signal import lfilter

    keep = np.exp(-dt_s / tau_s)
    return lfilter([1.0 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0] if len(x) else x


def with_inputs(series: ErrorSeries, names: Sequence[str]) -> ErrorSeries:
    """The record with exactly the named inputs, in that order; those it lacks are derived. Its current stays known,
    also where that is none of them.

    Derive on the whole measurement before cutting it into records, so that filters know the past.
    Raises DataError for a name that is neither there nor derivable.
    """
    if tuple(names) == series.input_names:
        return series
    columns = [_column(series, name) for name in names]
    known_a = series.current_a if "I" in series.input_names else series.current_beside_a
    return replace(
        series,
        inputs=np.column_stack(columns),
        input_names=tuple(names),
        current_beside_a=None if "I" in names else known_a,
    )


SAME_STEP = 0.01
"""Largest relative difference of two time steps that count as one. A convention: logged times jitter."""


def same_step(one_s: float, other_s: float) -> bool:
    """Whether two time steps, s, count as one."""
    return abs(one_s / other_s - 1.0) <= SAME_STEP


def model_variables(series: ErrorSeries, names: Sequence[str], dt_s: float) -> Array:
    """(n, 1 + n_inputs): the error (V) and the named inputs along a record, for a model that steps by `dt_s` (s).

    Raises DataError for a record that is sampled at another step, else as `with_inputs`.
    """
    if not same_step(series.dt_s, dt_s):
        raise DataError(
            f"{series.name}: sampled every {series.dt_s:g} s, but the model steps {dt_s:g} s; "
            f"resample the record to {dt_s:g} s."
        )
    return np.column_stack([series.error_v, with_inputs(series, names).inputs])


def _column(series: ErrorSeries, name: str) -> Array:
    if name in series.input_names:
        return series.inputs[:, series.input_names.index(name)]
    if name == "soc":
        return series.soc
    if name == "I_next":
        return np.append(series.current_a[1:], series.current_a[-1:])
    if (match := _FILTERED.match(name)) and float(match.group(1)) > 0.0:
        return low_pass(series.current_a, series.dt_s, float(match.group(1)))
    raise DataError(
        f"{series.name}: no input {name!r}; it has {', '.join(series.input_names)}, and soc, I_next and "
        "filtered currents such as I_60s can be derived."
    )
