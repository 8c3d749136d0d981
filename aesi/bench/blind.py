"""`aesi bench blind`: does the tracer name the effect that a virtual cell lacks, when the label is withheld from it?

PyBaMM simulates the measurements of a cell with known effects; the tracer gets the cell file without these effects. The
benchmark yields one row per case and a summary. The summary has the strict and the lenient rates of right answers with
95 % intervals, by kind of case; the error that is left; the errors of the estimated parameters and the coverage of
their intervals; the stated confidence beside the frequency of right answers; and the confusion matrix. A case that
exceeds its processor time, or that the tracer refuses, counts as a wrong answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from aesi.bench import some_chosen
from aesi.bench.detectable import SEEN_NATS, Detectability, detectability
from aesi.bench.limit import LOST, NO_ANSWER, NO_TIME, NoAnswer, Stopwatch, answer_of, timed
from aesi.bench.scoring import (
    TO_THE_NOISE,
    calibration,
    confusion,
    judge,
    median_of,
    neutral_value,
    rate,
    size_error,
)
from aesi.constants import MV_PER_V
from aesi.data.blind import FULL, BlindCase, CaseSpec, cells_in, generate, label_of, plan, small_plan
from aesi.data.virtual import INSTRUMENT
from aesi.errors import SimulationError
from aesi.physics import Cell
from aesi.pipeline.discovery.discover import discovery_content
from aesi.tracer import discover
from aesi.tracer.report.outcome import STATES
from aesi.tracer.search.plausible import ALIKE_NATS

LIMIT_S = 180.0
"""Limit of the processor time of one case, s. A case that takes longer counts as not answered. A convention."""


def chosen(
    cases: int | None = None,
    only: str | None = None,
    small: bool = False,
    seed: int = 0,
    every: int = 1,
    after: int = 0,
) -> Sequence[CaseSpec]:
    """The selected cases of the plan of a seed.

    cases : number of cases, counted from the first; None selects all.  only : a kind of case, or a substring of the
    recipe's name.  small : take the small plan, which serves tests.  seed : of the plan.  every : take each n-th case.
    after : number of first cases that are skipped because they may have been looked at.
    The options apply in the order only, every, after, cases.  Raises InputError if no case is selected.
    """
    specs = small_plan(seed) if small else plan(seed, FULL)
    found = [s for s in specs if only is None or only in (s.kind, *s.recipes) or only in "+".join(s.recipes)]
    kinds, recipes = (s.kind for s in specs), sorted(name for s in specs for name in s.recipes)
    return some_chosen("blind", found[::every][after:][:cases], (*kinds, *recipes))


def judged(spec: CaseSpec, cells: str, limit_s: float | None = LIMIT_S) -> dict[str, Any]:
    """Generate one case, run the tracer on it and return its row.

    cells : folder of the declared cell files.  limit_s : limit of the tracer's processor time, s; None sets no limit. A
    case that takes longer counts as wrong. A case that the laboratory cannot simulate has the verdict NOT_MADE.
    """
    spent = Stopwatch()
    try:
        case = generate(spec, cells_in(Path(cells)))
    except SimulationError as error:
        return {**_planned(spec), "verdict": NOT_MADE, "error": str(error), **spent.row}
    return _judged(case, limit_s)


def lost(spec: CaseSpec) -> dict[str, Any]:
    """The row of a case whose process the operating system ended. It counts as wrong; its detectability is unknown."""
    told = {"label": label_of(spec), "unexplained_mv": None, **asdict(Detectability())}
    return _planned(spec) | told | LOST.row | MISSED | NO_TIME


NOT_MADE = "not made"
"""Verdict of a case that the laboratory cannot simulate as planned, for example because the voltage reaches a limit.
The summary counts these cases (`not_made`), but no rate includes them."""


def _planned(spec: CaseSpec) -> dict[str, Any]:
    return {
        "case": spec.name,
        "kind": spec.kind,
        "cell": spec.cell,
        "model": spec.model,
        "records": "+".join(spec.records),
        "spread": spec.spread,
        "warmth": spec.warmth,
        "soc0_given": spec.soc0_given,
        "dt_s": spec.dt_s,
        "target_mv": spec.target_mv,
    }


def _judged(case: BlindCase, limit_s: float | None) -> dict[str, Any]:
    spent = Stopwatch()
    row = _planned(case.spec) | {"label": case.label, "unexplained_mv": case.truth["rms_mv"]}
    content = answer_of(lambda: _content(case), limit_s)
    row |= content.row | MISSED if isinstance(content, NoAnswer) else _scored(case, content)
    other = row["effects"] if row["verdict"] not in NO_ANSWER and not row["exact"] else None
    return row | spent.row | asdict(detectability(case, other))


def _content(case: BlindCase) -> dict[str, Any]:
    declared = Cell.from_bpx(case.declared)
    return discovery_content(discover(declared, case.measurements, soc0=case.soc0))


MISSED: dict[str, Any] = {
    "effects": [],
    "exact": False,
    "grouped": False,
    "right": False,
    "all_named": False,
    "false_name": False,
    "fitted": False,
}
"""Scores of a case that gave no answer."""


def _scored(case: BlindCase, content: Mapping[str, Any]) -> dict[str, Any]:
    kept = ("verdict", "effects", "indistinguishable", "confidence", "margin", "noise_floor_mv")
    row = {key: content[key] for key in kept}
    for state in STATES:
        row[f"{state}_test_mv"] = content[state]["test"].get("rmse_mv")
    judgement = judge(case.label, case.also, case.neutral, content)
    noise_mv = MV_PER_V * INSTRUMENT.voltage_noise_v
    after_mv = row["after_test_mv"]
    after_over_noise = None if after_mv is None else after_mv / noise_mv
    errors, covered = _parameters(case, content)
    return row | {
        "exact": judgement.exact,
        "grouped": judgement.grouped,
        "right": judgement.lenient,
        "all_named": bool(case.effects) and judgement.named == 1.0,
        "false_name": bool(judgement.false_names),
        "false_names": list(judgement.false_names),
        "after_over_noise": after_over_noise,
        "contradicted": content["contradicted"],
        "fitted": judgement.named == 1.0
        and after_over_noise is not None
        and after_over_noise <= TO_THE_NOISE,
        "size_error": max(errors) if errors else None,
        "parameters_covered": covered,
    }


def _parameters(case: BlindCase, content: Mapping[str, Any]) -> tuple[list[float], list[bool]]:
    """`size_error` of the named effects' parameters, and whether the 90 % interval of each contains the true value.

    Only parameters are compared whose true value is known (`Recipe.as_named`) and is not that without an effect. A
    parameter without an interval counts as not covered.
    """
    errors, covered = [], []
    for candidate in content["candidates"]:
        if candidate["effect"] not in content["effects"]:
            continue
        for name, estimate in candidate["parameters"].items():
            truth = case.truth.get(f"{candidate['effect']}.{name}")
            if truth is None or estimate.get("value") is None:
                continue
            neutral = neutral_value(candidate["effect"], name)
            if truth != neutral:
                errors.append(size_error(estimate["value"], truth, neutral))
                interval = estimate.get("low"), estimate.get("high")
                covered.append(None not in interval and bool(interval[0] <= truth <= interval[1]))
    return errors, covered


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The summary row: strict and lenient rates in per cent with 95 % intervals, medians, the calibration of the
    confidence, and the confusion matrix.

    Keys that begin with `seen` are of the cases with effects that the data can tell (`SEEN_NATS`); `stranger` means a
    case whose effect is in no catalogue. `seen_missed_alike` is the share of wrong answers among the former that say as
    much of held-out data as the label. `after_over_noise_median` is the error on held-out data over the noise.
    """
    planned, rows = rows, [r for r in rows if r["verdict"] != NOT_MADE]
    effect = [r for r in rows if r["label"] not in ("none", "unknown")]
    nothing = [r for r in rows if r["label"] == "none"]
    stranger = [r for r in rows if r["label"] == "unknown"]
    several = [r for r in effect if r["kind"] == "pair"]
    fitted = [{**r, "called_found": r["verdict"] == "found"} for r in effect if r["fitted"]]
    named = [r for r in effect if r["grouped"]]
    seen = [r for r in effect if r["seen_nats"] is not None and r["seen_nats"] > SEEN_NATS]
    compared = [r for r in seen if not r["exact"] and r.get("ahead_nats") is not None]
    missed = [{"alike": r["ahead_nats"] < ALIKE_NATS} for r in compared]
    answered = _answered(rows)
    unknown = [r for r in answered if r["verdict"] == "unknown" and r["label"] not in ("none", "unknown")]
    claimed = [r for r in answered if r["verdict"] in ("found", "none")]
    covered = [{"covered": one} for r in named for one in r["parameters_covered"]]
    return {
        "summary": True,
        "cases": len(rows),
        "not_made": len(planned) - len(rows),
        "no_answer": len(rows) - len(answered),
        **rate(rows, "exact").named("exact"),
        **rate(rows, "grouped").named("grouped"),
        **rate(rows, "right").named("lenient"),
        **rate(effect, "exact").named("effect_exact"),
        **rate(effect, "grouped").named("effect_grouped"),
        **rate(effect, "right").named("effect_lenient"),
        "effects_to_be_seen": len(seen),
        **rate(seen, "exact").named("seen_exact"),
        **rate(seen, "grouped").named("seen_grouped"),
        **rate(missed, "alike").named("seen_missed_alike"),
        **rate(several, "all_named").named("pair_both_named"),
        **rate(nothing, "right").named("none_lenient"),
        **rate(_answered(nothing), "false_name").named("none_false_name"),
        **rate(stranger, "right").named("stranger_unknown"),
        **rate(_answered(stranger), "false_name").named("stranger_false_name"),
        **rate(_answered(effect), "false_name").named("effect_false_name"),
        **rate(unknown, "false_name").named("false_name_beside_unknown"),
        **rate(fitted, "called_found").named("fitted_called_found"),
        **rate([r for r in claimed if r["exact"]], "contradicted").named("exact_contradicted"),
        **rate([r for r in claimed if not r["exact"]], "contradicted").named("wrong_contradicted"),
        "after_over_noise_median": median_of(named, "after_over_noise"),
        "size_error_median": median_of(named, "size_error"),
        **rate(covered, "covered").named("parameters_covered"),
        "calibration": calibration(answered),
        "processor_s_median": median_of(timed(rows), "processor_s"),
        "processor_s_most": max((r["processor_s"] for r in timed(rows)), default=None),
        "confusion": confusion((row["label"], row) for row in rows),
    }


