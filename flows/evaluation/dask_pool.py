"""Candidates on Dask: a cluster of processes on this machine, or the scheduler at an address.

A worker that is lost in mid-candidate gives it back to the scheduler, which hands it to another. Each worker
builds the problem of a study once, from the experiment, and keeps it.
"""

from __future__ import annotations

import logging
import time
import uuid
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from queue import Empty, Queue
from typing import Any

from aesi.errors import AesiError, InputError
from aesi.logins import login_left_out, without_login
from aesi.records import Failed
from flows.base import codec
from flows.evaluation.pool import MemoryOfThreads, guarded
from flows.evaluation.scorer_recipe import build_scorer

CONNECT_S = 15
"""Wait for a scheduler that does not answer."""
OWN_CLUSTER = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.admin.tick.interval": "500ms",
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": str(1 << 30),
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": str(1 << 30),
    "distributed.nanny.pre-spawn-environ.MALLOC_ARENA_MAX": "1",
}
"""A cluster of one's own shows no dashboard, and its monitors would take 3 % of each core. Memory is kept between
candidates: Dask's default gives it back after each array, and taking it again costs a third of a candidate."""

KEEP_RESTARTED = {"distributed.deploy.lost-worker-timeout": "365 days"}
"""A cluster of one's own gives up a worker that is not there 15 s after it was lost, whatever came in between: one that
is restarted for a second candidate that hangs is gone for good then, and its last one keeps the search for ever. Each
has a nanny that starts it again. It is looked up when a worker is lost, so that it is set to stay."""


class SchedulerLost(AesiError):
    """The Dask scheduler answered when the work began, and does no more."""


@contextmanager
def scheduler_kept(address: str | None, *more: type[Exception]) -> Iterator[None]:
    """Within, what Dask raises of work whose scheduler is lost is SchedulerLost, with what to do.

    Dask cancels all work at that moment, also where the scheduler is back a second later.
    more : what else can have no other cause within.
    """
    from distributed.client import ClosedClientError
    from distributed.comm import CommClosedError

    try:
        yield
    except (CancelledError, ClosedClientError, CommClosedError, *more) as error:
        place = without_login(address) if address else "on this machine"
        raise SchedulerLost(
            f"the Dask scheduler {place} was lost, and with it what its workers were at; what is finished is kept: "
            "start it again, then give the same command again (`aesi run` with --resume)."
        ) from error


def connect(address: str | None, workers: int) -> tuple[Any, Any]:
    """A client of the scheduler at an address, or of a new cluster of processes on this machine, and that cluster.

    Raises InputError without Dask or for what is no address, AesiError where the scheduler does not answer.
    """
    dask, distributed = _libraries()
    # What goes wrong with a scheduler reaches the caller as an exception, and need not be told twice, with a traceback.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    cluster = None
    if address is None:
        dask.config.set(KEEP_RESTARTED)
        with dask.config.set(OWN_CLUSTER):
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                host="127.0.0.1",
                silence_logs=40,
            )
    else:
        _check_form(address)
    try:
        return distributed.Client(cluster or address, timeout=CONNECT_S, set_as_default=False), cluster
    except (OSError, TimeoutError, ValueError) as error:
        if cluster is not None:
            cluster.close(timeout=10)
            raise AesiError(
                f"the Dask cluster on this machine does not answer ({error}); use the runner local."
            ) from None
        reason = login_left_out(str(error), address or "")
        raise AesiError(
            f"the Dask scheduler {without_login(address or '')} does not answer ({reason}); start it with `dask "
            "scheduler`, or leave out --address for a cluster on this machine."
        ) from None


def check_scheduler(address: str | None) -> None:
    """Raises as `connect` would, so that it is told before the work that leads there.

    A scheduler that has just been started is waited for; of a cluster on this machine only Dask has to be there.
    """
    if address is None:
        _libraries()
    else:
        leave(*connect(address, workers=0))


def leave(client: Any, cluster: Any) -> None:
    """Leave a scheduler; end the cluster where it is ours, and none is given otherwise."""
    # Of a scheduler that is lost Dask's own end fails at times, and would hide why it came.
    with suppress(Exception):
        client.close(timeout=5)
    if cluster is not None:
        cluster.close(timeout=10)


def _libraries() -> tuple[Any, Any]:
    try:
        import dask
        import distributed
    except ImportError as error:
        raise InputError(
            f"the runner dask needs Dask, which is not installed ({error}): pip install 'dask[distributed]', "
            "or use the runner local."
        ) from None
    return dask, distributed


def _check_form(address: str) -> None:
    """Dask's own client, given what is no address, keeps the process for half a minute and ends with a traceback."""
    from distributed.comm.addressing import parse_address, parse_host_port

    try:
        parse_host_port(parse_address(address)[1])
    except ValueError as error:
        shown = without_login(address)
        reason = f" ({error})" if shown == address else ", which takes no login"
        raise InputError(
            f"{shown!r} is no address of a Dask scheduler{reason}; give it as tcp://HOST:PORT."
        ) from None


@dataclass
class _Submitted:
    """A candidate that the scheduler has.

    worker : address of the worker that evaluates it, '' while it waits.  since_s : when it began to run, s on this
    process's monotonic clock; None while it waits or its worker builds the problem.
    """

    tag: Any
    future: Any = None
    worker: str = ""
    since_s: float | None = None


