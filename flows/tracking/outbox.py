"""A queue on disk between a run and its tracking store.

What is to be tracked is first written here, then delivered by a thread, in order. A store that is away, slow
or locked costs the run nothing; a killed run loses nothing. Delivery is idempotent: an item that was sent but
not yet crossed off when the process died is recognised by the store's own records.
"""

from __future__ import annotations

import json
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from aesi.errors import AesiError, first_line
from aesi.numerics.files.whole import write_whole


class OfAnotherVersion(AesiError):
    """An item that another version of the program wrote, which this one cannot deliver."""


class Item(dict[str, Any]):
    """What is to be tracked. Raises OfAnotherVersion where a key is asked for that it lacks."""

    def __missing__(self, key: str) -> Any:
        raise OfAnotherVersion(f"it lacks {key!r}")


Deliver = Callable[[Item, bool], None]
"""Sends one item; the flag says that it may have been sent before."""

RETRY_S = (1.0, 2.0, 5.0, 10.0, 20.0)
"""Waits before each further try of a store that does not answer."""
FLUSH_S = 60.0
"""How long a store that fails is waited for by an ending run. One that is at work is waited for to the end: with four
times as much to do as the machine has cores, logging the model alone took 6 s."""
REFUSED = "refused"
TRIES = 3
"""Failures of one item before a store that answers is taken to refuse it."""


class Outbox:
    """Items of one run below `folder`; `deliver` raises where an item could not be sent.

    away : tells a passing failure (retried for ever) from an item the store refuses (put aside, and said).
    left : what an earlier process had put in and not delivered, in order.
    refused : whether an item was put aside since this object was made: the store refused it, it cannot be read, or
    another version wrote it.
    """

    def __init__(
        self,
        folder: Path,
        deliver: Deliver,
        away: Callable[[Exception], bool],
        say: Callable[[str], None],
    ) -> None:
        self._folder = folder
        self._deliver = deliver
        self._away = away
        self._say = say
        self._wake = threading.Condition()
        self._closing = False
        self._failing_since: float | None = None
        self._tries = 0
        self._sending = False
        self.refused = False
        folder.mkdir(parents=True, exist_ok=True)
        # One process writes here, so that the folder is listed once: very many may wait for a store that is away.
        found = sorted(folder.glob("[0-9]*.json"))
        aside = (folder / REFUSED).glob("[0-9]*.json")  # whose numbers are taken, too
        self._next = 1 + max((int(path.stem) for path in (*found, *aside)), default=0)
        read = {path: item for path in found if (item := self._read(path)) is not None}
        self.left: tuple[Item, ...] = tuple(read.values())
        self._waiting = deque(read)
        self._old = {path.name for path in read}
        self._thread = threading.Thread(target=self._run, name="aesi-outbox", daemon=True)
        self._thread.start()

    def put(self, item: Mapping[str, Any]) -> None:
        """Keep the item on disk and deliver it when possible."""
        with self._wake:
            path = self._folder / f"{self._next:08d}.json"
            self._next += 1
            write_whole(path, json.dumps(item))
            self._waiting.append(path)
            self._wake.notify_all()

    @property
    def pending(self) -> int:
        """Number of items that are not delivered yet."""
        return len(self._waiting)

    def flush(self, timeout_s: float) -> int:
        """Wait for delivery, at most `timeout_s` after the store was last seen to work; the number left.

        An item on its way is work, however long it takes: each request of MLflow's ends by itself.
        """
        last, since = self.pending, time.monotonic()
        while last:
            time.sleep(0.05)
            left = self.pending
            if left < last or self._at_work:
                last, since = left, time.monotonic()
            elif time.monotonic() - since > timeout_s:
                break
        return last

    def close(self) -> None:
        """Stop delivering; what waits, or was refused, stays on disk."""
        with self._wake:
            self._closing = True
            self._wake.notify_all()
        self._thread.join(timeout=30)
        with suppress(OSError):  # it is not empty
            self._folder.rmdir()

    @property
    def _at_work(self) -> bool:
        """Whether an item is on its way to a store that has not failed since the last one."""
        return self._sending and self._failing_since is None and not self._tries

    def _run(self) -> None:
        attempt = 0
        while True:
            with self._wake:
                if self._closing:
                    return
                if not self._waiting:
                    self._wake.wait()
                    continue
                first = self._waiting[0]
                if not first.exists():  # somebody took it away
                    self._waiting.popleft()
                    continue
            self._sending = True
            try:
                attempt = 0 if self._send(first) else attempt + 1
                if not attempt:
                    self._waiting.popleft()
            except OSError as error:  # of the disk: the item could not be crossed off
                attempt += 1
                self._old.add(first.name)
                self._complain(f"{first} is delivered and cannot be removed ({first_line(error)})")
            finally:
                self._sending = False
            if attempt:
                with self._wake:
                    self._wake.wait_for(lambda: self._closing, RETRY_S[min(attempt, len(RETRY_S)) - 1])

    def _send(self, path: Path) -> bool:
        """True where the item is dealt with."""
        try:
            self._deliver(_parsed(path), path.name in self._old)
        except OfAnotherVersion as error:
            self._leave_out(
                path,
                f"is of another version of the program ({error})",
                f"put it back into {path.parent} and run `aesi tables` of that version",
            )
            return True
        except Exception as error:
            self._old.add(path.name)  # part of it may have arrived
            if self._away(error):
                self._complain(
                    f"the store does not answer ({first_line(error)}); results are kept in {self._folder} and "
                    "delivered when it is back"
                )
                return False
            self._tries += 1
            if self._tries < TRIES:
                return False
            self._tries = 0
            refused = f"the store refused an item ({first_line(error)})"
            try:
                aside = self._put_aside(path)
            except OSError as blocked:
                self._complain(
                    f"{refused}; {path} cannot be put aside ({first_line(blocked)}) and is tried again"
                )
                return False
            self._say(f"tracking: {refused}; it is kept in {aside}.")
            return True
        self._tries = 0
        path.unlink(missing_ok=True)
        if self._failing_since is not None:
            self._failing_since = None
            self._say("tracking: the store answers again; what waited is being delivered.")
        return True

    def _read(self, path: Path) -> Item | None:
        """What an earlier process had put in; None, which is said, of what cannot be read, such as a file that is cut
        off. It is put aside where it can be."""
        try:
            item = _parsed(path)
            if isinstance(item, Item):
                return item
            reason = "it is no item"
        except (ValueError, OSError) as error:
            reason = first_line(error)
        self._leave_out(path, f"cannot be read ({reason})", f"put a whole copy back into {path.parent}")
        return None

    def _leave_out(self, path: Path, why: str, advice: str) -> None:
        """Say of an item that it is not delivered, put aside where it can be."""
        where = path
        with suppress(OSError):
            where = self._put_aside(path)
        self._say(
            f"tracking: an item that waited for the store {why}, so that what it held is missing there; it is kept in "
            f"{where}: {advice}, or delete it."
        )

    def _put_aside(self, path: Path) -> Path:
        """Where an item is from now on.  Raises OSError where it cannot be moved."""
        self.refused = True
        aside = self._folder / REFUSED / path.name
        aside.parent.mkdir(exist_ok=True)
        return path.replace(aside)

    def _complain(self, reason: str) -> None:
        """Say, once until something is delivered again, why nothing is."""
        if self._failing_since is None:
            self._failing_since = time.monotonic()
            self._say(f"tracking: {reason}.")


def _parsed(path: Path) -> Any:
    """The content of an item's file."""
    return json.loads(path.read_bytes(), object_hook=Item)
