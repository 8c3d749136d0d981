"""What may go wrong with Prefect beside a run, and what it costs: its pages, never the run.

Prefect starts a server of its own where none is configured. On a busy machine that takes minutes, and Prefect counts
its own pauses, not the clock; a second thread that asks for the server while the first still waits is told an address
where nothing listens yet (`httpx.ConnectError`). So it is started here, alone, before Prefect needs it.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from aesi.errors import AesiError, first_line
from flows.base.interrupt import hearing_signals_again
from flows.base.time_limit import time_limit

T = TypeVar("T")
START_S = 60.0
"""Wall time for the server to answer: 24 s were the longest seen on a machine that does nothing else, and after ten
minutes of a machine with four times as much to do as it has cores it had not."""


class ServerNotStarted(AesiError):
    """Prefect's temporary server does not answer in time."""


def start_server(limit_s: float = START_S) -> None:
    """Start Prefect's temporary server where no server is configured. Raises ServerNotStarted."""
    from prefect.server.api.server import SubprocessASGIServer
    from prefect.settings import PREFECT_API_URL

    if PREFECT_API_URL.value():
        return
    server = SubprocessASGIServer()
    try:
        with time_limit(limit_s, lambda: TimeoutError(f"it does not answer after {limit_s:g} s")):
            server.start()
    except Exception as error:
        server.stop()
        raise ServerNotStarted(first_line(error)) from error


def of_prefect(error: Exception) -> bool:
    """Whether it was Prefect's server that did not answer, or not as it should, and not the work that it shows."""
    import httpx
    from prefect.exceptions import PrefectException

    return isinstance(error, httpx.HTTPError | PrefectException)


def no_answer(error: Exception) -> bool:
    """Whether nothing came back at all."""
    import httpx

    return isinstance(error, httpx.TransportError)


def ended_by_signal(error: BaseException) -> bool:
    """Whether it came of Prefect's attempt to tell its server, which may have been ended too, that a signal came."""
    from prefect.exceptions import TerminationSignal

    one: BaseException | None = error
    while one is not None and not isinstance(one, TerminationSignal):
        one = one.__cause__ or one.__context__
    return one is not None


def stop_sending() -> None:
    """Send no more of the run's log to a server that is lost: each batch would be an error on the console."""
    from prefect.logging.handlers import APILogHandler

    for name in list(logging.root.manager.loggerDict):
        logger = logging.getLogger(name)
        for handler in logger.handlers[:]:
            if isinstance(handler, APILogHandler):
                logger.removeHandler(handler)


@dataclass
class KeptWork(Generic[T]):
    """What a piece of work came to, whatever Prefect makes of it."""

    results: list[T] = field(default_factory=list)
    errors: list[BaseException] = field(default_factory=list)

    def do(self, work: Callable[[], T]) -> T:
        """The work, with what comes of it kept."""
        try:
            result = work()
        except BaseException as error:
            self.errors.append(error)
            raise
        self.results.append(result)
        return result

    def outcome(self, otherwise: Callable[[], T]) -> T:
        """What came of the work, as it would have come without Prefect; `otherwise`, where it has not begun.

        Raises what the work raised.
        """
        if self.results:
            return self.results[-1]
        if self.errors:
            raise self.errors[-1]
        return otherwise()


CURRENT: ContextVar[KeptWork[Any] | None] = ContextVar("job", default=None)
"""The job of this process that a flow is started for; a flow that a deployment started has none."""


def as_the_job(work: Callable[[], T]) -> T:
    """The work of a flow, kept for the process that started it, and ended by signals as that process is."""
    job = CURRENT.get()
    if job is None:
        return work()
    with hearing_signals_again():
        return job.do(work)
