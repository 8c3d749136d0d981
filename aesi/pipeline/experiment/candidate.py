"""One candidate of the search as it is tracked: the sparse candidate and its intervals on validation."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from aesi.conformal import METHODS, Method
from aesi.conformal.scores import Scores
from aesi.conformal.validation import validation_scores
from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.records import ErrorSeries, Failed
from aesi.sparse import Candidate, FitnessWeights, Genome, Problem, SparseModel, evaluate
from aesi.sparse.search.genome_space import GenomeSpace

CALIBRATION_RESIDUALS = 26_000
"""Residuals that a candidate's intervals are calibrated on. Thinned to pieces that each lose their first window,
these leave the 20,000 rows from which SPCI needs one fit instead of six: 0.5 instead of 1.8 s a candidate at 88,200
rows."""


@dataclass(frozen=True, eq=False)
class ScoredCandidate:
    """A candidate with the one-step intervals of its AESI I, and of its AESI II (`stable`).

    coverage_pct, width_v : share of validation samples covered, and mean width in V; None where the residuals
    cannot be calibrated (`note` says why).  seconds : what it took, by the clock.
    The out-of-fold residuals are not kept: at 88,200 rows they would be nearly all of what is stored of a candidate.
    """

    candidate: Candidate
    coverage_pct: float | None = None
    width_v: float | None = None
    note: str = ""
    seconds: float = 0.0
    stable_coverage_pct: float | None = None
    stable_width_v: float | None = None


def score(problem: Problem, config: ExperimentConfig, genome: Genome) -> ScoredCandidate | Failed:
    """Evaluate a genome, calibrate its intervals on out-of-fold residuals, and judge them on validation data."""
    started = time.perf_counter()
    outcome = evaluate(problem, genome, weights(config))
    if isinstance(outcome, Failed):
        return outcome
    return replace(_with_intervals(outcome, problem, config), seconds=time.perf_counter() - started)


def _with_intervals(outcome: Candidate, problem: Problem, config: ExperimentConfig) -> ScoredCandidate:
    slim = replace(outcome, residuals=())
    try:
        one, stable = (_scores(problem, config, outcome, model) for model in outcome.ensembles)
    except AesiError as error:
        return ScoredCandidate(slim, note=str(error))
    return ScoredCandidate(
        slim,
        coverage_pct=100.0 * one.coverage,
        width_v=one.mean_width_v,
        stable_coverage_pct=100.0 * stable.coverage,
        stable_width_v=stable.mean_width_v,
    )


def _scores(problem: Problem, config: ExperimentConfig, outcome: Candidate, model: SparseModel) -> Scores:
    """Scores of the intervals of one ensemble on validation."""
    calibration, judged = _roles(problem, outcome, model)
    conformal = config.conformal
    return validation_scores(
        method(config),
        [residual for residual, _ in calibration],
        [residual for residual, _ in judged],
        conformal.alpha,
        conformal.window,
        np.random.default_rng(config.seed),
        current_a=[current for _, current in calibration],
        valid_current_a=[current for _, current in judged],
        max_residuals=CALIBRATION_RESIDUALS,
    )


_Driven = tuple[Array, Array]
"""One-step residuals of a record, V, and the current they arose under, A."""


def _roles(problem: Problem, candidate: Candidate, model: SparseModel) -> tuple[list[_Driven], list[_Driven]]:
    """Residuals to calibrate on and to judge on: the validation records, or where there are none the middle
    training record, by models and a calibration that have not seen it."""
    out_of_fold = [
        (each.stable_v if model is candidate.stability else each.one_step_v, record.current_a[1:])
        for each, record in zip(candidate.residuals, problem.split.train, strict=True)
    ]
    if problem.split.valid:
        return out_of_fold, [_residual(model, record) for record in problem.split.valid]
    if len(out_of_fold) == 1:
        residual, current = out_of_fold[0]
        cut = len(residual) // 2
        out_of_fold = [(residual[:cut], current[:cut]), (residual[cut:], current[cut:])]
    middle = len(out_of_fold) // 2
    return out_of_fold[:middle] + out_of_fold[middle + 1 :], [out_of_fold[middle]]


def _residual(model: SparseModel, record: ErrorSeries) -> _Driven:
    return (record.error_v - model.one_step(record))[1:], record.current_a[1:]


def scorer(problem: Problem, config: ExperimentConfig) -> partial[ScoredCandidate | Failed]:
    """`score` with the problem and the experiment bound, which a worker process calls with a genome."""
    return partial(score, problem, config)


def weights(config: ExperimentConfig) -> FitnessWeights:
    """Weights (gamma) of the scalar fitness."""
    return FitnessWeights(*config.search.weights)


def top_share(config: ExperimentConfig) -> float:
    """Share of the candidates that are averaged: the same as that of the resamples which make an ensemble.

    It is one candidate alone where corrections are shrunk by what left-out drives bear out (fade.py), since that takes
    off what was chance. Over the development splits of the NMC drive in `aesi bench splits` (16 candidates) the mean of
    the two fittest takes 2.1 points less off the recalibrated model's squared error than the fittest alone, and their
    mean shrunk as one 1.3 less.
    """
    return 0.0 if config.library.fade else config.search.top_share


def genome_space(problem: Problem, config: ExperimentConfig) -> GenomeSpace:
    """The ranges of the genes that the experiment names."""
    search, library = config.search, config.library
    return GenomeSpace(
        len(problem.library),
        search.lambda1,
        search.lambda2,
        search.tau,
        library.p_c,
        library.d,
        library.feedback,
    )


def method(config: ExperimentConfig) -> Method:
    """The conformal method that the experiment names."""
    return METHODS[config.conformal.method]