class DaskPool:
    """See `flows.evaluation.pool.Pool`.

    content, base : the experiment as JSON, and the folder its paths start from (which the workers must see).
    memory_mb : address space that a worker's process may take for each of its threads while they evaluate, beyond what
    it has (Linux).
    study : content key of the study: a worker that lives on builds its problem again where the files are others.
    """

    def __init__(
        self,
        content: str,
        base: str,
        address: str | None,
        workers: int,
        timeout_s: float,
        memory_mb: float,
        study: str = "",
    ) -> None:
        self._recipe, self._timeout_s, self._memory_mb = (content, base, study), timeout_s, memory_mb
        self._address = address
        self._client, self._cluster = connect(address, workers)
        self._submitted: dict[str, _Submitted] = {}
        self._finished: Queue[Any] = Queue()
        self._topic = f"aesi-began-{uuid.uuid4().hex}"
        self._client.subscribe_topic(self._topic, self._began)

    @property
    def idle(self) -> int:
        """One candidate a thread, and one waiting for each, so that no worker pauses between two.

        As the methods below it raises SchedulerLost where the scheduler answers no more."""
        with self._kept():
            return max(0, 2 * max(1, sum(self._client.ncores().values())) - self.busy)

    @property
    def busy(self) -> int:
        return len(self._submitted)

    def start(self, tag: Any, genome: Any) -> None:
        """Hand a genome to the scheduler."""
        key = f"candidate-{uuid.uuid4().hex}"
        candidate = self._submitted[key] = _Submitted(tag)  # before it is submitted: it may begin at once
        given = (self._topic, key, self._memory_mb, *self._recipe, codec.dumps(genome))
        with self._kept():
            candidate.future = self._client.submit(_evaluate_timed, *given, key=key, pure=False)
        candidate.future.add_done_callback(self._finished.put)

    def collect(self, timeout_s: float) -> list[tuple[Any, Any]]:
        """(tag, outcome) of what has finished, after at most `timeout_s`."""
        with self._kept():
            return self._done(timeout_s) + self._overdue()

    def _kept(self) -> AbstractContextManager[None]:
        return scheduler_kept(self._address, OSError)  # an evaluation raises none: it is an outcome

    def _done(self, timeout_s: float) -> list[tuple[Any, Any]]:
        found = []
        try:
            future = self._finished.get(timeout=timeout_s)
            while True:
                candidate = self._submitted.pop(future.key, None)
                if candidate is not None:
                    found.append((candidate.tag, _outcome(future)))
                future = self._finished.get_nowait()
        except Empty:
            return found

    def close(self) -> None:
        """Leave the scheduler; end the cluster where it is ours."""
        leave(self._client, self._cluster)

    def processor_s(self) -> dict[str, float]:
        """Processor seconds that each worker has used since it started."""
        return dict(self._client.run(time.process_time))

    def _began(self, event: tuple[float, dict[str, str]]) -> None:
        """A worker says that it begins with a candidate; one that is begun again elsewhere has all its time again."""
        _, told = event
        candidate = self._submitted.get(told["key"])
        if candidate is not None:
            candidate.worker, candidate.since_s = told["worker"], time.monotonic()

    def _overdue(self) -> list[tuple[Any, Any]]:
        """Candidates past their time: their worker is restarted, since a thread cannot be stopped."""
        now = time.monotonic()
        found = []
        for key, candidate in list(self._submitted.items()):
            if candidate.since_s is None or now - candidate.since_s <= self._timeout_s:
                continue
            del self._submitted[key]
            found.append((candidate.tag, Failed(f"took longer than {self._timeout_s:g} s", of_machine=True)))
            self._client.cancel([candidate.future], force=True)  # else another worker is given it
            self._client.restart_workers([candidate.worker], raise_for_error=False)
        return found


_MEMORY = MemoryOfThreads()
"""Memory limit of the threads of a worker's process."""


def _evaluate_timed(
    topic: str, key: str, memory_mb: float, content: str, base: str, study: str, genome: bytes
) -> bytes:
    """As `evaluate_bytes`, within what it may take of memory and, told to the pool, of time: both count from when the
    problem is built, as in `LocalPool`.

    Two candidates a thread are handed over, and one that waits behind another has used none of its time.
    """
    from distributed import get_worker

    _scorer(content, base, study)
    worker = get_worker()
    worker.log_event(topic, {"key": key, "worker": worker.address})
    with _MEMORY.limited(memory_mb, worker.state.nthreads):
        return evaluate_bytes(content, base, study, genome)


def evaluate_bytes(content: str, base: str, study: str, genome: bytes) -> bytes:
    """The function that runs on a worker: genome in, outcome out, both without pickle."""
    return codec.dumps(guarded(_scorer(content, base, study), codec.loads(genome)))


@lru_cache(maxsize=1)
def _scorer(content: str, base: str, study: str) -> Any:
    return build_scorer(content, base)


def _outcome(future: Any) -> Any:
    if future.status != "error":
        return codec.loads(future.result())  # which raises CancelledError of one that is cancelled
    error = future.exception()
    if isinstance(error, AesiError):  # the experiment cannot be loaded there: no candidate ever will
        raise error
    return Failed(f"its worker was lost ({type(error).__name__}: {error})", of_machine=True)
