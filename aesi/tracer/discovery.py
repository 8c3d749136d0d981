"""Close the loop on one case: which effect does the declared model lack, and what does adding it bring?"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from aesi.errors import DataError
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.effects import CATALOGUE
from aesi.records import Hold, Measurement, Run
from aesi.tracer import rough_look, second_look
from aesi.tracer.candidates import Candidate, ranking
from aesi.tracer.checks import check_measurement, check_record, check_same_cell
from aesi.tracer.explain import explain
from aesi.tracer.fit import Fit, fit_hypothesis
from aesi.tracer.outcome import FileOutcome, States, outcomes, polarisation_v, simulated, test_rmse_v
from aesi.tracer.problem import TOLERANCES, Problem
from aesi.tracer.records import Record, noise_floor_v, prepare_all, prepare_test
from aesi.tracer.search import (
    EVIDENCE_NATS,
    Admission,
    Archive,
    Breadth,
    Scored,
    Search,
    context_of,
    select,
)
from aesi.tracer.tell_apart import experiment
from aesi.tracer.verdict import UNSEEN_SHARE, Verdict, beyond, judge, tolerance_v
from aesi.tracer.yardstick import Yardstick, measure

NUMERICS = "numerical_error"
NUMERICS_SHARE = 0.1
"""Numerics that move the voltage by more than this share of the noise are refined for every hypothesis."""
OWN_PARAMETERS = ("solid_diffusivity", "charge_transfer_kinetics", "electrolyte_transport")
"""What a recalibration of the declared model, without any new physics, may move."""

Progress = Callable[[str, Scored, Admission | None], None]


@dataclass(frozen=True, eq=False)
class Left:
    """What a residual depends on (share of its variance by family of variables), and what a sparse correction could
    explain of it."""

    shares: Mapping[str, float]
    yardstick: Yardstick


@dataclass(frozen=True, eq=False)
class Discovery:
    """The outcome of one case.

    model_effects : what `after` simulates with: the effects found, and the tolerated parameters where they
    settled.
    soc0, hold : of the first record, fitted.  effects : what was tried, by id.  files : errors by file and
    part.  before, after : what is left as declared and at the end.  experiments : group of look-alikes -> what would
    tell them apart.
    """

    cell: Cell
    verdict: Verdict
    candidates: tuple[Candidate, ...]
    files: tuple[FileOutcome, ...]
    noise_floor_v: float
    before: Left
    after: Left
    model_effects: tuple[ActiveEffect, ...]
    soc0: float
    hold: Hold
    effects: Mapping[str, Effect]
    experiments: tuple[tuple[tuple[str, ...], str], ...]
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    simulations: int = 0


def discover(
    cell: Cell,
    measurements: Sequence[Measurement],
    tests: Sequence[Measurement] = (),
    *,
    soc0: float | None = None,
    holdout: float = 0.3,
    max_effects: int = 3,
    seed: int = 0,
    effects: Mapping[str, Effect] = CATALOGUE,
    given: Sequence[ActiveEffect] = (),
    archive: Path | None = None,
    progress: Progress | None = None,
) -> Discovery:
    """Find what `cell` lacks to explain the measurements.

    measurements : what may be looked at, less the last `holdout` share of each where no `tests` are given.
    tests : files that choose nothing.  soc0 : state of charge at the first sample; None takes it from the
    rest voltage.
    effects : what may be tried.  given : effects that the declared model has already.  archive : a file that
    keeps fits, so that an interrupted search resumes.

    Raises DataError where the data cannot decide anything or do not belong to the cell.
    """
    began = time.perf_counter()
    if not measurements:
        raise DataError("give at least one measurement to look at.")
    for data in (*measurements, *tests):
        check_measurement(cell, data)
    records = prepare_all(cell, measurements, soc0, 0.0 if tests else holdout)
    for record in records:
        check_record(cell, record)
    tested = tuple(prepare_test(cell, data, measurements, soc0) for data in tests)
    there = {active.id for active in given} - set(TOLERANCES)
    measured = all(data.temperature_degc is not None for data in measurements)
    tried = {
        name: effect
        for name, effect in effects.items()
        if name != NUMERICS and name not in there and not (measured and effect.infers)
    }
    problem = _refined(Problem(cell, records, tried, fixed=tuple(given)), effects.get(NUMERICS))
    _check_cells(problem, tested)
    problem = _with_noise_of_residual(problem)
    another = second_look.is_possible(problem)
    breadth = second_look.FIRST if another else Breadth()
    looked = _look(problem, max_effects, seed, archive, progress, breadth)
    if another and looked.verdict.word == "unknown":
        looked = _look_again(looked, max_effects, seed, archive, progress)
    elif looked.verdict.word == "unknown" and not looked.verdict.effects:
        looked = _look_roughly(looked, seed, archive, progress)
    return _told(looked, tested, time.perf_counter() - began)


@dataclass(frozen=True, eq=False)
class _Looked:
    """A finished search and what it allows one to say.

    steps : hypotheses chosen after each addition.  chosen : what `after` is.  recalibrated : the model with its own
    parameters free.  moved : own parameters of it that mattered, with the evidence that they bring (nats).
    """

    search: Search
    steps: list[Scored]
    verdict: Verdict
    chosen: Scored
    recalibrated: Fit
    moved: Mapping[str, float] = field(default_factory=dict)


def _look(
    problem: Problem,
    max_effects: int,
    seed: int,
    archive: Path | None,
    progress: Progress | None,
    breadth: Breadth,
) -> _Looked:
    noise_v = _noise_v(problem)
    archived = Archive(archive, context_of(problem))
    search = Search(problem, np.random.default_rng(seed), archived, polarisation_v(problem, None))
    steps, verdict = _searched(search, max_effects, progress, breadth, noise_v)
    chosen = search.fit(verdict.effects) or steps[0]
    return _Looked(search, steps, verdict, chosen, _recalibrated(problem, steps[0].fit))


def _look_again(
    first: _Looked, max_effects: int, seed: int, archive: Path | None, progress: Progress | None
) -> _Looked:
    """The search once more, on top of a recalibrated model."""
    problem, noise_v = second_look.freed(first.search.problem), _noise_v(first.search.problem)
    archived = Archive(archive, context_of(problem))
    search = second_look.SecondSearch(problem, np.random.default_rng(seed), archived)
    steps, verdict = _searched(search, max_effects, progress, second_look.BREADTH, noise_v)
    if not search.improves(steps[-1], first.steps[0].fit):
        first.search.notes.append(second_look.CONTRADICTION)
        verdict = second_look.contradicted(first.verdict)
        return replace(first, verdict=verdict, steps=first.steps[:1], chosen=first.steps[0])
    nats = second_look.nats_of_potential(problem, steps[0].fit)
    moved = {second_look.OCP: nats} if nats >= EVIDENCE_NATS else {}
    left = [beyond(scored.fit.rmse_v, noise_v) for scored in (first.steps[0], steps[0], steps[-1])]
    verdict = second_look.reworded(verdict, steps[-1].hypothesis, moved, left)
    return _Looked(search, steps, verdict, steps[-1], steps[0].fit, moved)


def _look_roughly(first: _Looked, seed: int, archive: Path | None, progress: Progress | None) -> _Looked:
    """The first search's outcome, with the effect named that takes up most of a large residual, where there is one."""
    if not rough_look.is_due(first.search):
        return first
    problem = rough_look.weighed(first.search)
    search = Search(
        problem,
        np.random.default_rng(seed),
        Archive(archive, context_of(problem)),
        first.search.polarisation_v,
        _reporter(progress),
    )
    rough = rough_look.most_of_it(search)
    if rough is None:
        return first
    verdict = rough_look.named(first.verdict, rough)
    return _Looked(search, [rough.base, rough.best], verdict, rough.best, first.recalibrated)


