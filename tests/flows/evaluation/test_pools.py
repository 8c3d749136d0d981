"""Processes that evaluate: what goes wrong in one candidate stays in it."""

import gc
import os
import signal
import sys
import time

import numpy as np
import pytest

from aesi.errors import FitError, InputError
from aesi.records import Failed
from flows.evaluation.local_pool import LocalPool
from flows.evaluation.pool import guarded


def behave(genome):
    """A stand-in for the evaluation whose genome says how it ends."""
    kind, value = genome
    if kind == "sleep":
        time.sleep(value)
    elif kind == "raise":
        raise ValueError(value)
    elif kind == "reject":
        raise FitError(value)
    elif kind == "eat":
        return np.ones(value).sum()
    elif kind == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    return value


@pytest.fixture
def pool():
    made = LocalPool(lambda: behave, workers=2, timeout_s=2.0, memory_mb=500)
    yield made
    made.close()


def outcomes(pool, genomes, timeout_s=20.0):
    found, waiting, deadline = {}, list(enumerate(genomes)), time.monotonic() + timeout_s
    while len(found) < len(genomes):
        assert time.monotonic() < deadline
        while waiting and pool.idle:
            tag, genome = waiting.pop(0)
            pool.start(tag, genome)
        found |= dict(pool.collect(0.2))
    return [found[i] for i in range(len(genomes))]


def test_outcomes_come_back_with_their_tags(pool):
    assert outcomes(pool, [("return", i) for i in range(20)]) == list(range(20))


class Service:
    """Held by a thread of the parent, and so out of reach in a fork."""

    def __init__(self, ended):
        self.itself, self.ended = self, ended

    def __del__(self):
        self.ended.write_text(self.ended.read_text() + f"{os.getpid()} ")


@pytest.mark.skipif(sys.platform != "linux", reason="forks are made on Linux")
def test_a_fork_ended_what_threads_of_its_parent_were_at_work_on(tmp_path):
    ended = tmp_path / "ended"
    ended.write_text("")
    gc.disable()
    try:
        Service(ended)
        pool = LocalPool(lambda: lambda _: gc.collect() >= 0, workers=1, timeout_s=5.0, memory_mb=500)
        assert outcomes(pool, [None]) == [True]
        pool.close()
        assert ended.read_text() == ""
    finally:
        gc.enable()
    gc.collect()
    assert ended.read_text() == f"{os.getpid()} "


def test_a_hang_is_cut_off_and_the_pool_goes_on(pool):
    result = outcomes(pool, [("sleep", 60), ("return", 1), ("return", 2), ("return", 3)])
    assert result == [Failed("took longer than 2 s", of_machine=True), 1, 2, 3]


def test_an_exception_is_an_outcome_that_says_where(pool):
    odd, rejected, fine = outcomes(pool, [("raise", "odd"), ("reject", "no terms"), ("return", 1)])
    assert odd.reason.startswith("ValueError: odd (in test_pools.py:")
    assert rejected == Failed("no terms")
    assert fine == 1


@pytest.mark.skipif(os.uname().sysname != "Linux", reason="memory is limited on Linux")
def test_eating_memory_is_an_outcome(pool):
    eaten, fine = outcomes(pool, [("eat", 10**9), ("eat", 10**6)])
    # Of a process that threads share, another candidate may have taken it.
    assert eaten == Failed("ran out of memory (search.memory_mb)", of_machine=True)
    assert fine == 10**6


def test_building_the_problem_took_of_the_time_of_the_first_candidate():
    def build():
        time.sleep(2.0)
        return behave

    pool = LocalPool(build, workers=1, timeout_s=1.0, memory_mb=500)
    try:
        assert outcomes(pool, [("return", 1), ("sleep", 60)]) == [
            1,
            Failed("took longer than 1 s", of_machine=True),
        ]
    finally:
        pool.close()


def test_a_lost_process_costs_one_candidate(pool):
    result = outcomes(pool, [("die", 0), ("return", 1), ("die", 0), ("return", 2)])
    assert [isinstance(one, Failed) for one in result] == [True, False, True, False]
    assert "SIGKILL" in result[0].reason


def test_a_process_that_died_idle_is_replaced(pool):
    outcomes(pool, [("return", 0), ("return", 0)])
    for one in pool._processes:
        os.kill(one.process.pid, signal.SIGKILL)
        one.process.join()
    assert outcomes(pool, [("return", 1), ("return", 2)]) == [1, 2]


