"""A plain evolutionary search by one objective, for baselines and benchmarks of designs, which need no Pareto front."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Protocol, TypeVar

import numpy as np

from aesi.errors import FitError
from aesi.records import Failed
from aesi.sparse.search.genome import Genome
from aesi.sparse.search.genome_space import GenomeSpace


class HasFitness(Protocol):
    """Something with a fitness."""

    @property
    def fitness(self) -> float:
        """The fitness; higher is better."""
        ...


class Evaluated(HasFitness, Protocol):
    """Result of an evaluation: genome and fitness."""

    @property
    def genome(self) -> Genome:
        """The genome that was evaluated."""
        ...


R = TypeVar("R", bound=HasFitness)
T = TypeVar("T", bound=Evaluated)


def ranked(tried: Iterable[R], admitted: Callable[[R], bool]) -> list[R]:
    """The results, fittest first; those that are not `admitted` come last, equally fit ones stay in their order."""
    return sorted(tried, key=lambda result: (not admitted(result), -result.fitness))


def fittest(
    space: GenomeSpace,
    evaluate: Callable[[Genome], T | Failed],
    candidates: int,
    population: int,
    rng: np.random.Generator,
    admitted: Callable[[T], bool] = lambda scored: True,
) -> T:
    """The fittest of `candidates` genomes, bred in generations of `population`, the better half of all as parents.

    The first ones are the plain starts of the space. Those that are not `admitted` rank below all that are.
    Raises FitError where none survives.
    """
    survivors: list[T] = []
    starts = list(space.plain_starts())
    reason = ""
    for first in range(0, candidates, population):
        for _ in range(min(population, candidates - first)):
            outcome = evaluate(starts.pop(0) if starts else _proposal(space, survivors, population, rng))
            if isinstance(outcome, Failed):
                reason = outcome.reason
            else:
                survivors.append(outcome)
        survivors = ranked(survivors, admitted)
    if not survivors:
        raise FitError(f"none of {candidates} candidates survives (the last one: {reason}).")
    return survivors[0]


def _proposal(
    space: GenomeSpace, survivors: Sequence[Evaluated], population: int, rng: np.random.Generator
) -> Genome:
    """A child of two of the fittest, at random; a random genome while there are not two.  survivors : fittest first."""
    parents = survivors[: population // 2]
    if len(parents) < 2:
        return space.random(rng)
    mother, father = rng.choice(len(parents), size=2, replace=False)
    return space.child(parents[mother].genome, parents[father].genome, rng)
