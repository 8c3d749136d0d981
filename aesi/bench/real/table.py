"""What was found on measured cells as Markdown: a line for each kind of case, then one for each case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from aesi.bench import CaseRow
from aesi.bench.detectable import SEEN_NATS
from aesi.bench.limit import NOT_RUN
from aesi.bench.real.summary import SOC0

NOUNS = {
    "withheld": "temperature withheld",
    "ageing": "ageing",
    "witness": "spectrum beside it",
    "control": "control",
    "control_beside": "control",
}
BESIDE = ("fault_beside", "control_beside")
STATES = ("before", "recalibrated", "after")


def table(rows: Sequence[CaseRow]) -> list[str]:
    """Lines of Markdown of the cases that ran, those without an answer among them, as misses.

    `named` counts right names, where no name is right that none was given; `could be`: of the cases with a right name,
    those of which that says more than `SEEN_NATS` of unseen data.
    """
    ran = [row for row in rows if row["verdict"] != NOT_RUN]
    return [*_by_kind(ran), "", '??? note "Each case"', "", *(f"    {line}" for line in _each(ran))]


def _by_kind(rows: Sequence[CaseRow]) -> Iterator[str]:
    yield (
        "| put in, or withheld | beside a good record | cases | named | could be | of these named | size off, median | "
        "in its interval |"
    )
    yield "|---|---|---:|---:|---:|---:|---:|---:|"
    kinds: dict[tuple[str, bool], list[CaseRow]] = {}
    for row in rows:
        kinds.setdefault((_kind(row), row["group"] in BESIDE), []).append(row)
    for (kind, beside), ones in kinds.items():
        seen = [one for one in ones if one.get("seen_nats") is not None and one["seen_nats"] > SEEN_NATS]
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
    """What a case is about: what was put in, or its group."""
    if row["put_in"].startswith(SOC0):
        return "wrong initial state of charge"
    if row["put_in"]:
        return str(row["put_in"].split()[0]).replace("_", " ")
    if "self_heating" in row["answer"][:1]:
        return "temperature withheld, warming up"
    return NOUNS.get(row["group"], str(row["group"]))


def _each(rows: Sequence[CaseRow]) -> Iterator[str]:
    yield "| record | about | verdict | right | nats | true | found | declared, mV | recalibrated | as written |"
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
    """The true one and the one found: of what was put in or withheld, K, A, V, s or ohm; of a witness ohmic resistance
    and charge transfer, mohm; of ageing the capacity lost, %."""
    if "ohmic_found_mohm" in row:
        true, found = (
            " + ".join(f"{row[f'{part}_{of}_mohm']:.1f}" for part in ("ohmic", "transfer"))
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
