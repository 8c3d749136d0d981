"""Records whose current seems to run otherwise between the rows than it was taken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from aesi.constants import MV_PER_V
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.records import HOLD_WORDS, OTHER_HOLD
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import HOLD_OPTION
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.hypothesis_fits import FIT_ROUNDS
from aesi.tracer.search.path import Path
from aesi.tracer.search.plausible import ALIKE_NATS


def other_hold_warnings(path: Path) -> tuple[str, ...]:
    """A sentence on each record whose hold was not declared, where with the other one a hypothesis of fewer effects,
    or else the chosen one, leaves less than the chosen one and is more probable by `ALIKE_NATS`: the least that tells
    two hypotheses apart.

    Rows of 1 s whose current was held, taken as straight lines, have been explained by a wrong electrolyte and porosity
    where the contact resistance was wrong.
    """
    return tuple(filter(None, (_warning(path, k) for k in _undeclared(path.problem))))


def _undeclared(problem: InverseProblem) -> Iterator[int]:
    """Numbers of the records whose hold was not declared, and matters.

    Rows that are averages are joined by straight lines whatever the hold. Else the voltages of the declared model with
    the two have to differ by so much that they could be told apart by `ALIKE_NATS`.
    """
    declared = ModelState(problem)
    for k, record in enumerate(problem.records):
        if record.data.hold is not None or record.thin.time_s is not record.data.time_s:
            continue
        held = replace(record, thin_hold=OTHER_HOLD[record.hold])
        try:
            one, other = (declared.simulated(r, k, thin=True).voltage_v[: r.n_fit] for r in (record, held))
        except AesiError:
            continue
        if 0.5 * float(np.sum(((one - other) / record.white_v[: record.n_fit]) ** 2)) >= ALIKE_NATS:
            yield k


def _warning(path: Path, k: int) -> str:
    problem, size, chosen = path.problem, path.chosen.score.size, path.chosen
    taken = problem.records[k].hold
    held = replace(problem.records[k], hold=OTHER_HOLD[taken], thin_hold=OTHER_HOLD[taken])
    otherwise = replace(problem, records=(*problem.records[:k], held, *problem.records[k + 1 :]))

    def refitted(one: InverseProblem, fit: FittedHypothesis) -> tuple[float, float]:
        fitter = HypothesisFitter(one, path.blocks, fit.hypothesis)
        x = fitter.descend(fit.point.x, size, FIT_ROUNDS)
        left_v = fitter.residual(x)
        return fitter.cost(x, size), np.inf if left_v is None else MV_PER_V * rms(left_v[problem.slices[k]])

    now_cost, now_mv = refitted(problem, chosen)
    for one in _no_larger(path):
        cost, left_mv = refitted(otherwise, one)
        if cost <= now_cost - ALIKE_NATS and left_mv < now_mv:
            model = " + ".join(one.hypothesis) or "no effect"
            return (
                f"with the current {HOLD_WORDS[held.hold]} the fitted rows of {held.name} are explained better "
                f"({left_mv:.3g} mV RMS are left by {model}, instead of {now_mv:.3g}): the file seems to be written "
                f"so, and the verdict may rest on that alone. Declare it with {HOLD_OPTION.format(held.hold)}, and "
                "search again."
            )
    return ""


def _no_larger(path: Path) -> list[FittedHypothesis]:
    """The hypotheses that were fitted with fewer effects than the chosen one, of equally many the best first, and the
    chosen one last."""
    fits = [one for one in path.explanations() if isinstance(one, FittedHypothesis)]
    fewer = [one for one in fits if len(one.hypothesis) < len(path.chosen.hypothesis)]
    return [*sorted(fewer, key=lambda one: (len(one.hypothesis), -one.score.total)), path.chosen]
