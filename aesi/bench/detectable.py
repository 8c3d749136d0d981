"""Detectability of the effects of a labelled case: can any search with the tracer's likelihood find them?

The effects of a case change the voltage. A fit of the initial state of charge and of the cell's own parameters can
absorb most of this change, and on a measured cell so can the model error. The detectability is the log likelihood of
held-out data under all effects of the label minus that under the best hypothesis that lacks one of them, in nats.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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
from aesi.tracer.search.hypothesis_fits import fitted_hypothesis

SEEN_NATS = 5.0
"""Gain in log likelihood, nats, above which an effect counts as detectable. It is about the gain that the tracer
requires to admit an effect, which surrogates give as 3.8 to 5.4 nats on 14 development cases of `aesi bench blind`."""


@dataclass(frozen=True)
class Detectability:
    """What held-out data say of the label of a case, in nats of log likelihood; None where that is not known.

    seen_nats : under the label, minus that under the best hypothesis without one of its effects.  ahead_nats : under
    the label, minus that under another answer. Where this is small or negative, no search that judges by these data can
    prefer the label.
    """

    seen_nats: float | None = None
    ahead_nats: float | None = None


def detectability(case: BlindCase, answer: Sequence[str] | None = None) -> Detectability:
    """The detectability of a blind case. Nothing is known of a case without effects, of one that the tracer refuses,
    and of one that the model cannot simulate.

    answer : effects that were named in place of the label; None where there is no other answer.
    """
    if not case.effects:
        return Detectability()
    try:
        fit = _fits(label_problem(case))
        seen, label = _said_more(fit, case.effects), fit(case.effects)
        named = None if answer is None else fit(tuple(answer))
    except AesiError:
        return Detectability()
    if named is None or label is None:
        return Detectability(seen)
    return Detectability(seen, label.score.total - named.score.total)


def label_problem(case: BlindCase) -> InverseProblem:
    """The inverse problem in which the label is fitted. Its cell model is of the kind that generated the case (`dfn` or
    `espm`), so that the order reduction of the model is no part of the error."""
    model: ModelName = "dfn" if case.spec.model == "DFN" else "espm"
    return with_fine_numerics(
        inverse_problem(Cell.from_bpx(case.declared), case.measurements, case.soc0, model=model)
    )


def seen_on_measured(
    declared: Cell,
    data: Measurement,
    soc0: float | None,
    answers: Sequence[str],
    good: Sequence[Measurement],
    holdout: float,
) -> float | None:
    """Detectability of the answer on a measured record, nats: the log likelihood of held-out data under the best of the
    right answers minus that under the declared model, with the model error of measured cells.

    declared : the cell as its file declares it.  soc0 : state of charge at the first row; None if unknown.
    answers : effects, each of which is a right answer.  good : known-good records of the cell.
    holdout : last share of the data that is held out, 0 to 1.
    None if there is no right answer, if none of them can be simulated, or if the tracer refuses the records.
    """
    try:
        problem = inverse_problem(declared, [data], soc0, holdout, good=good)
        problem = replace(problem, trust="beside" if good else "measured")
        fit = _fits(problem)
        said = [_said_more(fit, (name,)) for name in answers]
    except AesiError:
        return None
    return max((nats for nats in said if nats is not None), default=None)


Fits = Callable[[tuple[str, ...]], FittedHypothesis | None]
"""Effects -> their fit to the records of a problem; None if the model cannot be simulated with them."""


def _fits(problem: InverseProblem) -> Fits:
    """Fits to one problem, each of them made once."""
    blocks, archive = blocks_of(problem), Archive(None, "")
    return lambda effects: fitted_hypothesis(problem, blocks, effects, None, archive)


def _said_more(fit: Fits, effects: tuple[str, ...]) -> float | None:
    """Log likelihood of held-out data under the effects minus that under the best hypothesis that lacks one of them,
    nats; None if the effects cannot be simulated, or none of these hypotheses can."""
    whole = fit(effects)
    fits = (fit(tuple(e for e in effects if e != name)) for name in effects)
    rests = [rest.score.total for rest in fits if rest is not None]
    return whole.score.total - max(rests) if whole is not None and rests else None
