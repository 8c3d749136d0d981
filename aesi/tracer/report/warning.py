"""Warnings where the test part, to which nothing was fitted, contradicts the verdict or the written model. They change
neither."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from aesi.advice import listed
from aesi.constants import MV_PER_V
from aesi.numerics.metrics import rms
from aesi.over_time import stamp
from aesi.tracer.decide.model_to_write import AS_GOOD
from aesi.tracer.decide.verdict import Verdict, beyond_noise
from aesi.tracer.report.outcome import NAMES, FileOutcome, State

OTHERS: tuple[State, ...] = ("before", "recalibrated")


def contradicted_by_v(files: Sequence[FileOutcome], verdict: Verdict) -> float | None:
    """Error of an explanation on the test part, V RMS beyond the noise, where it exceeds what a right one may leave;
    else None. Errors within the uncertainty of a test record's initial state do not count."""
    tests = [f for f in _tests(files) if "after" not in f.unsimulated]
    if verdict.word == "unknown" or not tests:
        return None
    noise_v = np.repeat([f.noise_v for f in tests], [len(f.time_s) for f in tests])
    left_v = rms(np.concatenate([f.beyond_start_v() for f in tests]))
    over_v = beyond_noise(left_v, rms(noise_v))
    return over_v if over_v > verdict.tolerance_v else None


def warnings(
    files: Sequence[FileOutcome],
    verdict: Verdict,
    rest_a: float = 0.0,
    explained: Sequence[FileOutcome] | None = None,
) -> tuple[str, ...]:
    """Sentences where the test part contradicts a verdict that explains the data; where the written model is worse than
    another one, on the test part or on the fitted rows; where a model cannot be simulated; and where the test part has
    no load.

    rest_a : current below which the cell rests, A.  explained : outcomes with the model that the verdict is about in
    place of the written one, where that is another; None where it is the same.
    """
    told = [f for f in files if not f.unsimulated]
    said = (
        *_of_unsimulated(files),
        _of_contradiction(files if explained is None else explained, verdict),
        _of_worse_on_tests(_tests(told), bool(verdict.effects)),
        _of_worse_on_fitted([f for f in told if f.part == "fit"]),
        _of_rest(_tests(files), rest_a),
    )
    return tuple(sentence for sentence in said if sentence is not None)


def _of_unsimulated(files: Sequence[FileOutcome]) -> Iterator[str]:
    """A sentence for each part of a file, and each reason why models cannot be simulated on it."""
    for f in files:
        models: dict[str, list[str]] = {}
        for state, why in f.unsimulated.items():
            models.setdefault(why, []).append(NAMES[state])
        for why, names in models.items():
            part = "the test part" if f.part == "test" else "the fitted part"
            have, each = ("has no figure", "it") if len(names) == 1 else ("have no figures", "they")
            yield f"{listed(names)} {have} on {part} of {f.name}, where {each} cannot be simulated: {why}"


def _of_contradiction(files: Sequence[FileOutcome], verdict: Verdict) -> str | None:
    over_v = contradicted_by_v(files, verdict)
    if over_v is None:
        return None
    said = "the finding" if verdict.effects else "that nothing is missing"
    return (
        f"the test part contradicts {said}: the error there is {MV_PER_V * over_v:.2f} mV beyond the noise, and a "
        f"right model leaves at most {MV_PER_V * verdict.tolerance_v:.2f} mV. {_advice(files)}"
    )


def _of_worse_on_tests(tests: Sequence[FileOutcome], named: bool) -> str | None:
    """A sentence on the models that are better than the written one on the test part; None where there is none.

    named : whether the verdict names an effect.
    """
    after_mv = _left_mv(tests, "after")
    less = _less_than(tests, after_mv)
    if not less:
        return None
    same = next((state for state in OTHERS if _same(tests, state)), None)
    model = "the finding added" if named else NAMES["after"]
    if same is not None:
        model = f"{NAMES[same]}, which model/ holds,"
    harms = same != "before" and after_mv > AS_GOOD * min(less.values())
    advice = ": do not use the model in model/ on such data." if harms else "."
    return f"the RMSE on the test part is {after_mv:.2f} mV with {model} {_others(less)}{advice}"


def _of_worse_on_fitted(fitted: Sequence[FileOutcome]) -> str | None:
    after_mv = _left_mv(fitted, "after")
    less = _less_than(fitted, after_mv)
    if less.get(NAMES["recalibrated"], after_mv) * AS_GOOD >= after_mv:
        less.pop(NAMES["recalibrated"], None)
    if not less or _same(fitted, "before"):
        return None
    return (
        f"the RMSE on the fitted part, of the rows as measured, is {after_mv:.2f} mV with {NAMES['after']} "
        f"{_others(less)}."
    )


def _others(less: Mapping[str, float]) -> str:
    """Clause with the models of smaller errors, RMS mV: 'and 8.00 mV with the declared model'."""
    return " ".join(f"and {left_mv:.2f} mV with {words}" for words, left_mv in less.items())


def _of_rest(tests: Sequence[FileOutcome], rest_a: float) -> str | None:
    if not tests or max(float(np.max(np.abs(f.current_a))) for f in tests) >= rest_a:
        return None
    return (
        "the cell rests throughout the test part, which does not test the model under load: hold out more "
        "(--holdout), or give a test record (--test)."
    )


def _advice(files: Sequence[FileOutcome]) -> str:
    """What to look at first where the test part contradicts a verdict."""
    ran_out = [
        f"{f.name} at {stamp(f.emptied_s['after'])} s" for f in _tests(files) if "after" in f.emptied_s
    ]
    if ran_out:
        where = ", ".join(ran_out)
        return f"The model runs empty or full on {where}: check capacity (soh), soc0 and temperature first."
    if all(f.at_its_temperature for f in files if f.part == "fit"):
        without = [f.name for f in _tests(files) if not f.at_its_temperature]
        if without:
            # The finding holds at the measured temperatures; under load a cell is kelvins warmer than declared.
            return (
                f"The fitted records were simulated at their measured temperatures, and {listed(without)} at that of "
                "the cell's file: give its own first (a column temperature_degc)."
            )
    return "Another effect is missing, or a further one: search again with the test part among the data (--data)."


def _tests(files: Sequence[FileOutcome]) -> list[FileOutcome]:
    return [f for f in files if f.part == "test"]


def _same(tests: Sequence[FileOutcome], state: State) -> bool:
    """Whether the written model is the one of `state`."""
    return all(np.array_equal(f.voltages["after"], f.voltages[state]) for f in tests)


def _less_than(files: Sequence[FileOutcome], after_mv: float) -> dict[str, float]:
    """Model in words -> RMS error, mV, for the models with a smaller error than the written one."""
    return {NAMES[state]: left_mv for state in OTHERS if (left_mv := _left_mv(files, state)) < after_mv}


def _left_mv(files: Sequence[FileOutcome], state: State) -> float:
    """RMS error of a model, mV, rounded to the hundredth that is shown; 0 where there are no rows."""
    if not files:
        return 0.0
    return round(MV_PER_V * rms(np.concatenate([f.residual_v(state) for f in files])), 2)
