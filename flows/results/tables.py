"""`aesi tables`: the paper's tables rebuilt from the tracking store, and from nothing else.

Each finished run carries its rows as the artifact summary.json. Runs that differ by seed alone are put
together as mean and spread, with their ids beneath; those of other settings or of another version of the program are
named, and left out.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from aesi.errors import InputError
from aesi.logins import without_login
from aesi.pipeline.report import tables
from aesi.pipeline.report.compare import differing_keys
from aesi.pipeline.written import FIGURES, REPORT, SUMMARY
from flows.tracking.experiment_log import CODE, FALLBACK, SETTING, UNFITTED
from flows.tracking.store import KIND, SHORTEST_ID, Store, is_of_experiment, one_of
from flows.tracking.view import NOTE

RANGED = ("test_mser_pct", "test_mser_recalibrated_pct", "coverage_pct")
"""Figures that tables show with their range over seeds."""
COUNTED = ("diverged",)
"""Figures that are summed over the runs of one setting, not averaged."""
NO_SETTING = ("seed", "versions", "search.workers", "search.timeout_s", "search.memory_mb")
NO_SETTINGS = ("chosen_", "runner.", "tracking.")
"""Tracked parameters, and beginnings of some, that tell runs of one setting apart."""
MOST_NAMED = 6
"""Runs, or keys of settings, in one sentence: more are counted. A convention."""


@dataclass(frozen=True)
class _LeftOut:
    """Finished runs that are not shown, newest first."""

    by_setting: tuple[Any, ...] = ()
    by_program: tuple[Any, ...] = ()


def tables_of(
    experiment: str,
    format: Literal["md", "tex", "csv"] = "md",
    run_ids: Sequence[str] = (),
    figures: Path | None = None,
    uri: str | None = None,
) -> str:
    """The tables of the latest finished runs of an experiment, one a seed; of `run_ids` where given.

    figures : a folder that gets the tracked reports and figures.
    Raises InputError where nothing of that name was tracked.
    """
    name, place = tracked_as(experiment)
    store = Store.to_read(uri or place)
    runs, left_out = _chosen(store, name, run_ids)
    summaries = [_summary(store, run) for run in runs]
    rows = merged([summary["models"] for summary in summaries])
    if figures is not None:
        for run in runs:
            _copy_figures(store, run.info.run_id, figures / run.info.run_id)
    text = tables.render(rows, format)
    return f"{text}\n{_footer(name, runs, left_out, format)}"


def merged(runs: Sequence[Sequence[dict[str, Any]]]) -> list[dict[str, Any]]:
    """Rows of several runs as one set: the mean of every number, and of RANGED the range over seeds."""
    if len(runs) == 1:
        return list(runs[0])
    names = list(dict.fromkeys(row["name"] for rows in runs for row in rows))
    return [_mean([row for rows in runs for row in rows if row["name"] == name]) for name in names]


def _mean(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {**_mean_value(rows), "seeds": len(rows)}


def _mean_value(values: Sequence[Any]) -> Any:
    present = [value for value in values if value is not None]
    if not present:
        return None
    first = present[0]
    if isinstance(first, Mapping):
        keys = dict.fromkeys(key for value in present for key in value)
        mean = {key: _mean_value([value.get(key) for value in present]) for key in keys}
        mean |= {key: sum(value.get(key) or 0 for value in present) for key in keys if key in COUNTED}
        spread = {key: _ends([value.get(key) for value in present]) for key in keys if key in RANGED}
        return mean | ({"spread": spread} if spread else {})
    if isinstance(first, (int, float)) and not isinstance(first, bool):
        return sum(present) / len(present)
    return first


def _ends(values: Sequence[float | None]) -> list[float] | None:
    present = [value for value in values if value is not None]
    return [min(present), max(present)] if present else None


def tracked_as(experiment: str) -> tuple[str, str | None]:
    """The name of an experiment that is given by its name or its file, and the store that its file names, if any."""
    path = Path(experiment)
    if path.suffix not in (".yaml", ".yml"):
        return experiment, None
    if not path.exists():
        return path.stem, None
    from aesi.pipeline.experiment.config import read_experiment

    config = read_experiment(path)
    return config.name, config.tracking.uri


def _chosen(store: Store, name: str, run_ids: Sequence[str]) -> tuple[list[Any], _LeftOut]:
    """The runs asked for, else the newest finished run of each seed that shares setting and program with the newest
    run; and what is left out: all of other settings, and those of seeds that only another version of the program has
    run.
    """
    finished = _finished(store, name)
    if run_ids:
        asked = {run.info.run_id: run for run in (_by_id(finished, i, name) for i in run_ids)}
        return _of_one_setting(asked), _LeftOut()
    if not finished:
        raise InputError(
            f"experiment {name!r} has no finished run yet; `aesi run` makes one{_of_other_jobs(store, name)}."
        )
    newest = finished[0].data.tags
    of_program: dict[str, Any] = {}
    of_others: dict[str, Any] = {}
    otherwise_set = []
    for run in finished:
        tags, seed = run.data.tags, run.data.params.get("seed", "0")
        if tags.get(SETTING) == newest.get(SETTING):
            same = tags.get(CODE) == newest.get(CODE)  # runs of before it was tracked stay together
            (of_program if same else of_others).setdefault(seed, run)
        else:
            otherwise_set.append(run)
    left_out = {seed: run for seed, run in of_others.items() if seed not in of_program}
    return _by_seed(of_program), _LeftOut(tuple(otherwise_set), tuple(_by_seed(left_out)))


def _of_other_jobs(store: Store, name: str) -> str:
    """A clause on discoveries, batches and benchmarks that are tracked under the name; '' for fewer than two."""
    found = store.find_experiment(name)
    jobs = [] if found is None else store.jobs(found)
    others = sum(run.info.status == "FINISHED" and not is_of_experiment(run) for run in jobs)
    if others < 2:
        return ""
    return f". Discoveries, batches and benchmarks have none; `aesi compare {name}` shows the {others} that are there"


def _finished(store: Store, name: str) -> list[Any]:
    """The finished runs of an experiment, newest first. Discoveries, batches and benchmarks that are tracked under the
    same name have no tables, and are left out."""
    experiment_id = store.find_experiment(name)
    if experiment_id is None:
        known = sorted(e.name for e in store.client.search_experiments() if e.name != "Default")
        there = f" Tracked so far: {', '.join(known)}." if known else " Nothing is tracked there yet."
        raise InputError(f"no experiment {name!r} is tracked in {without_login(store.uri)}.{there}")
    condition = f"tags.`{KIND}` = 'run' and attributes.status = 'FINISHED'"
    return [run for run in store.runs(experiment_id, condition) if is_of_experiment(run)]


def _by_seed(runs: Mapping[str, Any]) -> list[Any]:
    return [runs[seed] for seed in sorted(runs, key=int)]


def _of_one_setting(asked: Mapping[str, Any]) -> list[Any]:
    """The runs by their ids.  Raises InputError where more than the seed differs: a mean of them would say nothing."""
    settings = {
        ((run.data.tags.get(SETTING), run.data.tags.get(CODE)), run.data.params.get("seed")): i
        for i, run in asked.items()
    }
    if len({setting for setting, _ in settings}) > 1 or len(settings) < len(asked):
        raise InputError(
            f"the runs {' and '.join(asked)} do not differ by their seeds alone, and a mean of them would say nothing; "
            f"`aesi compare {' '.join(asked)}` shows them side by side."
        )
    return list(asked.values())


def _by_id(finished: Sequence[Any], run_id: str, name: str) -> Any:
    found = one_of(finished, run_id)
    if found is None:
        there = _some([run.info.run_id[:8] for run in finished]) or "none"
        raise InputError(
            f"--run {run_id} is no finished run of {name!r}; give its id, or the beginning of at least {SHORTEST_ID} "
            f"letters. There are: {there}."
        )
    return found


def _summary(store: Store, run: Any) -> dict[str, Any]:
    return dict(json.loads(store.read(run, SUMMARY).read_text(encoding="utf-8")))


def _copy_figures(store: Store, run_id: str, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for item in store.client.list_artifacts(run_id):
        if item.path in (REPORT, FIGURES):
            store.client.download_artifacts(run_id, item.path, str(folder))


def _footer(name: str, runs: Sequence[Any], left_out: _LeftOut, format: str) -> str:
    text = f"Experiment {name}, tracked run{'s' if len(runs) > 1 else ''} {_ids(runs)}."
    if len(runs) > 1:
        text = f"Mean over {len(runs)} seeds. {text}"
    about, below, _ = runs[0].data.tags.get(NOTE, "").partition("\n\n")
    if about and below:  # without a note what came of that one run stands there alone
        text = f"{text} {about.splitlines()[0].rstrip('.')}."
    for run in runs:
        told = (run.data.tags.get(tag) for tag in (FALLBACK, UNFITTED))
        text = " ".join((text, *filter(None, told)))
    text += _left_out_words(left_out, runs[0])
    return {"md": text, "tex": f"% {text}", "csv": f"# {text}"}[format]


def _left_out_words(left_out: _LeftOut, shown: Any) -> str:
    """Sentences on the runs that are left out, each after a space."""
    text = ""
    if left_out.by_program:
        text = f" Left out, as of another version of the program: {_ids(left_out.by_program)}."
    if others := left_out.by_setting:
        keys = _set_otherwise(shown.data.params, [run.data.params for run in others])
        text += (
            f" {len(others)} run{'s' if len(others) > 1 else ''} with other settings{keys and f' ({keys})'} left out: "
            f"{_some([run.info.run_id[:8] for run in others])}; --run ID takes one."
        )
    return text


def _ids(runs: Sequence[Any]) -> str:
    return ", ".join(f"{run.info.run_id} (seed {run.data.params.get('seed', '?')})" for run in runs)


def _set_otherwise(shown: Mapping[str, str], others: Sequence[Mapping[str, str]]) -> str:
    """Keys of the settings in which any of the others differs from what is shown."""
    return _some(
        [
            key
            for key in differing_keys((shown, *others))
            if key not in NO_SETTING and not key.startswith(NO_SETTINGS)
        ]
    )


def _some(words: Sequence[str]) -> str:
    """`a, b, c and 4 more`."""
    more = len(words) - MOST_NAMED
    return ", ".join(words[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
