"""`aesi run` as a flow: the stages of an experiment, as the paper's table of contents.

    data and physics -> search -> final models -> intervals -> validation -> evaluation -> report -> comparison

Killed at any moment and started again with --resume, it finds finished candidates by their content, evaluates
the rest, tracks each once, and ends with the result of an uninterrupted run.
"""

from __future__ import annotations

import os
import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING

from aesi.logins import login_to_fill_in
from aesi.pipeline.written import REPORT
from flows.base.console import Console, duration
from flows.jobs.run_request import RunRequest
from flows.jobs.run_session import working_on

if TYPE_CHECKING:
    from flows.jobs.stages import Stages


def run_experiment(request: RunRequest, run: Stages, console: Console) -> Path:
    """The flow itself; `run` runs a stage."""
    from flows.tracking.store import Store

    started = time.monotonic()
    config = request.config
    console.say(f"{config.name}: {config.note}" if config.note else config.name)
    store = Store(config.tracking.uri)
    with working_on(request, store, console) as (tracker, record):
        # Seconds, which the first line of a run is not kept for.
        from flows.jobs.experiment_stages import ExperimentJob

        folder = ExperimentJob(request, tracker, record.anew, run, console, started).results()
    console.say(f"Finished in {duration(time.monotonic() - started)}.")
    console.say(f"Report: {_shown(folder / REPORT)}")
    where = _uri_option(config.tracking.uri)
    console.say(f"Runs:   aesi ui{where}        Tables: aesi tables {config.name}{where}")
    return folder


def _uri_option(uri: str | None) -> str:
    """What finds the store of an experiment that names one, as a shell takes it; its login is left to fill in."""
    return f" --uri {shlex.quote(login_to_fill_in(uri))}" if uri else ""


def _shown(path: Path) -> str:
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)
