"""The record of a search: its steps, the hypotheses tried at each, and the hypothesis that was chosen."""

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
    """One step of a search.

    parents : hypotheses that effects were grown on, the one chosen so far first.  grown : the growths, best first.
    fitted : hypotheses among them that were fitted with the whole model, best first.  admitted : one of these, or None.
    admission_nats : gain on unseen data that was needed for admission.
    """

    parents: tuple[FittedHypothesis, ...]
    grown: tuple[Grown, ...]
    fitted: tuple[FittedHypothesis, ...]
    admitted: FittedHypothesis | None
    admission_nats: float = 0.0

    @property
    def best_gain(self) -> float:
        """Largest gain of a growth (there is at least one) over the best parent, nats, admitted or not."""
        return max(g.score.total for g in self.grown) - max(p.score.total for p in self.parents)


@dataclass(frozen=True, eq=False)
class Path:
    """A finished search.

    base : the hypothesis without effects.  chosen : the hypothesis that was chosen.
    search : the search whose choice this one is, refitted at another trust; None for a search itself. Scores at one
    trust do not compare with those at another, and `steps` are those of the search.
    beyond_reach_v : error beyond noise that all effects together leave, V, where that was too large to fit any; else
    None.
    """

    problem: InverseProblem
    blocks: Blocks
    base: FittedHypothesis
    steps: tuple[Step, ...]
    chosen: FittedHypothesis
    notes: tuple[str, ...] = ()
    beyond_reach_v: float | None = None
    search: Path | None = None

    def explanations(self) -> list[Explanation]:
        """Every hypothesis that was tried, once: its best fit with the whole model, else its best growth."""
        linear = _best([one for step in self.steps for one in step.grown])
        fits = [one for step in self.steps for one in (*step.parents, *step.fitted) if not one.as_declared]
        return list({**linear, **_best([*fits, self.base])}.values())

    @property
    def admission_nats(self) -> float:
        """Gain that an effect needed for admission, nats, the largest over the steps."""
        return max((step.admission_nats for step in self.steps), default=0.0)

    def gain(self, one: Explanation) -> float:
        """Gain of a hypothesis over the base on unseen data, nats."""
        return one.score.total - self.base.score.total


def _best(tried: Sequence[Explanation]) -> dict[frozenset[str], Explanation]:
    """Set of effects, in whatever order -> the hypothesis with these that gains most on unseen data."""
    best: dict[frozenset[str], Explanation] = {}
    for one in tried:
        known = best.setdefault(frozenset(one.hypothesis), one)
        if one.score.total > known.score.total:
            best[frozenset(one.hypothesis)] = one
    return best


Report = Callable[[InverseProblem, Explanation, float], None]
"""Called for each hypothesis tried, with the problem, the hypothesis, and its gain in nats over what it was compared
with: the hypothesis chosen before its step or, for one with an effect less, the chosen hypothesis."""


def unseen_rmse_v(blocks: Blocks, one: Explanation) -> float:
    """RMS residual on left-out blocks, V."""
    return rms(held_out_residual(blocks, one)[blocks.compared])


def excess_mean_square_v2(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis) -> float:
    """Mean square of the residual on left-out blocks minus that of the noise, V**2, at least 0."""
    return max(unseen_rmse_v(blocks, fit) ** 2 - problem.noise_v**2, 0.0)
