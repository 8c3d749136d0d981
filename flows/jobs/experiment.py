"""The stages of an experiment, as the paper's table of contents.

    data and physics -> search -> final models -> intervals -> validation -> evaluation -> report -> comparison

Killed at any moment and started again with --resume, it finds finished candidates by their content, evaluates
the rest, tracks each once, and ends with the result of an uninterrupted run.
"""

from __future__ import annotations

import os
import re
import shlex
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flows.base import environment
from flows.base.console import Console, duration
from flows.jobs.run_request import RunRequest
from flows.jobs.run_session import working_on

if TYPE_CHECKING:
    from flows.jobs.stages import Stages
    from flows.tracking.tracker import Tracker


def run_experiment(request: RunRequest, run: Stages, console: Console) -> Path:
    """The flow itself; `run` runs a stage."""
    from flows.tracking.store import Store

    started = time.monotonic()
    config = request.config
    console.say(f"{config.name}: {config.note}" if config.note else config.name)
    store = Store(config.tracking.uri)
    with working_on(request, store, console) as tracker:
        folder = _stages(request, tracker, run, console, started)
    console.say(f"Finished in {duration(time.monotonic() - started)}.")
    console.say(f"Report: {_shown(folder / 'report.html')}")
    where = _uri_option(config.tracking.uri)
    console.say(f"Runs:   aesi ui{where}        Tables: aesi tables {config.name}{where}")
    return folder


def _uri_option(uri: str | None) -> str:
    """What finds the store of an experiment that names one, as a shell takes it; without the login in it."""
    from flows.tracking.store import without_login

    return f" --uri {shlex.quote(without_login(uri))}" if uri else ""


def _stages(
    request: RunRequest,
    tracker: Tracker,
    run: Stages,
    console: Console,
    started: float,
) -> Path:
    from aesi.pipeline.experiment.comparison import comparison
    from aesi.pipeline.experiment.fit import build_problem, final_models
    from aesi.pipeline.experiment.intervals.conformalise import conformalise
    from aesi.pipeline.experiment.judging.evaluate import evaluate_models
    from aesi.pipeline.experiment.judging.validation import validation_mser
    from aesi.pipeline.experiment.load import load
    from aesi.pipeline.experiment.outputs import Result, write_outputs
    from aesi.pipeline.notes import together
    from flows.base.stage_cache import Cache
    from flows.search.study import run_study
    from flows.tracking.experiment_log import UNFITTED, CandidateTracker, track_result, track_start

    loaded = run("data and physics", lambda: load(request.config), retries=2)
    config = loaded.config  # that of the fallback where it fell back to one
    for note in together(loaded.notes):
        console.say(f"  {note}")
    folder = environment.run_folder(config.name, tracker.run_id)
    track_start(tracker, config, loaded, folder)
    problem = run("library and resamples", lambda: build_problem(loaded, config))
    # Bad input has been refused by now, and a run that it refuses is taken back.
    console.say(f"run {tracker.run_id} {'resumed' if tracker.resumed else 'started'}")
    follow = CandidateTracker(tracker, config, loaded, problem)
    name = f"{config.name}, seed {config.seed} ({tracker.run_id[:8]})"
    found = run(
        "search",
        lambda: run_study(
            problem,
            config,
            console,
            request.use_cache,
            follow,
            publish_as=name,
            on_generation=lambda done, total: run.progress("search", done, total),
            lost_again=not tracker.resumed,
        ),
    )
    tracker.metrics({f"importance/{gene}": share for gene, share in found.result.importances().items()})
    cache = Cache(console.say, request.use_cache)
    key = (config.digest, found.key)
    models = run(
        "final models",
        lambda: final_models(
            problem, found.chosen, config, lambda name, fit: cache.get(f"model {name}", key, fit)
        ),
    )
    for note in models.unfitted:
        console.say(f"  {note}")
    if models.unfitted:
        tracker.parameters({}, {UNFITTED: " ".join(models.unfitted)})
    fitted = run(
        "intervals", lambda: conformalise(models.fitted, problem, found.chosen, config, loaded.left_out)
    )
    validation = run("validation", lambda: validation_mser(loaded, problem, found.candidates()))
    evaluation = run("evaluation", lambda: evaluate_models(fitted, loaded.split, validation))
    seconds = time.monotonic() - started
    rows = found.rows()
    result = Result(
        config,
        loaded,
        problem,
        found.chosen,
        rows,
        fitted,
        evaluation,
        tracker.run_id,
        seconds,
        failed=len(found.result.trials) - len(rows),
        unfitted=models.unfitted,
    )
    summary = run("report", lambda: write_outputs(folder, result))
    console.say(summary["finding"])
    tracker.json("comparison.json", run("comparison", lambda: comparison(result)))
    track_result(tracker, folder, summary, found.number, fitted, config.note)
    slug = re.sub("[^a-z0-9]+", "-", config.name.lower()).strip("-")
    run.publish(f"{slug}-report", _page(folder, summary, tracker), f"What came of {config.name}")
    run.publish(
        f"{slug}-tables", (folder / "tables.md").read_text(encoding="utf-8"), f"Tables of {config.name}"
    )
    return folder


def _page(folder: Path, summary: Mapping[str, Any], tracker: Tracker) -> str:
    """The headline of the report as Prefect shows it, and where the rest is."""
    from flows.tracking.experiment_log import result_line

    row = next(row for row in summary["models"] if row["name"] == summary["chosen"])
    lines = [f"# {row['name']}, {row['terms']} terms", "", result_line(row), ""]
    if summary["fallback"]:
        lines += [f"**{summary['fallback']}**", ""]
    lines += [f"- report: `{folder / 'report.html'}`", f"- tracked: [{tracker.run_id}]({tracker.address})"]
    return "\n".join(lines)


def _shown(path: Path) -> str:
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)
