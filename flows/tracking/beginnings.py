"""A run from its creation in the tracking store to its record on disk: who is killed in between leaves a run that is
running for good, and that no record names. A note on disk names it before it is there, by a tag that it will carry."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from aesi.logins import without_login
from aesi.numerics.files.whole import write_whole
from flows.base import environment
from flows.base.locks import ProcessLock
from flows.tracking.run_records import records
from flows.tracking.store import Store

BEGUN = "aesi.begun"
"""Tag of a whole run: what the note on its beginning is called."""


@contextmanager
def noted_beginning(store: Store, experiment: str) -> Iterator[dict[str, str]]:
    """Within, a run is made in the store with these tags and its record is written, by one process of the workspace at
    a time."""
    with _alone():
        mark = uuid4().hex
        note = _folder() / f"{mark}.json"
        write_whole(note, json.dumps({"store": without_login(store.uri), "experiment": experiment}))
        yield {BEGUN: mark}
        note.unlink(missing_ok=True)


def close_unrecorded(store: Store, say: Callable[[str], None]) -> None:
    """Close as killed what was made in the store by a process that died before it wrote the run's record; a note of
    another version is named and left."""
    if not any(_folder().glob("*.json")):
        return
    with _alone() as lock:
        recorded = {record.run_id for record in records()}
        for note in _folder().glob("*.json") if lock.held else ():
            content = _read(note)
            if content is None:
                say(
                    f"{note} is no note of this version on a run that begins, so that a run that it may name stays "
                    "RUNNING in its store: run a job with the version that wrote it, or delete the file."
                )
                continue
            address, experiment = content
            found = store.find_experiment(experiment)
            run = found and next(store.runs(found, f"tags.`{BEGUN}` = '{note.stem}'"), None)
            if not run and address != without_login(store.uri):
                continue  # it may be in that one
            if run and run.info.run_id not in recorded:
                store.client.set_terminated(run.info.run_id, "KILLED")
                say(f"run {run.info.run_id} had been killed as it began; it is closed as such.")
            note.unlink(missing_ok=True)


@contextmanager
def _alone() -> Iterator[ProcessLock]:
    """Waits for the process of this workspace that begins a run: its note is none of a killed one's."""
    lock = ProcessLock(_folder() / "beginning.lock", str(_folder()), "beginning a run at the same time")
    lock.acquire(wait=True)
    try:
        yield lock
    finally:
        lock.release()


def _read(note: Path) -> tuple[str, str] | None:
    """The store and the experiment that a note names; None of what `noted_beginning` does not write."""
    try:
        content = json.loads(note.read_bytes())
    except ValueError:
        return None
    match content:
        case {"store": str(address), "experiment": str(experiment)}:
            return address, experiment
    return None


def _folder() -> Path:
    return environment.state() / "begun"
