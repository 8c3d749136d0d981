"""Results of the benchmarks over time, and what got worse.

A history is a JSON file: entries with date, commit, machine and load, each with the lines that one
`aesi bench NAME --json` printed. Two lines are about the same thing where their benchmark and the fields of its
`Watch.case` agree; of those, the watched figures are compared, ratios and accuracies rather than seconds, since
seconds belong to a machine and its load.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from math import isfinite
from pathlib import Path
from typing import Any

from aesi.errors import InputError

Line = dict[str, Any]


@dataclass(frozen=True)
class Watch:
    """What is compared of a benchmark.

    case : fields that tell its lines apart.  higher, lower : figures that should not fall, or rise, by more than
    the given share of what they were, whatever their sign.  together : the lines of a run are one picture: all are kept
    beside the one that sums them up, and only the newest run's count.
    """

    case: tuple[str, ...] = ()
    higher: Mapping[str, float] = field(default_factory=dict)
    lower: Mapping[str, float] = field(default_factory=dict)
    together: bool = False


TIMING = 0.4
"""Ratios of times from one run of a shared machine scatter by a quarter and more."""
RESULT = 0.1
"""Share by which an error may rise between two recorded runs."""
RATE = 0.03
"""Share of cases, or of a reduction, by which a rate may fall."""

WATCHED = {
    "espm": Watch(("case",), higher={"ratio": TIMING}, lower={"rmse_mv": RESULT}),
    "dfn": Watch(
        ("load", "record", "who", "across", "in_particle"),
        higher={"ratio": TIMING},
        lower={"rmse_mv": RESULT},
        together=True,
    ),
    "resistance": Watch(
        ("cell", "record", "degc", "cells"), higher={"inside_pct": RATE}, lower={"off": RESULT}
    ),
    "ensemble": Watch(("terms", "lambda1", "rows", "candidates", "resamples"), higher={"ratio": TIMING}),
    "design": Watch(("setting", "cells", "candidates"), higher={"aesi_i_mean_pct": RATE}),
    "spci": Watch(
        ("method", "n_calibration", "n_test"), higher={"ratio": TIMING}, lower={"score_ratio": RESULT}
    ),
    "bands": Watch(("layout", "horizon_s", "method", "cells", "seed"), lower={"score_ratio": RESULT}),
    "blind": Watch(
        ("summary", "seed", "cases"),
        higher={"effect_exact_pct": RATE, "effect_grouped_pct": RATE, "stranger_unknown_pct": RATE},
        lower={"none_false_name_pct": RATE},
    ),
    "real": Watch(
        ("summary", "cases", "ran"),
        higher={"withheld_named_pct": RATE, "fault_named_pct": RATE, "control_silent_pct": RATE},
        lower={"after_worse_pct": RATE},
    ),
    "tracking": Watch(("rows", "terms", "resamples", "artifact_kb"), lower={"overhead_pct": TIMING}),
    "search": Watch(("storage", "terms", "candidates"), higher={"ratio": TIMING}),
    "scale": Watch(("runner", "rows", "terms", "workers"), higher={"ratio_by_processor": RESULT}),
}


@dataclass(frozen=True)
class Entry:
    """One recorded run. load : the machine's one-minute load when it began; None where nobody noted it."""

    date: str
    commit: str
    machine: str
    load: float | None
    lines: tuple[Line, ...]


def read_history(path: Path) -> list[Entry]:
    """The entries of a history, oldest first; none where there is no file.

    Raises InputError for a file that cannot be read, or that holds something else.
    """
    if not path.exists():
        return []
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}.") from None
    except ValueError:
        raise _no_history(path, "it is not one JSON object") from None
    match content:
        case {"entries": [*entries]}:
            return [_entry(path, number, entry) for number, entry in enumerate(entries, 1)]
    raise _no_history(path, "it has no list of 'entries'")


def _entry(path: Path, number: int, content: object) -> Entry:
    match content:
        case {
            "date": str(),
            "commit": str(),
            "machine": str(),
            "load": int() | float() | None,
            "lines": [*lines],
        } if len(content) == len(fields(Entry)) and all(map(_is_line, lines)):
            return Entry(**{**content, "lines": tuple(lines)})
    raise _no_history(path, f"its entry {number} is none of a run of benchmarks")


