"""The flows as Prefect knows them: parameters that a form can ask for, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from prefect import flow

from flows.console import Console
from flows.run import Order, _experiment
from flows.stages import as_tasks


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
    console = Console()
    order = Order(path, tuple(overrides or ()), runner, address, resume, use_cache)
    return _experiment(order, as_tasks(console.say), console)
