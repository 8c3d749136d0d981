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


@dataclass(frozen=True, eq=False)
class Found:
    """The result of the search stage.

    numbers : of the fittest candidates, those that `chosen` is the mean of, the best first.
    key : content key of these.  scored : number -> outcome, of all candidates.
    """

    result: SearchResult
    numbers: tuple[int, ...]
    chosen: Candidate
    key: str
    scored: dict[int, ScoredCandidate | Failed]

    @property
    def number(self) -> int:
        """Of the fittest candidate."""
        return self.numbers[0]

    def candidates(self) -> tuple[Candidate, ...]:
        """All candidates that did not fail."""
        return tuple(one.candidate for one in self.scored.values() if not isinstance(one, Failed))

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
    reuse: bool = True,
    on_scored: OnScored | None = None,
    tally: Tally | None = None,
    publish_as: str | None = None,
    on_generation: Callable[[int, int], None] | None = None,
    lost_again: bool = False,
) -> Found:
    """Search until all candidates of the experiment are known, and pick one.

    on_generation : told how many candidates of how many are done, a generation at a time.
    publish_as : name of the study in Optuna's storage; None publishes nothing.
    lost_again : see `Evaluation`; not of a run that is gone on with, whose candidates are tracked as they were.

    Raises FitError, with the reasons counted, where no candidate is feasible.
    """
    outcomes = shared_outcomes(config)
    study = study_key(problem, config)
    pool = open_pool(problem, config, study)
    tally = tally or Tally()
    evaluation = Evaluation(pool, outcomes, study, console.say, tally, reuse, lost_again)
    scored: dict[int, ScoredCandidate | Failed] = {}
    waiting: dict[Genome, list[ScoredCandidate | Failed]] = {}
    started = time.monotonic()
    settings = settings_of(problem, config)
    constraints = settings.constraints
    published = None
    if publish_as:
        space = genome_space(problem, config)
        published = PublishedStudy(publish_as, config.runner.storage, constraints, space, console.say)

    def evaluate_many(genomes: Sequence[Genome]) -> Iterator[tuple[int, Candidate | Failed]]:
        for position, outcome in evaluation(genomes):
            waiting.setdefault(genomes[position], []).append(outcome)
            yield position, outcome if isinstance(outcome, Failed) else outcome.candidate

    def on_candidate(number: int, genome: Genome, outcome: Candidate | Failed) -> None:
        scored[number] = waiting[genome].pop()
        if on_scored is not None:
            on_scored(number, genome, scored[number])
        if published is not None:
            published.add(number, genome, scored[number])
        done, total = len(scored), config.search.candidates
        if on_generation is not None and (done % config.search.population == 0 or done == total):
            on_generation(done, total)
        told = _best(scored, constraints)
        console.progress("candidates", len(scored), config.search.candidates, started, told)

    try:
        result = search(
            problem,
            config.search.candidates,
            config.seed,
            settings,
            on_candidate=on_candidate,
            evaluate_many=evaluate_many,
        )
    finally:
        pool.close()
        outcomes.close()
    if tally.found:
        console.say(f"  {tally.evaluated} candidates evaluated, {tally.found} known from before")
    numbers = result.fittest(top_share(config))
    chosen = averaged([_alive(number, scored[number]) for number in numbers])
    key = fingerprint.key(*(evaluation.key(genome) for genome in chosen.genomes))
    return Found(result, numbers, chosen, key, scored)


def settings_of(problem: Problem, config: ExperimentConfig) -> SearchSettings:
    """How an experiment searches."""
    asked = config.search
    return SearchSettings(
        asked.population,
        Constraints(asked.pearson_train, asked.pearson_valid),
        weights(config),
        genome_space(problem, config),
        None if asked.warm_start else (),
    )


def _alive(number: int, outcome: ScoredCandidate | Failed) -> Candidate:
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
    return f"best fitness {max(values):.3f}" if values else "none meets the constraints yet"
