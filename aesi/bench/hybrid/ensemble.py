"""`aesi bench ensemble`: how fast is a search over ensembles of bootstrap resamples, compared with PySINDy's STLSQ?

The record is synthetic and of the paper's size: the current has pulses like those of a drive, the states follow it
through low-pass filters and through its integral, and the error depends on these states, with coloured noise added. The
library holds the terms of lowest degree. The time of this package (`ours_s`) is that of a whole search, work that is
done once included: building the library, factorisation, Gram matrices of all resamples, and for each candidate the
fits, the out-of-bag errors in free run, and both ensembles. PySINDy is timed on a few of the same resamples, and the
time is scaled to all; it is that of STLSQ alone, without the library and the out-of-bag errors. Both run in one thread.
All times are processor times, which other work on the machine changes little.

`failed` counts the candidates that a search would discard. With a tiny ridge most candidates diverge on the left-out
pieces; this shows only when all fits are done and both ensembles are made, so that these candidates cost as much as the
others. A candidate whose threshold exceeds every coefficient is recognised at once and costs almost nothing.

For a small library the ratio of times depends on how many candidates share the work that is done once, and on how many
are discarded at once. At 60 terms this work took 1.27 s of processor time, a fitted candidate 0.35 to 0.48 s, and one
without any term left 0.01 s. The ratio was 21.5 to 23.7 in four runs with three candidates, and 93 and 211 in earlier
runs with twenty.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from time import process_time
from typing import Any

import numpy as np
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import AtLeastOne
from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import InputError
from aesi.numerics.typing import Array
from aesi.records import INPUT_NAMES, ErrorSeries, Failed, Split
from aesi.sparse import Genome, Library, Options, Problem, STRidge, evaluate
from aesi.sparse.terms.inputs import low_pass, with_inputs

CASES = ((60, 1e-3), (200, 1e-12), (626, 1e-3), (626, 1e-12))
"""(number of terms in the library, ridge lambda1) of each case."""
SYNTHETIC_INPUTS = (*INPUT_NAMES, "soc")
"""Inputs of the terms."""

_DT_S = 0.1
"""Time step, s, that of the paper's records."""
_CAPACITY_AS = 30.0 * SECONDS_PER_HOUR
"""Capacity of the cell, A s (30 Ah)."""


