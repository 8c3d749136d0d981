"""Score of one candidate of the search: its losses, and its one-step-ahead intervals on validation data."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from aesi.conformal import METHODS, Method
from aesi.conformal.scores import Scores
from aesi.conformal.validation import Driven, validation_scores
from aesi.errors import AesiError
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.records import ErrorSeries, Failed
from aesi.sparse import Candidate, FitnessWeights, Genome, Problem, SparseModel, evaluate
from aesi.sparse.search.genome_space import GenomeSpace

CALIBRATION_RESIDUALS = 26_000
"""Most residuals that the intervals of a candidate are calibrated on. They are taken in pieces, of which each loses its
first window; 20,000 rows are left. From this number on SPCI needs one fit instead of six: 0.5 s instead of 1.8 s per
candidate at 88,200 rows."""


@dataclass(frozen=True, eq=False)
class ScoredCandidate:
    """A candidate with the scores of its one-step-ahead intervals on validation data.

    candidate : without its out-of-fold residuals, which at 88,200 rows would be nearly all of what is stored of it.
    coverage_pct, width_v : coverage (per cent) and mean width (V) of the intervals of AESI I; None if they cannot be
    calibrated.  note : why not.  seconds : wall time of the evaluation, s.
    stable_coverage_pct, stable_width_v : the same of AESI II.
    """

    candidate: Candidate
    coverage_pct: float | None = None
    width_v: float | None = None
    note: str = ""
    seconds: float = 0.0
    stable_coverage_pct: float | None = None
    stable_width_v: float | None = None


def score(problem: Problem, config: ExperimentConfig, genome: Genome) -> ScoredCandidate | Failed:
    """Evaluate a genome, calibrate its intervals on out-of-fold residuals, and score them on validation data; Failed if
    the genome gives no model."""
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
    """Scores of the one-step-ahead intervals of one ensemble on validation data."""
    calibration, judged = _roles(problem, outcome, model)
    conformal = config.conformal
    return validation_scores(
        method(config),
        calibration,
        judged,
        conformal.alpha,
        conformal.window,
        np.random.default_rng(config.seed),
        CALIBRATION_RESIDUALS,
    )


def _roles(problem: Problem, candidate: Candidate, model: SparseModel) -> tuple[list[Driven], list[Driven]]:
    """(residuals for the calibration, residuals for the score) of an ensemble.

    The calibration uses the out-of-fold residuals of the training records. The score is on the validation records;
    without any it is on the middle training record, which then takes no part in the calibration. A single training
    record is cut in two.
    """
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


def _residual(model: SparseModel, record: ErrorSeries) -> Driven:
    return (record.error_v - model.one_step(record))[1:], record.current_a[1:]


def scorer(problem: Problem, config: ExperimentConfig) -> partial[ScoredCandidate | Failed]:
    """`score` with the problem and the experiment bound. A worker process calls it with a genome."""
    return partial(score, problem, config)


def weights(config: ExperimentConfig) -> FitnessWeights:
    """Weights (gamma in the paper) of the losses in the scalar fitness."""
    return FitnessWeights(*config.search.weights)


def top_share(config: ExperimentConfig) -> float:
    """Share of the candidates, the fittest ones, that are averaged; 0 takes the fittest alone.

    It is the share of the resamples that make an ensemble. Where corrections are shrunk to what left-out drives support
    (fade.py) one candidate is taken, since the shrinking already removes what fits by chance. Over the development
    splits of the NMC drive in `aesi bench splits` (16 candidates), the mean of the two fittest reduces the recalibrated
    model's squared error by 2.1 percentage points less than the fittest alone, and their mean shrunk as one by 1.3
    less.
    """
    return 0.0 if config.library.fade else config.search.top_share


def genome_space(problem: Problem, config: ExperimentConfig) -> GenomeSpace:
    """The genes of the search and their ranges, from the experiment file."""
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
    """The method for intervals one step ahead, from the experiment file."""
    return METHODS[config.conformal.method]
