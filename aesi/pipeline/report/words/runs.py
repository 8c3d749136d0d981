"""The finding of an experiment's run in plain words, from the numbers alone."""

from __future__ import annotations

import numpy as np

from aesi.advice import listed
from aesi.constants import MV_PER_V
from aesi.over_time import stamp
from aesi.pipeline.product.trained import ALL_PCT, NONE_PCT, NOWHERE, is_applied_nowhere, trained_sentence
from aesi.pipeline.report.views import Row, RunView
from aesi.records import Role

NEARLY = 0.98
"""A one-step error above this share of persistence's is called no better than it."""
HUNDREDTHS = 2
"""Most decimals of an error in mV, to which it has to be less to be called less."""
TENTH_MV = 0.1
"""Least distance of two errors that are told to a tenth, mV."""


def run_finding(view: RunView) -> str:
    """A sentence on what the correction gains on the test records in free run, on where a mere refit does better,
    on the records on which nothing of the correction is applied, and on the error before a simulation ran out."""
    head = _gain_sentence(view).removesuffix(".")
    return f"{head}{_refit_better(view)}{_not_applied(view)}{_ran_out(view)}."


def _refit_better(view: RunView) -> str:
    """Clause, from '; ' on, that the physics with its own parameters refitted has a lower error than the chosen model;
    '' where it has not, or where the correction was learnt on that physics."""
    ours, refitted = _free_run_mv(view, view.chosen), _refitted_mv(view)
    if ours is None or refitted is None or not _is_less(refitted, ours):
        return ""
    return (
        f"; with its own parameters refitted to the training records, and nothing learnt, the {view.physics} errs less "
        f"there: {_distinct_mv(refitted, ours)[0]} mV"
    )


def _refitted_mv(view: RunView) -> float | None:
    """RMSE of the refitted physics on the test records, mV; None where the correction is learnt on that physics, or
    there is no such figure."""
    if view.corrected not in (view.physics, view.chosen):
        return None
    return _before_mv(view, "test", "mser_recalibrated_pct")


def _physics_mv(view: RunView, name: str, role: Role = "test") -> float | None:
    """RMSE in free run, mV, of the physics as declared or of that on which the correction was learnt. Where that is no
    model of the experiment, it follows from the reduction of the error by the chosen model; None where this is not
    known either."""
    told = _free_run_mv(view, name, role)
    if told is not None:
        return told
    return _before_mv(view, role, "mser_pct" if name == view.physics else "mser_recalibrated_pct")


def _before_mv(view: RunView, role: Role, key: str) -> float | None:
    """RMSE, mV, of the physics that the chosen model takes so much off as its figure `key` says, per cent."""
    model = view.model(view.chosen)
    after, taken = (_figure(model, "free_run", f"{role}_{each}") for each in ("rmse_mv", key))
    if after is None or taken is None or taken >= 100.0:
        return None
    return float(after / np.sqrt(1.0 - taken / 100.0))


def _not_applied(view: RunView) -> str:
    """Clause, from '; ' on, on test records so far outside the trained range that next to nothing of the correction is
    applied, or on a correction that is applied nowhere; '' without either."""
    records = (view.model(view.chosen) or {}).get("test_records") or {}
    if any(map(is_applied_nowhere, records.values())):
        return f"; {NOWHERE}"
    names = [
        name for name, one in records.items() if (kept := one.get("kept_pct")) is not None and kept < NONE_PCT
    ]
    if not names:
        return ""
    return (
        f"; {listed(names)} cannot show what the correction is worth, since none of it is applied so far outside the "
        "range it was trained on: train on records that span the states of charge and temperatures of the test"
    )