def run(
    cases: AtLeastOne[tuple[int, float]] = CASES,
    n: PositiveInt = 88_200,
    candidates: PositiveInt = 20,
    resamples: PositiveInt = 100,
    peer_models: PositiveInt = 2,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One row per case: processor times for all candidates, their ratio, errors of the coefficients, peak memory.

    cases : (terms, lambda1).  n : rows that are fitted.  candidates : number of candidates, which differ in their
    threshold.  resamples : bootstrap resamples of each.  peer_models : fits of PySINDy that are timed.  seed : of the
    record.  Coefficient errors are relative to the largest coefficient of a QR solution.
    Raises InputError for more peer_models than resamples, and for a library of no terms or of more than there are.
    """
    if peer_models > resamples:
        raise InputError(
            f"peer_models = {peer_models} with resamples = {resamples}: each fit of PySINDy takes a resample of its "
            "own; give as many resamples, or fewer fits."
        )
    from threadpoolctl import threadpool_limits

    for terms, _ in cases:
        lowest_terms(terms)  # refused before anything is timed
    record = synthetic_record(n + 1, seed)
    with threadpool_limits(1):
        # A small case first, so that loading compiled code and warming up the solvers is not timed.
        _ours(synthetic_record(2001, seed), 40, 1e-3, 1, 4)
        for terms, lambda1 in cases:
            yield _case(record, terms, lambda1, candidates, resamples, peer_models)


def synthetic_record(n: int, seed: int) -> ErrorSeries:
    """A synthetic record of n samples at 10 Hz: smooth states like those of an ESPM, and an error that depends on them
    in part."""
    rng = np.random.default_rng(seed)
    time_s: Array = _DT_S * np.arange(n, dtype=float)
    raw = np.repeat(rng.normal(0.0, 45.0, n // 40 + 1), 40)[:n]
    current = np.clip(low_pass(raw, _DT_S, 1.5), -90.0, 150.0)
    current -= current.mean() - 0.6 * _CAPACITY_AS / time_s[-1]
    soc = 0.95 - np.cumsum(current) * _DT_S / _CAPACITY_AS
    slow = {tau: low_pass(current, _DT_S, tau) for tau in (20.0, 40.0, 70.0, 250.0)}
    inputs = np.column_stack(
        [
            current,
            5e4 * (1.0 - 0.6 * soc) + 25.0 * slow[70.0],
            3e4 * soc - 20.0 * slow[250.0],
            1000.0 + 3.0 * slow[20.0] + 0.5 * slow[40.0],
            1000.0 - 2.8 * slow[40.0],
        ]
    )
    noise = low_pass(rng.normal(0.0, 1.0, n), _DT_S, 30.0) * 0.1
    drive = 1e-4 * current + 8e-3 * np.tanh(slow[40.0] / 40.0) * soc + 1e-2 * (soc - 0.6) ** 2
    return ErrorSeries(
        "synthetic", _DT_S, time_s, low_pass(drive, _DT_S, 5.0) + noise, inputs, soc, 3.7 + 0.4 * soc
    )


def lowest_terms(terms: int) -> Library:
    """The library of that many terms of lowest degree over SYNTHETIC_INPUTS.  Raises InputError if there are fewer."""
    every = Library.build(SYNTHETIC_INPUTS)
    if not 1 <= terms <= len(every):
        raise InputError(f"a library of {terms} terms: there are 1 to {len(every)} over these inputs.")
    return every.take(np.argsort(every.degrees, kind="stable")[:terms])


def _case(
    record: ErrorSeries, terms: int, lambda1: float, candidates: int, resamples: int, peer_models: int
) -> dict[str, Any]:
    with _PeakMemory() as memory:
        started = process_time()
        problem, genomes, failed = _ours(record, terms, lambda1, candidates, resamples)
        ours_s = process_time() - started
    peer_s, peer_error, error = _peer(problem, genomes, peer_models)
    peer_total_s = peer_s * candidates * resamples
    return {
        "terms": terms,
        "lambda1": lambda1,
        "rows": len(problem.target),
        "candidates": candidates,
        "failed": failed,
        "resamples": resamples,
        "ours_s": round(ours_s, 4),
        "ours_s_per_candidate": round(ours_s / candidates, 3),
        "peer": "PySINDy STLSQ",
        "peer_s": round(peer_total_s, 3),
        "peer_models_timed": peer_models,
        "peer_s_per_model": round(peer_s, 3),
        "ratio": round(peer_total_s / ours_s, 2),
        "coefficient_error": error,
        "coefficient_error_reference": "QR of the weighted rows, relative to the largest coefficient",
        "peer_coefficient_error": peer_error,
        "peak_mb": round(memory.peak_mb),
    }


def _ours(
    record: ErrorSeries, terms: int, lambda1: float, candidates: int, resamples: int
) -> tuple[Problem, list[Genome], int]:
    library = lowest_terms(terms)
    split = Split((with_inputs(record, SYNTHETIC_INPUTS),), (), ())
    problem = Problem.build(split, Options(resamples=resamples), library)
    thresholds = np.geomspace(1e-2, 1.0, candidates)
    genomes = [Genome.whole(library, lambda1, float(t), 0.41) for t in thresholds]
    outcomes = [evaluate(problem, genome) for genome in genomes]
    return problem, genomes, sum(isinstance(outcome, Failed) for outcome in outcomes)


def _peer(problem: Problem, genomes: Sequence[Genome], models: int) -> tuple[float, float, float]:
    """(processor time of one fit of PySINDy, s; largest error of its coefficients; largest error of ours). The errors
    are relative to the largest coefficient, and the reference is a QR solution of the weighted rows."""
    from pysindy import STLSQ

    theta = problem.theta(np.arange(len(problem.library))).T
    spent, peer_error, error = 0.0, 0.0, 0.0
    for k in range(models):
        genome = genomes[k * (len(genomes) - 1) // max(1, models - 1)]
        weights = problem.weights(k)
        rows = np.repeat(np.arange(len(weights)), weights.astype(int))
        x, y = theta[rows], problem.target[rows]
        peer = STLSQ(threshold=genome.lambda2, alpha=genome.lambda1, unbias=False)
        started = process_time()
        with _quiet():
            peer.fit(x, y[:, None])
        spent += process_time() - started
        solver = STRidge(genome.lambda1, genome.lambda2)
        reference = solver.fit(theta, problem.target, weights)
        scale = max(float(np.abs(reference).max()), np.finfo(float).tiny)
        error = max(error, float(np.abs(solver.fit_factor(problem.factors[k]) - reference).max()) / scale)
        peer_error = max(peer_error, float(np.abs(peer.coef_[0] - reference).max()) / scale)
    return spent / models, peer_error, error


def _quiet() -> Any:
    import warnings

    # STLSQ warns of an empty model and of an ill-conditioned system; both are expected here.
    return warnings.catch_warnings(action="ignore")


class _PeakMemory:
    """Peak resident memory of this process while a `with` block runs, MiB, sampled every 20 ms."""

    peak_mb = 0.0

    def __enter__(self) -> _PeakMemory:
        import psutil

        self._process = psutil.Process()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        self._thread.join()

    def _watch(self) -> None:
        while True:
            self.peak_mb = max(self.peak_mb, self._process.memory_info().rss / 2**20)
            if self._done.wait(0.02):
                return
