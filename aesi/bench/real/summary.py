"""Rates over the cases that ran, each with its interval, and what did not run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from aesi.bench import CaseRow
from aesi.bench.detectable import SEEN_NATS
from aesi.bench.limit import NO_ANSWER, NOT_RUN
from aesi.bench.scoring import rate
from aesi.tracer.decide.written import AS_GOOD

NEAR_K = 2.0
"""A temperature, a share of capacity in percentage points, or a share of the right value, that counts as near;
conventions."""
NEAR_PP = 2.0
NEAR_SHARE = 0.15
HALVED = 0.5
"""Share of the declared error that counts as halved."""
SOC0 = "wrong_soc0"


def summary(rows: Sequence[CaseRow]) -> CaseRow:
    """Rates of all cases that ran; those of the cases that chose nothing stand under `reported`."""
    ran = [r for r in rows if r["verdict"] != NOT_RUN]
    return {
        "summary": True,
        "cases": len(rows),
        "not_run": [r["case"] for r in rows if r["verdict"] == NOT_RUN],
        **_rates(ran),
        "reported": _rates([r for r in ran if not r["development"]]),
        "confusion": _confusion(ran),
    }


def _rates(rows: Sequence[CaseRow]) -> CaseRow:
    def of(group: str) -> list[CaseRow]:
        return [r for r in rows if r["group"] == group]

    faults = [r for r in of("fault") if r["answer"]]
    sized = [r for r in [*faults, *of("physics")] if r.get("size_error") is not None]
    return {
        "ran": len(rows),
        "no_answer": sum(r["verdict"] in NO_ANSWER for r in rows),
        **_withheld([r for r in of("withheld") if "ambient_temperature" in r["answer"][:1]]),
        **rate([r for r in of("withheld") if "self_heating" in r["answer"][:1]], "named").named(
            "warming_named"
        ),
        **rate(faults, "named").named("fault_named"),
        **rate(_seen(faults), "named").named("fault_seen_named"),
        "fault_named_by_kind": _by_kind(faults),
        **rate(of("physics"), "named").named("physics_named"),
        "size_error_median": _median(sized, "size_error"),
        **rate([r for r in sized if r.get("size_covered") is not None], "size_covered").named("size_covered"),
        **_beside(of("fault_beside"), of("control_beside")),
        **_initial_state([r for r in of("fault") if r["put_in"].startswith(SOC0)]),
        **_controls(of("control"), rows),
        **rate(of("ageing"), "named").named("ageing_named"),
        **_near([r for r in of("ageing") if "lost_off_pp" in r], "lost_off_pp", NEAR_PP).named(
            "ageing_within_2pp"
        ),
        **_witnesses([r for r in rows if "ohmic_off" in r]),
        **rate([{"worse": not _at_most(r, AS_GOOD)} for r in rows if _errors(r)], "worse").named(
            "after_worse"
        ),
        "processor_s_median": _median(rows, "processor_s"),
        "processor_s_total": float(sum(r["processor_s"] for r in rows)),
    }


def _withheld(rows: Sequence[CaseRow]) -> CaseRow:
    """The size counts that stands beside the name; the course is that of the written model, whatever is named."""
    near = [{"near": "size_found" in r and abs(r["size_found"] - r["size_true"]) <= NEAR_K} for r in rows]
    halved = [{"halved": _at_most(r, HALVED)} for r in rows if r["named"] and _errors(r)]
    return {
        **rate(rows, "named").named("withheld_named"),
        **rate(near, "near").named("withheld_within_2k"),
        "withheld_course_rms_k_median": _median([r for r in rows if r["named"]], "course_rms_k"),
        **rate(halved, "halved").named("withheld_error_halved"),
    }


def _seen(rows: Sequence[CaseRow]) -> list[CaseRow]:
    """Of which the right name says enough of unseen data to be admitted."""
    return [r for r in rows if r.get("seen_nats") is not None and r["seen_nats"] > SEEN_NATS]


def _beside(rows: Sequence[CaseRow], controls: Sequence[CaseRow]) -> CaseRow:
    """Of faults and contacts with good records of the cell beside them, and of records without a fault."""
    faults = [r for r in rows if r["answer"]]
    sized = [r for r in faults if r.get("size_error") is not None]
    silent = [r for r in rows if not r["answer"]]
    return {
        **rate(faults, "named").named("beside_named"),
        **rate(_seen(faults), "named").named("beside_seen_named"),
        "beside_named_by_kind": _by_kind(faults),
        "beside_size_error_median": _median(sized, "size_error"),
        **rate([r for r in sized if r.get("size_covered") is not None], "size_covered").named(
            "beside_size_covered"
        ),
        **rate(silent, "named").named("beside_wrong_soc0_silent"),
        **rate(controls, "named").named("beside_control_silent"),
    }


def _initial_state(rows: Sequence[CaseRow]) -> CaseRow:
    return {
        **rate(rows, "named").named("wrong_soc0_silent"),
        "wrong_soc0_error_median": _median(rows, "size_error"),
    }


def _controls(controls: Sequence[CaseRow], rows: Sequence[CaseRow]) -> CaseRow:
    """Silence of the controls, and how often one shows a name that a case matched to it has as its answer, of
    those that gave an answer."""
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


def _witnesses(rows: Sequence[CaseRow]) -> CaseRow:
    """Of the found model's resistances at half charge, at the temperature of the spectra."""
    both = [{"off": r[key]} for r in rows for key in ("ohmic_off", "transfer_off")]
    return {
        **_near(both, "off", NEAR_SHARE).named("witness_within_15pct"),
        "witness_ohmic_off_median": _median(rows, "ohmic_off"),
        "witness_transfer_off_median": _median(rows, "transfer_off"),
    }


def _near(rows: Sequence[CaseRow], key: str, limit: float) -> Any:
    return rate([{"near": r[key] <= limit} for r in rows], "near")


def _by_kind(rows: Sequence[CaseRow]) -> dict[str, str]:
    """Kind of fault and its size as put in -> 'named of cases'."""
    out: dict[str, list[bool]] = {}
    for row in rows:
        out.setdefault(row["put_in"], []).append(bool(row["named"]))
    return {put_in: f"{sum(named)} of {len(named)}" for put_in, named in out.items()}


def _errors(row: CaseRow) -> bool:
    return all(row.get(f"{state}_test_mv") is not None for state in ("before", "recalibrated", "after"))


def _at_most(row: CaseRow, times: float) -> bool:
    """Whether the error on unseen data is at most so many times that of the declared model, or, for a factor above one,
    that of the better of declared and recalibrated."""
    better = row["before_test_mv"]
    if times > 1:
        better = min(better, row["recalibrated_test_mv"])
    return bool(row["after_test_mv"] <= times * better)


def _median(rows: Sequence[Mapping[str, Any]], key: str) -> float | None:
    values = [row[key] for row in rows if row.get(key) is not None]
    return float(np.median(values)) if values else None


def _confusion(rows: Sequence[CaseRow]) -> dict[str, dict[str, int]]:
    """Answer -> what was said -> cases."""
    out: dict[str, Counter[str]] = {}
    for row in rows:
        asked = " or ".join(row["answer"]) or "no name"
        names = "+".join(row["effects"])
        said = f"unknown: {names}" if names and row["verdict"] == "unknown" else names or row["verdict"]
        out.setdefault(asked, Counter())[said] += 1
    return {asked: dict(counts) for asked, counts in out.items()}
