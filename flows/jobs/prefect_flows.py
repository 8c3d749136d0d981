"""The jobs as Prefect knows them: parameters that a form can ask for, names that a person would give."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from prefect import flow
from prefect.runtime import flow_run

from flows.base import environment
from flows.base.console import Console
from flows.jobs.discovery import TrackedUnder, finding_folder, run_discovery
from flows.jobs.experiment import run_experiment
from flows.jobs.run_request import RunRequest
from flows.jobs.stages import PrefectStages
from flows.jobs.temporary_server import as_the_job


def _experiment_name() -> str:
    """`measured_nmc, seed 0`."""
    given = flow_run.parameters
    handed = given.get("handed")
    asked = handed.request if handed else RunRequest(given["path"], tuple(given.get("overrides") or ()))
    return str(asked.title)


def _discovery_name() -> str:
    """`what nmc_30ah lacks on drive.csv`."""
    given = flow_run.parameters
    if given.get("case") is None:
        return f"what the model lacks, {Path(given['path']).stem}"
    return f"what {given['cell']} lacks on {', '.join(given['data'])}"


@flow(name="experiment", flow_run_name=_experiment_name, validate_parameters=False, persist_result=False)
def experiment(
    path: str,
    overrides: list[str] | None = None,
    runner: Literal["local", "dask"] | None = None,
    address: str | None = None,
    resume: bool = False,
    use_cache: bool = True,
    handed: Any = None,
) -> Path:
    """The whole job of `aesi run`: data, physics, search, ensembles, intervals, tables, figures, report.

    handed : all of the above with the file as it was read, which only a process that has read it can hand over. A
    deployment gives none, and the file is read as the flow starts.
    """
    environment.prepare_process()
    console = Console()
    asked = RunRequest(path, tuple(overrides or ()), runner, address, resume, use_cache)
    request = handed.request if handed else asked
    limit_s = request.config.runner.stage_timeout_s
    return as_the_job(lambda: run_experiment(request, PrefectStages(console.say, limit_s), console))


@flow(name="discovery", flow_run_name=_discovery_name, validate_parameters=False, persist_result=False)
def discovery(
    path: str | None = None,
    overrides: list[str] | None = None,
    out: str | None = None,
    cell: str = "",
    data: list[str] | None = None,
    case: Any = None,
    handed: Any = None,
) -> dict[str, Any]:
    """The whole job of `aesi discover`.

    path : an experiment file that describes the case and how it is tracked, as a deployment gives it.
    case : which only a process that has read the records can hand over: `cell` and `data` then say what it is about.
    handed : `path` and `overrides` with the file as that process has read it, which says how the case is tracked.
    """
    environment.prepare_process()
    from aesi.pipeline.discovery.cases import case_of_experiment

    console = Console()
    folder = Path(out) if out else None
    under = TrackedUnder()
    if case is None:
        asked = handed.request if handed else RunRequest(str(path), tuple(overrides or ()))
        case, under = case_of_experiment(asked.config), TrackedUnder.of(asked.config)
        folder = folder or finding_folder(asked.config)
    elif handed:
        under = TrackedUnder.of(handed.request.config)
    assert folder is not None  # `aesi discover` with records asks for one
    stages = PrefectStages(console.say)
    return as_the_job(lambda: run_discovery(case, folder, stages, console, under))