def _reporter(progress: Progress | None) -> Callable[[Scored, Admission | None], None]:
    if progress is None:
        return lambda scored, admission: None
    return lambda scored, admission: progress("+".join(scored.hypothesis), scored, admission)


def _searched(
    search: Search, max_effects: int, progress: Progress | None, breadth: Breadth, noise_v: float
) -> tuple[list[Scored], Verdict]:
    problem = search.problem
    search.report = _reporter(progress)
    steps = select(search, max_effects, lambda base, one: _grade(search, noise_v, base, one), breadth)
    if steps is None:
        raise DataError(
            f"the model of {problem.cell.name} cannot be simulated on {problem.records[0].name}; check the cell file."
        )
    return steps, judge(search, steps, noise_v, polarisation_v(problem, steps[-1].fit))


def _refined(problem: Problem, numerics: Effect | None) -> Problem:
    """The problem with finer numerics in every simulation, where the declared ones move the voltage at
    all."""
    if numerics is None:
        return problem
    finer = (*problem.fixed, numerics.activate())
    moved, noise = [], _noise_v(problem)
    for record in problem.records:
        seen = record.thin.take(slice(0, record.n_fit))
        coarse = problem.voltage(seen, record.soc0, problem.fixed, record.thin_hold)
        moved.append(problem.voltage(seen, record.soc0, finer, record.thin_hold) - coarse)
    shift = float(np.sqrt(np.mean(np.concatenate(moved) ** 2)))
    return replace(problem, fixed=finer) if shift > NUMERICS_SHARE * noise else problem


