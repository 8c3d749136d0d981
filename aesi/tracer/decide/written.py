"""Which model is written where nothing explains the data, and why it is not what was named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aesi.tracer.case.blocks import Blocks
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.decide.carry_over import FAST_C, ORDINARY_C, LeftOut, left_out_errors, range_fault
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.model_state import ModelState

NO_BETTER = "on data left out it is no better than the declared model, or worse in a range of charge"


@dataclass(frozen=True, eq=False)
class Option:
    """A model that may be written: what it leaves on parts left out, the fit that it is from (None: the declared one),
    and why it cannot be simulated over the declared range, None where it can."""

    state: ModelState
    left_out: LeftOut
    fit: FittedHypothesis | None = None
    fault: str | None = None


def written(
    declared: InverseProblem,
    blocks: Blocks,
    tried: Sequence[tuple[InverseProblem, FittedHypothesis]],
    named: FittedHypothesis | None,
) -> tuple[ModelState, str | None]:
    """Which of the fits leaves least on parts left out, or what was named, with all else as declared, where it leaves
    no more than models of measured cells err by; and why what was named is not what is written.

    It has to run over the declared range and to be worth it, see `LeftOut.may_replace`; else it is the declared model.
    tried : with own parameters alone, and what was named: an effect that nothing speaks for enough is not written.
    """
    as_it_is = Option(ModelState(declared), left_out_errors(declared, blocks, None))
    options = [_option(blocks, as_it_is, problem, fit, fit is named) for problem, fit in dict.fromkeys(tried)]
    best = min(
        [as_it_is, *(one for one in options if one.fault is None)], key=lambda one: one.left_out.pooled_v
    )
    wanted = next((one for one in options if one.fit is named), None)
    if wanted is None:
        return best.state, None
    if wanted.fault is None and wanted.left_out.as_good_as(best.left_out):
        return wanted.state, None
    return best.state, f"{_refusal(wanted)}; {_instead(best, as_it_is)}"


def limits_of(state: ModelState) -> tuple[str, ...]:
    """Where a model that is written stops short of the declared one."""
    fast = range_fault(state, FAST_C)
    return () if fast is None else (f"with what was found, {fast}; the declared model does not.",)


def _option(
    blocks: Blocks, declared: Option, problem: InverseProblem, fit: FittedHypothesis, named: bool
) -> Option:
    state, left_out = ModelState.of(problem, fit), left_out_errors(problem, blocks, fit)
    if not left_out.may_replace(declared.left_out):
        return Option(state, left_out, fit, NO_BETTER)
    return Option(state, left_out, fit, range_fault(state, ORDINARY_C if named else (*ORDINARY_C, *FAST_C)))


def _refusal(named: Option) -> str:
    names = " + ".join(named.state.hypothesis)
    return f"{names}: {named.fault or 'another model leaves far less on parts of the data left out'}"


def _instead(taken: Option, declared: Option) -> str:
    if taken.fit is None:
        return "the declared model stays"
    left_mv, before_mv = 1e3 * taken.left_out.pooled_v, 1e3 * declared.left_out.pooled_v
    return f"written is the recalibrated model, which leaves {left_mv:.1f} mV there, the declared one {before_mv:.1f}"
