"""`aesi bench left_out`: does the written model predict a record that the search has not seen?

Each record of a measured cell is left out in turn: the search sees the others, and the models are tested on the
left-out record. The RMS error of the written model (`after`) is compared with those of the declared model (`before`)
and of the recalibrated one. The initial state of charge of the left-out record is found as `ModelState.simulated` finds
it for any record that was not fitted. A record with a thermocouple is simulated at the measured temperature. Of a drive
only the first hour is used.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from aesi.bench import CaseRow, some_chosen
from aesi.bench.limit import LOST, NO_TIME, NOT_RUN, NoAnswer, Stopwatch, answer_of
from aesi.bench.scoring import answer_words
from aesi.constants import SECONDS_PER_HOUR
from aesi.data import read_measurement
from aesi.data.catalogue import HG2, LFP, M50T, NMC, PANASONIC, locate
from aesi.errors import DataError
from aesi.physics import Cell
from aesi.pipeline.discovery.discover import discovery_content
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.decide.model_to_write import AS_GOOD
from aesi.tracer.report.outcome import STATES

LIMIT_S = 900.0
"""Limit of the processor time of one case, s. A convention; the slowest case took 390 s."""
ROWS = 20_000
"""Most rows of a record that are used; a longer one is averaged. A convention that limits the processor time."""


@dataclass(frozen=True)
class MeasuredSet:
    """The records of one measured cell and the file that declares it.

    data : name of the data set.  cell : name of a file in the folder of cell files; None takes the file published with
    the data set.  slow : records that are used whole.  drives : records of which only the first hour is used.
    fitted : those of them that the file was calibrated with, which are among the data and never left out.
    """

    data: str
    cell: str | None
    slow: tuple[str, ...]
    drives: tuple[str, ...]
    fitted: tuple[str, ...] = ()

    @property
    def left_out(self) -> tuple[str, ...]:
        """The records that are left out in turn."""
        return tuple(name for name in (*self.slow, *self.drives) if name not in self.fitted)


SETS = (
    MeasuredSet(NMC, None, ("C20", "C2", "1C", "drive_cycle"), ()),
    MeasuredSet(LFP, None, ("C20", "C2", "1C", "2C", "drive_cycle"), ()),
    MeasuredSet(M50T, "lg_m50_chen2020.bpx.json", ("n0_c20_discharge", "n0_hppc"), ("n0_udds",)),
    MeasuredSet(
        HG2, "lg_18650hg2_25degc.bpx.json", ("25degC_cap_1c_b",),
        ("25degC_us06", "25degC_la92", "25degC_mixed2", "10degC_us06", "0degC_mixed1", "40degC_la92"),
    ),
    MeasuredSet(
        PANASONIC, "panasonic_ncr18650pf.bpx.json", ("25degC_1c_start",),
        ("25degC_us06", "25degC_la92", "25degC_hwfet", "10degC_cycle_1", "0degC_cycle_1", "n10degC_cycle_1"),
        ("25degC_1c_start",),
    ),
)  # fmt: skip
DEVELOPMENT_SETS = (
    MeasuredSet(
        HG2, "lg_18650hg2_25degc.bpx.json", ("40degC_c20_ocv",),
        ("25degC_us06", "25degC_mixed3", "40degC_la92", "0degC_mixed1"),
    ),
    MeasuredSet(
        PANASONIC, "panasonic_ncr18650pf_25degc.bpx.json", ("25degC_1c_end", "25degC_hppc", "0degC_hppc"),
        ("25degC_cycle_1", "25degC_la92", "10degC_cycle_1"), ("25degC_hppc",),
    ),
)  # fmt: skip
"""Sets of development records, of which each holds several kinds: full discharges, pulses and drives, at several
temperatures. On drives alone two rules for what is written were told apart the other way round than on such sets."""


@dataclass(frozen=True)
class LeftOutCase:
    """One case: the record `test` of a set is left out, and the search sees the other records."""

    set: MeasuredSet
    test: str

    @property
    def name(self) -> str:
        """Name of the case, `SET/RECORD`."""
        return f"{self.set.data}/{self.test}"


def plan(only: str | None = None, development: bool = False) -> Sequence[LeftOutCase]:
    """One case for each record that is left out of each set.

    only : substring of a case's name; None selects all cases.  development : the sets that rules may be chosen on, in
    place of the others.  Raises InputError if no case is selected.
    """
    sets = DEVELOPMENT_SETS if development else SETS
    cases = [LeftOutCase(one, test) for one in sets for test in one.left_out]
    found = [case for case in cases if only is None or only in case.name]
    return some_chosen("left_out", found, (case.name for case in cases))


def judged(case: LeftOutCase, cells: str, limit_s: float | None = LIMIT_S) -> CaseRow:
    """Run one case and return its row; the verdict is NOT_RUN if its data are not available.

    cells : folder of the cell files.  limit_s : limit of the processor time, s; None sets no limit. A case that takes
    longer has failed, as has one with a model that cannot be simulated on the record.  `times_better` is the error of
    the written model over the lower of the errors of the declared and the recalibrated model, so that values above 1
    mean that the written model is worse.
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
    told = {"verdict": content["verdict"], "effects": content["effects"]}
    left = {f"{state}_mv": content[state]["test"].get("rmse_mv") for state in STATES}
    if None in left.values():
        return row | told | {"error": "one of the models cannot be simulated on the record", **spent.row}
    better = min(left["before_mv"], left["recalibrated_mv"])
    return row | told | left | {"times_better": left["after_mv"] / better, **spent.row}


def lost(case: LeftOutCase) -> CaseRow:
    """The row of a case whose process the operating system ended. The case counts as failed."""
    return _asked(case) | LOST.row | NO_TIME


def _asked(case: LeftOutCase) -> CaseRow:
    return {"case": case.name, "cell": case.set.data, "record": case.test}


def _records(one: MeasuredSet) -> Iterator[tuple[str, Measurement]]:
    for name in one.slow:
        yield name, read_measurement(locate(one.data, name), max_rows=ROWS)
    for name in one.drives:
        yield name, read_measurement(locate(one.data, name), max_rows=ROWS, stop_s=SECONDS_PER_HOUR)


def summary(rows: Sequence[CaseRow]) -> dict[str, Any]:
    """The summary row: in how many cases the written model is no worse than the better of the declared and the
    recalibrated model (`no_worse`: at most AS_GOOD times its error), the worst case, and how often each answer was
    given (`confusion`)."""
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
        "confusion": dict(Counter(map(answer_words, judged_rows))),
    }


def table(rows: Sequence[CaseRow]) -> list[str]:
    """Lines of a Markdown table with one line per left-out record; the largest ratio is in bold."""
    worst = max((row.get("times_better", 0.0) for row in rows), default=0.0)
    lines = [
        "| cell | left-out record | verdict | declared, mV | recalibrated, mV | as written, mV "
        "| as written / better |",
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
