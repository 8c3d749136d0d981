"""One candidate of the search: fit on all resamples, judge, combine. Pure in problem and genome."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.metrics import pearson
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.records import ErrorSeries, Failed
from aesi.sparse import free_run
from aesi.sparse.ensemble import Ensemble, best_members, combine
from aesi.sparse.genome import Genome
from aesi.sparse.model import SparseModel
from aesi.sparse.problem import Problem, Regime
from aesi.sparse.stridge import STRidge

_ROWS_AT_ONCE = 4096


@dataclass(frozen=True)
class FitnessWeights:
    """gamma of the paper's loss; each loss is made comparable first (see `Candidate`)."""

    oob: float = 0.45
    valid: float = 0.45
    sparse: float = 0.10


@dataclass(frozen=True, eq=False)
class HonestResiduals:
    """Errors that a model left which had not seen them, for calibration.

    one_step_v, free_run_v : (n - 1,) V, measured minus predicted error of samples 1 to n - 1 of the record,
    by a model fitted on all rows but the piece around them.  starts : the samples from which each free run
    started (its prediction of sample starts[i] + 1 is the first); infinite where it diverged.
    """

    record: str
    one_step_v: Array
    free_run_v: Array
    starts: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Candidate:
    """What became of a genome.

    loss_oob, loss_valid : mean squared error over that of the bare physics model on the same samples, in the
    problem's regime (1 is no better than none). loss_valid is the mean over both ensembles, on the
    validation records; where there are none, on the left-out pieces, by fits of all and of the stable terms.
    loss_sparse : number of active terms of AESI I.
    fitness : 1 - (g1 loss_oob + g2 loss_valid + g3 loss_sparse / library size).
    pearson_train, pearson_valid : correlation of error and prediction of AESI I, in free run.
    free_run_valid_mser_pct, one_step_valid_rmse_v : of AESI I on the validation records (of the fold models
    on the folds where there are none).
    """

    genome: Genome
    loss_oob: float
    loss_valid: float
    loss_sparse: int
    fitness: float
    pearson_train: float
    pearson_valid: float
    free_run_valid_mser_pct: float
    one_step_valid_rmse_v: float
    bagging: SparseModel
    stability: SparseModel
    residuals: tuple[HonestResiduals, ...]
    oob_by_resample: Array

    @property
    def losses(self) -> tuple[float, float, float]:
        """The three objectives, all to be minimised."""
        return self.loss_oob, self.loss_valid, float(self.loss_sparse)


@dataclass(frozen=True)
class _Judged:
    loss: float
    pearson: float
    mser_pct: float
    one_step_rmse_v: float


def evaluate(problem: Problem, genome: Genome, weights: FitnessWeights | None = None) -> Candidate | Failed:
    """Fit, judge and combine one candidate.

    Returns Failed, with the reason, where no term is admitted, thresholding leaves none, every resample
    diverges in free run, no term is stable, or the combined models diverge on the validation data.
    """
    active = np.flatnonzero(genome.active(problem.library))
    if not len(active):
        return Failed(
            f"no term is left within p_c = {genome.p_c}, d = {genome.d}, feedback = {genome.feedback}"
        )
    solver = STRidge(genome.lambda1, genome.lambda2)
    columns = np.append(active, len(problem.library))
    fits = np.stack([solver.fit_factor(factor[:, columns]) for factor in problem.factors])
    alive = fits.any(axis=1)
    if not alive.any():
        return Failed(f"every coefficient is below lambda2 = {genome.lambda2:g} in every resample")
    losses = np.full(len(fits), np.inf)
    losses[alive] = _out_of_bag(problem, active, fits[alive], problem.out_of_bag[alive])
    best = best_members(losses, problem.options.best)
    if not len(best):
        return Failed("every resample diverges in free run")
    ensemble = combine(fits[best], problem.full_factor[:, columns], genome.tau, solver)
    if not ensemble.stability.any():
        return Failed(
            f"no term reaches an inclusion probability of tau = {genome.tau:g}, or survives the refit"
        )
    bagging = _model(problem, active, ensemble.bagging, ensemble, "AESI I")
    stability = _model(problem, active, ensemble.stability, ensemble, "AESI II")
    fold_fits = np.stack([solver.fit_factor(factor[:, columns]) for factor in problem.fold_factors])
    left, by_folds = _folds(problem, active, fold_fits)
    if problem.split.valid:
        judged = [_on_records(model, problem.split.valid, problem) for model in (bagging, stability)]
    else:
        stable = np.append(ensemble.stability != 0, True)
        refits = np.zeros_like(fold_fits)
        refits[:, stable[:-1]] = [
            solver.fit_factor(factor[:, columns[stable]]) for factor in problem.fold_factors
        ]
        judged = [by_folds, _folds(problem, active, refits)[1]]
    valid = replace(judged[0], loss=0.5 * (judged[0].loss + judged[1].loss))
    if not np.isfinite(valid.loss):
        return Failed("the model diverges in free run on the validation data")
    weights = weights or FitnessWeights()
    loss_oob = float(losses[best].mean())
    count = int(np.count_nonzero(ensemble.bagging))
    return Candidate(
        genome=genome,
        loss_oob=loss_oob,
        loss_valid=valid.loss,
        loss_sparse=count,
        fitness=fitness((loss_oob, valid.loss, count), len(problem.library), weights),
        pearson_train=_train_pearson(problem, active, ensemble.bagging),
        pearson_valid=valid.pearson,
        free_run_valid_mser_pct=valid.mser_pct,
        one_step_valid_rmse_v=valid.one_step_rmse_v,
        bagging=bagging,
        stability=stability,
        residuals=_honest(problem, left),
        oob_by_resample=losses,
    )


