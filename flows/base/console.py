"""Messages and progress on stderr: on a terminal one line that is overwritten, plain lines elsewhere."""

from __future__ import annotations

import logging
import sys
import time

_LOG = logging.getLogger("aesi")
"""What is said goes here too, since Prefect shows this logger's lines with the flow run they belong to."""
_LOG.setLevel(logging.INFO)
_LOG.propagate = False  # stderr has it already


class Console:
    """Messages and progress. `every_s` is how often progress is written where nothing can be overwritten."""

    def __init__(self, every_s: float = 15.0) -> None:
        self._moving = sys.stderr.isatty()
        self._every_s = every_s
        self._last_s = 0.0
        self._open_line = False

    def say(self, message: str) -> None:
        """One line that stays."""
        self._close()
        print(message, file=sys.stderr, flush=True)
        _LOG.info(message)

    def progress(
        self, what: str, done: int, total: int, started_s: float, note: str = "", known: int = 0
    ) -> None:
        """Where a long piece of work stands; `started_s` is time.monotonic() at its start.

        known : how many of those done were known from before, and took no time.
        """
        now = time.monotonic()
        finished = done >= total
        if not self._moving and not finished and now - self._last_s < self._every_s:
            return
        self._last_s = now
        left = _left(done, total, now - started_s, known)
        line = f"  {what}: {done}/{total}{left}{f', {note}' if note else ''}"
        self._show(line)
        if finished:
            self._close()

    def count(self, what: str, done: int, started_s: float, note: str = "") -> None:
        """Progress of work whose end is not known beforehand."""
        now = time.monotonic()
        if not self._moving and now - self._last_s < self._every_s:
            return
        self._last_s = now
        line = f"  {what}: {done} in {duration(now - started_s)}{f', {note}' if note else ''}"
        self._show(line)

    def begins(self, what: str, part: str) -> None:
        """What a long piece of work does now, until it says something else."""
        self._show(f"  {what}: {part} ...")

    def _show(self, line: str) -> None:
        """A line in the place of the last one, or below it where nothing can be overwritten."""
        if not self._moving:
            self.say(line)
            return
        sys.stderr.write(f"\r\x1b[2K{line[:110]}")
        sys.stderr.flush()
        self._open_line = True

    def _close(self) -> None:
        if self._open_line:
            sys.stderr.write("\n")
            self._open_line = False


def _left(done: int, total: int, elapsed_s: float, known: int) -> str:
    if done >= total:
        return f" in {duration(elapsed_s)}"
    worked = done - known
    return f", about {duration(elapsed_s / worked * (total - done))} left" if worked > 0 else ""


def duration(seconds: float) -> str:
    """A duration as a person says it."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.1f} min"