def _ran_out(view: RunView) -> str:
    """Clause, from '; ' on, on when a simulation of test records ran empty or full, after which its errors do not show
    how accurate the model is, and on the errors before that; '' where none did."""
    model = view.model(view.chosen) or {}
    records = {
        name: figures["ran_out_s"]
        for name, figures in (model.get("test_records") or {}).items()
        if figures.get("ran_out_s") is not None
    }
    if not records:
        return ""
    where = " and ".join(f"{name} at {stamp(at_s)} s" for name, at_s in records.items())
    text = (
        f"; a simulation runs empty or full on {where}, from where on its error shows only that it ran out, not how "
        "accurate it is"
    )
    left = {
        name: error
        for name in dict.fromkeys((view.physics, view.corrected, view.chosen))
        if (error := _figure(view.model(name), "free_run", "test_until_ran_out_rmse_mv")) is not None
    }
    told = listed([f"{error:.1f} mV by {name}" for name, error in left.items()])
    return f"{text}: before that the error is {told}" if told else text


def _on_test(view: RunView) -> str:
    """Beginning of the headline: that the test records were held out, or which the declared model has seen."""
    which = f"test records, of which the declared model has seen {listed(view.seen)}"
    return f"On {which if view.seen else 'held-out test records'}, in free run, the RMSE"


def _gain_sentence(view: RunView) -> str:
    """A sentence on the error of the chosen model on the test records in free run, beside that of the physics."""
    model = view.model(view.chosen)
    after, reduction = (_figure(model, "free_run", key) for key in ("test_rmse_mv", "test_mser_pct"))
    before, corrected = (_physics_mv(view, name) for name in (view.physics, view.corrected))
    if after is None or reduction is None or before is None:
        return f"No model of the voltage error could be evaluated in free run on {view.cell}."
    if view.chosen in (view.physics, view.corrected):
        declared = (
            "" if view.chosen == view.physics else f", the {view.physics} as declared by {before:.1f} mV"
        )
        return (
            f"No correction of the voltage error was chosen: the {view.chosen} alone errs by {after:.1f} "
            f"mV RMSE on the test records{declared}."
        )
    alone = before if corrected is None or view.corrected == view.physics else corrected
    if not _is_less(alone, after) and not _is_less(after, alone):
        return (
            "The data-driven correction makes no difference here: in free run on the test records the error is "
            f"{after:.{HUNDREDTHS}f} mV with and without it. Use the {view.corrected} alone."
        )
    if corrected is not None and _is_less(corrected, before) and _is_less(corrected, after):
        between, last = _distinct_mv(corrected, after)
        return (
            f"{_on_test(view)} is {between} mV with the {view.corrected} and {before:.1f} mV with the {view.physics} "
            f"as declared. The correction learnt on top of it does not help: {view.chosen} leaves {last} mV."
        )
    first, last = _distinct_mv(before, after)
    if not _is_less(after, before):
        return (
            "The data-driven correction does not help here: in free run on the test records the error grows from "
            f"{first} mV to {last} mV. Use the {view.physics} alone."
        )
    share = own_share(view)
    if share is None or corrected is None or view.corrected == view.physics:
        return (
            f"{_on_test(view)} is {last} mV with {view.chosen} and {first} mV with the {view.physics} alone. The "
            f"correction removes {reduction:.1f} % of its mean squared error."
        )
    between, last = _distinct_mv(corrected, after)
    # Else the correction would be credited with what the recalibration does.
    return (
        f"{_on_test(view)} is {last} mV with {view.chosen}, {between} mV with the {view.corrected} alone and "
        f"{before:.1f} mV with the {view.physics} as declared. The correction removes {share:.1f} % of the mean "
        f"squared error that the {view.corrected} leaves ({reduction:.1f} % of that of the {view.physics} as declared)."
    )


def corrected_mv(view: RunView) -> float | None:
    """RMSE of the physics that the correction was learnt on, in free run on the test records, mV; None where it is not
    known."""
    return _physics_mv(view, view.corrected)


def headline_digits(view: RunView) -> int:
    """Decimals that tell the error of the chosen model, in free run on the test records, mV, from that of the physics
    that it corrects."""
    ours, physics = _free_run_mv(view, view.chosen), corrected_mv(view)
    return 1 if ours is None or physics is None or view.chosen == view.corrected else _digits(ours, physics)