def test_closing_ends_the_processes_at_once(pool):
    pool.start(0, ("sleep", 60))
    processes = [one.process for one in pool._processes]
    started = time.monotonic()
    pool.close()
    assert time.monotonic() - started < 30
    assert not any(process.is_alive() for process in processes)


ORPHANS = """
import os, time, sys
from flows.evaluation.local_pool import LocalPool
from flows.evaluation.pool import guarded
pool = LocalPool(lambda: time.sleep, 2, 600, 1000)
pool.start(0, 600)
print(*[p.process.pid for p in pool._processes], flush=True)
time.sleep(600)
"""


def test_the_processes_of_a_killed_parent_end(tmp_path):
    import subprocess
    import sys

    import psutil

    with subprocess.Popen([sys.executable, "-c", ORPHANS], stdout=subprocess.PIPE, text=True) as parent:
        children = [psutil.Process(int(pid)) for pid in parent.stdout.readline().split()]
        parent.kill()
    gone, alive = psutil.wait_procs(children, timeout=10)
    assert not alive
    assert len(gone) == 2


def test_without_dask_it_says_what_to_install(monkeypatch):
    from flows.evaluation.dask_pool import DaskPool

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'dask\[distributed\]'"):
        DaskPool("{}", "", None, workers=1, timeout_s=1.0, memory_mb=500)


def test_a_worker_that_lives_on_evaluated_on_the_data_of_an_earlier_study(monkeypatch):
    from flows.base import codec
    from flows.evaluation import dask_pool

    built = []

    def build(content, base):
        built.append(content)
        return lambda genome: [len(built), genome]

    monkeypatch.setattr(dask_pool, "build_scorer", build)
    dask_pool._scorer.cache_clear()
    genome = codec.dumps("x")
    outcomes = [
        codec.loads(dask_pool.evaluate_bytes("{}", "", study, genome)) for study in ("one", "one", "another")
    ]
    dask_pool._scorer.cache_clear()
    assert outcomes == [[1, "x"], [1, "x"], [2, "x"]]


def evaluate_slowly(content, base, study, genome):
    """What runs on a worker of Dask in place of an evaluation: a genome says how long it takes."""
    from flows.base import codec

    time.sleep(codec.loads(genome))
    return genome


@pytest.fixture
def dask_pool(monkeypatch):
    """A pool of one Dask worker that lives in threads of this process, whose candidates sleep as they say."""
    import distributed

    from flows.evaluation import dask_pool

    monkeypatch.setattr(dask_pool, "evaluate_bytes", evaluate_slowly)
    monkeypatch.setattr(dask_pool, "_scorer", lambda *_: None)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        monkeypatch.setattr(
            dask_pool, "connect", lambda *_: (distributed.Client(cluster, set_as_default=False), None)
        )
        made = []

        def make(timeout_s):
            made.append(dask_pool.DaskPool("{}", "", None, workers=1, timeout_s=timeout_s, memory_mb=500))
            return made[-1]

        yield make
        for each in made:
            each.close()


def test_a_candidate_that_waited_behind_another_on_dask_failed_within_its_time(dask_pool):
    pool = dask_pool(1.0)
    assert outcomes(pool, [0.7] * 4) == [0.7] * 4


def test_a_hang_on_dask_is_cut_off_on_its_own_worker(dask_pool, monkeypatch):
    pool, restarted = dask_pool(1.5), []
    monkeypatch.setattr(
        pool._client, "restart_workers", lambda workers, raise_for_error: restarted.extend(workers)
    )
    assert outcomes(pool, [3.0, 0.1]) == [Failed("took longer than 1.5 s", of_machine=True), 0.1]
    assert restarted == list(pool._client.scheduler_info()["workers"])


def evaluate_hungrily(content, base, study, genome):
    """A genome says how many numbers it takes."""
    from flows.base import codec

    return codec.dumps(guarded(behave, ("eat", codec.loads(genome))))


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux")
def test_what_a_candidate_may_take_of_memory_did_not_count_on_dask(dask_pool, monkeypatch):
    import resource

    monkeypatch.setattr("flows.evaluation.dask_pool.evaluate_bytes", evaluate_hungrily)
    before = resource.getrlimit(resource.RLIMIT_AS)
    eaten = 150_000_000  # 1.2 GB of the 500 MB that it may take
    out_of_memory = Failed("ran out of memory (search.memory_mb)", of_machine=True)
    assert outcomes(dask_pool(5.0), [eaten, 1000]) == [out_of_memory, 1000.0]
    assert resource.getrlimit(resource.RLIMIT_AS) == before
