"""The yardstick: how much of a residual a sparse correction could still explain, and the causes that its terms suggest.

A correction of the voltage error learnt from the model's states (`aesi.sparse`: Chebyshev and hyperbolic terms, an
ensemble over resampled blocks, thresholded ridge) contains no physics. The error that it explains on left-out pieces,
in free run, is structure that a physical effect could explain as well. The terms that it needs suggest where to look.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray
from aesi.records import INPUT_NAMES, ErrorSeries, Failed, Run, Split
from aesi.sparse import Candidate, Genome, Library, Options, Problem, evaluate, with_inputs
from aesi.sparse.terms.library import ERROR

POINTS_TO: Mapping[str, tuple[str, ...]] = {
    "current: an ohmic or a kinetic drop": ("I",),
    "electrolyte concentration: transport in the electrolyte": ("c_e0", "c_eL"),
    "surface concentrations: diffusion in the particles, or their open-circuit potentials": ("c_sp", "c_sn"),
    "current of the last minutes: hysteresis, heat or slow diffusion": ("I_300s",),
    "the error's own past: hysteresis, or a slow state that the model lacks": (ERROR,),
}
"""Possible cause -> the variables whose terms suggest it."""
INPUTS = (*INPUT_NAMES, "I_300s")
ORDER, DEGREE = 3, 2
RESAMPLES = 20
"""Resamples of the ensemble, in blocks of BLOCK_S (s), with PIECES left-out pieces. Few suffice: only the order of
magnitude of the structure is asked for, no model is kept."""
BLOCK_S = 100.0
PIECES = 10
RIDGES = (1.0, 100.0)
"""Weights tried, in the units of the scaled library."""
THRESHOLD = 1e-3
"""Coefficients below this are dropped."""
SHOWN = 4
"""Most terms that are named for each of POINTS_TO."""


@dataclass(frozen=True)
class Pointer:
    """One of POINTS_TO.  share : of the residual's mean square that its terms explain on left-out pieces, 0 to 1; for
    the error's own past what it explains beyond all other terms.  terms : names of the chosen terms."""

    share: float
    terms: tuple[str, ...] = ()


@dataclass(frozen=True)
class Yardstick:
    """explained_v : RMS of the residual that the correction explains on left-out pieces, V; None where the data are too
    few for a correction, or vary too little.  pointers : possible cause -> `Pointer`."""

    explained_v: float | None = None
    pointers: Mapping[str, Pointer] = field(default_factory=dict)


def yardstick_of(runs: Sequence[Run], residuals: Sequence[Array]) -> Yardstick:
    """The yardstick over some records, from those with enough rows at their sampling rate.

    runs, residuals : one per record; residuals (n,) V, measured - model. Records of different sampling rates have a
    correction each.
    """
    groups: dict[int, list[ErrorSeries]] = {}
    for run, residual in zip(runs, residuals, strict=True):
        series = _evenly_sampled(run, residual)
        groups.setdefault(round(np.log2(series.dt_s)), []).append(series)
    parts = [
        (part.explained_v, sum(map(len, group)), part)
        for group in groups.values()
        if (part := _of_one_rate([_resampled(s, group[0].dt_s) for s in group])).explained_v is not None
    ]
    if not parts:
        return Yardstick()
    explained, rows, told = zip(*parts, strict=True)
    square = float(np.average(np.square(explained), weights=rows))
    return Yardstick(float(np.sqrt(square)), told[int(np.argmax(explained))].pointers)


def _evenly_sampled(run: Run, residual: Array) -> ErrorSeries:
    """The record resampled evenly at its median spacing. A row holds the inputs of the next row, which it predicts."""
    inputs = np.column_stack([run.current_a if name == "I" else run.series[name] for name in INPUT_NAMES])
    series = ErrorSeries(
        name="record",
        dt_s=float(np.median(np.diff(run.time_s))),
        time_s=run.time_s,
        error_v=residual,
        inputs=inputs,
        soc=run.series["soc"],
        model_v=run.voltage_v,
    )
    return _with_next_inputs(with_inputs(_resampled(series, series.dt_s), INPUTS))


