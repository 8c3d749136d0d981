"""One candidate of the search as it is tracked: the sparse candidate and its intervals on validation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from aesi.conformal import METHODS, Method
from aesi.errors import AesiError, ConfigError
from aesi.numerics.typing import Array
from aesi.pipeline.config import ExperimentConfig
from aesi.records import ErrorSeries, Failed
from aesi.sparse import Candidate, FitnessWeights, Genome, Problem, evaluate


@dataclass(frozen=True, eq=False)
class Scored:
    """A candidate with the one-step intervals of its AESI I.

    coverage_pct, width_v : share of validation samples covered, and mean width in V; None where the residuals
    cannot be calibrated (`note` says why).
    """

    candidate: Candidate
    coverage_pct: float | None = None
    width_v: float | None = None
    note: str = ""


def score(problem: Problem, config: ExperimentConfig, genome: Genome) -> Scored | Failed:
    """Evaluate a genome, calibrate its intervals on honest residuals, and judge them on validation data."""
    outcome = evaluate(problem, genome, weights(config))
    if isinstance(outcome, Failed):
        return outcome
    calibration, judged = _roles(problem, outcome)
    conformal = config.conformal
    try:
        calibrated = method(config).fit(
            calibration, conformal.alpha, conformal.window, np.random.default_rng(config.seed)
        )
    except AesiError as error:
        return Scored(outcome, note=str(error))
    covered, widths = [], []
    for residual in judged:
        known = np.isfinite(residual)
        intervals = calibrated.intervals(residual)
        covered.append(intervals.covers(residual)[known])
        widths.append(intervals.width_v[known])
    return Scored(
        outcome,
        coverage_pct=100.0 * float(np.concatenate(covered).mean()),
        width_v=float(np.concatenate(widths).mean()),
    )


def _roles(problem: Problem, candidate: Candidate) -> tuple[list[Array], list[Array]]:
    """Residuals to calibrate on and to judge on: the validation records, or where there are none the middle
    training record, by models and a calibration that have not seen it."""
    honest = [each.one_step_v for each in candidate.residuals]
    if problem.split.valid:
        return honest, [_residual(candidate, record) for record in problem.split.valid]
    if len(honest) == 1:
        honest = np.array_split(honest[0], 2)
    middle = len(honest) // 2
    return honest[:middle] + honest[middle + 1 :], [honest[middle]]


def _residual(candidate: Candidate, record: ErrorSeries) -> Array:
    return (record.error_v - candidate.bagging.one_step(record))[1:]


def scorer(problem: Problem, config: ExperimentConfig) -> partial[Scored | Failed]:
    """`score` with the problem and the experiment given: what a worker process calls with a genome."""
    return partial(score, problem, config)


def weights(config: ExperimentConfig) -> FitnessWeights:
    """gamma of the scalar fitness."""
    return FitnessWeights(*config.search.weights)


def method(config: ExperimentConfig) -> Method:
    """The conformal method the experiment names. Raises ConfigError for an unknown name."""
    found = METHODS.get(config.conformal.method)
    if found is None:
        raise ConfigError(
            f"conformal.method = {config.conformal.method!r} is unknown; there are: {', '.join(METHODS)}."
        )
    return found