def _check_cells(problem: Problem, tests: Sequence[Record]) -> None:
    for record in (*problem.records, *tests):
        run = simulated(problem, None, record, None, thin=True)
        check_same_cell(record.name, record.thin.voltage_v - run.voltage_v, problem.cell)


def _with_noise_of_residual(problem: Problem) -> Problem:
    """The noise floor again from the residual of the empty hypothesis: no load steps blur it there."""
    base = fit_hypothesis(problem, ())
    if base is None:
        return problem
    records = []
    for rows, record in zip(problem.slices, problem.records, strict=True):
        noise = noise_floor_v(base.residual_v[rows], record.thin.current_a[: record.n_fit])
        records.append(replace(record, noise_v=min(record.noise_v, noise)))
    return replace(problem, records=tuple(records))


def _grade(search: Search, noise_v: float, base: Scored, current: Scored) -> int:
    """How far what is left is within what a model may miss: see `select`."""
    before = base.structured_v if current.hypothesis else 0.0
    allowed = tolerance_v(noise_v, polarisation_v(search.problem, current.fit), before)
    if current.structured_v > allowed:
        return 0
    unseen_v = search.unseen_rmse_v(current, float(np.hypot(UNSEEN_SHARE * allowed, noise_v)))
    return 2 if beyond(unseen_v, noise_v) <= UNSEEN_SHARE * allowed else 1


def _noise_v(problem: Problem) -> float:
    return float(np.sqrt(np.mean([r.noise_v**2 for r in problem.records])))


def _recalibrated(problem: Problem, base: Fit) -> Fit:
    """The declared model with its own parameters free, and as many starts and steps as a hypothesis gets."""
    own = tuple(name for name in OWN_PARAMETERS if name in problem.effects)
    return fit_hypothesis(problem, own) or base


def _told(looked: _Looked, tested: Sequence[Record], seconds: float) -> Discovery:
    search, verdict, chosen = looked.search, looked.verdict, looked.chosen
    problem = search.problem
    shown = (*looked.steps, chosen) if verdict.effects else looked.steps
    fits: States = {"before": None, "recalibrated": looked.recalibrated, "after": chosen.fit}
    kinds = {k: str(e.kind) for k, e in problem.effects.items()}
    cell, model_effects, soc0 = second_look.settled(problem, chosen.fit)
    return Discovery(
        cell=cell,
        verdict=verdict,
        candidates=ranking(
            search, shown, verdict, lambda fit: test_rmse_v(problem, fit, tested), looked.moved
        ),
        files=outcomes(problem, fits, tested, search.rng),
        noise_floor_v=float(np.sqrt(np.mean([r.noise_full_v**2 for r in problem.records]))),
        before=_left(problem, None),
        after=_left(problem, chosen.fit),
        model_effects=model_effects,
        soc0=soc0,
        hold=problem.records[0].hold,
        effects=problem.effects,
        experiments=tuple((g, experiment(g, kinds)) for g in verdict.groups),
        notes=tuple(n for r in (*problem.records, *tested) for n in r.notes) + tuple(search.notes),
        seconds=seconds,
        simulations=sum(s.fit.simulations for s in search.scored.values() if s is not None),
    )


def _left(problem: Problem, fit: Fit | None) -> Left:
    runs, residuals = [], []
    for index, record in enumerate(problem.records):
        run = simulated(problem, fit, record, index, thin=True)
        keep = slice(0, record.n_fit)
        series = {name: column[keep] for name, column in run.series.items()}
        runs.append(Run(run.time_s[keep], run.current_a[keep], run.voltage_v[keep], series))
        residuals.append((record.thin.voltage_v - run.voltage_v)[keep])
    return Left(explain(runs, residuals), measure(runs, residuals))
