"""The model to write where nothing explains the data, and why it is not the one with the named effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from aesi.advice import listed
from aesi.constants import MV_PER_V
from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.trust import MEASURED_CELL
from aesi.tracer.decide.carry_over import FAST_C, ORDINARY_C, LeftOut, left_out_errors, range_fault
from aesi.tracer.decide.prediction_in_use import predicted_share_in_use
from aesi.tracer.decide.verdict import PREDICTED_SHARE, predicted_share
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.model_error import MEASURED_V
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.search.wrong_parameters import beyond_spread

AS_GOOD = 1.05
"""The model with the named effects, or else the declared one, is preferred where its `worst_ratio` is at most this many
times the smallest one. A convention."""
HARM = "its error on left-out data is larger than that of the declared model in a range of charge"
UNTESTED = "these data do not test it, and at other states of charge or currents its error is unknown"
BEYOND_SPREAD = "it needs {} further from the declared value than cell files are usually wrong by"
LESS_ELSEWHERE = "another model has a smaller error on left-out records"


@dataclass(frozen=True, eq=False)
class Option:
    """A model that may be written.

    left_out : its errors on data that it has not seen.  tested : whether these data could contradict it, for a model
    error in V.  beyond_spread : ids of the effects whose declared parameters are further off in it than cell files are.

    Nothing explains the data, so that some fits make up for what is missing by an impossible cell. On the 49
    development records of `aesi bench real` every recalibration within the tight spreads ended with a parameter four
    standard deviations off. While such fits were written, 4 left over 5 % more of the last part than the declared
    model, and 14 than the better of the declared and the recalibrated one; without them 2 and 12.

    A fit is asked with the error of the declared model on left-out data (`usual_error_v`): where it predicts other
    states of charge and currents with more uncertainty it may be worse there, whatever its own error on these data. To
    within 9 mV in place of that error, what was written on development drives of `aesi bench real` without their
    temperature left 61 instead of 53 mV of the last part in the median, and 102 instead of 82 of other drives in the
    same chamber. Where nothing was demanded, a recalibration was up to 49 times as far off as the declared model on
    another drive.
    """

    state: ModelState
    left_out: LeftOut
    tested: Callable[[float], bool] = lambda _: True
    beyond_spread: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis | None) -> Option:
        """The option of a fit; None takes the declared model."""
        left_out = left_out_errors(problem, blocks, fit)
        if fit is None:
            return cls(ModelState(problem), left_out)
        tested = cache(partial(_tested, problem, blocks, fit))
        return cls(ModelState.of(problem, fit), left_out, tested, tuple(beyond_spread(problem, fit, 0.0)))

    @property
    def usual_error_v(self) -> float:
        """V RMS, error of the model on left-out data, at least that of measured cells at 25 degC, which is taken where
        the model cannot be simulated on a left-out record."""
        error_v = self.left_out.pooled_v
        return max(MEASURED_V, error_v) if np.isfinite(error_v) else MEASURED_V


def _tested(problem: InverseProblem, blocks: Blocks, fit: FittedHypothesis, allowed_v: float) -> bool:
    """Whether these data could have contradicted a fit, for a model error of `allowed_v` (V). Several records could
    where the fit predicts enough of ordinary use. A single record could where its ranges of charge predict each other
    and, if own parameters are open, its ranges of current too, since the response to the current determines these
    parameters."""
    if len(problem.records) > 1:
        return predicted_share_in_use(problem, blocks, fit, allowed_v) >= PREDICTED_SHARE
    conditions = ("charge",) if problem.trust in MEASURED_CELL else ("rate", "charge")
    return all(
        name in blocks.folds and predicted_share(problem, blocks, fit, allowed_v, name) >= PREDICTED_SHARE
        for name in conditions
    )


def worst_ratio(one: Option, options: Sequence[Option]) -> float:
    """The largest ratio, over left-out records, of the model's RMS error to that of the best model; 1 where both are
    zero."""
    least = np.min([other.left_out.by_record for other in options], axis=0)
    told = np.isfinite(least)  # a record that no model can run decides nothing
    own, least = np.array(one.left_out.by_record)[told], least[told]
    ratios = np.divide(own, least, out=np.where(own > 0.0, np.inf, 1.0), where=least > 0.0)
    return float(np.max(ratios, initial=0.0))


def carries_best(options: Sequence[Option]) -> Option:
    """The option with the smallest `worst_ratio`; the first of several equal ones.

    options : at least one. The choice is never far worse than another model on any left-out record; a mean over the
    records would let a gain on one pay for a loss on another.
    """
    return min(options, key=lambda one: worst_ratio(one, options))


def model_to_write(
    declared: Option, recalibrated: Sequence[Option], named: Sequence[Option] = ()
) -> tuple[ModelState, str | None]:
    """(model to write, why it is not the one with the named effects; None where it is, or where nothing was named).

    It is the model that carries over best. The model with the named effects, or else the declared one, is preferred
    where it is as good within `AS_GOOD`. The written model must be worse than the declared one in no range of charge,
    and must run over the declared range.

    recalibrated : models with own parameters fitted, some of them with effects that stand in for what the cell lacks.
    named : models with the named effects, own parameters as declared first, then fitted.
    """
    own = [one for one in recalibrated if _refit_fault(one, declared) is None]
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
    return best.state, why if best is declared else f"{why}; {_refit_instead(best, declared)}"


def why_not_refit(
    declared: Option, recalibrations: Sequence[Option], options: Sequence[Option], taken: ModelState
) -> str | None:
    """Why the recalibrated model that carries over best is not written, a clause that also names the refit written in
    its place, if any; None where it is written, or has no fault.

    options : recalibrated models that may be written, `recalibrations` among them.  taken : the written model.
    """
    if not recalibrations:
        return None
    best = carries_best(recalibrations)
    fault = None if best.state is taken else _refit_fault(best, declared)
    if fault is None:
        return None
    why = f"the recalibrated model: {fault}"
    other = next((one for one in options if one.state is taken), None)
    if other is None:
        return why
    return f"{why}; model/ holds another fit of its parameters, {_left_clause(other, declared)}"


def refused_refit(declared: Option, recalibrations: Sequence[Option], taken: Option) -> tuple[str, ...]:
    """A sentence on a recalibrated model that carries over better than the written one with the named effects, `taken`,
    and is not written; empty where there is none."""
    if not recalibrations:
        return ()
    best = carries_best(recalibrations)
    fault = _refit_fault(best, declared) if carries_best((taken, best)) is best else None
    return () if fault is None else (f"the recalibrated model is not written: {fault}.",)


def stand_in_notes(state: ModelState, named: Sequence[str]) -> tuple[str, ...]:
    """A sentence on effects of the written model that the verdict does not name; empty where there is none."""
    beside = [name for name in state.hypothesis if name not in named]
    if not beside:
        return ()
    return (
        f"the written model is recalibrated with {' + '.join(beside)}, since that has the smallest error on left-out "
        "records; this does not show that the cell lacks it: it stands in for an error that no hypothesis explains.",
    )


def fast_load_limits(state: ModelState) -> tuple[str, ...]:
    """Sentences on fast full discharges and charges that the declared model can run and the written one cannot."""
    fast = range_fault(state, FAST_C)
    return () if fast is None else (f"with the finding, {fast}; the declared model does not.",)


def _refit_fault(one: Option, declared: Option) -> str | None:
    """Why a recalibrated model may not be written, a clause; None where it may."""
    return _fault(one, declared, (*ORDINARY_C, *FAST_C))


def _fault(one: Option, declared: Option, rates_c: Sequence[float]) -> str | None:
    if one.beyond_spread:
        return BEYOND_SPREAD.format(listed(one.beyond_spread))
    if not one.tested(declared.usual_error_v):
        return UNTESTED
    return HARM if one.left_out.harms(declared.left_out) else range_fault(one.state, rates_c)


def _refit_instead(taken: Option, declared: Option) -> str:
    names = " + ".join(taken.state.hypothesis)
    beside = f" with {names}" if names else ""
    return f"model/ holds the recalibrated model{beside}, {_left_clause(taken, declared)}"


def _left_clause(taken: Option, declared: Option) -> str:
    left_mv, before_mv = (MV_PER_V * one.left_out.pooled_v for one in (taken, declared))
    return f"whose error on left-out data is {left_mv:.1f} mV ({before_mv:.1f} mV with the declared model)"
