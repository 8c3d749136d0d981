"""The report of a run over measured cells: one HTML file that opens without a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from aesi.bench import CaseRow
from aesi.bench.real.figures import confusion_figure, residual_figure, sizes_figure, worst_of
from aesi.pipeline.report.page import write_page

FIGURES: Mapping[str, tuple[str, str]] = {
    "withheld_named_pct": ("withheld temperatures named, %", "90 or more"),
    "withheld_within_2k_pct": ("of all, named and within 2 K of the thermocouple's mean, %", "80 or more"),
    "withheld_course_rms_k_median": ("course of the temperature where it is named, RMS, K, median", ""),
    "withheld_error_halved_pct": ("error on unseen data at most halved by it, %", "100"),
    "warming_named_pct": ("records that warm up: heat or temperature named, %", ""),
    "fault_named_pct": ("faults put in and named, %", "90 or more"),
    "fault_seen_named_pct": ("of faults that stand out of what such models err by, named, %", "90 or more"),
    "beside_named_pct": ("the same and contacts with a good record beside, named, %", "90 or more"),
    "beside_seen_named_pct": ("of those that stand out of what the good ones leave, named, %", "90 or more"),
    "beside_size_error_median": ("error of their size, share, median", "0.10 or less"),
    "beside_size_covered_pct": ("true size within its 90 % interval, %", "85 to 95"),
    "beside_wrong_soc0_silent_pct": ("wrong initial states beside a good record without a name, %", "100"),
    "beside_control_silent_pct": ("records without a fault beside a good one without a name, %", "100"),
    "size_error_median": ("error of their size, share, median", "0.10 or less"),
    "size_covered_pct": ("true size within its 90 % interval, %", "85 to 95"),
    "physics_named_pct": ("contacts and capacities put in and named, %", ""),
    "wrong_soc0_silent_pct": ("wrong initial states without a name, %", "100"),
    "wrong_soc0_error_median": ("of the wrong initial state left, share, median", "0.10 or less"),
    "control_silent_pct": ("controls without a name, %", "100"),
    "control_matched_false_pct": ("controls with the name of a case matched to them, %", "0"),
    "ageing_named_pct": ("aged and fresh cells told apart, %", ""),
    "ageing_within_2pp_pct": ("capacity within 2 percentage points of the measured one, %", "100"),
    "witness_within_15pct_pct": ("resistances within 15 % of the spectra's, %", "100"),
    "witness_ohmic_off_median": ("ohmic resistance off, share, median", "0.15 or less"),
    "witness_transfer_off_median": ("charge transfer off, share, median", "0.15 or less"),
    "after_worse_pct": ("written model more than 5 % worse than declared or recalibrated, %", "0"),
    "processor_s_median": ("processor time a case, s, median", ""),
    "processor_s_total": ("processor time of all, s", ""),
}
"""Key of the summary -> what it is, and what it should be."""


def write_report(path: Path, rows: Sequence[CaseRow], summary: Mapping[str, Any]) -> Path:
    """Write the page; rows as `judged` gives them, with their residuals."""
    sized = [r for r in rows if r.get("size_error") is not None and "size_neutral" in r]
    worst = worst_of(rows)
    figures = {f"worst_{k}": residual_figure(row) for k, row in enumerate(worst)}
    if summary["confusion"]:
        figures["confusion"] = confusion_figure(summary["confusion"])
    if sized:
        figures["sizes"] = sizes_figure(sized)
    return write_page(
        path,
        "real.html",
        figures,
        title="Findings on measured cells",
        rows=sorted(rows, key=lambda row: (row["group"], row["case"])),
        summary=summary,
        lines=_lines(summary),
        worst=[f"worst_{k}" for k in range(len(worst))],
        by_kind=_by_kind(rows),
        witnesses=[r for r in rows if "ohmic_off" in r],
        courses=[r for r in rows if "course_rms_k" in r],
        losses=[r for r in rows if "lost_off_pp" in r],
    )


def _lines(summary: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """What a figure is, of all cases, of those that chose nothing, and its aim; without figures that no case gave."""
    return [
        (words, _told(summary, key), _told(summary["reported"], key), aim)
        for key, (words, aim) in FIGURES.items()
        if summary.get(key) is not None
    ]


def _told(rates: Mapping[str, Any], key: str) -> str:
    """A figure with its 95 % interval and how many cases it is of; '–' where there is none."""
    value = rates.get(key)
    if value is None:
        return "–"
    name = key.removesuffix("_pct")
    cases = rates.get(f"{name}_cases")
    if cases is None:
        return f"{value:.3g}"
    low, high = rates[f"{name}_95_pct"]
    return f"{value:.0f} [{low:.0f}, {high:.0f}] of {cases}"


def _by_kind(rows: Sequence[CaseRow]) -> list[dict[str, Any]]:
    """A row a kind and size of fault: cases by cell, each named or what was said instead."""
    found: dict[str, list[CaseRow]] = {}
    for row in rows:
        if row.get("put_in"):
            found.setdefault(row["put_in"], []).append(row)
    return [
        {"put_in": put_in, "said": [(r["record"].partition("/")[0], r["named"], _said(r)) for r in each]}
        for put_in, each in sorted(found.items())
    ]


def _said(row: CaseRow) -> str:
    effects = " + ".join(row.get("effects") or ())
    return effects or str(row["verdict"])
