"""Which model is written where nothing explains the data, and why it is not what was named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.trust import MEASURED_CELL
from aesi.tracer.decide.carry_over import FAST_C, ORDINARY_C, LeftOut, left_out_errors, range_fault
from aesi.tracer.decide.in_use import foretold_in_use
from aesi.tracer.decide.verdict import FORETOLD_SHARE, foretold_share
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.model_error import MEASURED_V
from aesi.tracer.likelihood.model_state import ModelState

AS_GOOD = 1.05
"""What was named, or else the declared model, is preferred where its worst ratio is at most this many times the
least one. A convention."""
HARM = "on data left out it is worse than the declared model in a range of charge"
UNTESTED = "these data cannot bear it out, at other states of charge or currents it could be anything"
LESS_ELSEWHERE = "another model leaves less on records left out"


@dataclass(frozen=True, eq=False)
class Option:
    """A model that may be written, what it leaves on records that it has not seen, and whether these data could speak
    against it.

    What was fitted to one record says something of its last third, left out. Where it says nothing of a range of
    charge, as far as models of measured cells are off there, it may be anything beyond the record. On development
    records of `aesi bench real` recalibrations with all open wide foretold 33 to 47 % of the rows, and left 14.4, 201,
    12.2, 137 and 3.9 mV on the last part where others left 12.2, 84.7, 18.4, 63.0 and 3.5; a diffusivity over
    concentration fitted to a 1C discharge 38 %, and left 1,880 mV where the declared model left 287. What was named on
    six others foretold 71 to 84 %, recalibrations within what files are off by 94 % and more. At one current nothing is
    foretold of another: the NMC cell's 1C fitted with own parameters open leaves 51 to 561 mV, 14 as declared.
    """

    state: ModelState
    left_out: LeftOut
    tested: bool = True

    @classmethod
    def of(cls, problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis | None) -> Option:
        """A fit, None for the declared model."""
        if fit is None:
            return cls(ModelState(problem), left_out_errors(problem, blocks, fit))
        return cls(
            ModelState.of(problem, fit),
            left_out_errors(problem, blocks, fit),
            _tested(problem, blocks, fit),
        )


def _tested(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis) -> bool:
    """Whether these data could have spoken against a fit. Several records could, where it foretells something of
    ordinary use. A single record could, as far as its ranges of charge foretell each other; where own parameters are
    open, which are known by how they answer to the current, its ranges of current have to as well."""
    if len(problem.records) > 1:
        return foretold_in_use(problem, blocks, fit, MEASURED_V) >= FORETOLD_SHARE
    conditions = ("charge",) if problem.trust in MEASURED_CELL else ("rate", "charge")
    return all(
        name in blocks.folds and foretold_share(problem, blocks, fit, MEASURED_V, name) >= FORETOLD_SHARE
        for name in conditions
    )


def worst_ratio(one: Option, options: Sequence[Option]) -> float:
    """The largest ratio, over records left out, of what this model leaves of one to what the best model leaves."""
    least = np.min([other.left_out.by_record for other in options], axis=0)
    told = np.isfinite(least)  # where no model runs, none is better than another
    return float(np.max(np.array(one.left_out.by_record)[told] / least[told], initial=0.0))


def carries_best(options: Sequence[Option]) -> Option:
    """The model, of at least one, whose worst ratio is least; the first of several that are as good.

    Such a model is never far worse than another on any record left out. A mean over the records would let a gain on one
    pay for a loss on another.
    """
    return min(options, key=lambda one: worst_ratio(one, options))


def written(
    declared: Option, recalibrated: Sequence[Option], named: Sequence[Option] = ()
) -> tuple[ModelState, str | None]:
    """The model that is written, and why it is not what was named (None where it is, or where nothing was).

    It is the model that carries over best; what was named, or else the declared model, is preferred where that does as
    well. Whatever is written may do harm in no range of charge, and has to run over the declared range.

    recalibrated : models with own parameters open, some of them with effects that stand in for what the cell lacks.
    named : what was named, with the own parameters as declared, then with these open.
    """
    own = [one for one in recalibrated if _fault(one, declared, (*ORDINARY_C, *FAST_C)) is None]
    faults = [_fault(one, declared, ORDINARY_C) for one in named]
    sound = [one for one, fault in zip(named, faults, strict=True) if fault is None]
    preferred = [*sound, declared]
    options = [*preferred, *own]
    best = carries_best(options)
    least = worst_ratio(best, options)
    best = next((one for one in preferred if worst_ratio(one, options) <= AS_GOOD * least), best)
    if not named or any(best is one for one in sound):
        return best.state, None
    names = " + ".join(named[0].state.hypothesis)
    fault = faults[0] if not sound else None
    why = f"{names}: {fault or LESS_ELSEWHERE}"
    return best.state, why if best is declared else f"{why}; {_instead(best, declared)}"


def of_refit(
    declared: Option, recalibrations: Sequence[Option], options: Sequence[Option], taken: ModelState
) -> str | None:
    """Why the recalibration that carries best is not what is written, and what is in its place where that is not the
    declared model; None where it is written, or where nothing speaks against it.

    options : recalibrations that may be written, those among them.
    """
    if not recalibrations:
        return None
    best = carries_best(recalibrations)
    fault = None if best.state is taken else _fault(best, declared, (*ORDINARY_C, *FAST_C))
    if fault is None:
        return None
    why = f"the recalibrated model: {fault}"
    other = next((one for one in options if one.state is taken), None)
    if other is None:
        return why
    left_mv, before_mv = 1e3 * other.left_out.pooled_v, 1e3 * declared.left_out.pooled_v
    return (
        f"{why}; written is another fit of its parameters, which leaves {left_mv:.1f} mV of data left out, the "
        f"declared model {before_mv:.1f}"
    )


def stand_ins(state: ModelState, named: Sequence[str]) -> tuple[str, ...]:
    """A sentence on effects that are written though they are not named."""
    beside = [name for name in state.hypothesis if name not in named]
    if not beside:
        return ()
    return (
        f"the model that is written is recalibrated with {' + '.join(beside)}, which leaves least on records left out; "
        "that the cell lacks this is not shown: it stands in for what no hypothesis explains.",
    )


def limits_of(state: ModelState) -> tuple[str, ...]:
    """Sentences on where a model that is written stops short of the declared one."""
    fast = range_fault(state, FAST_C)
    return () if fast is None else (f"with what was found, {fast}; the declared model does not.",)


def _fault(one: Option, declared: Option, rates_c: Sequence[float]) -> str | None:
    if not one.tested:
        return UNTESTED
    return HARM if one.left_out.harms(declared.left_out) else range_fault(one.state, rates_c)


def _instead(taken: Option, declared: Option) -> str:
    left_mv, before_mv = 1e3 * taken.left_out.pooled_v, 1e3 * declared.left_out.pooled_v
    names = " + ".join(taken.state.hypothesis)
    beside = f" with {names}" if names else ""
    return (
        f"written is the recalibrated model{beside}, which leaves {left_mv:.1f} mV there, the declared one "
        f"{before_mv:.1f}"
    )