def own_share(view: RunView) -> float | None:
    """By how much the correction lowers the mean squared error of the physics that it was learnt on, in free run on the
    test records, per cent; negative where it raises it. None where there is no correction, or a figure is missing."""
    before, after = corrected_mv(view), _free_run_mv(view, view.chosen)
    if not before or after is None or view.chosen in (view.physics, view.corrected):
        return None
    return 100.0 * (1.0 - (after / before) ** 2)


def refit_finding(view: RunView) -> str:
    """A sentence on what the correction gains beyond a mere refit of the physics, where it was not learnt on that; or
    on what to do where the refit does better."""
    after = _free_run_mv(view, view.chosen)
    beyond = _figure(view.model(view.chosen), "free_run", "test_mser_recalibrated_pct")
    refitted = _refitted_mv(view)
    if view.corrected == view.chosen or after is None or beyond is None or refitted is None:
        return ""
    if beyond < 0.0:  # by how much the refit errs less is in the first sentence
        advice = f"Recalibrate the {view.physics} first (cell.start: recalibrated)."
        return advice if _refit_better(view) else ""
    return (
        f"With its own parameters refitted to the training records and nothing learnt, the {view.physics} errs by "
        f"{_distinct_mv(refitted, after)[0]} mV there: the correction leaves {beyond:.1f} % less mean "
        "squared error than that."
    )


def validation_finding(view: RunView) -> str:
    """A sentence where the physics refitted to the training records does worse than as declared: on these, else on
    the validation records."""
    if (worse := _worse_refitted(view, "train")) is not None:
        first, last = worse
        return (
            f"On the training records themselves the {view.corrected} errs by {last} mV and the {view.physics} by "
            f"{first} mV: its own parameters cannot follow these records. Leave them as declared (cell.start: "
            "declared)."
        )
    if (worse := _worse_refitted(view, "valid")) is None:
        return ""
    first, last = worse
    return (
        f"On the validation records the {view.corrected} errs by {last} mV and the {view.physics} by {first} mV: "
        "what was fitted to the training records does not hold there. Are they of the same cell, at the same "
        "temperature and age?"
    )


def _worse_refitted(view: RunView, role: Role) -> tuple[str, str] | None:
    """The errors of the physics as declared and refitted on the records of a role, mV, where the latter is the larger
    one."""
    declared, refitted = (_physics_mv(view, name, role) for name in (view.physics, view.corrected))
    if declared is None or refitted is None or not _is_less(declared, refitted):
        return None
    return _distinct_mv(declared, refitted)


def constant_finding(view: RunView) -> str:
    """A sentence on what is left of the test records by the mean error of the training records, the least that a
    correction has to beat; '' where it was not asked for, or was chosen."""
    rows = (view.model(f"{physics} + constant") for physics in (view.corrected, view.physics))
    row = next((row for row in rows if row is not None), None)
    error = _figure(row, "free_run", "test_rmse_mv")
    ours = _free_run_mv(view, view.chosen)
    if row is None or row["name"] == view.chosen or error is None or ours is None:
        return ""
    left = _distinct_mv(error, ours)[0]
    return f"The mean error of the training records, added as a constant, gives an RMSE of {left} mV there."


def others_finding(view: RunView) -> str:
    """Which other corrections do better on the test records, in words; '' where none does."""
    ours = _free_run_mv(view, view.chosen)
    physics = (view.physics, view.corrected)
    left = {
        row["name"]: _figure(row, "free_run", "test_rmse_mv")
        for row in view.models
        if row["name"] != view.chosen and row["name"].startswith(tuple(f"{name} + " for name in physics))
    }
    better = {
        name: error for name, error in left.items() if error is not None and ours and _is_less(error, ours)
    }
    if not better or ours is None:
        return ""
    best = min(better, key=lambda name: better[name])
    least = _distinct_mv(better[best], ours)[0]
    if len(left) == 1:
        return f"The other correction learnt on the same records, {best}, has a lower RMSE there: {least} mV."
    has = "has a lower RMSE" if len(better) == 1 else "have a lower RMSE"
    return (
        f"{len(better)} of {len(left)} other corrections learnt on the same records {has} there; the lowest is that of "
        f"{best}, {least} mV."
    )


