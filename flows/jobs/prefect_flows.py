"""The flows as Prefect knows them: parameters that a form can ask for, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from prefect import flow

from flows.base import environment
from flows.base.console import Console
from flows.jobs.experiment import run_experiment
from flows.jobs.run_request import RunRequest
from flows.jobs.stages import as_tasks


@flow(name="experiment", flow_run_name="{path}", validate_parameters=False, persist_result=False)
def experiment(
    path: str,
    overrides: list[str] | None = None,
    runner: Literal["local", "dask"] | None = None,
    address: str | None = None,
    resume: bool = False,
    use_cache: bool = True,
) -> Path:
    """The whole job of `aesi run`: data, physics, search, ensembles, intervals, tables, figures, report."""
    environment.prepare()
    console = Console()
    request = RunRequest(path, tuple(overrides or ()), runner, address, resume, use_cache)
    limit_s = request.config().runner.stage_timeout_s
    return run_experiment(request, as_tasks(console.say, limit_s), console)


@flow(name="discovery", flow_run_name="{path}", validate_parameters=False, persist_result=False)
def discovery(path: str, overrides: list[str] | None = None, out: str | None = None) -> dict[str, Any]:
    """The whole job of `aesi discover` on the case that an experiment file describes."""
    from flows.jobs.discovery import case_and_folder, trace

    environment.prepare()
    console = Console()
    case, folder, name = case_and_folder(path, overrides or (), Path(out) if out else None)
    return trace(case, folder, as_tasks(console.say), console, name)
