"""Can the effects of a labelled case be seen at all? What no finder with this likelihood could name is told apart.

A case asks for a change of the voltage of some size, but initial state of charge and own parameters may take most of
it up, and on a measured cell the errors that models of such cells have. What the hypothesis with all effects of the
label says of unseen data more than the best one that lacks one of them is what there is to be seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from aesi.data.blind import BlindCase
from aesi.errors import AesiError
from aesi.physics import Cell
from aesi.physics.simulation import ModelName
from aesi.records import Measurement
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.reduction import with_fine_numerics
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.fitted import fitted_hypothesis

SEEN_NATS = 5.0
"""What an effect has to say to be admitted: 3.8 to 5.4 nats on 14 development cases of `aesi bench blind`, by
surrogates."""


def seen_nats(case: BlindCase) -> float | None:
    """Nats that the label says more of unseen data than the best hypothesis without one of its effects; None for a case
    without effects, or one that the tracer refuses or the model cannot simulate."""
    if not case.effects:
        return None
    try:
        return _said_more(label_problem(case), case.effects, Archive(None, ""))
    except AesiError:
        return None


def label_problem(case: BlindCase) -> InverseProblem:
    """What the label is fitted to: the case with the model that made it."""
    model: ModelName = "dfn" if case.spec.model == "DFN" else "espm"
    return with_fine_numerics(
        inverse_problem(Cell.from_bpx(case.declared), case.measurements, case.soc0, model=model)
    )


def seen_on_measured(
    declared: Cell,
    data: Measurement,
    soc0: float | None,
    answers: Sequence[str],
    good: Sequence[Measurement] = (),
    holdout: float = 0.3,
) -> float | None:
    """Nats that the best of several right answers says more of unseen data than the declared model, where a model of a
    measured cell errs as such models do; None where there is no right name, where none of them can be simulated, or
    where the tracer refuses the records.

    good : records of the cell that are known to be good.  holdout : last share of the data that is kept back.
    """
    try:
        problem = inverse_problem(declared, [data], soc0, holdout, good=good)
        problem = replace(problem, trust="beside" if good else "measured")
        archive = Archive(None, "")  # of all answers: what they are held against is fitted once
        said = [_said_more(problem, (name,), archive) for name in answers]
    except AesiError:
        return None
    return max((nats for nats in said if nats is not None), default=None)


def _said_more(problem: InverseProblem, effects: tuple[str, ...], archive: Archive) -> float | None:
    """Than the best hypothesis that lacks one of the effects, nats."""
    blocks = blocks_of(problem)

    def fit(hypothesis: tuple[str, ...]) -> FittedHypothesis | None:
        return fitted_hypothesis(problem, blocks, hypothesis, None, archive)

    whole = fit(effects)
    if whole is None:
        return None
    rests = [fit(tuple(e for e in effects if e != name)) for name in effects]
    return whole.score.total - max((r.score.total for r in rests if r is not None), default=-float("inf"))
