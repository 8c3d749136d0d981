"""A function over many items, in processes of this machine or on Dask: results as they come, in any order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from flows.base import environment
from flows.base.interrupt import leaving_interrupts_to_us
from flows.evaluation.dask_pool import connect, leave, scheduler_kept

T = TypeVar("T")
R = TypeVar("R")


def in_processes(
    function: Callable[[T], R], items: Sequence[T], workers: int, lost: Callable[[T], R]
) -> Iterator[R]:
    """Results by processes that start anew; `function` is one that they can import, or a partial of one.

    What has not begun is given up where the caller stops asking.
    lost : result of an item whose process the system ended, as it does where memory runs out; the others go on.
    """
    from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
    from concurrent.futures.process import BrokenProcessPool
    from multiprocessing import get_context

    def submit_next(pool: ProcessPoolExecutor) -> None:
        if waiting:
            item = waiting.popleft()
            with leaving_interrupts_to_us():
                running[pool.submit(function, item)] = pool, item

    def new_pool() -> ProcessPoolExecutor:
        context = get_context("spawn")
        pools.append(ProcessPoolExecutor(1, mp_context=context, initializer=environment.prepare_process))
        return pools[-1]

    # A pool that loses a process gives up all that its others are at, and does not tell which one it was: so each
    # process has a pool of its own.
    pools: list[ProcessPoolExecutor] = []
    waiting = deque(items)
    running: dict[Future[R], tuple[ProcessPoolExecutor, T]] = {}
    try:
        for _ in range(min(workers, len(items))):
            submit_next(new_pool())
        while running:
            results = []
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                pool, item = running.pop(future)
                try:
                    results.append(future.result())
                except BrokenProcessPool:
                    results.append(lost(item))
                    pool = new_pool()
                submit_next(pool)
            yield from results
    finally:
        for pool in pools:
            pool.shutdown(wait=False, cancel_futures=True)


def on_dask(
    function: Callable[[T], R],
    items: Sequence[T],
    workers: int,
    address: str | None,
    lost: Callable[[T], R],
) -> Iterator[R]:
    """Results by the scheduler at an address, or by a cluster of `workers` processes here.

    lost : as above, for an item that Dask gives up because worker after worker ended over it.
    Raises as `connect` does, and SchedulerLost.
    """
    client, cluster = connect(address, workers)
    from distributed import KilledWorker, as_completed

    try:
        with scheduler_kept(address):
            futures: Any = client.map(function, list(items), pure=False)
            given = dict(zip((future.key for future in futures), items, strict=True))
            for future in as_completed(futures, loop=client.loop):
                try:
                    result = future.result()
                except KilledWorker:
                    result = lost(given[future.key])
                yield result
    finally:
        leave(client, cluster)
