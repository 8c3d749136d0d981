"""A Dask scheduler that is lost while its workers are at work."""

import subprocess
import sys
import time

import pytest

from flows.evaluation import dask_pool
from flows.evaluation.dask_pool import DaskPool, SchedulerLost
from flows.evaluation.spread import on_dask

CLUSTER = """
import time
from distributed import LocalCluster
if __name__ == "__main__":
    cluster = LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50)
    print(cluster.scheduler_address, flush=True)
    time.sleep(600)
"""
LOST = r"^the Dask scheduler tcp://127\.0\.0\.1:\d+ was lost, .* is kept: start it again, .* --resume\)\.$"


@pytest.fixture
def scheduler(tmp_path, monkeypatch):
    """A cluster that is not ours: its process, which holds the scheduler, and its address."""
    monkeypatch.setattr(dask_pool, "CONNECT_S", 5)  # for so long Dask tries to reach the scheduler again, too
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as process:
        yield process, process.stdout.readline().strip()
        process.kill()


def until_it_is_noticed(ask):
    while ask():
        time.sleep(0.1)


def test_candidates_of_a_lost_scheduler_failed_and_were_kept_as_failed(scheduler, monkeypatch):
    process, address = scheduler
    pool = DaskPool("{}", "", address, workers=1, timeout_s=600.0, memory_mb=500)
    try:
        monkeypatch.setattr(dask_pool, "_evaluate_timed", lambda *_: time.sleep(600))
        pool.start(0, None)
        process.kill()
        with pytest.raises(SchedulerLost, match=LOST):
            until_it_is_noticed(lambda: not pool.collect(1.0))
    finally:
        pool.close()


def test_a_search_that_asked_a_lost_scheduler_for_its_cores_ended_in_words_about_a_file(scheduler):
    process, address = scheduler
    pool = DaskPool("{}", "", address, workers=1, timeout_s=600.0, memory_mb=500)
    try:
        assert pool.idle == 2
        process.kill()
        process.wait()
        with pytest.raises(SchedulerLost, match=LOST):
            until_it_is_noticed(lambda: pool.idle)
    finally:
        pool.close()


def test_a_batch_whose_scheduler_was_lost_ended_in_an_unexpected_error(scheduler):
    process, address = scheduler
    # Workers cannot import a function of this file.
    results = on_dask(time.sleep, [0.0, 600.0], 1, address, lost=float)
    assert next(results) is None
    process.kill()
    with pytest.raises(SchedulerLost, match=LOST):
        next(results)
