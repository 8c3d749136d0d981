"""Does what is found carry over? Each measured record in turn as the test, the others of its cell as data.

The written model (`after`) is held against the declared and the recalibrated one on the record that chose nothing,
which begins as `ModelState.simulated` says of one that was not fitted. Records with a thermocouple are simulated at its
temperature. Of drives the first hour is taken.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aesi.bench import CaseRow, some_chosen
from aesi.bench.limit import LOST, NO_TIME, NOT_RUN, NoAnswer, Stopwatch, answer_of
from aesi.constants import SECONDS_PER_HOUR
from aesi.data import read_measurement
from aesi.data.catalogue import locate
from aesi.errors import DataError
from aesi.physics import Cell
from aesi.pipeline.discovery.discover import discovery_content
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.decide.written import AS_GOOD

LIMIT_S = 900.0
"""Limit of processor time for one case, s: a convention; the slowest of `aesi bench left_out` took 390 s."""


@dataclass(frozen=True)
class MeasuredSet:
    """Records of one measured cell and the file that declares it.

    data : name of the data set.  cell : a file in the folder of cell files, or None for the one published with the set.
    slow : records that are taken whole.  drives : those of which the first hour is taken.
    """

    data: str
    cell: str | None
    slow: tuple[str, ...]
    drives: tuple[str, ...]


SETS = (
    MeasuredSet("about_energy_nmc", None, ("C20", "C2", "1C", "drive_cycle"), ()),
    MeasuredSet("about_energy_lfp", None, ("C20", "C2", "1C", "2C", "drive_cycle"), ()),
    MeasuredSet("lg_m50t_w8", "lg_m50_chen2020.bpx.json", ("n0_c20_discharge", "n0_hppc"), ("n0_udds",)),
    MeasuredSet(
        "lg_18650hg2", "lg_18650hg2_25degc.bpx.json", ("25degC_cap_1c_b",),
        ("25degC_us06", "25degC_la92", "25degC_mixed2", "10degC_us06", "0degC_mixed1", "40degC_la92"),
    ),
    MeasuredSet(
        "panasonic_ncr18650pf", "panasonic_ncr18650pf.bpx.json", ("25degC_1c_start",),
        ("25degC_us06", "25degC_la92", "25degC_hwfet", "10degC_cycle_1", "0degC_cycle_1", "n10degC_cycle_1"),
    ),
)  # fmt: skip


@dataclass(frozen=True)
class LeftOutCase:
    """One record of a set, left out."""

    set: MeasuredSet
    test: str

    @property
    def name(self) -> str:
        """Of the case."""
        return f"{self.set.data}/{self.test}"


def plan(only: str | None = None) -> Sequence[LeftOutCase]:
    """Every record of every set in turn; only : substring of the name of a case.  Raises InputError if none has it."""
    cases = [LeftOutCase(one, test) for one in SETS for test in (*one.slow, *one.drives)]
    found = [case for case in cases if only is None or only in case.name]
    return some_chosen("left_out", found, (case.name for case in cases))


def judged(case: LeftOutCase, cells: str, limit_s: float | None = LIMIT_S) -> CaseRow:
    """The row of one case; `verdict` is 'not run' where its data cannot be had.

    cells : folder of the cell files.  limit_s : processor seconds; a case that takes longer has failed.
    """
    spent = Stopwatch()
    row = _asked(case)
    try:
        records = dict(_records(case.set))
        path = Path(cells) / case.set.cell if case.set.cell else locate(case.set.data, "cell.bpx.json")
        cell = Cell.from_bpx(path)
    except DataError as error:
        return row | {"verdict": NOT_RUN, "error": str(error), **spent.row}
    test = records.pop(case.test)
    content = answer_of(lambda: discovery_content(discover(cell, list(records.values()), [test])), limit_s)
    if isinstance(content, NoAnswer):
        return row | content.row | spent.row
    left = {f"{state}_mv": content[state]["test"]["rmse_mv"] for state in ("before", "recalibrated", "after")}
    better = min(left["before_mv"], left["recalibrated_mv"])
    told = {"verdict": content["verdict"], "effects": content["effects"]}
    return row | told | left | {"times_better": left["after_mv"] / better, **spent.row}


def lost(case: LeftOutCase) -> CaseRow:
    """The row of a case whose process the system ended: it has failed."""
    return _asked(case) | LOST.row | NO_TIME


def _asked(case: LeftOutCase) -> CaseRow:
    return {"case": case.name, "cell": case.set.data, "record": case.test}


def _records(one: MeasuredSet) -> Iterator[tuple[str, Measurement]]:
    for name in one.slow:
        yield name, read_measurement(locate(one.data, name), max_rows=20_000)
    for name in one.drives:
        yield name, read_measurement(locate(one.data, name), max_rows=20_000, stop_s=SECONDS_PER_HOUR)


def summary(rows: Sequence[CaseRow]) -> dict[str, Any]:
    """How often the written model is no worse than leaving the cell alone, the worst case, and what was named."""
    ran = [row for row in rows if row["verdict"] != NOT_RUN]
    judged_rows = [row for row in ran if "times_better" in row]
    worst = max(judged_rows, key=lambda row: float(row["times_better"]), default=None)
    return {
        "summary": True,
        "cases": len(ran),
        "not_run": len(rows) - len(ran),
        "failed": len(ran) - len(judged_rows),
        "no_worse": sum(row["times_better"] <= AS_GOOD for row in judged_rows),
        "worst_times": None if worst is None else worst["times_better"],
        "worst_case": None if worst is None else worst["case"],
        "confusion": dict(Counter("+".join(row["effects"]) or row["verdict"] for row in judged_rows)),
    }


def table(rows: Sequence[CaseRow]) -> list[str]:
    """Lines of Markdown, a record a line, the worst in bold."""
    worst = max((row.get("times_better", 0.0) for row in rows), default=0.0)
    lines = [
        "| cell | left out | verdict | declared, mV | recalibrated, mV | after, mV | after / better |",
        "|---|---|---|---:|---:|---:|---:|",
    ]
    for row in rows:
        said = row["verdict"] + (f": {', '.join(row['effects'])}" if row.get("effects") else "")
        if "times_better" not in row:
            lines.append(f"| {row['cell']} | {row['record']} | {said}: {row['error']} | | | | |")
            continue
        figures = [f"{row[k]:.1f}" for k in ("before_mv", "recalibrated_mv", "after_mv")]
        ratio = f"{row['times_better']:.2f}"
        ratio = f"**{ratio}**" if row["times_better"] == worst else ratio
        lines.append(f"| {row['cell']} | {row['record']} | {said} | {' | '.join(figures)} | {ratio} |")
    return lines
