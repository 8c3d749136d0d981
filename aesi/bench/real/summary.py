"""Rates over the cases that ran, each with its interval, and what did not run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from aesi.bench import CaseRow
from aesi.bench.scoring import rate

NEAR_K = 2.0


def summary(rows: Sequence[CaseRow]) -> CaseRow:
    """Rates of all cases that ran; those of the cases that chose nothing stand under `reported`."""
    ran = [r for r in rows if r["verdict"] != "not run"]
    return {
        "summary": True,
        "cases": len(rows),
        "not_run": [r["case"] for r in rows if r["verdict"] == "not run"],
        **_rates(ran),
        "reported": _rates([r for r in ran if not r["development"]]),
        "confusion": _confusion(ran),
    }


def _rates(rows: Sequence[CaseRow]) -> CaseRow:
    def of(group: str) -> list[CaseRow]:
        return [r for r in rows if r["group"] == group]

    withheld = [r for r in of("withheld") if "ambient_temperature" in r["answer"][:1]]
    near = [{"near": r.get("size_off") is not None and r["size_off"] <= NEAR_K} for r in withheld]
    halved = [
        {"halved": _at_most(r, 0.5)} for r in withheld if r.get("after_test_mv") is not None and r["named"]
    ]
    faults = [r for r in of("fault") if r["answer"]]
    sized = [r for r in [*faults, *of("physics")] if r.get("size_error") is not None]
    return {
        "ran": len(rows),
        "no_answer": sum(r["verdict"] in ("error", "out of time") for r in rows),
        **rate(withheld, "named").named("withheld_named"),
        **rate(near, "near").named("withheld_within_2k"),
        **rate(halved, "halved").named("withheld_error_halved"),
        **rate(faults, "named").named("fault_named"),
        **rate(of("physics"), "named").named("physics_named"),
        "size_error_median": _median([r["size_error"] for r in sized]),
        **rate([r for r in sized if r["size_covered"] is not None], "size_covered").named("size_covered"),
        **rate(of("control"), "named").named("control_silent"),
        **rate(of("ageing"), "named").named("ageing_named"),
        **rate([{"worse": not _at_most(r, 1.05)} for r in rows if _errors(r)], "worse").named("after_worse"),
        "processor_s_median": _median([r["processor_s"] for r in rows]),
    }


def _errors(row: CaseRow) -> bool:
    return row.get("after_test_mv") is not None and row.get("recalibrated_test_mv") is not None


def _at_most(row: CaseRow, times: float) -> bool:
    """Whether the error on unseen data is at most so many times the better of declared and recalibrated."""
    better = min(row["before_test_mv"], row["recalibrated_test_mv"])
    if times < 1:
        better = row["before_test_mv"]
    return bool(row["after_test_mv"] <= times * better)


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def _confusion(rows: Sequence[CaseRow]) -> dict[str, dict[str, int]]:
    """Answer -> what was said -> cases."""
    out: dict[str, Counter[str]] = {}
    for row in rows:
        asked = " or ".join(row["answer"]) or "no name"
        said = "+".join(row["effects"]) or row["verdict"]
        out.setdefault(asked, Counter())[said if row["verdict"] != "unknown" else f"unknown: {said}"] += 1
    return {asked: dict(counts) for asked, counts in out.items()}