def _answered(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows with an answer. Rates of false names are over these: of the other rows it is unknown which effects the
    tracer would have named."""
    return [r for r in rows if r["verdict"] not in NO_ANSWER]


def table(rows: Sequence[dict[str, Any]]) -> list[str]:
    """Lines of Markdown: a table with one line per case, in a block that the reader can open.

    Columns: `missing effect` is the label and `RMS` its change of the noise-free voltage; `nats` is the gain in log
    likelihood of held-out data under the label (`seen_nats`); `held-out error / noise` is the RMS error of the written
    model on held-out data over the sensor noise; `contradicted` marks verdicts `found` or `none` that leave a larger
    error there than a right explanation may.
    """
    lines = [
        '??? note "Each case"',
        "",
        "    | cell | truth | records | missing effect | RMS, mV | nats | answer | exact | in a group "
        "| held-out error / noise | contradicted |",
        "    |---|---|---|---|---:|---:|---|---|---|---:|---|",
    ]
    for row in (row for row in rows if row["verdict"] != NOT_MADE):
        nats, left = row["seen_nats"], row.get("after_over_noise")
        cells = [
            row["cell"],
            row["model"],
            row["records"],
            row["label"].replace("+", ", "),
            "" if row["unexplained_mv"] is None else f"{row['unexplained_mv']:.1f}",
            "" if nats is None else f"{nats:.1f}",
            row["verdict"] + (f": {', '.join(row['effects'])}" if row["effects"] else ""),
            "yes" if row["exact"] else "no",
            "yes" if row["grouped"] else "no",
            "" if left is None else f"{left:.2f}",
            "yes" if row.get("contradicted") else "",
        ]
        lines.append(f"    | {' | '.join(cells)} |")
    return lines
