"""How a current runs between the rows of a record that does not declare it: as explains the record better."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from aesi.constants import MV_PER_V
from aesi.data.thinning import Averaged
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.records import HOLD_WORDS, OTHER_HOLD, InferredHold
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.decide.verdict import Thresholds, beyond_noise, tolerance_v
from aesi.tracer.likelihood.fit import FittedHypothesis, HypothesisFitter
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.hypothesis_fits import FIT_ROUNDS
from aesi.tracer.search.path import Path
from aesi.tracer.search.plausible import ALIKE_NATS


def inferred_holds(path: Path) -> dict[int, InferredHold]:
    """Number of a record -> the hold that explains it better than the assumed one, for records that declare none. With
    that hold a hypothesis of fewer effects, or else the chosen one, leaves less on the record than the chosen one does
    with the assumed hold and no more than a right hypothesis may, and its cost is lower by `ALIKE_NATS` or more.

    Rows of 1 s whose current was held, taken as straight lines, have been explained by a wrong electrolyte and porosity
    where the contact resistance was wrong. Where neither explains the record, its hold cannot be told from what else
    the model lacks: on a drive of the NMC cell with an offset put in, a held current is likelier by more than that and
    leaves 2.49 instead of 2.60 mV; on the HG2's 1C discharge at -8 degC straight lines leave 2.37 instead of 2.39.
    """
    told = ((k, _better_hold(path, k)) for k in _undeclared(path.problem))
    return {k: better for k, better in told if better is not None}


def _undeclared(problem: InverseProblem) -> Iterator[int]:
    """Numbers of the records whose hold was not declared, and matters.

    Rows that are averages are joined by straight lines whatever the hold. Else the voltages of the declared model with
    the two have to differ by so much that they could be told apart by `ALIKE_NATS`.
    """
    declared = ModelState(problem)
    for k, record in enumerate(problem.records):
        if record.data.hold is not None or isinstance(record.thin, Averaged):
            continue
        held = replace(record, thin_hold=OTHER_HOLD[record.hold])
        try:
            one, other = (declared.simulated(r, k, thin=True).voltage_v[: r.n_fit] for r in (record, held))
        except AesiError:
            continue
        if 0.5 * float(np.sum(((one - other) / record.white_v[: record.n_fit]) ** 2)) >= ALIKE_NATS:
            yield k


def _better_hold(path: Path, k: int) -> InferredHold | None:
    problem, size, chosen = path.problem, path.chosen.score.size, path.chosen
    noise_v, allowed_v = rms(problem.white_v[problem.slices[k]]), tolerance_v(problem, Thresholds())
    taken = problem.records[k].hold
    held = replace(problem.records[k], hold=OTHER_HOLD[taken], thin_hold=OTHER_HOLD[taken])
    otherwise = replace(problem, records=(*problem.records[:k], held, *problem.records[k + 1 :]))

    def refitted(one: InverseProblem, fit: FittedHypothesis) -> tuple[float, float]:
        fitter = HypothesisFitter(one, path.blocks, fit.hypothesis)
        x = fitter.descend(fit.point.x, size, FIT_ROUNDS)
        left_v = fitter.residual(x)
        return fitter.cost(x, size), np.inf if left_v is None else rms(left_v[problem.slices[k]])

    now_cost, now_v = refitted(problem, chosen)
    for one in _no_larger(path):
        cost, left_v = refitted(otherwise, one)
        explains = left_v < now_v and beyond_noise(left_v, noise_v) <= allowed_v
        if explains and cost <= now_cost - ALIKE_NATS:
            reason = (
                f"which explains its fitted rows better ({_model(one)} leaves {MV_PER_V * left_v:.3g} mV RMS of them; "
                f"{_model(chosen)} left {MV_PER_V * now_v:.3g} with the current {HOLD_WORDS[taken]})"
            )
            return InferredHold(held.hold, reason)
    return None


def _model(one: FittedHypothesis) -> str:
    return f"the model with {' + '.join(one.hypothesis)}" if one.hypothesis else "the model without an effect"


def _no_larger(path: Path) -> list[FittedHypothesis]:
    """The hypotheses that were fitted with fewer effects than the chosen one, of equally many the best first, and the
    chosen one last."""
    fits = [one for one in path.explanations() if isinstance(one, FittedHypothesis)]
    fewer = [one for one in fits if len(one.hypothesis) < len(path.chosen.hypothesis)]
    return [*sorted(fewer, key=lambda one: (len(one.hypothesis), -one.score.total)), path.chosen]