def fitness(losses: tuple[float, float, float], library_size: int, weights: FitnessWeights) -> float:
    """The paper's scalar fitness, equation (24), from the three losses of a candidate."""
    oob, valid, sparse = losses
    return 1.0 - (weights.oob * oob + weights.valid * valid + weights.sparse * sparse / library_size)


def _out_of_bag(problem: Problem, active: IntArray, fits: Array, unseen: BoolArray) -> Array:
    """(models,) mean squared error of each on the rows it has not seen, relative to the bare model."""
    squared = np.zeros(len(fits))
    bare = np.zeros(len(fits))
    for rows, prediction in _predictions(problem, active, fits, problem.restart, problem.options.regime):
        mask = unseen[:, rows].T
        target = problem.target[rows, None]
        with np.errstate(invalid="ignore"):
            squared += np.where(mask, (target - prediction) ** 2, 0.0).sum(axis=0)
        bare += (mask * (target - problem.zero) ** 2).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = squared / bare
    return np.where(np.isfinite(ratio), ratio, np.inf)


def _predictions(
    problem: Problem, active: IntArray, fits: Array, restart: BoolArray, regime: Regime
) -> Iterator[tuple[slice, Array]]:
    """Yield (rows, (rows, models) scaled predictions), a slice of rows at a time.

    A free run carries its state from slice to slice and restarts from the measured error where told.
    """
    feedbacks = problem.library.feedbacks[active]
    functions = np.unique(feedbacks)
    products = problem.which[active]
    state = np.zeros(len(fits))
    clip = problem.options.outside == "clip"
    for a in range(0, len(problem.target), _ROWS_AT_ONCE):
        rows = slice(a, min(a + _ROWS_AT_ONCE, len(problem.target)))
        drive = np.stack(
            [
                problem.products[products[feedbacks == q], rows].T @ fits[:, feedbacks == q].T
                for q in functions
            ]
        )
        if regime == "one_step" or not functions.any():
            yield rows, np.einsum("qkj,qk->kj", drive, problem.error_functions[functions, rows])
        else:
            yield (
                rows,
                free_run.run_many(
                    drive, functions, problem.error[rows], restart[rows], state, clip, free_run.LIMIT
                ),
            )


def _train_pearson(problem: Problem, active: IntArray, coefficients: Array) -> float:
    runs = _predictions(problem, active, coefficients[None], problem.restart, "free_run")
    return pearson(problem.target, np.concatenate([prediction[:, 0] for _, prediction in runs]))


def _folds(problem: Problem, active: IntArray, fits: Array) -> tuple[dict[Regime, Array], _Judged]:
    """Scaled residuals of each piece by the model fitted on the others, by regime, and how those did."""
    restart = np.zeros(len(problem.target), dtype=bool)
    restart[[a for a, _ in problem.folds]] = True
    own = np.repeat(np.arange(len(fits)), [b - a for a, b in problem.folds])
    runs: dict[Regime, Array] = {}
    regimes: tuple[Regime, Regime] = ("one_step", "free_run")
    for regime in regimes:
        parts = [
            prediction[np.arange(len(prediction)), own[rows]]
            for rows, prediction in _predictions(problem, active, fits, restart, regime)
        ]
        runs[regime] = np.concatenate(parts)
    left = {regime: problem.target - run for regime, run in runs.items()}
    bare = float(np.mean((problem.target - problem.zero) ** 2))
    ratio = {regime: float(np.mean(series**2)) / bare for regime, series in left.items()}
    return left, _Judged(
        ratio[problem.options.regime],
        pearson(problem.target, runs["free_run"]),
        100.0 * (1.0 - ratio["free_run"]),
        problem.scaling.error_volts_per_unit * float(np.sqrt(np.mean(left["one_step"] ** 2))),
    )


def _honest(problem: Problem, left: dict[Regime, Array]) -> tuple[HonestResiduals, ...]:
    volts = problem.scaling.error_volts_per_unit
    return tuple(
        HonestResiduals(
            record.name,
            volts * left["one_step"][a:b],
            volts * left["free_run"][a:b],
            tuple(start - a for start, _ in problem.folds if a <= start < b),
        )
        for record, (a, b) in zip(problem.split.train, problem.spans, strict=True)
    )


def _on_records(model: SparseModel, records: tuple[ErrorSeries, ...], problem: Problem) -> _Judged:
    truth = np.concatenate([record.error_v[1:] for record in records])
    one_step = np.concatenate([model.one_step(record)[1:] for record in records])
    runs = [model.free_run(record) for record in records]
    free = np.concatenate([run.error_v[1:] for run in runs])
    bare = float(np.mean(truth**2))
    diverged = any(run.diverged_at is not None for run in runs)
    loss_free = np.inf if diverged else float(np.mean((truth - free) ** 2)) / bare
    loss_step = float(np.mean((truth - one_step) ** 2)) / bare
    return _Judged(
        loss_free if problem.options.regime == "free_run" else loss_step,
        pearson(truth, free),
        100.0 * (1.0 - loss_free),
        float(np.sqrt(loss_step * bare)),
    )


def _model(
    problem: Problem, active: IntArray, coefficients: Array, ensemble: Ensemble, name: str
) -> SparseModel:
    kept = np.flatnonzero(coefficients)
    return SparseModel(
        name,
        problem.library.take(active[kept]),
        coefficients[kept],
        problem.scaling,
        problem.dt_s,
        ensemble.inclusion[kept],
        ensemble.low[kept],
        ensemble.high[kept],
    )
