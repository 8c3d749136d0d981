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
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.samplers import NSGAIISampler
from optuna.study import Study
from optuna.trial import FrozenTrial, Trial

from aesi.sparse.genome import Genome, pack

TERMS = "terms"
INDEX = "index"
"""The user attributes that hold the mask, and the index of the candidate in the search."""

Range = tuple[float, float]


@dataclass(frozen=True)
class GenomeSpace:
    """Ranges of the genes; `size` is the number of library terms.

    The paper searches lambda1 in 1e-13 to 1e-1. On measured cells at 1 Hz the best ridge is near 10, so the
    upper end is wider here; the paper's range is one argument away.
    """

    size: int
    lambda1: Range = (1e-13, 1e3)
    lambda2: Range = (1e-3, 5.0)
    tau: Range = (0.3, 0.7)
    p_c: tuple[int, int] = (0, 5)
    d: tuple[int, int] = (1, 5)

    def distributions(self) -> dict[str, BaseDistribution]:
        """As Optuna describes them."""
        return {
            "lambda1": FloatDistribution(*self.lambda1, log=True),
            "lambda2": FloatDistribution(*self.lambda2, log=True),
            "tau": FloatDistribution(*self.tau),
            "p_c": IntDistribution(*self.p_c),
            "d": IntDistribution(*self.d),
            "feedback": CategoricalDistribution((False, True)),
        }

    def random(self, rng: np.random.Generator) -> Genome:
        """Genes at random, and a mask of random density: libraries of all sizes take part from the start."""
        return Genome.of(
            rng.random(self.size) < rng.uniform(0.05, 1.0),
            _log_uniform(rng, self.lambda1),
            _log_uniform(rng, self.lambda2),
            float(rng.uniform(*self.tau)),
            int(rng.integers(self.p_c[0], self.p_c[1] + 1)),
            int(rng.integers(self.d[0], self.d[1] + 1)),
            bool(rng.integers(2)),
        )

    def child(self, mother: Genome, father: Genome, rng: np.random.Generator) -> Genome:
        """Each gene and each term from either parent, then mutation."""
        parents = (mother.to_dict(), father.to_dict())
        mixed = Genome(**{gene: parents[rng.integers(2)][gene] for gene in parents[0]})
        masks = mother.mask(self.size), father.mask(self.size)
        mask = np.where(rng.random(self.size) < 0.5, *masks)
        rate = _log_uniform(rng, (1.0 / self.size, 0.2)) if self.size > 5 else 0.2
        mask ^= rng.random(self.size) < rate
        return self._mutated(replace(mixed, terms=pack(mask)), rng)

    def _mutated(self, genome: Genome, rng: np.random.Generator) -> Genome:
        changes: dict[str, Any] = {}
        for gene, bounds in (("lambda1", self.lambda1), ("lambda2", self.lambda2), ("tau", self.tau)):
            if rng.random() < 0.3:
                low, high = np.log(bounds)
                moved = np.log(getattr(genome, gene)) + 0.1 * (high - low) * rng.normal()
                changes[gene] = float(np.clip(np.exp(moved), *bounds))
        for gene, (low, high) in (("p_c", self.p_c), ("d", self.d)):
            if rng.random() < 0.2:
                changes[gene] = int(np.clip(getattr(genome, gene) + rng.choice([-1, 1]), low, high))
        if rng.random() < 0.05:
            changes["feedback"] = not genome.feedback
        return replace(genome, **changes)


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
        trial = study.ask(self._space.distributions())
        trial.set_user_attr(TERMS, self._terms)
        trial.set_user_attr(INDEX, index)
        return trial, Genome(terms=self._terms, **trial.params)

    def infer_relative_search_space(self, study: Study, trial: FrozenTrial) -> dict[str, BaseDistribution]:
        return self._space.distributions()

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


def _log_uniform(rng: np.random.Generator, bounds: Range) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds))))
