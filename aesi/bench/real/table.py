"""Results of `aesi bench real` as Markdown tables: one line for each kind of case, then one for each case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from aesi.bench import CaseRow
from aesi.bench.limit import NOT_RUN
from aesi.bench.real.summary import SOC0, detectable
from aesi.tracer.report.outcome import STATES

NOUNS = {
    "withheld": "temperature withheld",
    "ageing": "ageing",
    "witness": "spectrum beside it",
    "control": "control",
    "control_beside": "control",
}
"""Group of a case -> its name in the tables."""
BESIDE = ("fault_beside", "control_beside")


def table(rows: Sequence[CaseRow]) -> list[str]:
    """Lines of Markdown over the cases that ran. Cases without an answer count as wrong.

    `right` counts right answers: a right effect is named or, where there is none, nothing is named. `detectable` counts
    the cases whose right effect gains more than SEEN_NATS of log likelihood on held-out data. `size error` is that of
    named effects, relative to the true size.
    """
    ran = [row for row in rows if row["verdict"] != NOT_RUN]
    return [*_by_kind(ran), "", '??? note "Each case"', "", *(f"    {line}" for line in _each(ran))]


def _by_kind(rows: Sequence[CaseRow]) -> Iterator[str]:
    yield (
        "| fault, or withheld quantity | known-good record | cases | right | detectable | of these right "
        "| size error, median | within its interval |"
    )
    yield "|---|---|---:|---:|---:|---:|---:|---:|"
    kinds: dict[tuple[str, bool], list[CaseRow]] = {}
    for row in rows:
        kinds.setdefault((_kind(row), row["group"] in BESIDE), []).append(row)
    for (kind, beside), ones in kinds.items():
        seen = detectable(ones)
        right = any(one["answer"] for one in ones)
        sizes = [one["size_error"] for one in ones if one.get("size_error") is not None]
        covered = [one["size_covered"] for one in ones if one.get("size_covered") is not None]
        cells = [
            kind,
            "yes" if beside else "",
            str(len(ones)),
            str(sum(one["named"] for one in ones)),
            str(len(seen)) if right else "",
            str(sum(one["named"] for one in seen)) if right else "",
            f"{100 * np.median(sizes):.0f} %" if sizes else "",
            f"{sum(covered)} of {len(covered)}" if covered else "",
        ]
        yield f"| {' | '.join(cells)} |"


def _kind(row: CaseRow) -> str:
    """The kind of a case in words: the added fault, or the name of its group."""
    if row["put_in"].startswith(SOC0):
        return "wrong initial state of charge"
    if row["put_in"]:
        return str(row["put_in"].split()[0]).replace("_", " ")
    if "self_heating" in row["answer"][:1]:
        return "temperature withheld, warming up"
    return NOUNS.get(row["group"], str(row["group"]))


def _each(rows: Sequence[CaseRow]) -> Iterator[str]:
    yield (
        "| record | case | verdict | right | nats | true size | estimate | declared, mV | recalibrated, mV "
        "| as written, mV |"
    )
    yield "|---|---|---|---|---:|---:|---:|---:|---:|---:|"
    for row in rows:
        said = ", ".join(row["effects"])
        nats = row.get("seen_nats")
        cells = [
            row["record"],
            row["put_in"].replace("_", " ") or _kind(row),
            f"{row['verdict']}: {said}" if said else row["verdict"],
            "yes" if row["named"] else "no",
            "" if nats is None else f"{nats:.1f}",
            *_sizes(row),
            *(_mv(row.get(f"{state}_test_mv")) for state in STATES),
        ]
        yield f"| {' | '.join(cells)} |"


def _sizes(row: CaseRow) -> tuple[str, str]:
    """The true size and its estimate with the 90 % interval, as text: of an added fault or a withheld quantity in its
    SI unit; for a case with spectra the ohmic and the charge-transfer resistance, mohm; for ageing the capacity loss,
    %."""
    if "ohmic_found_mohm" in row:
        true, found = (
            " + ".join(f"{row[f'{part}_{of}_mohm']:.2f}" for part in ("ohmic", "transfer"))
            for of in ("measured", "found")
        )
        return f"{true} mohm", f"{found} mohm"
    if "lost_found_pct" in row:
        return f"{row['lost_measured_pct']:.1f} %", f"{row['lost_found_pct']:.1f} %"
    if row.get("size_true") is None:
        return "", ""
    return f"{row['size_true']:.3g}", f"{row['size_found']:.3g}{_interval(row)}"


def _interval(row: CaseRow) -> str:
    low, high = row.get("size_low"), row.get("size_high")
    return "" if low is None or high is None else f" [{low:.3g}, {high:.3g}]"


def _mv(error: float | None) -> str:
    return "" if error is None else f"{error:.1f}"
