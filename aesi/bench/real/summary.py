"""Summary of `aesi bench real`: rates over the cases that ran, in per cent with 95 % intervals, and other figures.

A key that ends in `_named` is the rate of right answers (entry `named` of a row); one that ends in `_silent` is the
same of cases in which no effect may be named.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from aesi.bench import CaseRow
from aesi.bench.detectable import SEEN_NATS
from aesi.bench.limit import NO_ANSWER, NOT_RUN, timed
from aesi.bench.scoring import confusion, median_of, rate
from aesi.tracer.decide.model_to_write import AS_GOOD
from aesi.tracer.report.outcome import STATES

NEAR_K = 2.0
"""Largest error, K, of a temperature that counts as near. A convention."""
NEAR_PP = 2.0
"""Largest error, percentage points, of a capacity loss that counts as near. A convention."""
NEAR_SHARE = 0.15
"""Largest relative error of a resistance that counts as near. A convention."""
HALVED = 0.5
"""Largest error of the written model, over that of the declared one, that counts as halved."""
SOC0 = "wrong_soc0"
"""Kind of fault that is a wrongly given initial state of charge."""


def summary(rows: Sequence[CaseRow]) -> CaseRow:
    """The summary row: the figures over all cases that ran and, under `reported`, over the test cases alone.

    rows : of `judged`.  `not_run` names the cases whose data were not available; they are in no figure.
    """
    ran = [r for r in rows if r["verdict"] != NOT_RUN]
    return {
        "summary": True,
        "cases": len(rows),
        "not_run": [r["case"] for r in rows if r["verdict"] == NOT_RUN],
        **_rates(ran),
        "reported": _rates([r for r in ran if not r["development"]]),
        "confusion": confusion((" or ".join(r["answer"]) or "no name", r) for r in ran),
    }


def _rates(rows: Sequence[CaseRow]) -> CaseRow:
    def of(group: str) -> list[CaseRow]:
        return [r for r in rows if r["group"] == group]

    faults = [r for r in of("fault") if r["answer"]]
    return {
        "ran": len(rows),
        "no_answer": sum(r["verdict"] in NO_ANSWER for r in rows),
        **_withheld([r for r in of("withheld") if "ambient_temperature" in r["answer"][:1]]),
        **rate([r for r in of("withheld") if "self_heating" in r["answer"][:1]], "named").named(
            "warming_named"
        ),
        **rate(faults, "named").named("fault_named"),
        **rate(detectable(faults), "named").named("fault_seen_named"),
        "fault_named_by_kind": _by_kind(faults),
        **rate(of("physics"), "named").named("physics_named"),
        **_sizes([*faults, *of("physics")], ""),
        **_with_good_records(of("fault_beside"), of("control_beside")),
        **_initial_state([r for r in of("fault") if r["put_in"].startswith(SOC0)]),
        **_controls(of("control"), rows),
        **rate(of("ageing"), "named").named("ageing_named"),
        **_near([r for r in of("ageing") if "lost_off_pp" in r], "lost_off_pp", NEAR_PP).named(
            "ageing_within_2pp"
        ),
        **_resistances([r for r in rows if "ohmic_off" in r]),
        **rate([{"worse": _is_worse(r)} for r in rows if _has_errors(r)], "worse").named("after_worse"),
        "processor_s_median": median_of(timed(rows), "processor_s"),
        "processor_s_total": float(sum(r["processor_s"] for r in rows)),
    }


def _withheld(rows: Sequence[CaseRow]) -> CaseRow:
    """Figures of the withheld temperatures.

    A temperature counts as near if its estimate with the named effect is; a case without such an estimate does not. The
    RMS difference over time is that of the written model. Both it and the halved error are over right answers only.
    """
    near = [{"near": "size_found" in r and abs(r["size_found"] - r["size_true"]) <= NEAR_K} for r in rows]
    halved = [{"halved": _is_halved(r)} for r in rows if r["named"] and _has_errors(r)]
    return {
        **rate(rows, "named").named("withheld_named"),
        **rate(near, "near").named("withheld_within_2k"),
        "withheld_course_rms_k_median": median_of([r for r in rows if r["named"]], "course_rms_k"),
        **rate(halved, "halved").named("withheld_error_halved"),
    }


def detectable(rows: Sequence[CaseRow]) -> list[CaseRow]:
    """The cases whose right answer is detectable: it gains more than SEEN_NATS of log likelihood on held-out data."""
    return [r for r in rows if r.get("seen_nats") is not None and r["seen_nats"] > SEEN_NATS]


def _with_good_records(rows: Sequence[CaseRow], controls: Sequence[CaseRow]) -> CaseRow:
    """Figures of the cases with known-good records: of those with a fault or contact resistance (`rows`), and of the
    controls without."""
    faults = [r for r in rows if r["answer"]]
    silent = [r for r in rows if not r["answer"]]
    return {
        **rate(faults, "named").named("beside_named"),
        **rate(detectable(faults), "named").named("beside_seen_named"),
        "beside_named_by_kind": _by_kind(faults),
        **_sizes(faults, "beside_"),
        **rate(silent, "named").named("beside_wrong_soc0_silent"),
        **rate(controls, "named").named("beside_control_silent"),
    }


def _sizes(rows: Sequence[CaseRow], prefix: str) -> CaseRow:
    """Figures of the estimated sizes, over the cases that have one.  prefix : of their keys."""
    sized = [r for r in rows if r.get("size_error") is not None]
    covered = [r for r in sized if r.get("size_covered") is not None]
    return {
        f"{prefix}size_error_median": median_of(sized, "size_error"),
        **rate(covered, "size_covered").named(f"{prefix}size_covered"),
    }


def _initial_state(rows: Sequence[CaseRow]) -> CaseRow:
    return {
        **rate(rows, "named").named("wrong_soc0_silent"),
        "wrong_soc0_error_median": median_of(rows, "size_error"),
    }


def _controls(controls: Sequence[CaseRow], rows: Sequence[CaseRow]) -> CaseRow:
    """Figures of the controls: how often nothing is named, and how often, among those that gave an answer, the right
    answer of a matched case is named although nothing was added to the control."""
    expected: dict[str, set[str]] = {}
    for row in rows:
        if row.get("matched"):
            expected.setdefault(row["matched"], set()).update(row["answer"])
    matched = [
        {"false": bool(expected[r["case"]] & set(r["effects"]))}
        for r in controls
        if r["case"] in expected and r["verdict"] not in NO_ANSWER
    ]
    return {
        **rate(controls, "named").named("control_silent"),
        **rate(matched, "false").named("control_matched_false"),
        "control_false_names": {r["case"]: r["effects"] for r in controls if r["effects"]},
    }


def _resistances(rows: Sequence[CaseRow]) -> CaseRow:
    """Figures of the written model's resistances at half charge and at the temperature of the spectra."""
    both = [{"off": r[key]} for r in rows for key in ("ohmic_off", "transfer_off")]
    return {
        **_near(both, "off", NEAR_SHARE).named("witness_within_15pct"),
        "witness_ohmic_off_median": median_of(rows, "ohmic_off"),
        "witness_transfer_off_median": median_of(rows, "transfer_off"),
    }


def _near(rows: Sequence[CaseRow], key: str, limit: float) -> Any:
    return rate([{"near": r[key] <= limit} for r in rows], "near")


def _by_kind(rows: Sequence[CaseRow]) -> dict[str, str]:
    """Kind and size of an added fault -> 'NAMED of CASES'."""
    out: dict[str, list[bool]] = {}
    for row in rows:
        out.setdefault(row["put_in"], []).append(bool(row["named"]))
    return {put_in: f"{sum(named)} of {len(named)}" for put_in, named in out.items()}


def _has_errors(row: CaseRow) -> bool:
    """Whether all three models could be simulated on the held-out data."""
    return all(row.get(f"{state}_test_mv") is not None for state in STATES)


def _is_halved(row: CaseRow) -> bool:
    """Whether the error of the written model on held-out data is at most half that of the declared one."""
    return bool(row["after_test_mv"] <= HALVED * row["before_test_mv"])


def _is_worse(row: CaseRow) -> bool:
    """Whether the error of the written model on held-out data is notably larger than that of the better of the declared
    and the recalibrated one."""
    better = min(row["before_test_mv"], row["recalibrated_test_mv"])
    return not row["after_test_mv"] <= AS_GOOD * better
