"""`aesi run` and `aesi discover`: under Prefect, or as the plain functions that the stages are."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from aesi.errors import first_line
from flows.base import environment
from flows.base.console import Console
from flows.jobs.discovery import TrackedUnder, check_case, finding_folder, run_discovery
from flows.jobs.experiment import run_experiment
from flows.jobs.run_request import HandedOver, RunRequest
from flows.jobs.stages import PlainStages, server_in_reach
from flows.jobs.temporary_server import (
    CURRENT,
    KeptWork,
    ServerNotStarted,
    ended_by_signal,
    of_prefect,
    start_server,
)

if TYPE_CHECKING:
    from aesi.pipeline.discovery.discover import Case

T = TypeVar("T")


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
    environment.prepare_process()
    from aesi.pipeline.experiment.load import check_declared
    from aesi.pipeline.experiment.sources import check_roles, check_there
    from flows.evaluation.in_reach import check_in_reach
    from flows.tracking.store import check_reached

    request = RunRequest(str(path), tuple(overrides), runner, address, resume, use_cache, use_prefect)
    config = request.config  # bad input is refused before anything is started
    check_roles(config)
    check_there(config)
    check_in_reach(config.runner)
    check_reached(config.tracking.uri)
    check_declared(config)
    if config.data.kind == "files":  # long records at 10 Hz take seconds each
        Console().say(f"Reading {', '.join(Path(name).name for name in config.data.listed)} ...")
    with suppress(OSError):  # of a disk, which the stage tries again
        _ = request.sources

    def under_prefect() -> Path:
        from flows.jobs.prefect_flows import experiment

        folder: Path = experiment(
            request.path,
            request.shown_overrides,
            runner=request.runner,
            address=request.shown_address,
            resume=request.resume,
            use_cache=request.use_cache,
            handed=HandedOver(request),
        )
        return Path(folder)

    def plainly() -> Path:
        console = Console()
        return run_experiment(request, PlainStages(console.say, config.runner.stage_timeout_s), console)

    return _with_or_without(under_prefect, plainly, use_prefect)


def discover(
    case: Case,
    out: Path,
    use_prefect: bool = True,
    request: RunRequest | None = None,
) -> dict[str, Any]:
    """Trace one case and write the finding to `out`; returns the content of discovery.json.

    request : of the experiment file that describes the case and how it is tracked, if one does.
    Raises AesiError, one sentence, for what cannot be used; nothing is started then.
    """
    environment.prepare_process()
    from flows.base.store_address import checked_address

    under = TrackedUnder.of(request.config) if request else TrackedUnder()
    checked_address(under.tracking.uri)
    check_case(case)

    def under_prefect() -> dict[str, Any]:
        from flows.jobs.prefect_flows import discovery

        found: dict[str, Any] = discovery(
            path=request.path if request else None,
            overrides=request.shown_overrides if request else [],
            out=str(out),
            cell=case.cell.name.removesuffix(".json").removesuffix(".bpx"),
            data=[one.name for one in case.measurements],
            case=case,
            handed=HandedOver(request) if request else None,
        )
        return found

    def plainly() -> dict[str, Any]:
        console = Console()
        return run_discovery(case, out, PlainStages(console.say), console, under)

    return _with_or_without(under_prefect, plainly, use_prefect)


def discover_experiment(
    request: RunRequest, out: Path | None = None, use_prefect: bool = True
) -> dict[str, Any]:
    """Trace the case that an experiment file describes; its results go below runs/ where no folder is given."""
    from aesi.pipeline.discovery.cases import case_of_experiment

    config = request.config
    return discover(case_of_experiment(config), out or finding_folder(config), use_prefect, request)


def _with_or_without(under_prefect: Callable[[], T], plainly: Callable[[], T], use_prefect: bool) -> T:
    """Under Prefect where it is wanted and answers; what the job came to does not depend on it."""
    if not use_prefect:
        return plainly()
    try:
        environment.make_prefect_home()  # before Prefect loads: it makes no parent folders
    except OSError as error:
        Console().say(
            f"Prefect has no place ({error.filename}: {error.strerror}); the stages run without it."
        )
        return plainly()
    if not os.environ.get("PREFECT_API_URL"):  # said at once: on a busy machine it takes half a minute
        Console().say("Starting Prefect's temporary server (--no-prefect runs the stages without it) ...")
    job: KeptWork[T] = KeptWork()
    token = CURRENT.set(job)
    try:
        start_server()
        with server_in_reach():
            return under_prefect()
    except ServerNotStarted as reason:
        Console().say(f"Prefect's temporary server did not start ({reason}); the stages run without it.")
    except Exception as error:
        if ended_by_signal(error):  # between Prefect's first steps and those of the job
            signal.raise_signal(signal.SIGTERM)
        if not of_prefect(error):
            raise
        if not job.errors:
            Console().say(
                f"prefect: its server is lost ({first_line(error)}); the run's results do not depend on it."
            )
    finally:
        CURRENT.reset(token)
    return job.outcome(plainly)
