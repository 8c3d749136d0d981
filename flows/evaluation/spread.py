"""A function over many items, in processes of this machine or on Dask: results as they come, in any order."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from flows.base import environment
from flows.base.interrupt import leaving_interrupts_to_us
from flows.evaluation.dask_pool import connect

T = TypeVar("T")
R = TypeVar("R")


def in_processes(function: Callable[[T], R], items: Sequence[T], workers: int) -> Iterator[R]:
    """Results by processes that start anew; `function` is one that they can import, or a partial of one.

    What has not begun is given up where the caller stops asking.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=environment.prepare_process
    ) as pool:
        with leaving_interrupts_to_us():
            futures = [pool.submit(function, item) for item in items]
        try:
            for future in as_completed(futures):
                yield future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def on_dask(function: Callable[[T], R], items: Sequence[T], workers: int, address: str | None) -> Iterator[R]:
    """Results by the scheduler at an address, or by a cluster of `workers` processes here.

    Raises as `connect` does.
    """
    client, cluster = connect(address, workers)
    from distributed import as_completed

    try:
        futures: Any = client.map(function, list(items), pure=False)
        for future in as_completed(futures, loop=client.loop):
            yield future.result()
    finally:
        client.close(timeout=5)
        if cluster is not None:
            cluster.close(timeout=10)
