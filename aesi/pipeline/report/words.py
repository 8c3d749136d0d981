"""The finding of a report in plain words, from the numbers alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.numerics.typing import Array
from aesi.pipeline.report.sizes import refit_does_as_well, with_size
from aesi.pipeline.report.views import DiscoveryView, Row, RunView

LARGE_SHARE = 0.5
"""Of the remaining error: where a sparse correction could still explain more, a sentence says so. A convention."""
NEARLY = 0.98
"""A one-step error above this share of persistence's is called no better than it."""
CERTAIN = 0.99
"""A confidence above it is not told to the per cent: the noise model behind it is itself a model."""


def run_finding(view: RunView) -> str:
    """What the correction buys on the test records in free run, and what the one-step figure is worth."""
    model, physics = view.model(view.chosen), view.model(view.physics)
    before, after = (_figure(row, "free_run", "test_rmse_mv") for row in (physics, model))
    reduction = _figure(model, "free_run", "test_mser_pct")
    if before is None or after is None or reduction is None:
        return f"No model of the voltage error could be evaluated in free run on {view.cell}."
    if view.chosen == view.physics:
        return (
            f"No correction of the voltage error was chosen: the {view.physics} alone errs by {before:.1f} "
            "mV RMSE on the test records."
        )
    if reduction <= 0:
        return (
            "The data-driven correction does not help here: in free run on the test records the error "
            f"grows from {before:.1f} mV to {after:.1f} mV. Use the {view.physics} alone."
        )
    return (
        f"On test records that chose nothing, run without any measured voltage, {view.chosen} takes the "
        f"voltage error from {before:.1f} mV to {after:.1f} mV RMSE: {reduction:.1f} % less mean squared "
        f"error than the {view.physics} alone."
    )


def corrected_finding(view: RunView) -> str:
    """What the correction brings beyond the physics that it was learned on, in words; where that is as declared, only
    that a mere refit of its parameters would have done better."""
    corrected, model = view.model(view.corrected), view.model(view.chosen)
    before, after = (_figure(row, "free_run", "test_rmse_mv") for row in (corrected, model))
    if before is None or after is None:
        return ""
    if view.corrected in (view.physics, view.chosen):
        beyond = _figure(model, "free_run", "test_mser_recalibrated_pct")
        if view.corrected == view.chosen or beyond is None or beyond >= 0.0:
            return ""
        refitted = after / np.sqrt(1.0 - beyond / 100.0)
        return (
            f"With its own parameters refitted to the training records and nothing learnt, the {view.physics} errs by "
            f"{refitted:.1f} mV there: recalibrate it first (cell.start: recalibrated)."
        )
    if after < before:
        return f"The {view.corrected} alone errs by {before:.1f} mV there; the correction takes it to {after:.1f} mV."
    return (
        f"The {view.corrected} alone errs by {before:.1f} mV there: the correction does not help beyond it."
    )


