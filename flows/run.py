"""`aesi run`: the paper's table of contents as a flow.

    data and physics -> search -> final models -> intervals -> evaluation -> report

Killed at any moment and started again with --resume, it finds finished candidates by their content, evaluates
the rest, tracks each once, and ends with the result of an uninterrupted run.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from aesi.pipeline.config import ExperimentConfig, RunnerConfig, read_experiment
from flows import environment
from flows.console import Console, duration
from flows.state import RunLock, RunRecord, records

if TYPE_CHECKING:
    from flows.mlflow_store import Store
    from flows.tracking import Tracker

NO_SERVER = "connect to ephemeral Prefect API server"
UNFINISHED = ("running", "killed", "failed")


@dataclass(frozen=True)
class Order:
    """What was asked for on the command line."""

    path: str
    overrides: tuple[str, ...] = ()
    runner: Literal["local", "dask"] | None = None
    address: str | None = None
    resume: bool = False
    use_cache: bool = True

    def config(self) -> ExperimentConfig:
        """The experiment with all overrides."""
        config = read_experiment(self.path, self.overrides)
        if self.runner is None and self.address is None:
            return config
        kind = self.runner or ("dask" if self.address else config.runner.kind)
        runner = RunnerConfig(kind=kind, address=self.address, storage=config.runner.storage)
        return config.model_copy(update={"runner": runner})


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
    order = Order(str(path), tuple(overrides), runner, address, resume, use_cache)
    order.config()  # bad input is refused before anything is started
    if use_prefect:
        try:
            return _under_prefect(order)
        except RuntimeError as error:
            if NO_SERVER not in str(error):
                raise
            Console().say("Prefect's temporary server did not start in time; the stages run without it.")
    from flows.stages import plainly

    console = Console()
    return run_order(order, plainly(console.say), console)


def _under_prefect(order: Order) -> Path:
    environment.make_prefect_home()  # before Prefect loads: it makes no parent folders
    from flows.deployed import experiment

    folder: Path = experiment(
        order.path,
        list(order.overrides),
        runner=order.runner,
        address=order.address,
        resume=order.resume,
        use_cache=order.use_cache,
    )
    return Path(folder)


def run_order(order: Order, run: Any, console: Console) -> Path:
    """The flow itself; `run` runs a stage."""
    from flows.mlflow_store import Store

    started = time.monotonic()
    config = order.config()
    console.say(f"{config.name}: {config.note}" if config.note else config.name)
    store = Store(config.tracking.uri)
    with _working_on(config, store, order.resume, console) as tracker:
        folder = _stages(config, order, tracker, run, console, started)
    console.say(f"Finished in {duration(time.monotonic() - started)}.")
    console.say(f"Report: {_shown(folder / 'report.html')}")
    console.say(f"Runs:   aesi ui        Tables: aesi tables {config.name}")
    return folder


def _stages(
    config: ExperimentConfig, order: Order, tracker: Tracker, run: Any, console: Console, started: float
) -> Path:
    from aesi.pipeline.conformalise import conformalise
    from aesi.pipeline.evaluate import evaluate
    from aesi.pipeline.fit import build_problem, final_models
    from aesi.pipeline.load import load
    from aesi.pipeline.outputs import Result, write_outputs
    from flows.cache import Cache
    from flows.studies import run_study
    from flows.tracked import CandidateTracker, track_result, track_start

    loaded = run("data and physics", lambda: load(config), retries=2)
    for note in loaded.notes:
        console.say(f"  {note}")
    track_start(tracker, config, loaded)
    problem = run("library and resamples", lambda: build_problem(loaded, config))
    follow = CandidateTracker(tracker, config, loaded, problem)
    found = run("search", lambda: run_study(problem, config, console, order.use_cache, follow))
    cache = Cache(console.say, order.use_cache)
    key = (config.digest, found.key)
    models = run(
        "final models",
        lambda: cache.get("final models", key, lambda: final_models(problem, found.chosen, config)),
    )
    fitted = run("intervals", lambda: conformalise(models, problem, found.chosen, config))
    evaluation = run("evaluation", lambda: evaluate(fitted, loaded.split))
    folder = environment.workspace() / "runs" / config.name / tracker.run_id
    seconds = time.monotonic() - started
    result = Result(
        config, loaded, problem, found.chosen, found.rows(), fitted, evaluation, tracker.run_id, seconds
    )
    summary = run("report", lambda: write_outputs(folder, result))
    track_result(tracker, folder, summary, found.number, result.best)
    return folder


@contextmanager
def _working_on(config: ExperimentConfig, store: Store, resume: bool, console: Console) -> Iterator[Tracker]:
    """The tracked run to work on, new or resumed, closed as what it becomes."""
    from flows.tracking import Tracker, deliver_leftovers

    _close_killed(config.name, store, console)
    deliver_leftovers(store, console.say)
    old = _unfinished(config, store, console) if resume else None
    tracker = Tracker(store, config, console.say, old.run_id if old else None)
    record = (
        replace(old, status="running")
        if old
        else RunRecord(tracker.run_id, config.name, config.digest, store.uri, time.time())
    )
    record.write()
    console.say(f"run {tracker.run_id} {'resumed' if old else 'started'}")
    with RunLock(tracker.run_id):
        try:
            yield tracker
        except KeyboardInterrupt:
            replace(record, status="killed").write()
            console.say(
                f"Stopped. Everything so far is kept; go on with: aesi run {config.name} ... --resume"
            )
            tracker.end("KILLED", wait_s=5)
            raise
        except BaseException:
            replace(record, status="failed").write()
            tracker.end("FAILED", wait_s=10)
            raise
        left = tracker.end("FINISHED")
        replace(record, status="finished").write()
        if left:
            console.say(
                f"tracking: {left} items could not be delivered to {store.uri}; the next run delivers them."
            )


def _unfinished(config: ExperimentConfig, store: Store, console: Console) -> RunRecord | None:
    """The newest unfinished run of the same experiment and settings that nobody works on."""
    for record in records(config.name):
        if record.status not in UNFINISHED or record.uri != store.uri:
            continue
        if record.config_digest != config.digest:
            continue
        lock = RunLock(record.run_id)
        if lock.acquire():
            lock.release()
            return record
    console.say("There is no unfinished run with these settings; a new one is started.")
    return None


def _close_killed(experiment: str, store: Store, console: Console) -> None:
    """A run that was killed stays RUNNING in MLflow for ever; whoever comes next closes it."""
    for record in records(experiment):
        if record.status != "running" or record.uri != store.uri:
            continue
        with RunLock(record.run_id) as lock:
            if lock.held:
                replace(record, status="killed").write()
                _terminate(store, record.run_id)
                console.say(f"run {record.run_id} had been killed; it is closed as such.")


def _terminate(store: Store, run_id: str) -> None:
    from mlflow.exceptions import MlflowException

    try:
        store.client.set_terminated(run_id, "KILLED")
    except (MlflowException, OSError):
        return  # the run is gone from the store: nothing to close


def _shown(path: Path) -> str:
    try:
        return os.path.relpath(path)
    except ValueError:
        return str(path)
