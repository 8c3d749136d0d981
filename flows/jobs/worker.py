"""`aesi worker`: one more process on a study.

A worker walks through the same search as `aesi run` with the same file and the same --set, takes candidates
that nobody has claimed, and ends when all are known. It tracks nothing: that is left to the run, so that the
store has one writer. Across machines the candidates are shared through `runner.storage`, a database URL;
on one machine through the workspace.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from aesi.errors import AesiError, FitError
from aesi.numerics.files.whole import check_writable
from aesi.pipeline.experiment.config import read_experiment
from flows.base.console import Console, duration


class NotShared(AesiError):
    """What a worker evaluates would reach nobody."""


def work(path: Path, overrides: Sequence[str]) -> int:
    """Evaluate candidates of an experiment until all are known; returns how many this process evaluated.

    Raises NotShared, before any is, where others could not use what it evaluates.
    """
    from aesi.pipeline.experiment.fit import build_problem
    from aesi.pipeline.experiment.load import load
    from flows.evaluation.generation import Tally
    from flows.evaluation.in_reach import check_in_reach
    from flows.search.study import run_study, shared_folder

    console = Console()
    config = read_experiment(path, overrides)
    check_in_reach(config.runner)
    if config.runner.storage is None:
        _check_shared(shared_folder())
    where = "the database of runner.storage" if config.runner.storage else "this workspace"
    console.say(f"{config.name}: a worker on the candidates shared in {where}")
    started = time.monotonic()
    problem = build_problem(load(config), config)
    tally = Tally()
    try:
        run_study(problem, config, console, tally=tally)
    except FitError as error:
        console.say(f"  {error}")  # the run that picks from these candidates fails; the work is done
    console.say(f"{tally.evaluated} candidates evaluated here, in {duration(time.monotonic() - started)}")
    return tally.evaluated


def _check_shared(folder: Path) -> None:
    try:
        check_writable(folder / "any")
    except OSError as error:
        raise NotShared(
            f"{error.filename}: {error.strerror}; nobody could use the candidates that a worker evaluates here: name "
            "the run's workspace by AESI_HOME, or a database by runner.storage."
        ) from None
