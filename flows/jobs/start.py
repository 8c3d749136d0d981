"""`aesi run`: under Prefect, or as the plain functions that the stages are."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from flows.base import environment
from flows.base.console import Console
from flows.jobs.experiment import run_experiment
from flows.jobs.run_request import RunRequest
from flows.jobs.stages import plainly, server_in_reach

NO_SERVER = "connect to ephemeral Prefect API server"


def start(
    path: Path | str,
    overrides: Sequence[str] = (),
    runner: Literal["local", "dask"] | None = None,
    address: str | None = None,
    resume: bool = False,
    use_cache: bool = True,
    use_prefect: bool = True,
) -> Path:
    """Run an experiment; the folder of its results. Raises AesiError where it cannot be done."""
    environment.prepare()
    console = Console()
    request = RunRequest(str(path), tuple(overrides), runner, address, resume, use_cache)
    config = request.config()  # bad input is refused before anything is started
    console.say(f"{config.name}: loading the libraries ...")  # at once: on a busy machine they take long
    if use_prefect:
        if not os.environ.get("PREFECT_API_URL"):
            console.say("Starting Prefect's temporary server (--no-prefect runs the stages without it) ...")
        try:
            return _under_prefect(request)
        except RuntimeError as error:
            if NO_SERVER not in str(error):
                raise
            console.say("Prefect's temporary server did not start in time; the stages run without it.")
    return run_experiment(request, plainly(console.say, config.runner.stage_timeout_s), console)


def _under_prefect(request: RunRequest) -> Path:
    environment.make_prefect_home()  # before Prefect loads: it makes no parent folders
    from flows.jobs.prefect_flows import experiment

    with server_in_reach():
        folder: Path = experiment(
            request.path,
            list(request.overrides),
            runner=request.runner,
            address=request.address,
            resume=request.resume,
            use_cache=request.use_cache,
        )
    return Path(folder)