def others_finding(view: RunView) -> str:
    """Which other corrections do better on the test records, in words; '' where none does."""
    ours = _figure(view.model(view.chosen), "free_run", "test_rmse_mv")
    physics = (view.physics, view.corrected)
    left = {
        row["name"]: _figure(row, "free_run", "test_rmse_mv")
        for row in view.models
        if row["name"] != view.chosen and row["name"].startswith(tuple(f"{name} + " for name in physics))
    }
    better = {name: error for name, error in left.items() if error is not None and ours and error < ours}
    if not better:
        return ""
    best = min(better, key=lambda name: better[name])
    verb = "errs" if len(better) == 1 else "err"
    return (
        f"{len(better)} of {len(left)} other corrections learnt on the same records {verb} less there, "
        f"{best} least: {better[best]:.1f} mV."
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
    """How much of the test data the model was not trained for, in words."""
    share = _figure(model, "free_run", "outside_pct")
    if not share:
        return ""
    return (
        f"{share:.1f} % of the test samples lie outside the range the correction was trained on; its inputs are "
        "held at the edge there. Its bands in free run are wider there by what it would add if it went on beyond the "
        "edge; no data has calibrated that."
    )


def interval_finding(model: Row) -> str:
    """Coverage against the nominal level, in words."""
    keys = ("nominal_pct", "coverage_pct", "average_width_v", "worst_bin_coverage_pct")
    nominal, coverage, width, worst = (_figure(model, "intervals", key) for key in keys)
    if nominal is None or coverage is None or width is None:
        return ""
    text = (
        f"{nominal:.0f} % intervals one step ahead cover {coverage:.1f} % of the test samples with "
        f"{1e3 * width:.2f} mV average width"
    )
    return text + ("." if worst is None else f"; {worst:.1f} % in the worst (current, SOC) bin.")


def discovery_finding(view: DiscoveryView) -> str:
    """The verdict as one sentence; missing physics, wrong parameters and instrument faults are named as such."""
    verdict, effects = view.discovery["verdict"], view.discovery["effects"]
    if verdict == "none":
        return f"Nothing is missing from the declared model of {view.cell} that these data could show."
    if verdict == "unknown":
        rest = "that no effect of the catalogue explains beyond doubt"
        if not effects:
            return f"The declared model of {view.cell} misses something real {rest}."
        return f"{_named(view, effects)}; and something real is left {rest}."
    sure = name_confidence(view.discovery)
    if refit_does_as_well(view.discovery):
        return (
            f"One of two explanations: {_lowered(_named(view, effects))}{sure}; or the model's own parameters are off, "
            "since a refit of them does as well on data that chose nothing."
        )
    return f"{_named(view, effects)}{sure}."


def name_confidence(discovery: Mapping[str, Any]) -> str:
    """The confidence in the names of a finding, never as certainty; '' where there is no finding."""
    if discovery["verdict"] != "found":
        return ""
    value = discovery["confidence"]
    share = f"over {100 * CERTAIN:.0f} %" if value > CERTAIN else f"{100 * value:.0f} %"
    names = "this name" if len(discovery["effects"]) == 1 else "these names"
    return f" ({share} confidence in {names})"


WITH_FINDING = "with the finding added"
"""Said of the last state where what was found is what is written."""


def states_of(discovery: Mapping[str, Any]) -> dict[str, str]:
    """The states of the model worth showing, in words: the last one where it is more than a refit."""
    shown = {"before": "as declared", "recalibrated": "recalibrated"}
    effects, written = set(discovery["effects"]), set(discovery.get("written", discovery["effects"]))
    if effects or written:
        shown["after"] = WITH_FINDING if written == effects else "as written"
    return shown


def reason_finding(discovery: Mapping[str, Any]) -> str:
    """What the verdict rests on: the error left beyond the noise against what any such model may leave."""
    left, allowed = discovery["structured_mv"], discovery["tolerance_mv"]
    amount = f"{left:.2f} mV of voltage error are left beyond the noise of the sensors"
    if discovery["verdict"] == "none":
        return (
            f"Why: on the data looked at, {amount}. Up to {allowed:.2f} mV are what the noise and the accuracy of any "
            "such model leave open, so these data give no reason to change it."
        )
    if discovery["verdict"] == "found":
        return f"Why: with the finding added {amount}; up to {allowed:.2f} mV count as explained."
    if left > allowed:
        found = "with what was found added, " if discovery["effects"] else ""
        return (
            f"Why: {found}{amount} on the data looked at, and no more than {allowed:.2f} mV would count as explained. "
            "The list of hypotheses says what came nearest, and why it was not accepted; data of another kind (a slow "
            "discharge, pulses with rests, another temperature) would narrow it down."
        )
    return f"Why: {discovery['reason']}."


def span_finding(view: DiscoveryView) -> str:
    """What the data cover, so that nobody reads the verdict as one about more."""
    if not view.traces:
        return ""
    hours = sum(float(t.time_s[-1] - t.time_s[0]) for t in view.traces) / SECONDS_PER_HOUR
    current, soc = (_range(getattr(t, name) for t in view.traces) for name in ("current_a", "soc"))
    return (
        f"The data span {hours:.1f} h, {round(100 * soc[0])} to {round(100 * soc[1])} % state of charge and currents "
        f"from {current[0]:.3g} to {current[1]:.3g} A (discharge positive); nothing is said beyond them."
    )


def _range(columns: Iterable[Array]) -> tuple[float, float]:
    parts = list(columns)
    return min(float(np.nanmin(part)) for part in parts), max(float(np.nanmax(part)) for part in parts)


def _named(view: DiscoveryView, effects: Sequence[str]) -> str:
    """What was found, each kind in its own words."""
    kinds = {row["effect"]: row["kind"] for row in view.discovery["candidates"]}
    groups: dict[str, list[str]] = {}
    for effect in effects:
        name = with_size(effect, view.discovery, _title(view.titles, effect))
        groups.setdefault(kinds.get(effect, "physics"), []).append(name)
    parts = []
    if "physics" in groups:
        parts.append(f"the declared model of {view.cell} lacks {listed(groups['physics'])}")
    if "parameter" in groups:
        names = listed(groups["parameter"])
        subject = f"its {names}" if parts else f"{names} of {view.cell}"
        parts.append(f"{subject} {_verb(groups['parameter'])} not as declared")
    if "instrument" in groups:
        parts.append(f"the data, not the cell, show {listed(groups['instrument'])}")
    text = "; ".join(parts)
    return text[:1].upper() + text[1:]


def _lowered(text: str) -> str:
    return text[:1].lower() + text[1:]


def _verb(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


def discovery_consequence(view: DiscoveryView) -> str:
    """What that brings on data that chose nothing, apart from what any refit brings."""
    values = {
        state: view.discovery.get(state, {}).get("test", {}).get("rmse_mv")
        for state in ("before", "recalibrated", "after")
    }
    if any(value is None for value in values.values()):
        return ""
    after = states_of(view.discovery).get("after")
    if after is None:
        return (
            f"On data that chose nothing the model as declared errs by {values['before']:.1f} mV RMSE, and with its "
            f"own parameters refitted by {values['recalibrated']:.1f} mV; the noise floor is "
            f"{view.discovery['noise_floor_mv']:.1f} mV."
        )
    return (
        f"On data that chose nothing the model as declared errs by {values['before']:.1f} mV RMSE, the "
        f"same model with its own parameters refitted by {values['recalibrated']:.1f} mV, and the model "
        f"{after} by {values['after']:.1f} mV; the noise floor is "
        f"{view.discovery['noise_floor_mv']:.1f} mV."
    )


def look_alike_finding(view: DiscoveryView) -> str:
    """What else fits as well, said next to the verdict."""
    groups = [
        [_title(view.titles, e) for e in group] for group in view.discovery.get("indistinguishable", [])
    ]
    if not groups:
        return ""
    return f"These data cannot tell {'; nor '.join(' from '.join(group) for group in groups)}."


def rest_finding(discovery: Mapping[str, Any]) -> str:
    """What a data-driven correction could still explain."""
    rest, after = discovery["explainable_mv"], discovery.get("after", {}).get("test", {}).get("rmse_mv")
    text = f"A flexible correction learnt on what is left could still explain {rest:.1f} mV"
    if not after:
        return text + "."
    text += f" of {after:.1f} mV: "
    if rest > LARGE_SHARE * after:
        return text + "much structure is left for physics to name."
    if discovery["structured_mv"] > discovery["tolerance_mv"]:
        return (
            text
            + "what is left is more than noise, but follows none of the model's variables in a way that carries "
            "over to unseen data. That points to an instrument, or to a state that the model does not have."
        )
    return text + "little structure is left for physics to name."


def listed(names: Sequence[str]) -> str:
    """`a`, `a and b`, `a, b and c`."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def _figure(row: Row | None, group: str, key: str) -> float | None:
    """A value of a row, None where the row, the group or the value is missing."""
    if row is None:
        return None
    value: float | None = (row.get(group) or {}).get(key)
    return value


def _title(titles: Mapping[str, str], effect: str) -> str:
    return titles.get(effect, effect.replace("_", " "))
