"""`discover`: find the effects that a declared model lacks, and by how much they lower the error."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path as FilePath
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from aesi.errors import AesiError, DataError
from aesi.numerics.metrics import rms
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.effects import CATALOGUE
from aesi.physics.initial_state import REST_C_RATE
from aesi.physics.record_checks import check_voltage
from aesi.physics.simulation import ModelName
from aesi.physics.start.temperature import OtherTemperature
from aesi.records import Hold, InferredHold, Measurement
from aesi.tracer.case.checks import check_compared, check_record, check_same_cell
from aesi.tracer.case.energies import ACTIVATION_ENERGIES
from aesi.tracer.case.free_parameter import RECORD_OWNERS, by_owner
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import PreparedRecord, prepare_all, prepare_test
from aesi.tracer.decide.evidence import Answer, Evidence, searched_answer
from aesi.tracer.decide.good_records import searched_answer_beside
from aesi.tracer.decide.model_choice import ModelChoice, with_model
from aesi.tracer.decide.other_hold import inferred_holds
from aesi.tracer.decide.own_heat import heat_of_file, with_heat_told
from aesi.tracer.decide.temperatures import (
    contradicting_unseen,
    other_temperatures,
    still_contradicting,
    temperature_fault,
)
from aesi.tracer.decide.verdict import Thresholds, Verdict
from aesi.tracer.likelihood.growth import Explanation
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.report.candidate_effects import CandidateEffect, ranking
from aesi.tracer.report.explain import explain
from aesi.tracer.report.outcome import FileOutcome, State, States, depletion_notes, held_out_rmse_v, outcomes
from aesi.tracer.report.own_parameters import OwnParameter, ages_told, own_parameters, starts_told
from aesi.tracer.report.tell_apart import telling_experiment
from aesi.tracer.report.warning import contradicted_by_v, warnings
from aesi.tracer.report.yardstick import Yardstick, yardstick_of
from aesi.tracer.search.archive import Archive, context_of
from aesi.tracer.search.growths import is_testable


@dataclass(frozen=True, eq=False)
class TriedHypothesis:
    """One hypothesis that was tried.

    effects : ids, in the order in which they were added.  trust : in the declared parameters, see `case.trust.Trust`.
    gain_nats : gain in log predictive density of unseen data over what it was compared with: the hypothesis chosen
    before its step or, where it has an effect less than the chosen one, that one.  rmse_v : RMS residual on fitted
    rows, V.  delta_v : size of the model error at which its score is highest, V.  values : owner -> name -> value of
    each moved parameter.  simulations : number spent on it.
    """

    effects: tuple[str, ...]
    trust: str
    gain_nats: float
    rmse_v: float
    delta_v: float
    values: Mapping[str, Mapping[str, float]]
    simulations: int


NO_YARDSTICK = (
    "the data are too short, or too little varies in them, for a flexible correction: what one could still explain is "
    "not known."
)

Progress = Callable[[TriedHypothesis], None]


@dataclass(frozen=True, eq=False)
class ResidualStructure:
    """shares : family of variables -> share of the residual's variance that it explains, 0 to 1.
    yardstick : how much of the residual a sparse correction could explain."""

    shares: Mapping[str, float]
    yardstick: Yardstick


@dataclass(frozen=True, eq=False)
class Discovery:
    """The outcome of one case.

    It compares three models. "before" is the declared one. "recalibrated" has its own parameters refitted and no
    effect. "after" is the written one: with the effects that were found or, where nothing explains the data, the model
    that carries over best.

    cell, held, model_effects : the written model: its cell, the effects that the cell's values contain, and the effects
    that a cell file cannot hold.
    soc0 : of the first record: fitted state of charge at the first row, in the stoichiometry windows of `cell`.
    hold : how the current runs between the rows of all records, as they declare or as was inferred; None where they
    differ or do not.
    chosen : effects of the hypothesis that the search chose, by id; the verdict need not name them.
    written : effects of the written model by id, with their parameters; they differ from the verdict's where these do
    not carry over.  own : model -> the declared parameters that were fitted, and their values.
    candidates : each effect that was simulated, best first.  files : errors by file and part.
    noise_floor_v : RMS of the records' white noise, V.  before, after : what the residuals of the declared and of the
    written model depend on.
    effects : by id, all that may be tried or moved.  tried : ids of those that competed, empty where none may be added.
    experiments : (group of look-alikes, experiment that would tell them apart).  choice : which model of the cell.
    not_adopted : why the written model lacks the effects of the verdict, or is not the refit with the smallest error.
    notes : assumptions, and remarks on the records and the search.
    contradicted : whether an explanation of the data leaves a larger error on the test part than a right one may.
    warnings : sentences on that; on records that contradict their own temperature; on a written model that is worse
    than another one, on the test part or on the fitted rows; and on a test part without load.
    other_temperature : names of the records, tests included, that contradict their temperature and that no model
    fitted at that temperature explains.
    good : names of the records that are known to be good, from which the verdict says how the others differ.
    seconds : spent on the search.  simulations : spent on the hypotheses that were tried, not on judging them.
    """

    cell: Cell
    verdict: Verdict
    candidates: tuple[CandidateEffect, ...]
    files: tuple[FileOutcome, ...]
    noise_floor_v: float
    before: ResidualStructure
    after: ResidualStructure
    model_effects: tuple[ActiveEffect, ...]
    soc0: float
    hold: Hold | None
    effects: Mapping[str, Effect]
    experiments: tuple[tuple[tuple[str, ...], str], ...]
    choice: ModelChoice
    not_adopted: str | None
    notes: tuple[str, ...]
    contradicted: bool
    warnings: tuple[str, ...]
    other_temperature: tuple[str, ...]
    good: tuple[str, ...]
    held: tuple[ActiveEffect, ...]
    chosen: tuple[str, ...]
    written: Mapping[str, Mapping[str, float]]
    own: Mapping[State, tuple[OwnParameter, ...]]
    tried: tuple[str, ...]
    seconds: float
    simulations: int


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
    archive: FilePath | None = None,
    progress: Progress | None = None,
    model: ModelName | None = None,
    good: Sequence[Measurement] = (),
) -> Discovery:
    """Find the effects that the model of `cell` lacks to explain the measurements.

    measurements : records to fit. Without `tests`, the last `holdout` share (0 to 1, of the time) of each is kept back
    for the test.  tests : records for the test only; nothing is fitted to them.  soc0 : state of charge at the first
    sample; None reads it from the rest voltage.
    max_effects : most effects that may be added.  seed : of the bootstrap intervals.
    effects : those that may be tried, by id.  given : effects that the declared model has already.  archive : file that
    stores fits, so that an interrupted search resumes.  progress : called with each hypothesis after it was tried.
    model : "espm" or "dfn" for every hypothesis; None takes the porous electrode where it differs notably from the
    single particle.
    good : records of the same cell that are known to be good. The search then is for effects that act on the
    measurements and not on these.

    Where the data are explained better if the current of a record that declares no hold runs otherwise between its rows
    than it was assumed to, they are searched again so. Where nothing explains records without a temperature, they are
    searched again with a cell that warms itself by the thermal data of its file (`decide.own_heat`).

    Raises DataError where the data cannot decide anything or do not belong to the cell.
    """
    began = time.perf_counter()
    if not measurements:
        raise DataError("give at least one measurement to look at.")
    for data in (*measurements, *good, *tests):
        check_voltage(cell, data)
    spent = _Spent(progress)
    search = _Search(
        cell=cell,
        measurements=measurements,
        tests=tests,
        soc0=soc0,
        holdout=0.0 if tests else holdout,
        max_effects=max_effects,
        effects=effects,
        archive=archive,
        model=model,
        good=good,
        spent=spent,
    )
    found = _discovery_of(
        _with_heat(search, given) if max_effects else search.of(given),
        spent.simulations,
        np.random.default_rng(seed),
        time.perf_counter() - began,
    )
    return found if max_effects else replace(found, tried=())


def _check_case(problem: InverseProblem, tested: Sequence[PreparedRecord]) -> None:
    """Raises DataError where a record, fitted or not, seems to be of another cell, and where no known-good record has
    been at the states of charge of the others."""
    check_compared(problem)
    declared = ModelState(problem)
    numbers = [*range(len(problem.records)), *[None] * len(tested)]
    for number, record in zip(numbers, (*problem.records, *tested), strict=True):
        check_same_cell(problem, record, declared.simulated(record, number, thin=True))


def _hold_of_test(
    test: Measurement, fitted: Iterable[Measurement], inferred: Iterable[InferredHold]
) -> InferredHold | None:
    """The hold of a test record that declares none: that of the fitted records, since one logger wrote them all. It has
    to be inferred of at least one of them and declared otherwise by none; else None."""
    holds = {one.hold for one in inferred}
    if test.hold is not None or len(holds) != 1 or holds | {one.hold for one in fitted} - {None} != holds:
        return None
    return InferredHold(holds.pop(), "as that of the fitted records")


def inverse_problem(
    cell: Cell,
    measurements: Sequence[Measurement],
    soc0: float | None = None,
    holdout: float = 0.3,
    effects: Mapping[str, Effect] = CATALOGUE,
    given: Sequence[ActiveEffect] = (),
    model: ModelName = "espm",
    good: Sequence[Measurement] = (),
    inferred: Mapping[int, InferredHold] = MappingProxyType({}),
) -> InverseProblem:
    """The problem that `discover` searches, from the same arguments.

    inferred : number of a record -> how its current runs, where nobody declared that.
    Raises DataError where a record is too short or holds no load, and where an effect's id is reserved.
    """
    records = prepare_all(cell, measurements, soc0, holdout, given, good, inferred)
    for record in records:
        check_record(cell, record)
    taken = next((name for name in effects if name in (*RECORD_OWNERS, ACTIVATION_ENERGIES)), None)
    if taken is not None:
        raise DataError(
            f"an effect cannot have the id {taken!r}, which the cell or its records have their own of; give it another."
        )
    there = {active.id for active in given} - _restating(effects)
    tried = {name: effect for name, effect in effects.items() if name not in there}
    return InverseProblem(cell, records, tried, fixed=tuple(given), model=model)


def _restating(effects: Mapping[str, Effect]) -> set[str]:
    """Ids of the effects that restate declared parameters. They may be tried even where they are given: a parameter
    that was corrected once may still be off."""
    return {effect.id for effect in effects.values() if effect.restates_declared}


class _Searched(NamedTuple):
    """A search with its model choice and its test records."""

    evidence: Evidence
    choice: ModelChoice
    tested: tuple[PreparedRecord, ...]


@dataclass(frozen=True, eq=False)
class _Search:
    """The search that `discover` makes of a declared model, with the arguments of that.

    holdout : as there, 0 where there are tests.
    """

    cell: Cell
    measurements: Sequence[Measurement]
    tests: Sequence[Measurement]
    soc0: float | None
    holdout: float
    max_effects: int
    effects: Mapping[str, Effect]
    archive: FilePath | None
    model: ModelName | None
    good: Sequence[Measurement]
    spent: _Spent

    def of(self, declared: Sequence[ActiveEffect]) -> _Searched:
        """The search of the cell with these effects, repeated while the data say that the current of a record runs
        otherwise between its rows.  Raises DataError as `discover`."""
        inferred: dict[int, InferredHold] = {}
        problem, tested = self._problem(declared, inferred), self._tested(declared, inferred)
        _check_case(problem, tested)
        evidence, choice = self._answered(problem)
        while others := inferred_holds(evidence.paths.get("tight", evidence.path)):
            inferred |= others
            evidence, choice = self._answered(self._problem(declared, inferred))
            tested = self._tested(declared, inferred)
        return _Searched(evidence, choice, tested)

    def _problem(
        self, declared: Sequence[ActiveEffect], inferred: Mapping[int, InferredHold]
    ) -> InverseProblem:
        return inverse_problem(
            self.cell,
            self.measurements,
            self.soc0,
            self.holdout,
            self.effects,
            declared,
            self.model or "espm",
            self.good,
            inferred,
        )

    def _tested(
        self, declared: Sequence[ActiveEffect], inferred: Mapping[int, InferredHold]
    ) -> tuple[PreparedRecord, ...]:
        holds = (_hold_of_test(data, self.measurements, inferred.values()) for data in self.tests)
        return tuple(
            prepare_test(self.cell, data, self.measurements, self.soc0, declared, hold)
            for data, hold in zip(self.tests, holds, strict=True)
        )

    def _answered(self, problem: InverseProblem) -> tuple[Evidence, ModelChoice]:
        return with_model(problem, self.model, self._answer, self._archive_of, self.max_effects)

    def _answer(
        self, problem: InverseProblem, archive: Archive, most: int, shallower: Answer | None = None
    ) -> Answer:
        if problem.has_good:
            return searched_answer_beside(problem, most, archive, Thresholds(), self.spent)
        return searched_answer(problem, most, archive, Thresholds(), self.spent, shallower)

    def _archive_of(self, problem: InverseProblem, other_model: Archive | None) -> Archive:
        return Archive(self.archive, context_of(problem), other_model)


def _with_heat(search: _Search, given: Sequence[ActiveEffect]) -> _Searched:
    """The search of the declared model or, where `heat_of_file` gives a heat and the data do not speak against it, of
    the declared model with that heat."""
    cold = search.of(given)
    heat = heat_of_file(cold.evidence)
    if heat is None:
        return cold
    try:
        warm = search.of((*given, heat))
    except DataError:  # the records speak against that heat
        return cold
    told = with_heat_told(warm.evidence, cold.evidence)
    return cold if told is None else warm._replace(evidence=told)


class _Spent:
    """Counts simulations and passes on what was tried."""

    def __init__(self, progress: Progress | None) -> None:
        self.progress, self.simulations = progress, 0

    def __call__(self, problem: InverseProblem, one: Explanation, gain: float) -> None:
        self.simulations += one.simulations
        if self.progress is None:
            return
        left = one.point.residual_v - one.point.jacobian_v @ one.score.shift
        values = by_owner(one.values_by_key, one.hypothesis)
        tried = TriedHypothesis(
            one.hypothesis, problem.trust, gain, rms(left), one.score.delta_v, values, one.simulations
        )
        self.progress(tried)


def _discovery_of(
    searched: _Searched, simulations: int, rng: np.random.Generator, seconds: float
) -> Discovery:
    """The outcome as reported.  rng : of the bootstrap intervals.  simulations, seconds : spent on the search."""
    evidence, choice, tested = searched
    problem, verdict = evidence.path.problem, evidence.verdict
    records, declared = problem.records, ModelState(problem)
    fitted = _fitted(evidence)
    others = still_contradicting(fitted, other_temperatures(problem))
    at_other = {records[k].name: other for k, other in others.items()} | contradicting_unseen(fitted, tested)
    evidence = _without_fault(evidence, others)
    fits: States = {"before": declared, "recalibrated": evidence.recalibrated, "after": evidence.after}
    states = {
        name: state.with_file_capacity() for name, state in fits.items()
    }  # errors are those of the written models
    files = outcomes(records, states, tested, rng)
    inside, soc0 = evidence.after.folded_cell()
    left = _structure_of(records, states["after"])
    explained = files
    if evidence.fault is not None and verdict.word != "unknown":
        # A finding that may not be written is judged on the test part all the same.
        found = states | {"after": fitted.with_file_capacity()}
        explained = outcomes(records, found, tested, np.random.default_rng(0))
    return Discovery(
        cell=inside.cell,
        verdict=verdict,
        candidates=ranking(evidence.path, verdict, partial(_test_error_v, problem, tested)),
        files=files,
        noise_floor_v=float(np.sqrt(np.mean([r.noise_full_v**2 for r in records]))),
        before=_structure_of(records, declared),
        after=left,
        model_effects=inside.left,
        held=inside.held,
        soc0=soc0,
        hold=records[0].data.hold if len({r.data.hold for r in records}) == 1 else None,
        effects=problem.effects,
        experiments=tuple((g, telling_experiment(g, problem.effects)) for g in verdict.groups),
        choice=choice,
        not_adopted=evidence.fault,
        notes=(choice.sentence, *_notes(evidence, tested, left), *depletion_notes(files)),
        contradicted=contradicted_by_v(explained, verdict) is not None,
        warnings=(
            *(other.sentence(name) for name, other in at_other.items()),
            *warnings(files, verdict, REST_C_RATE * problem.cell.capacity_ah, explained),
        ),
        other_temperature=tuple(at_other),
        good=tuple(record.name for record in records if record.good),
        chosen=evidence.path.chosen.hypothesis,
        written={name: (evidence.after.values or {})[name] for name in evidence.after.hypothesis},
        own={state: own_parameters(fits[state]) for state in ("recalibrated", "after")},
        tried=tuple(name for name in problem.competing() if _was_tried(evidence, name)),
        seconds=seconds,
        simulations=simulations,
    )


def _was_tried(evidence: Evidence, effect: str) -> bool:
    """Whether the records could decide on an effect in one of the searches."""
    return any(is_testable(path.problem, effect) for path in evidence.paths.values())


def _fitted(evidence: Evidence) -> ModelState:
    """The model that explains the data. The written one may be another, since that has to run over the declared
    range."""
    unknown = evidence.verdict.word == "unknown"
    return evidence.after if unknown else ModelState.of(evidence.path.problem, evidence.path.chosen)


def _without_fault(evidence: Evidence, others: Mapping[int, OtherTemperature]) -> Evidence:
    """The evidence, with the declared model written in place of a fitted one that makes up for a wrong temperature."""
    fault = temperature_fault(evidence.after, others)
    if fault is None:
        return evidence
    return replace(evidence, after=ModelState(evidence.path.problem), fault=fault, limits=())


def _test_error_v(
    problem: InverseProblem, tested: Sequence[PreparedRecord], one: Explanation
) -> float | None:
    """RMSE on data that no fit has seen, V; None without such data, or where the model cannot be simulated there."""
    try:
        error_v = held_out_rmse_v(ModelState.of(problem, one).with_file_capacity(), problem.records, tested)
    except AesiError:  # it was simulated on the fit part alone
        return None
    return error_v if error_v is not None and np.isfinite(error_v) else None


def _notes(evidence: Evidence, tested: Sequence[PreparedRecord], left: ResidualStructure) -> tuple[str, ...]:
    records = evidence.path.problem.records
    known = [
        f"{r.name} is a known-good record: the verdict is on how the other records differ from it."
        for r in records
        if r.good
    ]
    notes = [*known, *(note for record in (*records, *tested) for note in record.notes)]
    notes += [note for path in evidence.paths.values() for note in path.notes]
    notes += [*evidence.verdict.look_alike_notes, *evidence.limits]
    ages = ages_told((evidence.after, evidence.recalibrated))
    notes += [ages] if ages else []
    notes += starts_told(evidence.after)
    if left.yardstick.explained_v is None:
        notes.append(NO_YARDSTICK)
    if (
        evidence.fault is not None and evidence.after.values is not None
    ):  # else it is said with what is written
        notes.append(f"not adopted: {evidence.fault}.")
    return tuple(dict.fromkeys(notes))


def _structure_of(records: Sequence[PreparedRecord], state: ModelState) -> ResidualStructure:
    runs, residuals = [], []
    for index, record in enumerate(records):
        seen = record.thin.take(slice(0, record.n_fit))
        runs.append(state.simulated(replace(record, thin=seen), index, thin=True))
        residuals.append(seen.voltage_v - runs[-1].voltage_v)
    return ResidualStructure(explain(runs, residuals), yardstick_of(runs, residuals))
