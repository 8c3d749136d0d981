"""A tracked run from its start to its end: finished, failed, interrupted, or killed and closed later."""

from __future__ import annotations

import errno
import shutil
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from aesi.errors import AesiError, InputError
from aesi.logins import without_login
from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.files.whole import check_writable
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.product.contents import contents
from flows.base import environment, fingerprint
from flows.base.console import Console
from flows.base.interrupt import kept_on_interrupt
from flows.jobs.run_request import RunRequest
from flows.tracking.run_records import RunLock, RunRecord, RunTaken, records

if TYPE_CHECKING:
    from flows.tracking.store import Store
    from flows.tracking.tracker import Subject, Trackable, Tracker

UNFINISHED = ("running", "killed", "failed")
BAD_INPUT = InputError.exit_code
"""Some of its kind are not: data that are away are nobody's fault."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


class DiskFull(AesiError):
    """There is no room for what a run has to keep."""


@contextmanager
def working_on(request: RunRequest, store: Store, console: Console) -> Iterator[tuple[Tracker, RunRecord]]:
    """The tracked run to work on, new or resumed, and its record; closed as what it becomes.

    Raises DiskFull, with what to do, where there is no room for what the run has to keep, RunTaken where another
    process works on the run that is to be gone on with, and StoreAway where the store fails before the run has begun.
    """
    config = request.config
    with _advice_where_full(request), ExitStack() as held:
        with store.in_use():
            tracker, record = _begin(request, config, store, console, held)
        kept = f"Everything so far is kept; go on with: {request.resuming}"
        with kept_on_interrupt(kept), _ended_as_it_ends(record, tracker, console):
            yield tracker, record


@contextmanager
def tracked_job(subject: Subject, title: str, console: Console) -> Iterator[Tracker | None]:
    """A tracked run of a job that is no experiment, closed with the status that the job ends with. None, with a
    message, where the store does not answer or nothing can be written in the workspace: the job goes on, since its
    results lie elsewhere.

    title : what the run is called.  Runs that were killed before are closed first, and what they could not deliver is
    delivered.
    """
    from flows.tracking.store import Store, StoreAway

    try:
        check_writable(environment.state() / "state" / "any")
    except OSError as error:
        console.say(
            f"not tracked: {error.filename}: {error.strerror}; AESI_HOME can name a folder for what is tracked."
        )
        yield None
        return
    with ExitStack() as held:
        try:
            store = Store(subject.tracking.uri)
            with store.in_use():
                _put_in_order(store, console)
                tracker, record = _begun(subject, subject.digest, title, store, console, held)
        except StoreAway as error:
            console.say(f"not tracked: {error}")
            yield None
            return
        with _ended_as_it_ends(record, tracker, console):
            yield tracker


@contextmanager
def _ended_as_it_ends(record: RunRecord, tracker: Tracker, console: Console) -> Iterator[None]:
    """Within, this process, which holds the run's lock, works on it; it is closed as finished, failed or killed.

    One that ends at bad input before anything came of it is taken back: nothing has run.
    """
    try:
        yield
    except KeyboardInterrupt:
        _close(record, tracker, "killed", wait_s=5)
        raise
    except InputError as error:
        if tracker.empty and error.exit_code == BAD_INPUT:
            _withdraw(record, tracker)
        else:
            _close(record, tracker, "failed", wait_s=10)
        raise
    except BaseException:
        _close(record, tracker, "failed", wait_s=10)
        raise
    left = tracker.end("FINISHED")
    replace(record, status="finished").write()
    if left:
        place = without_login(tracker.store.uri)
        console.say(f"tracking: {left} items could not be delivered to {place}; the next run delivers them.")


def _begin(
    request: RunRequest, config: ExperimentConfig, store: Store, console: Console, held: ExitStack
) -> tuple[Tracker, RunRecord]:
    """The tracker of the run to work on and its record, after what earlier runs have left is put in order; `held` keeps
    the run's lock, outside of which nothing is done with it."""
    from flows.tracking.tracker import Tracker

    _put_in_order(store, console)
    anew = not request.use_cache
    old = _unfinished(config, store, console, held, anew) if request.resume else None
    if old is None:
        return _begun(config, resume_key(config), request.title, store, console, held, anew)
    record = replace(old, status="running")
    record.write()  # before it runs in the store: who is killed in between is closed there
    return Tracker(store, config, console.say, old.run_id), record