def _with_next_inputs(series: ErrorSeries) -> ErrorSeries:
    """The series with the inputs of the next row in each row; the last row keeps its own."""
    return replace(series, inputs=np.vstack([series.inputs[1:], series.inputs[-1:]]))


def _resampled(series: ErrorSeries, dt_s: float) -> ErrorSeries:
    """The series at even steps of `dt_s`, s, by linear interpolation; as it is if it has them already."""
    if series.dt_s == dt_s and np.ptp(np.diff(series.time_s)) < 0.01 * dt_s:
        return series
    time = np.arange(series.time_s[0], series.time_s[-1], dt_s)

    def at(column: Array) -> Array:
        return np.interp(time, series.time_s, column)

    inputs = np.column_stack([at(column) for column in series.inputs.T])
    error, soc, model = at(series.error_v), at(series.soc), at(series.model_v)
    return replace(series, dt_s=dt_s, time_s=time, error_v=error, inputs=inputs, soc=soc, model_v=model)


def _of_one_rate(records: Sequence[ErrorSeries]) -> Yardstick:
    """The yardstick of records of one sampling rate."""
    options = _options(records)
    try:
        problem = Problem.build(Split(tuple(records), (), ()), options)
    except DataError:  # too few samples, or nothing that varies
        return Yardstick()
    every = np.ones(len(problem.library), dtype=bool)
    without_past = max((_candidate(problem, every, ridge, feedback=False) for ridge in RIDGES), key=_share)
    with_past = _candidate(problem, every, RIDGES[-1], feedback=True)
    best = max(without_past, with_past, key=_share)
    if best is None:
        return Yardstick()
    square = float(np.mean(np.concatenate([r.error_v for r in records]) ** 2))
    shares = {
        text: _share(with_past) - _share(without_past)
        if ERROR in names
        else _share(_candidate(problem, _terms_in(problem.library, names), RIDGES[0], feedback=False))
        for text, names in POINTS_TO.items()
    }
    pointers = {
        text: Pointer(max(share, 0.0), _largest_terms(best, POINTS_TO[text]) if share > 0 else ())
        for text, share in shares.items()
    }
    return Yardstick(float(np.sqrt(_share(best) * square)), pointers)


def _options(records: Sequence[ErrorSeries]) -> Options:
    rows = sum(map(len, records))
    block = max(int(BLOCK_S / records[0].dt_s), 10)
    return Options(
        inputs=INPUTS,
        p_c=ORDER,
        d=DEGREE,
        mixed=False,
        resamples=RESAMPLES,
        block=block,
        fold=max(rows // PIECES, block),
        balance=False,
    )


def _candidate(problem: Problem, terms: BoolArray, ridge: float, feedback: bool) -> Candidate | None:
    """The correction with these terms, (m,), or None if it cannot be fitted.  feedback : whether it may use the error's
    own past."""
    genome = Genome.of(terms, ridge, THRESHOLD, 0.5, ORDER, DEGREE, feedback)
    outcome = evaluate(problem, genome)
    return None if isinstance(outcome, Failed) else outcome


def _share(candidate: Candidate | None) -> float:
    """Share of the mean square error that the candidate explains on left-out pieces in free run, 0 to 1."""
    return 0.0 if candidate is None else max(0.0, 1.0 - candidate.loss_valid)


def _terms_in(library: Library, names: Sequence[str]) -> BoolArray:
    """(m,) True for the constant and for the terms in no other variables than these."""
    wanted = {library.variables.index(name) for name in names if name in library.variables}
    return np.array([{variable for variable, _ in term.factors} <= wanted for term in library.terms])


def _largest_terms(candidate: Candidate | None, names: Sequence[str]) -> tuple[str, ...]:
    """Names of the `SHOWN` terms with the largest coefficients that hold one of the variables, largest first."""
    if candidate is None:
        return ()
    model = candidate.stability
    variables = model.library.variables
    ranked = sorted(
        zip(-np.abs(model.coefficients), model.library.terms, strict=True), key=lambda pair: pair[0]
    )
    held = [t for _, t in ranked if any(variables[v] in names for v, _ in t.factors)]
    return tuple(t.name(variables) for t in held[:SHOWN])