def persistence_finding(model: Row) -> str:
    """One step ahead against persistence, in words."""
    ours, echo = (_figure(model, "one_step", key) for key in ("test_rmse_mv", "persistence_rmse_mv"))
    if ours is None or echo is None:
        return ""
    verdict = "better than" if ours < NEARLY * echo else "no better than"
    return (
        f"One step ahead, with the measured voltage given, it errs by {ours:.2f} mV, {verdict} repeating "
        f"the last error (persistence, {echo:.2f} mV): one-step figures flatter, the free run is the "
        "figure that counts."
    )


def outside_finding(model: Row) -> str:
    """A sentence on the share of test data outside the training range, and on the share of the correction there."""
    share = _figure(model, "free_run", "outside_pct")
    records = model.get("test_records") or {}
    fading = {name: one for name, one in records.items() if one.get("kept_pct") is not None}
    if fading:
        told = (
            trained_sentence(name, one)
            for name, one in fading.items()
            if one["outside_pct"] or one["kept_pct"] < ALL_PCT
        )
        return " ".join(told)
    if not share:
        return ""
    return (
        f"{share:.1f} % of the test samples lie outside the range the correction was trained on; inputs beyond it "
        "are held at its edge. Its bands in free run are wider by what it would add if it went on beyond the edge; no "
        "data has calibrated that."
    )


def interval_finding(model: Row) -> str:
    """Coverage against the nominal level, in words."""
    keys = ("nominal_pct", "coverage_pct", "average_width_v", "worst_bin_coverage_pct")
    nominal, coverage, width, worst = (_figure(model, "intervals", key) for key in keys)
    if nominal is None or coverage is None or width is None:
        return ""
    text = (
        f"{nominal:g} % intervals one step ahead cover {coverage:.1f} % of the test samples with "
        f"{MV_PER_V * width:.2f} mV average width"
    )
    text += "." if worst is None else f"; {worst:.1f} % in the worst (current, SOC) bin."
    free, wide = (_figure(model, "free_run_intervals", key) for key in ("coverage_pct", "average_width_v"))
    if free is None or wide is None:
        return text
    start = _figure(model, "free_run_intervals", "start_v")
    text += f" The band in free run covers {free:.1f} % of them and is {MV_PER_V * wide:.1f} mV wide"
    if start is None:
        return f"{text}."
    return (
        f"{text}. It includes the uncertainty of the initial state of charge, which is read from a voltage: one "
        f"standard deviation is {MV_PER_V * start:.1f} mV. Give cell.soc0 if it is known."
    )


def _is_less(first: float, other: float) -> bool:
    """Whether an error, mV, is less than another one, as far as `_distinct_mv` shows them."""
    return round(first, HUNDREDTHS) < round(other, HUNDREDTHS)


def _distinct_mv(first: float, other: float) -> tuple[str, str]:
    """Two errors, mV, as text: to a tenth, or to a hundredth where they are less than a tenth apart, since rounding
    alone would make 1.0 and 1.1 of 1.046 and 1.056."""
    digits = _digits(first, other)
    return f"{first:.{digits}f}", f"{other:.{digits}f}"


def _digits(first: float, other: float) -> int:
    """Decimals of two errors that stand side by side, mV."""
    return HUNDREDTHS if abs(first - other) < TENTH_MV or f"{first:.1f}" == f"{other:.1f}" else 1


def _free_run_mv(view: RunView, name: str, role: Role = "test") -> float | None:
    """RMSE of a model in free run, mV; None where it is not known."""
    return _figure(view.model(name), "free_run", f"{role}_rmse_mv")


def _figure(row: Row | None, group: str, key: str) -> float | None:
    """A value of a row, None where the row, the group or the value is missing."""
    if row is None:
        return None
    value: float | None = (row.get(group) or {}).get(key)
    return value
