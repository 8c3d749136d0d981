"""The pool that an experiment asks for: processes of this machine, or Dask workers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from aesi.pipeline.experiment.candidate import scorer
from aesi.pipeline.experiment.config import NO_PART, ExperimentConfig
from aesi.sparse import Problem
from flows.evaluation.local_pool import LocalPool
from flows.evaluation.pool import Pool
from flows.evaluation.scorer_recipe import build_scorer


def open_pool(problem: Problem, config: ExperimentConfig, study: str) -> Pool:
    """Who evaluates the candidates of the experiment; study : its content key."""
    content = config.model_dump_json(exclude=set(NO_PART))  # no password goes to workers, who need none
    search = config.search
    if config.runner.kind == "dask":
        from flows.evaluation.dask_pool import DaskPool

        where, limits = config.runner.address, (search.timeout_s, search.memory_mb)
        return DaskPool(content, str(config.base), where, search.workers, *limits, study)
    build = _Builder(partial(scorer, problem, config), partial(build_scorer, content, str(config.base)))
    return LocalPool(build, search.workers, search.timeout_s, search.memory_mb)


class _Builder:
    """Makes the evaluating function in a process; only the recipe travels where memory is not shared."""

    def __init__(self, shared: Callable[[], Any], recipe: Callable[[], Any]) -> None:
        self._shared: Callable[[], Any] | None = shared
        self._recipe = recipe

    def __call__(self) -> Any:
        return (self._shared or self._recipe)()

    def __getstate__(self) -> dict[str, Any]:
        return {"_shared": None, "_recipe": self._recipe}
