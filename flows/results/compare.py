"""`aesi compare`: tracked runs side by side, on one offline page, from the tracking store alone."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from aesi.errors import InputError
from aesi.pipeline.report.compare import ComparedRun, write_comparison
from aesi.pipeline.written import COMPARISON, FINDING
from flows.tracking.experiment_log import CODE, OF_A_MODEL
from flows.tracking.store import SHORTEST_ID, Store, is_of_experiment, job_of, one_of
from flows.tracking.tracker import was_cut

FINISHED = "FINISHED"
"""MLflow's word for the state of a run that reached its end."""
OF_THE_RESULT = ("chosen_candidate", "chosen_model")
"""Parameters that are what came of a run, not what was asked for."""
PROGRAM = "program (digest of its code)"
"""What the page calls the tag of the program that ran an experiment."""
DIGITS = 8
"""Of that digest on the page. A convention, as of the ids of runs there."""


def compare(wanted: Sequence[str], out: Path, uri: str | None = None) -> list[ComparedRun]:
    """Write the page about the runs that are named; returns what it shows.

    wanted : run ids, their beginnings or the folders that they wrote, or names of experiments for all finished runs of
    the name: also discoveries, batches and benchmarks, which stand in tables of their own.
    Raises InputError where a name stands for nothing that is tracked, or fewer than two runs are left.
    """
    store = Store.to_read(uri)
    runs = [_compared(store, name, run) for name, run in _chosen(store, wanted)]
    if len(runs) < 2:
        raise InputError(
            f"there is {len(runs) or 'no'} run to compare; name two runs, or an experiment with several."
        )
    write_comparison(out, runs)
    return runs


def _chosen(store: Store, wanted: Sequence[str]) -> list[tuple[str, Any]]:
    """(experiment, run) of what was named, each once, in the order of the names; oldest first in an experiment."""
    experiments = {e.experiment_id: e.name for e in store.client.search_experiments()}
    by_name = {name: number for number, name in experiments.items()}
    known: list[Any] | None = None
    found: dict[str, tuple[str, Any]] = {}
    for name in wanted:
        if name in by_name:
            jobs = store.jobs(by_name[name])
            matching = [run for run in reversed(jobs) if run.info.status == FINISHED]
        else:
            known = known if known is not None else store.all_jobs()
            one = one_of(known, name)
            matching = [one] if one else []
        if not matching:
            ended = (run for run in store.all_jobs() if run.info.status == FINISHED)
            there = ", ".join(sorted({experiments[run.info.experiment_id] for run in ended})) or "none"
            needed = f" (of an id, {SHORTEST_ID} letters at least)" if len(name) < SHORTEST_ID else ""
            raise InputError(
                f"{name!r} is no tracked run{needed} and no experiment with a finished run; experiments with one: "
                f"{there}."
            )
        found |= {run.info.run_id: (experiments[run.info.experiment_id], run) for run in matching}
    return list(found.values())


def _compared(store: Store, experiment: str, run: Any) -> ComparedRun:
    return ComparedRun(
        run_id=run.info.run_id,
        name=run.info.run_name or experiment,
        experiment=experiment,
        started=datetime.fromtimestamp(run.info.start_time / 1000, UTC).strftime("%Y-%m-%d %H:%M"),
        job=job_of(run),
        finished=run.info.status == FINISHED,
        settings=_settings(run),
        metrics=_metrics(run),
        chosen=run.data.params.get("chosen_model", ""),
        judged_on=_judged_on(run.data.params),
        comparison=_content(store, run, COMPARISON),
        discovery=_content(store, run, FINDING) if "verdict" in run.data.tags else {},
        away=store.files_away(run),
    )


def _settings(run: Any) -> dict[str, str]:
    """What was asked for, and the program that ran it: with another one, runs of the same settings differ."""
    asked = {key: text for key, text in run.data.params.items() if key not in OF_THE_RESULT}
    code = run.data.tags.get(CODE)  # runs of before it was tracked, discoveries and benchmarks have none
    return asked if code is None else asked | {PROGRAM: code[:DIGITS]}


def _metrics(run: Any) -> dict[str, float]:
    """By the names of now: runs of earlier versions have a figure of their chosen model by that of a whole run."""
    names = OF_A_MODEL if is_of_experiment(run) else {}
    return {names.get(name, name): value for name, value in run.data.metrics.items()}


def _judged_on(params: Mapping[str, str]) -> str:
    """Key of the rows that a run was tested on, equal for runs that were tested on the same rows. It holds the time
    step of the averages and the digests of the test records, which are tracked after those of the other roles. Where
    one record is cut into parts, where the cell is virtual, and where the list of records was too long to be tracked
    whole, it holds all digests and the choice of the test part."""
    dt_s, asked, read = (
        params.get("data.dt_s"),
        params.get("data.test") or "[]",
        params.get("data_digest", ""),
    )
    if not (was_cut(asked) or was_cut(read)):
        digests, tests = read.split(", "), json.loads(asked)
        if tests and len(digests) > len(tests):
            return json.dumps([dt_s, sorted(digests[-len(tests) :])])
    return json.dumps(
        [dt_s, read, asked, *(params.get(f"data.repeats.{key}") for key in ("period_s", "test"))]
    )


def _content(store: Store, run: Any, name: str) -> dict[str, Any]:
    """A JSON artifact, or nothing where the run carries none: runs of earlier versions have no comparison.json."""
    path = store.artifact(run, name)
    if path is None:
        return {}
    return dict(json.loads(path.read_text(encoding="utf-8")))
