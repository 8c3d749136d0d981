"""NSGA-II over genomes whose term mask is no Optuna parameter.

One Optuna parameter a term costs 40 ms a trial in memory and 2.2 s on SQLite at 626 terms, before any work,
and mutating whole words of bits loses the single term. Here Optuna keeps six parameters (lambda1, lambda2,
tau, p_c, d, feedback), visible to its dashboard, and the mask travels as one user attribute of the trial,
packed in hexadecimal. Optuna does what it is good at (ranking under constraints, crowding, generations,
storage); crossover and mutation of the mask are ten lines of numpy. `overhead` in tests/flows measures it.

Every candidate has an index in the search, stored with its trial. Random numbers come from (seed, index): a
search is the same whether it was interrupted or not, and workers that share a study draw different points.
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
from optuna.trial import FrozenTrial, Trial

from aesi.sparse.genome import Genome
from aesi.sparse.genome_space import GenomeSpace

__all__ = ["GenomeSpace", "TermSampler", "distributions", "genome_of", "violation"]

TERMS = "terms"
INDEX = "index"
"""The user attributes that hold the mask, and the index of the candidate in the search."""


def distributions(space: GenomeSpace) -> dict[str, BaseDistribution]:
    """The genes that are Optuna parameters."""
    return {
        "lambda1": FloatDistribution(*space.lambda1, log=True),
        "lambda2": FloatDistribution(*space.lambda2, log=True),
        "tau": FloatDistribution(*space.tau),
        "p_c": IntDistribution(*space.p_c),
        "d": IntDistribution(*space.d),
        "feedback": CategoricalDistribution((False, True)),
    }


class TermSampler(NSGAIISampler):
    """NSGA-II that knows how to cross masks. `warm_start` genomes are the first trials."""

    def __init__(
        self, space: GenomeSpace, seed: int, population_size: int = 20, warm_start: Sequence[Genome] = ()
    ) -> None:
        super().__init__(population_size=population_size, seed=seed)
        self.size = population_size
        self._space = space
        self._seed = seed
        self._warm_start = tuple(warm_start)
        self._index = 0
        self._terms = ""

    def ask(self, study: Study, index: int) -> tuple[Trial, Genome]:
        """The trial of the candidate with this index, and its genome."""
        self._index = index
        trial = study.ask(distributions(self._space))
        trial.set_user_attr(TERMS, self._terms)
        trial.set_user_attr(INDEX, index)
        return trial, Genome(terms=self._terms, **trial.params)

    def infer_relative_search_space(self, study: Study, trial: FrozenTrial) -> dict[str, BaseDistribution]:
        return distributions(self._space)

    def get_trial_generation(self, study: Study, trial: FrozenTrial) -> int:
        generation = self._index // self.size
        study._storage.set_trial_system_attr(trial._trial_id, self._get_generation_key(), generation)
        return generation

    def sample_relative(
        self, study: Study, trial: FrozenTrial, search_space: dict[str, BaseDistribution]
    ) -> dict[str, Any]:
        rng = np.random.default_rng([self._seed, self._index])
        parents = self.get_parent_population(study, self.get_trial_generation(study, trial))
        if self._index < len(self._warm_start):
            genome = self._warm_start[self._index]
        elif parents:
            genome = self._space.child(_tournament(parents, rng), _tournament(parents, rng), rng)
        else:
            genome = self._space.random(rng)
        self._terms = genome.terms
        return {name: getattr(genome, name) for name in search_space}


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
