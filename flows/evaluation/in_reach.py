"""Whether those that a job needs beyond this process answer, asked before its work begins."""

from __future__ import annotations

from aesi.pipeline.experiment.sections import RunnerConfig


def check_in_reach(runner: RunnerConfig) -> None:
    """Raises InputError for a database or an address that cannot be used, AesiError where no Dask scheduler answers."""
    if runner.storage is not None:
        from flows.evaluation.outcome_database import DatabaseOutcomes

        DatabaseOutcomes(runner.storage).close()
    if runner.kind == "dask":
        from flows.evaluation.dask_pool import check_scheduler

        check_scheduler(runner.address)
