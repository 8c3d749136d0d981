"""Results of `aesi bench cells` as Markdown tables: RMS errors, mV, by record, and by cell and chamber temperature."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from aesi.bench.physics.archive import chamber, chamber_degc

COLUMNS = {
    "declared_mv": "declared",
    "calibrated_mv": "calibrated",
    "with_temperature_mv": "with temperature",
    "aged_mv": "aged",
    "windows_mv": "windows",
    "hybrid_mv": "hybrid",
}
"""Key of a row -> heading of its column in `table`, RMS errors in mV."""


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines of a Markdown table with one line per record, RMS errors in mV, then the protocols of the published
    figures, which the table refers to by number."""
    protocols = list(dict.fromkeys(r["others"] for r in rows if r.get("others")))
    lines = [f"| cell | record | mean degC | {' | '.join(COLUMNS.values())} | others |"]
    lines.append("|---|---|" + "---:|" * (len(COLUMNS) + 1) + "---|")
    for row in rows:
        name = row["record"] + (" (fitted)" if row["fitted"] else "")
        shown = [_shown(row, key) for key in COLUMNS]
        others = (
            f"{row['others_mv']:g} [{protocols.index(row['others']) + 1}]" if row.get("others_mv") else ""
        )
        degc = "" if row.get("mean_degc") is None else f"{row['mean_degc']:.1f}"
        lines.append(f"| {row['cell']} | {name} | {degc} | {' | '.join(shown)} | {others} |")
    return [*lines, "", *(f"[{k}] {text}.  " for k, text in enumerate(protocols, start=1))]


HEADINGS = COLUMNS | {
    "porous_mv": "porous electrode",
    "charged_mv": "as aged as it shows",
    "alone_mv": "fitted at 25 °C alone",
    "cold_mv": "fitted in the cold",
}
JUDGED = ("declared_mv", "alone_mv", "with_temperature_mv", "porous_mv", "aged_mv", "charged_mv", "cold_mv")
"""Keys of the columns for the records of the archives: start file, file fitted at 25 degC alone, calibrated file with
the single-particle and with the porous-electrode model, calibrated file at the state of health of the day and at that
which a charge to full shows, file fitted in the cold as well."""


def archive_table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Lines of Markdown: a table with the median and the largest RMS error, mV, of the records of each cell and chamber
    temperature, then a table of the records in a block to open."""
    there = sorted(
        (row for row in rows if "error" not in row),
        key=lambda row: (row["cell"], chamber_degc(row["record"]), row["record"]),
    )
    keys = [key for key in JUDGED if any(row.get(key) is not None for row in there)]
    records = (f"    {line}" for line in _by_record(there, keys))
    return [*_by_chamber(there, keys), "", '??? note "Each record of the archives"', "", *records]


def tested_mv(rows: Sequence[Mapping[str, Any]], key: str) -> list[float]:
    """The RMS errors, mV, in a column of the rows that have it, without those of records that its file was fitted
    to."""
    return [row[key] for row in rows if row.get(key) is not None and key not in row.get("fitted_mv", ())]


def _by_chamber(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> Iterator[str]:
    """Lines of the table by cell and chamber temperature: `median / largest` RMS error, mV. Records that a file was
    fitted to are left out of its column."""
    yield f"| cell | chamber | records | {' | '.join(HEADINGS[key] for key in keys)} | ran out |"
    yield "|---|---|---:|" + "---:|" * (len(keys) + 1)
    for cell, place in dict.fromkeys((row["cell"], chamber(row["record"])) for row in rows):
        ours = [row for row in rows if (row["cell"], chamber(row["record"])) == (cell, place)]
        figures = [tested_mv(ours, key) for key in keys]
        shown = " | ".join(f"{np.median(each):.1f} / {max(each):.1f}" if each else "" for each in figures)
        out = sum("with_temperature" in row["ran_out"] for row in ours)
        yield f"| {cell} | {place} | {len(ours)} | {shown} | {out or ''} |"


def _by_record(rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> Iterator[str]:
    yield f"| cell | record | mean degC | {' | '.join(HEADINGS[key] for key in keys)} |"
    yield "|---|---|---:|" + "---:|" * len(keys)
    for row in rows:
        shown = " | ".join(_shown(row, key) for key in keys)
        yield f"| {row['cell']} | {row['record']} | {row['mean_degc']:.1f} | {shown} |"


def _shown(row: Mapping[str, Any], key: str) -> str:
    if key == "hybrid_mv" and row.get("trained"):
        return "trained"
    if row.get(key) is None:
        return ""
    name = key.removesuffix("_mv")
    ran_out = row.get("ran_out", {}).get(name)
    until_held = row.get("until_held_mv", {}).get(name)
    fitted = " (fitted)" if key in row.get("fitted_mv", ()) else ""
    out = "" if ran_out is None else f" (ran out at {ran_out:.0f} s)"
    held = "" if until_held is None else f" ({until_held:.1f} until {row['held_from_s']:.0f} s)"
    return f"{row[key]:.1f}{fitted}{out}{held}"