def _begun(
    subject: Trackable,
    key: str,
    title: str,
    store: Store,
    console: Console,
    held: ExitStack,
    anew: bool = False,
) -> tuple[Tracker, RunRecord]:
    """The tracker of a new run and its record, on disk; its lock is in `held`.  key : the record's digest."""
    from flows.tracking.beginnings import noted_beginning
    from flows.tracking.tracker import Tracker

    with noted_beginning(store, subject.name) as tags:
        tracker = Tracker(store, subject, console.say, title=title, tags=tags)
        held.enter_context(RunLock(tracker.run_id))  # before anybody could find its record without
        record = RunRecord(tracker.run_id, subject.name, key, time.time(), anew=anew)
        record.write()
    return tracker, record


@contextmanager
def _advice_where_full(request: RunRequest) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        raise DiskFull(
            f"no room is left for {environment.workspace()} ({error.strerror}); everything so far is kept: free "
            f"some space, then go on with: {request.resuming}"
        ) from error


def _close(record: RunRecord, tracker: Tracker, status: str, wait_s: float) -> None:
    """Say on disk and in the store how the run ended, as far as they take it; the reason is on its way already."""
    # The store first: whoever comes next looks at no run whose record says that it has ended.
    with suppress(OSError):
        tracker.conclude(status.upper())
        replace(record, status=status).write()
    tracker.close(wait_s)


def _withdraw(record: RunRecord, tracker: Tracker) -> None:
    """Leave nothing of a run on disk and in the store; where the store does not take that, it has failed."""
    from mlflow.exceptions import MlflowException

    try:
        tracker.withdraw(wait_s=10)
    except (OSError, MlflowException):
        _close(record, tracker, "failed", wait_s=10)
        return
    shutil.rmtree(environment.run_folder(record.experiment, record.run_id), ignore_errors=True)
    with suppress(OSError):
        record.forget()


def resume_key(config: ExperimentConfig) -> str:
    """What a run has to share to be gone on with: the settings, what a candidate may take, the content of the files
    that they name and of those of the catalogue, the program.

    What a run has tracked is not tracked again, so that candidates of other data or of another version, or that had
    failed for want of time, would stand beside the new ones.
    """
    from aesi.pipeline.experiment.sources import catalogue_files, named_files

    files = list(named_files(config).values())
    with suppress(InputError):  # that a set cannot be had is told when the data are loaded
        files += catalogue_files(config)
    limits = f"{config.search.timeout_s:g} s, {config.search.memory_mb:g} MB"
    return fingerprint.key(config.digest, limits, source_digest(), *contents(files))


def _unfinished(
    config: ExperimentConfig, store: Store, console: Console, held: ExitStack, anew: bool = False
) -> RunRecord | None:
    """The newest unfinished run of the same experiment, settings, files and program that is still in the store, with
    its lock in `held`.  Raises RunTaken where another process works on it.

    anew : whether it has to be one that was begun anew too: what another has tracked may have come from the cache.
    """
    there = [one for one in records(config.name) if one.status in UNFINISHED]
    key = resume_key(config) if there else ""
    for record in there:
        if record.config_digest != key or record.anew < anew or not store.holds(record.run_id):
            continue
        held.enter_context(RunLock(record.run_id))
        now = record.again()
        if now is not None and now.status in UNFINISHED:
            return now
        held.close()  # it has ended since its record was read
    begun = " that was begun with --no-cache" if anew else ""
    console.say(
        f"There is no unfinished run of these settings and files by this version{begun}; a new one is started."
    )
    return None


def _put_in_order(store: Store, console: Console) -> None:
    """Close what was killed, deliver what was left over."""
    from flows.tracking.beginnings import close_unrecorded
    from flows.tracking.leftovers import deliver_leftovers

    close_unrecorded(store, console.say)
    _close_killed(store, console)
    deliver_leftovers(store, console.say)


def _close_killed(store: Store, console: Console) -> None:
    """A run that was killed stays RUNNING in MLflow for ever; whoever comes next closes it."""
    for record in records():
        if record.status != "running" or not store.holds(record.run_id):
            continue
        with suppress(RunTaken), RunLock(record.run_id) as lock:
            if not lock.held or record.again() != record:
                continue
            if store.run(record.run_id).info.status == "RUNNING":  # else it was killed when all was done
                store.client.set_terminated(record.run_id, "KILLED")
                console.say(f"run {record.run_id} had been killed; it is closed as such.")
            replace(record, status="killed").write()
