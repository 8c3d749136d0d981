"""Tables of docs/benchmarks.json: the newest lines that `aesi bench --json` printed, and how watched figures moved."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import sqrt
from typing import Any

from flows.benchmarks.history import Entry, case_fields, case_of, latest, watched_figures

Line = dict[str, Any]
LONG = 12
"""Rows beyond which a table is folded away."""
LAYOUTS = ("all", "repeats", "schedules", "beyond")
DESIGN = "scaled"
"""Of bands, the one that is the default."""
DEVIATIONS = ("coverage_sd_pct", "coverage_se_pct")
"""Deviations between the cells of a line of bands."""
BY_CELLS_UNTIL = "2026-11-30"
"""Date of the last entries whose DEVIATIONS divide the sum of squares by the number of cells, not by one less."""
BAND_FIGURES = {
    "deviation": ("coverage_sd_pct", 1),
    "worst bin, %": ("worst_bin_coverage_pct", 1),
    "width, mV": ("width_mv", 1),
    "Winkler, mV": ("interval_score_mv", 1),
    "score": ("score_ratio", 2),
}
"""Head of a column -> figure of a line, and its digits."""


def by_one_less(entry: Entry) -> Entry:
    """The entry, with the deviations of bands over n - 1 of its n cells where they were recorded over n: larger by the
    square root of n / (n - 1)."""
    if entry.date > BY_CELLS_UNTIL:
        return entry

    def converted(line: Line) -> Line:
        if line["bench"] != "bands" or line["cells"] == 1:
            return line
        factor = sqrt(line["cells"] / (line["cells"] - 1))
        return line | {name: round(factor * line[name], 2) for name in DEVIATIONS}

    return replace(entry, lines=tuple(map(converted, entry.lines)))


def table_of(bench: str, entries: Sequence[Entry]) -> str:
    """What was recorded of a benchmark last: its lines, or where its runs are judged as a whole, the newest one."""
    if bench in IN_COLUMNS:
        return _side_by_side(bench, entries)
    found = [(entry, line) for entry, line in latest(entries).values() if line["bench"] == bench]
    if not found:
        return _nothing(bench)
    origins = dict.fromkeys(_origin(entry) for entry, _ in found)
    return "\n".join([*(f"{text}\n" for text in origins), *_tables([line for _, line in found])])


def over_time(entries: Sequence[Entry]) -> str:
    """Every recorded value of the figures that should not get worse, folded away."""
    moved: dict[tuple[Any, ...], list[str]] = {}
    for entry in entries:
        for line in entry.lines:
            for figure, value in watched_figures(line).items():
                moved.setdefault((*case_of(line), figure), []).append(f"{_cell(float(value))} ({entry.date})")
    rows = [
        f"| {bench} | {', '.join(_cell(each) for each in case)} | {figure} | {' → '.join(values)} |"
        for (bench, *case, figure), values in moved.items()
    ]
    table = ["| benchmark | case | figure | recorded |", "|---|---|---|---|", *rows]
    return _folded(f"{len(rows)} figures", table)


def bands(entries: Sequence[Entry]) -> str:
    """Of the bands of virtual cells: every layout and horizon of the default, other designs at a short horizon and
    over whole drives."""
    lines = [(entry, line) for entry, line in latest(entries).values() if line["bench"] == "bands"]
    if not lines:
        return _nothing("bands")
    origins = dict.fromkeys(_origin(entry) for entry, _ in lines)
    shown = sorted(
        (line for _, line in lines if _is_shown(line)),
        key=lambda line: (LAYOUTS.index(line["layout"]), line["method"] == DESIGN),
    )
    rows = [
        [
            line["layout"],
            line["method"],
            "whole drive" if line["horizon_s"] is None else f"{line['horizon_s']:g} s",
            f"{line['coverage_pct']:.1f} ± {_rounded(line['coverage_se_pct'], 1)}",
            *(_rounded(line[key], digits) for key, digits in BAND_FIGURES.values()),
        ]
        for line in shown
    ]
    head, *body = (
        "| " + " | ".join(row) + " |"
        for row in (["layout", "design", "horizon", "coverage, %", *BAND_FIGURES], *rows)
    )
    align = "|" + "---|" * 3 + "---:|" * (1 + len(BAND_FIGURES))
    return "\n".join([*(f"{text}\n" for text in origins), head, align, *body, ""])


def _rounded(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"


def _is_shown(line: Line) -> bool:
    if line["method"] == DESIGN:
        return True
    short = line["horizon_s"] in (1.0, None)
    return short and (
        line["layout"] == LAYOUTS[0] or (line["layout"] == "beyond" and "reach" in line["method"])
    )


def _side_by_side(bench: str, entries: Sequence[Entry]) -> str:
    """The newest labelled run, and all of them, oldest first: what a change of method brought is seen.

    Both are folded away, since the words above them say the same of the newest.
    """
    runs = [
        (entry, line)
        for entry in entries
        for line in entry.lines
        if line["bench"] == bench and line.get("label")
    ]
    if not runs:
        return _nothing(bench)
    newest, line = runs[-1]
    name = f"seed {line['seed']}, commit `{newest.commit[:7]}`, {newest.date}"
    every = [
        (f"{line['label']}, seed {line['seed']}, commit `{entry.commit[:7]}`", line) for entry, line in runs
    ]
    parts = [_folded("The newest recorded run in figures", _columns(bench, [(name, line)]))]
    if len(every) > 1:
        parts.append(
            _folded(f"All {len(every)} recorded runs, each by the code of its day", _columns(bench, every))
        )
    return "\n".join(parts)


def _columns(bench: str, runs: Sequence[tuple[str, Line]]) -> list[str]:
    """A figure a row, and a run a column."""
    rows = [
        f"| {title} | " + " | ".join(_figure(line, key) for _, line in runs) + " |"
        for key, title in IN_COLUMNS[bench]
    ]
    return ["| | " + " | ".join(head for head, _ in runs) + " |", "|---|" + "---:|" * len(runs), *rows]


def _figure(line: Line, key: str) -> str:
    """A rate with its interval and its cases, a share in per cent, or a plain figure."""
    if f"{key}_pct" not in line:
        value = line.get(key)
        return f"{100 * value:.2g} %" if key in SHARES and value is not None else _cell(value)
    if line[f"{key}_pct"] is None or not line.get(f"{key}_95_pct"):
        return "–"
    low, high = line[f"{key}_95_pct"]
    cases = line[f"{key}_cases"]
    # The line has the rate to a tenth of a per cent; rounded again, 60.5 would be 60.
    hits = round(line[f"{key}_pct"] * cases / 100)
    return f"{hits} of {cases}: {100 * hits / cases:.0f} % [{low:.0f}, {high:.0f}]"


def _tables(lines: Iterable[Line]) -> list[str]:
    """One table for the lines of one kind: those that name their case by the same fields."""
    kinds: dict[tuple[str, ...], list[Line]] = {}
    for line in lines:
        kinds.setdefault(case_fields(line), []).append(line)
    return [_table(kinds[fields]) for fields in sorted(kinds, key=len)]


def _table(lines: Sequence[Line]) -> str:
    """A line a row, many of them folded away; a line a column where it has more figures than there are lines."""
    keys = [
        key for key in dict.fromkeys(key for line in lines for key in line) if key not in ("bench", "summary")
    ]
    cells = [[_cell(line.get(key)) for line in lines] for key in keys]
    if len(lines) == 1:
        return _grid(
            [["figure", "value"], *([key, *row] for key, row in zip(keys, cells, strict=True))], "---:"
        )
    if len(lines) < len(keys) and len(lines) <= LONG:
        return _grid([[key, *row] for key, row in zip(keys, cells, strict=True)], "---:")
    table = _grid([keys, *zip(*cells, strict=True)], "---")
    return _folded(f"{len(lines)} lines", table.splitlines()) if len(lines) > LONG else table


def _grid(rows: Sequence[Sequence[str]], align: str) -> str:
    """A table whose first row is its head; `align` of all columns but the first."""
    head, *body = ("| " + " | ".join(row) + " |" for row in rows)
    return "\n".join([head, f"|---|{'|'.join([align] * (len(rows[0]) - 1))}|", *body, ""])


def _folded(title: str, table: Sequence[str]) -> str:
    return f'??? note "{title}"\n\n' + textwrap.indent("\n".join(table), "    ") + "\n"


def _nothing(bench: str) -> str:
    return f"No run has been recorded in this checkout; `aesi bench {bench}` makes one."


def _origin(entry: Entry) -> str:
    load = "" if entry.load is None else f", load {entry.load:.1f} at the start"
    return f"Measured on {entry.machine}, {entry.date}, commit `{entry.commit[:7]}`{load}."


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        text = f"{value:.4g}"
        return f"{float(text):,.0f}" if "e+" in text else text
    if isinstance(value, dict | list):
        return f"`{json.dumps(value)}`"
    return str(value).replace("|", "\\|")


IN_COLUMNS = {
    "blind": (
        ("cases", "cases"),
        ("not_made", "further cases that the simulator could not make"),
        ("no_answer", "without an answer (out of time, or refused)"),
        ("effect_exact", "effects named exactly"),
        ("seen_exact", "the same, of those that say enough of unseen data to be named at all"),
        ("effect_grouped", "effects named within a group of three"),
        ("effect_lenient", "the same, listed alternatives counted as right"),
        ("pair_both_named", "pairs, both named"),
        ("stranger_unknown", "strangers called `unknown`"),
        ("stranger_false_name", "names given to strangers"),
        ("none_false_name", "names given where nothing is missing"),
        ("effect_false_name", "names beside the right ones, or instead of them"),
        ("false_name_beside_unknown", "wrong names beside `unknown`"),
        ("fitted_called_found", "right and fitted to the noise, called `found`"),
        ("after_over_noise_median", "error on unseen data over the noise, median"),
        (
            "parameter_error_median",
            "largest error of a parameter relative to its value, median (earlier runs)",
        ),
        ("size_error_median", "largest error of a size over its distance from no effect, median"),
        ("parameters_covered", "parameters inside their 90 % interval"),
        ("processor_s_median", "processor seconds a case, median"),
    ),
    "real": (
        ("ran", "cases"),
        ("no_answer", "without an answer (out of time, or refused)"),
        ("withheld_named", "temperatures named"),
        ("withheld_within_2k", "temperatures within 2 K"),
        (
            "withheld_course_rms_k_median",
            "named temperatures: written model minus thermocouple, RMS, K, median",
        ),
        ("withheld_error_halved", "error on unseen data at least halved, of those named"),
        ("warming_named", "records that warm up: heat or temperature named"),
        ("fault_named", "faults named"),
        ("wrong_soc0_silent", "wrong initial states without a name"),
        ("wrong_soc0_error_median", "share of the wrong initial state left, median"),
        ("physics_named", "contacts and capacity named"),
        ("size_error_median", "relative error of the size, median"),
        ("size_covered", "sizes inside their 90 % interval"),
        ("control_silent", "controls without a name"),
        ("control_matched_false", "controls with the name of a case matched to them"),
        ("ageing_named", "ageing named, or rightly not"),
        ("ageing_within_2pp", "capacity within 2 percentage points of the measured one"),
        ("witness_within_15pct", "resistances within 15 % of the spectra's"),
        ("witness_ohmic_off_median", "ohmic resistance off the spectrum's, median"),
        ("witness_transfer_off_median", "charge transfer off the spectrum's, median"),
        ("after_worse", "worse on unseen data than the better of declared and recalibrated"),
        ("processor_s_median", "processor seconds a case, median"),
        ("processor_s_total", "processor seconds of all"),
    ),
}
"""Benchmarks whose runs stand side by side: key of a figure and what it is."""
SHARES = frozenset(
    {
        "parameter_error_median",
        "wrong_soc0_error_median",
        "size_error_median",
        "witness_ohmic_off_median",
        "witness_transfer_off_median",
    }
)
"""Figures of these that a line holds as a share of one."""
