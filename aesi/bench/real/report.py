"""Report of a run of `aesi bench real`: one HTML file that opens without a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from aesi.bench import CaseRow
from aesi.bench.real.figures import case_figure, confusion_figure, sizes_figure, worst_of
from aesi.bench.scoring import answer_words
from aesi.pipeline.report.page import write_page

FIGURES: Mapping[str, tuple[str, str]] = {
    "withheld_named_pct": ("withheld temperatures that were named, %", "90 or more"),
    "withheld_within_2k_pct": (
        "withheld temperatures estimated within 2 K of the thermocouple's mean, %",
        "80 or more",
    ),
    "withheld_course_rms_k_median": ("named temperatures: model minus thermocouple, RMS, K, median", ""),
    "withheld_error_halved_pct": ("named temperatures: error on held-out data at least halved, %", "100"),
    "warming_named_pct": ("records that warm up: self-heating or temperature named, %", ""),
    "fault_named_pct": ("added faults that were named, %", "90 or more"),
    "fault_seen_named_pct": ("detectable faults (above the model error) that were named, %", "90 or more"),
    "beside_named_pct": ("faults and contact resistances beside a known-good record, named, %", "90 or more"),
    "beside_seen_named_pct": ("the detectable ones of these, named, %", "90 or more"),
    "beside_size_error_median": (
        "relative error of the size beside a known-good record, median",
        "0.10 or less",
    ),
    "beside_size_covered_pct": (
        "true size within its 90 % interval, beside a known-good record, %",
        "85 to 95",
    ),
    "beside_wrong_soc0_silent_pct": (
        "wrong initial states of charge beside a known-good record, nothing named, %",
        "100",
    ),
    "beside_control_silent_pct": (
        "records without a fault beside a known-good record, nothing named, %",
        "100",
    ),
    "size_error_median": ("relative error of the size of faults and resistances, median", "0.10 or less"),
    "size_covered_pct": ("true size of these within its 90 % interval, %", "85 to 95"),
    "physics_named_pct": ("added contact resistances and capacities that were named, %", ""),
    "wrong_soc0_silent_pct": ("wrong initial states of charge, nothing named, %", "100"),
    "wrong_soc0_error_median": (
        "share of the wrong initial state of charge that is left, median",
        "0.10 or less",
    ),
    "control_silent_pct": ("controls, nothing named, %", "100"),
    "control_matched_false_pct": ("controls with the right answer of a matched case named, %", "0"),
    "ageing_named_pct": ("aged cells with a loss named, and fresh cells without, %", ""),
    "ageing_within_2pp_pct": ("capacity loss within 2 percentage points of the measured one, %", "100"),
    "witness_within_15pct_pct": ("resistances within 15 % of those of the spectra, %", "100"),
    "witness_ohmic_off_median": ("relative error of the ohmic resistance, median", "0.15 or less"),
    "witness_transfer_off_median": (
        "relative error of the charge-transfer resistance, median",
        "0.15 or less",
    ),
    "after_worse_pct": ("written model more than 5 % worse than declared or recalibrated, %", "0"),
    "processor_s_median": ("processor time per case, s, median", ""),
    "processor_s_total": ("processor time of all cases, s", ""),
}
"""Key of the summary -> (what the figure is, in words; its aim)."""


def write_report(path: Path, rows: Sequence[CaseRow], summary: Mapping[str, Any]) -> Path:
    """Write the report to `path` and return it.

    rows : of `judged`, with their residuals.  summary : of `summary.summary`, over the same rows.
    """
    sized = [r for r in rows if r.get("size_error") is not None and "size_neutral" in r]
    worst = worst_of(rows)
    figures = {f"worst_{k}": case_figure(row) for k, row in enumerate(worst)}
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
        resistances=[r for r in rows if "ohmic_off" in r],
        courses=[r for r in rows if "course_rms_k" in r],
        losses=[r for r in rows if "lost_off_pp" in r],
    )


def _lines(summary: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """Lines of the table: (what the figure is, its value over all cases, over the test cases alone, its aim). Figures
    without a case are left out."""
    return [
        (words, _figure_text(summary, key), _figure_text(summary["reported"], key), aim)
        for key, (words, aim) in FIGURES.items()
        if summary.get(key) is not None
    ]


def _figure_text(rates: Mapping[str, Any], key: str) -> str:
    """A figure as text, with its 95 % interval and the number of its cases if it is a rate; '–' without a case."""
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
    """One entry per kind and size of an added fault: (data set, whether the answer is right, the answer) of each
    case."""
    found: dict[str, list[CaseRow]] = {}
    for row in rows:
        if row.get("put_in"):
            found.setdefault(row["put_in"], []).append(row)
    return [
        {
            "put_in": put_in,
            "said": [(r["record"].partition("/")[0], r.get("named"), answer_words(r)) for r in each],
        }
        for put_in, each in sorted(found.items())
    ]
