"""The finding of a discovery in plain words, from the numbers alone."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from aesi.advice import listed
from aesi.constants import MV_PER_V, SECONDS_PER_HOUR
from aesi.numerics.typing import Array
from aesi.over_time import range_words
from aesi.pipeline.digits import decimals
from aesi.pipeline.report.views import DiscoveryView, Row
from aesi.pipeline.report.words.sizes import (
    capitalised,
    explain_part,
    finding_line,
    fit_explains,
    refit_does_as_well,
    unexplained_by,
    what_good_records_lack,
    with_size,
)
from aesi.tracer.case.free_parameter import RECORD_OWNERS, STATE_OF_CHARGE
from aesi.tracer.decide.model_to_write import AS_GOOD
from aesi.tracer.decide.verdict import Thresholds, beyond_noise
from aesi.tracer.likelihood.model_error import MEASURED_V
from aesi.tracer.report.outcome import STATES, Part

LARGE_SHARE = 0.5
"""Share of the remaining error from which on a sentence says that a sparse correction could still explain more. A
convention."""
CERTAIN = 0.99
"""A confidence above this is not told to the per cent: the noise model behind it is itself a model."""
ALONE = {"before": "the declared model", "recalibrated": "recalibration alone"}
"""State of the model -> words for it beside what is written."""
WITH_FINDING = "with the finding added"
"""Name of the last state where what was found is what is written."""
UNSEEN = "in cross-validation (each piece of the data predicted by a fit to the others)"
"""Words for the data by which hypotheses are judged: their errors are larger than those of the fit."""
OF_MEASURED = (
    "A measured cell nearly always ends as unknown without a known-good record: models of measured cells have errors "
    f"of some {MV_PER_V * MEASURED_V:.0f} mV. An effect that is named all the same explains only what exceeds these."
)
"""Sentence on a verdict of `unknown`, which measured cells nearly always have."""
OF_ANOTHER_CELL_MV = 50.0
"""Least error of the file of another cell of similar chemistry, only scaled, at 25 degC: 50 to 117 mV (docs/cells.md).
Calibrated files leave 6 to 22 there."""


def discovery_finding(view: DiscoveryView) -> str:
    """The verdict, with missing physics, wrong parameters and instrument faults named as such, and a sentence for each
    objection: a record contradicts its temperature, the test part contradicts the verdict, or the written model errs
    more than another one."""
    return " ".join([_verdict(view), *(f"{capitalised(one)}." for one in _objections(view.discovery))])


def short_finding(discovery: Mapping[str, Any], with_confidence: bool = False) -> str:
    """The verdict in one line, with what speaks against it, for a terminal, a row of a table or a tracked run.

    with_confidence : add the confidence in the names, if the verdict is `found`, in place of the look-alikes.
    """
    behind = (name_confidence(discovery) if with_confidence else "") or _or_look_alikes(discovery)
    return "; ".join([finding_line(discovery) + behind, *_objections(discovery)])


def _or_look_alikes(discovery: Mapping[str, Any]) -> str:
    """Clause that names what the data do not tell from the names; '' where there is nothing."""
    groups = look_alike_names(discovery, {})
    return f" (not told apart: {'; '.join(' or '.join(group) for group in groups)})" if groups else ""


def _objections(discovery: Mapping[str, Any]) -> list[str]:
    """Clauses on what contradicts a verdict or the written model; empty if nothing does."""
    records = discovery.get("other_temperature", ())
    said = (
        f"the voltage of {listed(records)} contradicts {'its' if len(records) == 1 else 'their'} temperature"
        if records
        else "",
        "the test part contradicts it" if discovery.get("contradicted") else "",
        _worse_on_test(discovery) or _worse_on_fit(discovery),
    )
    return [one for one in said if one]


def _worse_on_fit(discovery: Mapping[str, Any]) -> str:
    """Clause for a written model, other than the declared one, that leaves notably more of what it was fitted to
    than the recalibrated one; '' where it does not."""
    left = _left_mv(discovery, "fit")
    if not left.keys() >= {"recalibrated", "after"} or _written_as(discovery) == "before":
        return ""
    worse = left["after"] > AS_GOOD * left["recalibrated"]
    return f"{ALONE['recalibrated']} has a lower error on the fitted part" if worse else ""


def _worse_on_test(discovery: Mapping[str, Any]) -> str:
    """Clause for a written model that leaves more of the test part than the declared or the recalibrated one, with
    the advice not to use it where that is notably more; '' where it does not."""
    left = _left_mv(discovery, "test")
    less = [state for state in ALONE if state in left and left[state] < left.get("after", 0.0)]
    if not less:
        return ""
    has = "has" if len(less) == 1 else "have"
    others = f"{listed([ALONE[state] for state in less])} {has} a lower error on the test part"
    if _written_as(discovery) == "before":
        return f"{others} than the declared model, which model/ holds"
    if left["after"] > AS_GOOD * min(left[state] for state in less):
        return f"do not use the written model: {others}"
    return f"{others} than the written model"


def _left_mv(discovery: Mapping[str, Any], part: str) -> dict[str, float]:
    """State of the model -> RMSE on a part, mV, to the hundredth; without the states that have no figure there."""
    rows = {state: (discovery.get(state) or {}).get(part) or {} for state in STATES}
    return {state: round(row["rmse_mv"], 2) for state, row in rows.items() if row.get("rmse_mv") is not None}


def error_digits(discovery: Mapping[str, Any], part: str) -> int:
    """Decimals of the errors on a part, mV: one, or two where objections tell apart what one would show as equal."""
    left = set(_left_mv(discovery, part).values())
    return 1 if len({f"{error:.1f}" for error in left}) == len(left) else 2


def _verdict(view: DiscoveryView) -> str:
    verdict, effects = view.discovery["verdict"], view.discovery["effects"]
    if verdict == "none":
        nothing = f'nothing that the declared model of "{view.cell}" lacks'
        return f"These data show {what_good_records_lack(view.discovery) or nothing}."
    if verdict == "unknown":
        rest = unexplained_by(view.discovery)
        if not effects:
            return f'The declared model of "{view.cell}" has a systematic error{rest}.'
        names = [with_size(effect, view.discovery, _title(view.titles, effect)) for effect in effects]
        explained = f"{capitalised(listed(names))} {explain_part(names, view.discovery)}."
        return explained if fit_explains(view.discovery) else f"{explained} A systematic error remains{rest}."
    confidence = name_confidence(view.discovery, view.titles)
    if refit_does_as_well(view.discovery):
        return (
            f"One of two explanations: {_decapitalised(_named(view, effects))}{confidence}; or the model's own "
            "parameters are off: recalibrating them gives as low an error on the held-out data."
        )
    return f"{_named(view, effects)}{confidence}."


def _tried(discovery: Mapping[str, Any]) -> bool:
    """Whether any effect was tried."""
    return bool(discovery.get("tried", True))


def name_confidence(discovery: Mapping[str, Any], titles: Mapping[str, str] | None = None) -> str:
    """The confidence in the names of a finding, never as certainty; '' where there is no finding.

    It was measured with look-alikes counted as right: of a group of them it is told of the group.
    """
    if discovery["verdict"] != "found":
        return ""
    value = discovery["confidence"]
    share = f"over {100 * CERTAIN:.0f} %" if value > CERTAIN else f"{100 * value:.0f} %"
    one = len(discovery["effects"]) == 1
    groups = look_alike_names(discovery, titles or {})
    if groups and one:
        return f" ({share} confidence that it is one of: {', '.join(groups[0])})"
    names = "this name" if one else "these names"
    alike = (
        f", or in look-alikes of them: {'; '.join(' or '.join(group) for group in groups)}" if groups else ""
    )
    return f" ({share} confidence in {names}{alike})"


def states_of(discovery: Mapping[str, Any]) -> dict[str, str]:
    """The states of the model worth showing, in words: the last one where it is another than the first two."""
    shown = {"before": "as declared", "recalibrated": "recalibrated"}
    if _written_as(discovery) is None:
        effects, written = set(discovery["effects"]), set(discovery.get("written", discovery["effects"]))
        shown["after"] = WITH_FINDING if effects and written == effects else "as written"
    return shown


def _written_as(discovery: Mapping[str, Any]) -> str | None:
    """The other state that the written model is equal to, erring by the same on every part; None where there is
    none."""
    return next((s for s in ("before", "recalibrated") if discovery.get(s) == discovery.get("after")), None)


def written_finding(discovery: Mapping[str, Any]) -> str:
    """A sentence on which model `model/` holds, and why it is the declared one where it is that."""
    state = _written_as(discovery)
    if state is None and states_of(discovery)["after"] == WITH_FINDING:
        return f"model/ holds the model {WITH_FINDING}."
    if state is None:
        names = listed([_title({}, name) for name in discovery.get("written", discovery["effects"])])
        beside = (
            f" with {names}, in place of an error that no hypothesis explains"
            if names
            else ", by another fit"
        )
        return f"model/ holds a recalibrated model{beside}."
    if state == "recalibrated":
        return _of_records_alone(discovery) or "model/ holds the recalibrated model."
    text = "model/ holds the declared model, unchanged"
    if (why := discovery.get("not_adopted")) is not None:
        return f"{text}. Not adopted: {why}."
    if discovery["verdict"] == "unknown":
        return f"{text}: no fit predicts data that were left out of it well enough to replace it."
    return f"{text}."


def _of_records_alone(discovery: Mapping[str, Any]) -> str:
    """Sentences on `model/` where the recalibration had nothing of the cell to fit, as where one effect alone is tried:
    the starts of the records, in which it differs from the declared model, are in no model.  '' elsewhere."""
    rows = discovery.get("own_parameters", {}).get("recalibrated", [])
    if not rows or not all(row["effect"] in RECORD_OWNERS for row in rows):
        return ""
    starts = [f"{row['parameter']} at {row['value']:.3f}" for row in rows if row["effect"] == STATE_OF_CHARGE]
    where = f" (initial state of charge: {listed(starts)})" if starts else ""
    return (
        f"model/ holds the declared cell: recalibration fitted nothing of it, only what belongs to a record{where}. "
        "Simulated from a start that is read anew, a record is as far off as declared."
    )


def reason_finding(discovery: Mapping[str, Any], titles: Mapping[str, str] | None = None) -> str:
    """A sentence on what the verdict rests on: the error left beyond the noise against what any such model may
    leave."""
    left, allowed = discovery["structured_mv"], discovery["tolerance_mv"]
    amount = f"the voltage error beyond sensor noise is {left:.2f} mV {UNSEEN}"
    if discovery["verdict"] == "none":
        so = (
            "; what the known-good records lack too, the verdict does not tell: leave --good out to ask for that."
            if discovery.get("good")
            else ", so these data give no reason to add to the model."
        )
        return f"Why: {amount}. The noise and the accuracy of any such model account for up to {allowed:.2f} mV{so}"
    if discovery["verdict"] == "found":
        return f"Why: with the finding added, {amount}; up to {allowed:.2f} mV count as explained."
    if left > allowed and not discovery.get("of_another_age"):
        under = (
            "with the finding added, " if discovery["effects"] else _under_unnamed(discovery, titles or {})
        )
        why = f"Why: {under}{amount}; only up to {allowed:.2f} mV would count as explained."
        return f"{why} {OF_MEASURED}" if _tried(discovery) and not discovery.get("good") else why
    return f"Why: {discovery['reason']}."


def _under_unnamed(discovery: Mapping[str, Any], titles: Mapping[str, str]) -> str:
    """Words for the hypothesis that the error of an `unknown` without names is of; '' where no effect was tried."""
    if not _tried(discovery):
        return ""
    # Beside good records the verdict without a name is on the model without an effect, whatever the search chose.
    chosen = [] if discovery.get("good") else discovery["chosen"]
    if not chosen:
        return "with no effect added, "
    names = listed([_title(titles, effect) for effect in chosen])
    return f"with the hypothesis that the search chose ({names}), "


def next_finding(discovery: Mapping[str, Any], titles: Mapping[str, str] | None = None) -> str:
    """Sentences on what came nearest and on what to do next where effects were tried and leave something; '' else."""
    if discovery["verdict"] != "unknown" or not _tried(discovery):
        return ""
    nearest = check = beside = start = ""
    if not discovery["effects"]:
        start = "; start it from the declared file"
        if discovery["candidates"]:
            best = max(discovery["candidates"], key=lambda row: float(row["score"]))
            remark = f" ({best['remark']})" if best.get("remark") else ""
            nearest = f"Best candidate, not named: {hypothesis_title(best, titles or {})}{remark}. "
    if discovery["structured_mv"] >= OF_ANOTHER_CELL_MV:
        check = (
            "check that the cell file is of this cell (those of others are off by "
            f"{OF_ANOTHER_CELL_MV:g} mV and more), and fit it with aesi calibrate; then "
        )
    if not discovery.get("good"):
        beside = (
            ", or a known-good record of the cell (--good), with which the verdict can be 'found' or 'none'"
        )
    return (
        f"{nearest}Next: {check}add data of another kind (a slow discharge, pulses with rests, another temperature) to "
        f"narrow down the cause{beside}. aesi run learns a correction of the remaining error{start}."
    )


def hypothesis_title(row: Row, titles: Mapping[str, str]) -> str:
    """The title of an effect and, in its best hypothesis, of the effects beside it, with which it shares the score."""
    name, *others = (
        _title(titles, effect) for effect in dict.fromkeys((row["effect"], *row.get("hypothesis", ())))
    )
    return f"{name}, beside {' and '.join(others)}" if others else name


def span_finding(view: DiscoveryView) -> str:
    """A sentence on the range of the data, so that nobody reads the verdict as one about more."""
    if not view.traces:
        return ""
    hours = sum(float(t.time_s[-1] - t.time_s[0]) for t in view.traces) / SECONDS_PER_HOUR
    (least, most), soc = (_range(getattr(t, name) for t in view.traces) for name in ("current_a", "soc"))
    digits = decimals(max(abs(least), abs(most)))
    least, most = (
        round(end, digits) + 0.0 for end in (least, most)
    )  # + 0.0: a rounded-away minus says nothing
    percent = range_words(*(f"{round(100 * end)}" for end in soc))
    return (
        f"The data span {hours:.1f} h, {percent} % state of charge and currents of "
        f"{range_words(f'{least:g}', f'{most:g}')} A (discharge positive); the verdict holds only within these ranges."
    )


def _range(columns: Iterable[Array]) -> tuple[float, float]:
    """(least, largest) of all columns, without what is not known (NaN): parts on which no model can be simulated."""
    values = np.concatenate(list(columns))
    return float(np.nanmin(values)), float(np.nanmax(values))


def _named(view: DiscoveryView, effects: Sequence[str]) -> str:
    """The effects that were found, each kind in its own words."""
    kinds = {row["effect"]: row["kind"] for row in view.discovery["candidates"]}
    groups: dict[str, list[str]] = {}
    for effect in effects:
        name = with_size(effect, view.discovery, _title(view.titles, effect))
        groups.setdefault(kinds.get(effect, "physics"), []).append(name)
    parts = []
    if "physics" in groups:
        parts.append(f'the declared model of "{view.cell}" lacks {listed(groups["physics"])}')
    if "parameter" in groups:
        names = listed(groups["parameter"])
        subject = f"its {names}" if parts else f'{names} of "{view.cell}"'
        parts.append(f"{subject} {_verb(groups['parameter'])} not as declared")
    if "instrument" in groups:
        parts.append(f"the data, not the cell, show {listed(groups['instrument'])}")
    return capitalised("; ".join(parts))


def _decapitalised(text: str) -> str:
    return text[:1].lower() + text[1:]


def _verb(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"


def part_words(part: Part, discovery: Mapping[str, Any]) -> str:
    """'on held-out data', or what else a part of the data is; of a test part the records that the declared model was
    fitted to are named."""
    if part == "fit":
        return "on the fitted data"
    seen = discovery.get("seen", ())
    return (
        f"on test data, of which the declared model has seen {listed(seen)}" if seen else "on held-out data"
    )


def discovery_consequence(view: DiscoveryView) -> str:
    """A sentence on what `model/` holds and what each state of the model leaves of data that chose nothing, of those
    that were fitted where there are none; what a finding brings is the step from the refit to it."""
    discovery = view.discovery
    part: Part = "test" if _left_mv(discovery, "test") else "fit"
    where = part_words(part, discovery)
    words = states_of(discovery)
    errors = {state: (discovery.get(state) or {}).get(part, {}).get("rmse_mv") for state in words}
    digits = error_digits(discovery, part)
    told = [f"{error:.{digits}f} mV {words[state]}" for state, error in errors.items() if error is not None]
    holds = written_finding(discovery)
    if not told:
        return holds
    return (
        f"{holds} RMSE {where}: {', '.join(told)}; the noise floor is {discovery['noise_floor_mv']:.2f} mV."
    )


def look_alike_finding(discovery: Mapping[str, Any], titles: Mapping[str, str] | None = None) -> str:
    """A sentence on what else fits as well, beside the verdict."""
    groups = look_alike_names(discovery, titles or {})
    if not groups:
        return ""
    return f"These data cannot tell apart {'; nor '.join(listed(group) for group in groups)}."


def look_alike_names(discovery: Mapping[str, Any], titles: Mapping[str, str]) -> list[list[str]]:
    """The names of each group that the data cannot tell apart; what fits as well only beside others, with these."""
    beside = {row["effect"]: row.get("hypothesis", ()) for row in discovery.get("candidates", ())}
    named = set(discovery["effects"])

    def told(effect: str) -> str:
        others = [_title(titles, one) for one in beside.get(effect, ()) if one not in {effect, *named}]
        return _title(titles, effect) + (f" (beside {listed(others)})" if others else "")

    return [[told(effect) for effect in group] for group in discovery.get("indistinguishable", [])]


def closest_finding(view: DiscoveryView) -> str:
    """A sentence on the hypothesis without the finding that comes closest to it, and on the distance."""
    effects = set(view.discovery["effects"])
    rows = view.discovery["candidates"]
    without = [row for row in rows if not effects <= {row["effect"], *row.get("hypothesis", ())}]
    ours = [row["score"] for row in rows if effects == {row["effect"], *row.get("hypothesis", ())}]
    if not without or not ours:
        return "No other hypothesis explains these data as well."
    closest = max(without, key=lambda row: float(row["score"]))
    names = [
        _title(view.titles, e) for e in dict.fromkeys((closest["effect"], *closest.get("hypothesis", ())))
    ]
    behind = max(ours) - closest["score"]
    if behind <= 0.0:
        return f"{listed(names)} scores {-behind:.1f} nats higher, but was not chosen: see its remark in the table."
    return f"No other hypothesis explains these data as well: {listed(names)} comes closest, {behind:.1f} nats behind."


def rest_finding(discovery: Mapping[str, Any]) -> str:
    """A sentence on the error that the written model leaves of the fitted data: how much of it a correction, learnt
    from it, could still explain, and what that says beside the verdict."""
    rest, left = discovery["explainable_mv"], discovery.get("after", {}).get("fit", {}).get("rmse_mv")
    if rest is None:
        return "How much a flexible correction could still explain is not known: these data are too few to learn one."
    text = f"A flexible correction, learnt from the error of the model in model/, could still explain {rest:.1f} mV"
    if not left:
        return f"{text}."
    text += f" of its {left:.1f} mV on the fitted data: "
    noise, allowed = discovery["noise_floor_mv"], discovery["tolerance_mv"]
    beyond, systematic = beyond_noise(left, noise), rest > LARGE_SHARE * left
    exceeds = beyond > max(allowed, Thresholds().noise_share * noise)
    if discovery["verdict"] == "unknown":
        return text + _rest_of_unknown(systematic, exceeds)
    return text + _rest_of_explained(discovery, systematic, beyond if exceeds else None)


def _rest_of_unknown(systematic: bool, exceeds: bool) -> str:
    """A clause on the error of the written model where nothing to be relied on explains the data.

    systematic : whether a correction could explain most of it.  exceeds : whether it exceeds the noise.
    """
    if systematic:
        return "much of it is systematic, and missing physics may explain it."
    if exceeds:
        return (
            "it exceeds the noise, and functions of the model's variables predict little of it. That points to a fault "
            "of an instrument, or to a state that the model lacks."
        )
    return "little systematic error is left where it was fitted, which does not show that it holds elsewhere."


def _rest_of_explained(discovery: Mapping[str, Any], systematic: bool, beyond: float | None) -> str:
    """The same where the data are explained: what is left of them then is no news, or is not what the verdict is about.

    beyond : error beyond the noise, mV, where that is more than a right model leaves; else None.
    """
    begin = (
        "much of it is systematic"
        if systematic
        else "functions of the model's variables predict little of it"
    )
    if discovery.get("not_adopted"):
        lacks = "the finding" if discovery["effects"] else "the fit"
        return f"{begin}; what explains the data is {lacks}, which model/ does not hold."
    if beyond is not None:
        return (
            f"{begin}; beyond the noise it is {beyond:.2f} mV, more than the {discovery['structured_mv']:.2f} mV in "
            "cross-validation that the verdict rests on."
        )
    if discovery.get("good"):
        return f"{begin}; beside the known-good records up to {discovery['tolerance_mv']:.2f} mV count as explained."
    if systematic:
        return f"{begin}, but no more than the noise and the accuracy of any such model account for."
    return "little systematic error remains for missing physics to explain."


def _title(titles: Mapping[str, str], effect: str) -> str:
    return titles.get(effect, effect.replace("_", " "))
