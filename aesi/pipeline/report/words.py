"""The finding of a report in plain words, from the numbers alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from aesi.pipeline.report.views import DiscoveryView, Row, RunView

SAME_SHARE = 0.98
"""An error after that is not below this share of the recalibrated one is no better than a refit."""
LARGE_SHARE = 0.5
"""An explainable rest above this share of the remaining error is worth a sentence."""


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


def persistence_finding(model: Row) -> str:
    """One step ahead against persistence, in words."""
    ours, echo = (_figure(model, "one_step", key) for key in ("test_rmse_mv", "persistence_rmse_mv"))
    if ours is None or echo is None:
        return ""
    verdict = "better than" if ours < echo else "no better than"
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
        "held at the edge there, and its intervals are not calibrated."
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
    sure = f" ({100 * view.discovery['confidence']:.0f} % confidence)"
    if verdict == "none":
        return f"Nothing is missing from the declared model of {view.cell} that these data could show{sure}."
    if verdict == "unknown":
        rest = "that no effect of the catalogue explains beyond doubt"
        if not effects:
            return f"The declared model of {view.cell} misses something real {rest}{sure}."
        return f"{_named(view, effects)}; and something real is left {rest}{sure}."
    return f"{_named(view, effects)}{sure}."


def _named(view: DiscoveryView, effects: Sequence[str]) -> str:
    """What was found, each kind in its own words."""
    kinds = {row["effect"]: row["kind"] for row in view.discovery["candidates"]}
    groups: dict[str, list[str]] = {}
    for effect in effects:
        groups.setdefault(kinds.get(effect, "physics"), []).append(_title(view.titles, effect))
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
    if not view.discovery["effects"]:
        return (
            f"On data that chose nothing the model as declared errs by {values['before']:.1f} mV RMSE, and with its "
            f"own parameters refitted by {values['recalibrated']:.1f} mV; the noise floor is "
            f"{view.discovery['noise_floor_mv']:.1f} mV."
        )
    text = (
        f"On data that chose nothing the model as declared errs by {values['before']:.1f} mV RMSE, the "
        f"same model with its own parameters refitted by {values['recalibrated']:.1f} mV, and the model "
        f"with the finding added by {values['after']:.1f} mV; the noise floor is "
        f"{view.discovery['noise_floor_mv']:.1f} mV."
    )
    if view.discovery["effects"] and values["after"] > SAME_SHARE * values["recalibrated"]:
        text += " A refit of the model's own parameters does as well here: it can stand in for the finding."
    return text


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
    if after:
        share = "much" if rest > LARGE_SHARE * after else "little"
        text += f" of {after:.1f} mV: {share} structure is left for physics to name"
    return text + "."


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
