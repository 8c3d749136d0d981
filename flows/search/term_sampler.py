"""NSGA-II over genomes whose term mask is no Optuna parameter.

One Optuna parameter a term costs 40 ms a trial in memory and 2.2 s on SQLite at 626 terms, before any work,
and mutating whole words of bits loses the single term. Here Optuna keeps six parameters (lambda1, lambda2,
tau, p_c, d, feedback), visible to its dashboard, and the mask travels as one user attribute of the trial,
packed in hexadecimal. Optuna does what it is good at (ranking under constraints, crowding, generations,
storage); crossover and mutation of the mask are ten lines of numpy. A trial is written once, when it is
finished, instead of attribute by attribute. `aesi bench search` measures what this costs beside it.

Every candidate has an index in the search, stored with its trial. Random numbers come from (seed, index): a
search is the same whether it was interrupted or not, and never draws the same point again.
The generation is the index over the population size, so pruned trials count, and a generation can be asked
for as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.samplers import NSGAIISampler
from optuna.study import Study
from optuna.trial import FrozenTrial, TrialState, create_trial

from aesi.sparse.search.genome import Genome
from aesi.sparse.search.genome_space import GenomeSpace

TERMS = "terms"
INDEX = "index"
"""The user attributes that hold the mask, and the index of the candidate in the search."""


def distributions(space: GenomeSpace, genome: Genome) -> dict[str, BaseDistribution]:
    """The genes that are Optuna parameters, over ranges that hold this genome: a warm start may be from outside of the
    space, and Optuna refuses it otherwise."""
    result: dict[str, BaseDistribution] = {
        "lambda1": FloatDistribution(*space.lambda1, log=True),
        "lambda2": FloatDistribution(*space.lambda2, log=True),
        "tau": FloatDistribution(*space.tau),
        "p_c": IntDistribution(*space.p_c),
        "d": IntDistribution(*space.d),
        "feedback": CategoricalDistribution((False, True)),
    }
    for name, distribution in result.items():
        value = getattr(genome, name)
        if isinstance(distribution, FloatDistribution | IntDistribution):
            distribution.low = min(distribution.low, value)
            distribution.high = max(distribution.high, value)
    return result


class TermSampler(NSGAIISampler):
    """NSGA-II that knows how to cross masks. `warm_start` genomes are the first candidates."""

    def __init__(
        self, space: GenomeSpace, seed: int, population_size: int, warm_start: Sequence[Genome]
    ) -> None:
        super().__init__(population_size=population_size, seed=seed)
        self.size = population_size
        self._space = space
        self._seed = seed
        self._warm_start = tuple(warm_start)

    def propose(self, study: Study, index: int) -> Genome:
        """The genome of the candidate with this index, given the generations before its own."""
        if index < len(self._warm_start):
            return self._warm_start[index]
        rng = np.random.default_rng([self._seed, index])
        parents = self.get_parent_population(study, index // self.size)
        if not parents:
            return self._space.random(rng)
        parents = _by_index(parents)
        return self._space.child(_tournament(parents, rng), _tournament(parents, rng), rng)

    def get_population(self, study: Study, generation: int) -> list[FrozenTrial]:
        """The evaluated trials of a generation, read afresh: Optuna's own cache is only emptied by `ask`."""
        evaluated = study.get_trials(deepcopy=False, states=[TrialState.COMPLETE])
        return [trial for trial in evaluated if trial.user_attrs[INDEX] // self.size == generation]

    def select_parent(self, study: Study, generation: int) -> list[FrozenTrial]:
        """The elite of a generation and its parents, which breaks ties by the order in which it meets them."""
        earlier = self.get_population(study, generation - 1)
        return self._elite_population_selection_strategy(
            study, _by_index([*earlier, *self.get_parent_population(study, generation - 1)])
        )

    def write(self, genome: Genome, index: int, state: TrialState, **contents: Any) -> FrozenTrial:
        """A trial that carries the genome, for `Study.add_trial`: a single write to the storage."""
        chosen = distributions(self._space, genome)
        noted = contents.pop("user_attrs", {})
        return create_trial(
            state=state,
            params={name: getattr(genome, name) for name in chosen},
            distributions=chosen,
            user_attrs={TERMS: genome.terms, INDEX: index, **noted},
            system_attrs={self._get_generation_key(): index // self.size},
            **contents,
        )


def _by_index(trials: Sequence[FrozenTrial]) -> list[FrozenTrial]:
    """One order for all: Optuna hands parents out ranked the first time, and as stored from then on."""
    return sorted(trials, key=lambda trial: trial.user_attrs[INDEX])


def genome_of(trial: FrozenTrial) -> Genome:
    """The genome of a stored trial."""
    return Genome(terms=trial.user_attrs[TERMS], **trial.params)


def violation(trial: FrozenTrial) -> float:
    """Sum of the violated constraints; 0 for a feasible trial."""
    return sum(max(0.0, value) for value in trial.constraints.values())


def _tournament(parents: Sequence[FrozenTrial], rng: np.random.Generator) -> Genome:
    one, other = (parents[i] for i in rng.integers(len(parents), size=2))
    return genome_of(other if _beats(other, one) else one)


def _beats(a: FrozenTrial, b: FrozenTrial) -> bool:
    if violation(a) != violation(b):
        return violation(a) < violation(b)
    pairs = list(zip(a.values, b.values, strict=True))
    return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)
