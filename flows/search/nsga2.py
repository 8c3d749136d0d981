"""Evolutionary search over libraries and hyperparameters: NSGA-II, three losses, two correlation constraints.

    minimise  loss_oob, loss_valid, loss_sparse    subject to  pearson_train >= eps1, pearson_valid >= eps2

The front is kept whole; the paper's scalar fitness, 1 - (g1 L_oob + g2 L_valid + g3 L_sparse), picks from it.
A candidate that fails is a pruned trial with its reason. How the term mask travels, and why, is told in
term_sampler.py.

A generation is asked for as a whole and told in order, so a search gives the same trials whoever evaluates
them and however many at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import optuna
from optuna.storages import BaseStorage
from optuna.study import Study
from optuna.trial import FrozenTrial, TrialState

from aesi.errors import ConfigError
from aesi.records import Failed
from aesi.sparse import Candidate, FitnessWeights, Genome, Problem, evaluate
from aesi.sparse.search.genome_space import GenomeSpace
from flows.search.result import FINISHED, RECORD, RECORDED, SearchResult
from flows.search.term_sampler import INDEX, TermSampler

Outcome = Candidate | Failed
EvaluateMany = Callable[[Sequence[Genome]], Iterable[tuple[int, Outcome]]]
"""A generation in, (position, outcome) out, in any order."""
OnCandidate = Callable[[int, Genome, Outcome], None]


@dataclass(frozen=True)
class Constraints:
    """Least Pearson correlation of error and prediction, in free run."""

    pearson_train: float = 0.5
    pearson_valid: float = 0.5

    def violations(self, one: Candidate) -> dict[str, float]:
        """What is asked for, in words -> by how much a candidate misses it; it is met at 0 and below."""
        return {
            f"correlation on training of at least {self.pearson_train:g}": self.pearson_train
            - one.pearson_train,
            f"correlation on validation of at least {self.pearson_valid:g}": self.pearson_valid
            - one.pearson_valid,
        }


@dataclass(frozen=True)
class SearchSettings:
    """Settings of a search.

    population : candidates in a generation.  weights : of the scalar fitness.
    space : of the genomes; None takes the default one of the problem's library.
    warm_start : genomes to begin with; None takes `GenomeSpace.plain_starts`, () none.
    """

    population: int = 20
    constraints: Constraints = Constraints()
    weights: FitnessWeights = field(default_factory=FitnessWeights)
    space: GenomeSpace | None = None
    warm_start: Sequence[Genome] | None = None


def search(
    problem: Problem,
    n_trials: int,
    seed: int = 0,
    settings: SearchSettings | None = None,
    *,
    storage: str | BaseStorage | None = None,
    name: str = "aesi",
    on_candidate: OnCandidate | None = None,
    evaluate_many: EvaluateMany | None = None,
) -> SearchResult:
    """Search until the study holds `n_trials` finished trials; continue what `storage` already holds.

    storage : Optuna's, or the URL of a database; None keeps the study in memory. Of one process at a time; several
    share the evaluation of a study (`evaluate_many`), not the study.
    on_candidate : called with index, genome and outcome as each is evaluated.
    evaluate_many : what evaluates a generation, by the weights of the settings; by default one candidate after the
    other is evaluated here.
    The same seed gives the same candidates, interrupted or not.
    Raises ConfigError for a space of another library. Exceptions of the evaluation are bugs: what the generation has
    finished is stored, and they propagate.
    """
    settings = settings or SearchSettings()
    space = settings.space or GenomeSpace.of(problem.library, problem.options.feedback)
    if space.size != len(problem.library):
        raise ConfigError(f"the genome space has {space.size} terms, the library {len(problem.library)}.")
    starts = space.plain_starts() if settings.warm_start is None else settings.warm_start
    sampler = TermSampler(space, seed, settings.population, starts)
    study = _open(storage, name, sampler)

    def one_by_one(genomes: Sequence[Genome]) -> Iterable[tuple[int, Outcome]]:
        return ((k, evaluate(problem, genome, settings.weights)) for k, genome in enumerate(genomes))

    while (missing := n_trials - len(study.get_trials(deepcopy=False, states=FINISHED))) > 0:
        _generation(
            study,
            sampler,
            min(missing, settings.population),
            evaluate_many or one_by_one,
            settings.constraints,
            on_candidate,
        )
    return SearchResult.of(study, space.size, settings.weights)


def _generation(
    study: Study,
    sampler: TermSampler,
    most: int,
    evaluate_many: EvaluateMany,
    constraints: Constraints,
    on_candidate: OnCandidate | None,
) -> None:
    indices = _next_indices(study, sampler.size, most)
    asked = [(index, sampler.propose(study, index)) for index in indices]
    outcomes: dict[int, Outcome] = {}
    try:
        for position, outcome in evaluate_many([genome for _, genome in asked]):
            outcomes[position] = outcome
            if on_candidate is not None:
                on_candidate(*asked[position], outcome)
    finally:
        # What is known is told even if the rest was interrupted, so that a resumed search keeps it.
        for position, (index, genome) in enumerate(asked):
            if position in outcomes:
                study.add_trial(_finished(sampler, genome, index, outcomes[position], constraints))


def _next_indices(study: Study, population: int, most: int) -> list[int]:
    """The lowest free indices, within one generation so that the next one has all of its parents."""
    trials = study.get_trials(deepcopy=False, states=FINISHED)
    taken = {trial.user_attrs[INDEX] for trial in trials}
    free = [index for index in range(len(trials) + most) if index not in taken][:most]
    return [index for index in free if index // population == free[0] // population]


def _finished(
    sampler: TermSampler, genome: Genome, index: int, outcome: Outcome, constraints: Constraints
) -> FrozenTrial:
    if isinstance(outcome, Failed):
        return sampler.write(genome, index, TrialState.PRUNED, user_attrs={"reason": outcome.reason})
    return sampler.write(
        genome,
        index,
        TrialState.COMPLETE,
        values=list(outcome.losses),
        user_attrs={RECORD: {key: float(getattr(outcome, key)) for key in RECORDED}},
        constraints=constraints.violations(outcome),
    )


def _open(storage: str | BaseStorage | None, name: str, sampler: TermSampler) -> Study:
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna.create_study(
        storage=storage,
        study_name=name,
        sampler=sampler,
        directions=["minimize"] * 3,
        load_if_exists=True,
    )
