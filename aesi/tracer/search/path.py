"""What a search leaves: its steps, all that was tried at each, and the hypothesis that was chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from aesi.numerics.metrics import rms
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.likelihood.fit import FittedHypothesis, held_out_residual
from aesi.tracer.likelihood.growth import Explanation, Grown


@dataclass(frozen=True, eq=False)
class Step:
    """One step.

    parents : fitted hypotheses that were grown from, the chosen one first.  grown : what they grew, best first.
    fitted : those of it that were fitted with the whole model, best first.  admitted : one of these, or None.
    admission_nats : what it had to say more of unseen data.
    """

    parents: tuple[FittedHypothesis, ...]
    grown: tuple[Grown, ...]
    fitted: tuple[FittedHypothesis, ...]
    admitted: FittedHypothesis | None
    admission_nats: float = 0.0

    @property
    def best_gain(self) -> float:
        """Nats that the best of what was grown (at least one effect) says more than its parent, admitted or not."""
        return max(g.score.total for g in self.grown) - max(p.score.total for p in self.parents)


@dataclass(frozen=True, eq=False)
class Path:
    """A search that is over: the base without effects, the steps, and the hypothesis that was chosen.

    beyond_reach_v : V beyond noise that all effects together leave, where that is so much that none was fitted.
    """

    problem: InverseProblem
    blocks: Blocks
    base: FittedHypothesis
    steps: tuple[Step, ...]
    chosen: FittedHypothesis
    notes: tuple[str, ...] = ()
    beyond_reach_v: float | None = None

    def explanations(self) -> list[Explanation]:
        """All that was tried, each at its best: fits with the whole model before first-order ones."""
        linear = _best([one for step in self.steps for one in step.grown])
        fits = [one for step in self.steps for one in (*step.parents, *step.fitted) if not one.as_declared]
        return list({**linear, **_best([*fits, self.base])}.values())

    @property
    def admission_nats(self) -> float:
        """Nats that an effect had to gain at the strictest step."""
        return max((step.admission_nats for step in self.steps), default=0.0)

    def gain(self, one: Explanation) -> float:
        """Nats that a hypothesis says more than the base."""
        return one.score.total - self.base.score.total


def _best(tried: Sequence[Explanation]) -> dict[frozenset[str], Explanation]:
    """The hypothesis of each set of effects, in whatever order, that gains most on unseen data."""
    best: dict[frozenset[str], Explanation] = {}
    for one in tried:
        known = best.setdefault(frozenset(one.hypothesis), one)
        if one.score.total > known.score.total:
            best[frozenset(one.hypothesis)] = one
    return best


Report = Callable[[InverseProblem, Explanation, float], None]
"""Called with the problem, each hypothesis and the nats that it gains over its parent."""


def unseen_rmse_v(blocks: Blocks, one: Explanation) -> float:
    """Root mean square of the residual on blocks that were left out, V."""
    return rms(held_out_residual(blocks, one)[blocks.compared])


def excess_mean_square_v2(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis) -> float:
    """V**2, mean square of the residual on blocks that were left out less the noise's, at least nought."""
    return max(unseen_rmse_v(blocks, fit) ** 2 - problem.noise_v**2, 0.0)
