"""Items that an ended run could not deliver to the tracking store; the next process delivers them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

from flows.base import environment
from flows.tracking.delivery import deliver
from flows.tracking.outbox import FLUSH_S, Outbox
from flows.tracking.run_records import RunLock, RunTaken
from flows.tracking.store import Store


def deliver_leftovers(store: Store, say: Callable[[str], None]) -> None:
    """Deliver what ended runs could not, where no living run does; say what was found when the store was opened."""
    for note in store.notes:
        say(note)
    for folder in sorted((environment.state() / "outbox").glob("*")):
        if not any(folder.glob("[0-9]*.json")) or not store.holds(folder.name):
            continue
        with suppress(RunTaken), RunLock(folder.name) as lock:
            if not lock.held:
                continue
            outbox = Outbox(folder, partial(deliver, store), store.away, say)
            left = outbox.flush(FLUSH_S)
            outbox.close()
            if not left:
                but = ", but for what was put aside" if outbox.refused else ""
                say(f"tracking: what run {folder.name[:8]} had left over is delivered{but}.")
