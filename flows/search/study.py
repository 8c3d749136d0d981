"""The search stage: one study, evaluated here or by Dask, shared with whoever works on the same."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aesi.errors import FitError
from aesi.numerics.files.source_digest import source_digest
from aesi.pipeline.experiment.candidate import ScoredCandidate, genome_space, top_share, weights
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.records import Failed, digest
from aesi.sparse import Candidate, Genome, Problem
from aesi.sparse.search.pick.average import averaged
from flows.base import environment, fingerprint
from flows.base.console import Console
from flows.evaluation.generation import Evaluation, Tally
from flows.evaluation.open_pool import open_pool
from flows.evaluation.outcome_store import Outcomes, open_outcomes
from flows.search.nsga2 import Constraints, SearchSettings, search
from flows.search.published_study import PublishedStudy
from flows.search.result import SearchResult

OnScored = Callable[[int, Genome, ScoredCandidate | Failed], None]
"""Told of each candidate: its number, its genome, what became of it."""
OnGeneration = Callable[[int, int], None]
"""Told how many candidates of how many are done, a generation at a time."""


@dataclass(frozen=True, eq=False)
class StudyResult:
    """The result of the search stage: that of the search, and the candidate that was picked.

    numbers : of the fittest candidates, of which `chosen` is the mean, best first.  key : content key of these.
    scored : number -> outcome, of all candidates.
    """

    result: SearchResult
    numbers: tuple[int, ...]
    chosen: Candidate
    key: str
    scored: dict[int, ScoredCandidate | Failed]

    def candidates(self) -> tuple[Candidate, ...]:
        """All candidates that did not fail, by number: who works beside whom decides in which order they come."""
        outcomes = (self.scored[number] for number in sorted(self.scored))
        return tuple(one.candidate for one in outcomes if not isinstance(one, Failed))

    def rows(self) -> list[dict[str, Any]]:
        """The candidates that were evaluated, as the report draws them."""
        front = {trial.number for trial in self.result.front()}
        return [
            {
                "number": trial.number,
                "oob": trial.losses[0],
                "valid": trial.losses[1],
                "terms": int(trial.losses[2]),
                "fitness": trial.numbers.get("fitness"),
                "feasible": trial.feasible,
                "front": trial.number in front,
                "chosen": trial.number in self.numbers,
            }
            for trial in self.result.trials
            if trial.losses is not None
        ]


def run_study(
    problem: Problem,
    config: ExperimentConfig,
    console: Console,
    only_of: str | None = None,
    on_scored: OnScored | None = None,
    tally: Tally | None = None,
    publish_as: str | None = None,
    on_generation: OnGeneration | None = None,
    lost_again: bool = False,
) -> StudyResult:
    """Search until all candidates of the experiment are known, and pick one.

    only_of, lost_again : see `Evaluation`; a resumed run leaves out the latter, since its candidates are tracked as
    they were.
    on_scored, on_generation : told of what is done.  tally : counts where the outcomes came from.
    publish_as : name of the study in Optuna's storage; None publishes nothing.

    Raises FitError, with the reasons counted, where no candidate is feasible.
    """
    outcomes = shared_outcomes(config)
    study = study_key(problem, config)
    pool = open_pool(problem, config, study)
    tally = tally or Tally()
    evaluation = Evaluation(pool, outcomes, study, console.say, tally, only_of, lost_again)
    settings = settings_of(problem, config)
    listeners = [] if on_scored is None else [on_scored]
    if publish_as:
        space = genome_space(problem, config)
        published = PublishedStudy(
            publish_as, config.runner.storage, settings.constraints, space, console.say
        )
        listeners.append(published.add)
    scores = _Scores(evaluation, config, settings.constraints, console, listeners, on_generation)
    try:
        result = search(
            problem,
            config.search.candidates,
            config.seed,
            settings,
            on_candidate=scores.on_candidate,
            evaluate_many=scores.evaluate_many,
        )
    finally:
        pool.close()
        outcomes.close()
    if tally.found:
        console.say(f"  {tally.evaluated} candidates evaluated, {tally.found} known from before")
    numbers = result.fittest(top_share(config))
    chosen = averaged([_evaluated(number, scores.scored[number]) for number in numbers])
    key = fingerprint.key(*(evaluation.key(genome) for genome in chosen.genomes))
    return StudyResult(result, numbers, chosen, key, scores.scored)


class _Scores:
    """What has become of the candidates of a study so far; whoever listens is told of each.

    The search sees a `Candidate`; what is kept and told also has its intervals on the validation records.
    scored : number -> outcome, of all candidates so far.
    """

    def __init__(
        self,
        evaluation: Evaluation,
        config: ExperimentConfig,
        constraints: Constraints,
        console: Console,
        listeners: Sequence[OnScored],
        on_generation: OnGeneration | None,
    ) -> None:
        self.scored: dict[int, ScoredCandidate | Failed] = {}
        self._evaluation, self._constraints, self._console = evaluation, constraints, console
        self._total, self._population = config.search.candidates, config.search.population
        self._listeners, self._on_generation = listeners, on_generation
        self._unnumbered: dict[Genome, list[ScoredCandidate | Failed]] = {}
        self._started = time.monotonic()

    def evaluate_many(self, genomes: Sequence[Genome]) -> Iterator[tuple[int, Candidate | Failed]]:
        """A generation as `search` asks for it: (position, outcome) as they come."""
        for position, outcome in self._evaluation(genomes):
            self._unnumbered.setdefault(genomes[position], []).append(outcome)
            yield position, outcome if isinstance(outcome, Failed) else outcome.candidate

    def on_candidate(self, number: int, genome: Genome, outcome: Candidate | Failed) -> None:
        """Keep the outcome of a candidate, now that the search has given it a number, and tell of it."""
        self.scored[number] = self._unnumbered[genome].pop()
        for listener in self._listeners:
            listener(number, genome, self.scored[number])
        done, total = len(self.scored), self._total
        if self._on_generation is not None and (done % self._population == 0 or done == total):
            self._on_generation(done, total)
        told = _best(self.scored, self._constraints)
        known = self._evaluation.tally.found
        self._console.progress("candidates", done, total, self._started, told, known)


def settings_of(problem: Problem, config: ExperimentConfig) -> SearchSettings:
    """Settings of the search of an experiment."""
    asked = config.search
    return SearchSettings(
        asked.population,
        Constraints(asked.pearson_train, asked.pearson_valid),
        weights(config),
        genome_space(problem, config),
        None if asked.warm_start else (),
    )


def _evaluated(number: int, outcome: ScoredCandidate | Failed) -> Candidate:
    """The candidate of an outcome.  Raises FitError if it failed."""
    if isinstance(outcome, Failed):
        raise FitError(f"the chosen candidate {number} failed: {outcome.reason}")
    return outcome.candidate


def shared_folder() -> Path:
    """Where the candidates of an experiment without a database are shared, in the workspace."""
    return environment.state() / "cache" / "candidates"


def shared_outcomes(config: ExperimentConfig) -> Outcomes:
    """Where the candidates of an experiment are shared: its database, or the workspace."""
    return open_outcomes(shared_folder(), config.runner.storage)


def study_key(problem: Problem, config: ExperimentConfig) -> str:
    """Content key of all that decides what becomes of a genome: records, settings, code.

    Of the records also where they lie in charge and temperature, beyond which corrections fade, and the errors of
    physics that has not seen them, by which candidates are judged.
    """
    search, conformal = config.search, config.conformal
    records = (*problem.split.train, *problem.split.valid)
    places = (column for record in records for column in (record.soc, record.temperature_degc))
    settings = [
        problem.options.__dict__,
        weights(config).__dict__,
        [conformal.method, conformal.alpha, conformal.window, config.seed],
        [search.timeout_s, search.memory_mb],
    ]
    return fingerprint.key(
        source_digest(),
        *(record.digest for record in records),
        digest(problem.unseen_error, problem.unseen_target, *places),
        json.dumps(settings, default=str),
    )


def _best(scored: dict[int, ScoredCandidate | Failed], constraints: Constraints) -> str:
    candidates = [one.candidate for one in scored.values() if not isinstance(one, Failed)]
    values = [one.fitness for one in candidates if max(constraints.violations(one).values()) <= 0.0]
    if values:
        return f"best fitness {max(values):.3f}"
    return "none meets the constraints yet" if candidates or not scored else "all have failed so far"