def _is_line(content: object) -> bool:
    match content:
        case {"bench": str()}:
            return True
    return False


def _no_history(path: Path, why: str) -> InputError:
    return InputError(
        f"{path} is no history of benchmarks ({why}); give a file as docs/hooks/record.py writes it, such as "
        "docs/benchmarks.json: what `aesi bench --json` prints is not yet one."
    )


def write_history(path: Path, entries: Sequence[Entry]) -> None:
    """Write all entries."""
    text = json.dumps({"entries": [asdict(entry) for entry in entries]}, indent=1)
    path.write_text(text + "\n", encoding="utf-8")


def worth_keeping(lines: Iterable[Line]) -> tuple[Line, ...]:
    """The lines; of a benchmark where one of them sums up the others (`summary`), that one alone."""
    found = tuple(lines)
    summed = {line["bench"] for line in found if line.get("summary") and not _watch(line).together}
    return tuple(line for line in found if line.get("summary") or line["bench"] not in summed)


def latest(entries: Sequence[Entry]) -> dict[tuple[Any, ...], tuple[Entry, Line]]:
    """The newest line of every case, with its entry; of lines that belong together, those of the newest run."""
    newest = {line["bench"]: entry for entry in entries for line in entry.lines}
    return {
        case_of(line): (entry, line)
        for entry in entries
        for line in entry.lines
        if not _watch(line).together or entry is newest[line["bench"]]
    }


def _watch(line: Mapping[str, Any]) -> Watch:
    return WATCHED.get(line["bench"], Watch())


def case_of(line: Mapping[str, Any]) -> tuple[Any, ...]:
    """What a line is about: its benchmark and the fields that tell its lines apart."""
    watch = _watch(line)
    return (line["bench"], *(_plain(line.get(name)) for name in watch.case))


def case_fields(line: Mapping[str, Any]) -> tuple[str, ...]:
    """The fields that tell a line apart, as far as it has them: lines of one benchmark may be of several kinds."""
    return tuple(name for name in _watch(line).case if name in line)


def watched_figures(line: Mapping[str, Any]) -> dict[str, float]:
    """The watched figures of a line."""
    watch = _watch(line)
    names = (*watch.higher, *watch.lower)
    return {name: line[name] for name in names if isinstance(line.get(name), int | float)}


def regressions(entries: Sequence[Entry], lines: Iterable[Line]) -> list[str]:
    """One sentence for each watched figure that is worse than when it was last recorded, or no number any more."""
    known = latest(entries)
    found = []
    for line in lines:
        if case_of(line) in known:
            entry, before = known[case_of(line)]
            since = f"{entry.date}, {entry.commit[:7] or 'no commit'}"
            found += [f"{_name(line)}: {text} ({since})" for text in _worse(before, line)]
    return found


def not_compared(entries: Sequence[Entry], lines: Iterable[Line]) -> list[str]:
    """The benchmarks of which no watched figure has been recorded of the same case."""
    known = latest(entries)
    compared: dict[str, bool] = {}
    for line in lines:
        _, before = known.get(case_of(line), (None, {"bench": line["bench"]}))
        met = bool(watched_figures(before).keys() & watched_figures(line).keys())
        compared[line["bench"]] = compared.get(line["bench"], False) or met
    return [bench for bench, met in compared.items() if not met]


def _worse(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    watch = _watch(now)
    old, new = watched_figures(before), watched_figures(now)
    found = []
    for name in [each for each in old if each in new]:
        room = watch.higher.get(name, watch.lower.get(name, 0.0)) * abs(old[name])
        fell = name in watch.higher and new[name] < old[name] - room
        rose = name in watch.lower and new[name] > old[name] + room
        if fell or rose or (isfinite(old[name]) and not isfinite(new[name])):
            found.append(f"{name} was {old[name]:.4g} and is {new[name]:.4g}")
    return found


def _name(line: Mapping[str, Any]) -> str:
    bench, *case = case_of(line)
    return f"{bench} ({', '.join(str(each) for each in case)})" if case else str(bench)


def _plain(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value
