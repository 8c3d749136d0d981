"""Ranges of the genes, and the operators of the search: a random genome, and a child of two."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from aesi.sparse.search.genome import Genome, pack
from aesi.sparse.terms.library import Library

Range = tuple[float, float]


@dataclass(frozen=True)
class GenomeSpace:
    """Ranges of the genes; `size` is the number of library terms, `feedback` whether any may hold the error.

    The paper searches lambda1 in 1e-13 to 1e-1. On measured cells at 1 Hz the best ridge is near 10, so the
    upper end is wider here; the paper's range is one argument away.
    """

    size: int
    lambda1: Range = (1e-13, 1e3)
    lambda2: Range = (1e-3, 5.0)
    tau: Range = (0.3, 0.7)
    p_c: tuple[int, int] = (0, 5)
    d: tuple[int, int] = (1, 5)
    feedback: bool = True

    @classmethod
    def of(cls, library: Library, feedback: bool = True) -> GenomeSpace:
        """The widest space of a library: up to its own highest order and degree.  feedback : as `Options.feedback`."""
        return cls(
            len(library),
            p_c=(0, int(library.orders.max())),
            d=(1, max(1, int(library.degrees.max()))),
            feedback=feedback,
        )

    def random(self, rng: np.random.Generator) -> Genome:
        """Genes at random, and a mask of random density: libraries of all sizes take part from the start."""
        return Genome.of(
            rng.random(self.size) < rng.uniform(0.05, 1.0),
            _log_uniform(rng, self.lambda1),
            _log_uniform(rng, self.lambda2),
            float(rng.uniform(*self.tau)),
            int(rng.integers(self.p_c[0], self.p_c[1] + 1)),
            int(rng.integers(self.d[0], self.d[1] + 1)),
            bool(rng.integers(2)) and self.feedback,
        )

    def plain_starts(self) -> tuple[Genome, ...]:
        """The genomes that a user would try first: the whole library under a strong ridge, with and without feedback.

        A search that begins with them never ends below them. Begun at random alone, searches of 100 to 200 candidates
        on a measured cell now and then stayed with a dozen terms and half of the reduction.
        """
        low = int(np.clip(1, *self.p_c)), int(np.clip(2, *self.d))
        extents = sorted({low, (self.p_c[1], self.d[1])})
        ridges = dict.fromkeys(float(np.clip(lambda1, *self.lambda1)) for lambda1 in (1.0, 100.0))
        return tuple(
            Genome.of(
                np.ones(self.size, dtype=bool),
                ridge,
                self.lambda2[0],
                float(np.mean(self.tau)),
                p_c,
                d,
                feedback,
            )
            for ridge in ridges
            for p_c, d in extents
            for feedback in ((False, True) if self.feedback else (False,))
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
            changes["feedback"] = self.feedback and not genome.feedback
        return replace(genome, **changes)


def _log_uniform(rng: np.random.Generator, bounds: Range) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds))))
