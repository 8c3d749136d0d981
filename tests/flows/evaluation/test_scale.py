"""Several at a time: Dask workers, concurrent runs, two processes against one. Real processes, so marked slow."""

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from flows.tracking.store import KIND, Store

pytestmark = pytest.mark.slow


def tracked_candidates(name, workspace=None):
    store = Store(f"sqlite:///{workspace}/mlflow.db" if workspace else None)
    experiment = store.find_experiment(name)
    (parent,) = store.runs(experiment, f"tags.`{KIND}` = 'run'")
    return parent, {
        label: (run.data.params["lambda1"], run.data.params["library_hash"], run.data.metrics.get("fitness"))
        for label, run in store.children(experiment, parent.info.run_id).items()
        if label.startswith("candidate:")
    }


def test_two_dask_workers_give_the_candidates_of_one_process(run, finished):
    run("search.workers=2", runner="dask")
    assert tracked_candidates("smoke")[1] == tracked_candidates("smoke", finished)[1]


def test_a_dask_worker_killed_in_mid_candidate_loses_nothing(aesi, arguments, tracked, finished):
    dask = [str(Path(sys.executable).with_name("dask"))]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": os.environ}
    address = "tcp://127.0.0.1:18786"
    scheduler = ["scheduler", "--host", "127.0.0.1", "--port", "18786", "--no-dashboard"]
    worker = ["worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]
    processes = [subprocess.Popen([*dask, *scheduler], **quiet)]
    try:
        time.sleep(3)
        processes += [subprocess.Popen([*dask, *worker], **quiet) for _ in range(2)]
        process = aesi(*arguments(), "--runner", "dask", "--address", address)
        deadline = time.monotonic() + 120
        while not list((tracked / ".aesi/cache/candidates").glob("??/*.bin")):
            assert process.poll() is None, process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.02)
        processes[1].kill()
        _, said = process.communicate(timeout=180)
        assert process.returncode == 0, said
    finally:
        for each in processes:
            each.kill()
            each.wait()
    assert tracked_candidates("smoke")[1] == tracked_candidates("smoke", finished)[1]


def test_a_scheduler_that_is_away_is_one_sentence(aesi, arguments, tracked):
    process = aesi(*arguments(), "--runner", "dask", "--address", "tcp://127.0.0.1:9")
    _, said = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "the Dask scheduler tcp://127.0.0.1:9 does not answer" in said.splitlines()[-1]


def test_concurrent_runs_on_sqlite_do_not_lock_each_other_out(aesi, arguments, tracked):
    names = ("one", "two", "three")
    processes = [aesi(*arguments(f"name={name}", f"seed={i}")) for i, name in enumerate(names)]
    for process in processes:
        _, said = process.communicate(timeout=300)
        assert process.returncode == 0, said
        assert "locked" not in said
    for name in names:
        parent, candidates = tracked_candidates(name)
        assert parent.info.status == "FINISHED"
        assert len(candidates) == 6


def test_two_runs_on_one_experiment_share_candidates_and_both_end(aesi, arguments, tracked):
    processes = [aesi(*arguments()) for _ in range(2)]
    for process in processes:
        _, said = process.communicate(timeout=300)
        assert process.returncode == 0, said
    store = Store()
    experiment = store.find_experiment("smoke")
    parents = list(store.runs(experiment, f"tags.`{KIND}` = 'run'"))
    assert [parent.info.status for parent in parents] == ["FINISHED", "FINISHED"]
    for parent in parents:
        labels = store.children(experiment, parent.info.run_id)
        assert sum(label.startswith("candidate:") for label in labels) == 6
    assert len(list((tracked / ".aesi/cache/candidates").glob("??/*.bin"))) == 6


def test_the_command_starts_prefect_in_an_empty_workspace(aesi, arguments, workspace):
    process = aesi(*arguments(prefect=True))
    _, said = process.communicate(timeout=240)
    assert process.returncode == 0, said
    assert "Failed to create" not in said
    assert "did not start" not in said
    assert (workspace / ".aesi" / "prefect" / "prefect.db").is_file()


def test_a_flow_runs_under_prefect(tracked, finished, monkeypatch):
    from prefect.testing.utilities import prefect_test_harness

    from flows.jobs.start import start

    with prefect_test_harness(server_startup_timeout=180):
        smoke = Path(__file__).resolve().parents[3] / "experiments" / "smoke.yaml"
        small = [
            "search.candidates=3",
            "search.population=3",
            "search.resamples=5",
            'models=["ESPM", "AESI I"]',
        ]
        folder = start(smoke, [*small, "tracking.log_model=false", "tracking.system_metrics=false"])
    assert (folder / "summary.json").is_file()


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="needs two cores")
def test_two_dask_workers_do_at_least_1_6_times_the_work_of_one(tracked):
    if os.getloadavg()[0] > 0.7 * (os.cpu_count() or 1) or psutil.cpu_percent(2.0) > 40:
        pytest.skip("the machine is busy with something else")
    from flows import benchmarks

    smoke = Path(__file__).resolve().parents[3] / "experiments" / "smoke.yaml"
    (line,) = benchmarks.run("scale", experiment=str(smoke))
    assert line["ratio"] >= 1.6, line


def test_a_cluster_of_its_own_that_does_not_answer_was_called_the_scheduler_none(monkeypatch):
    import distributed

    from aesi.errors import AesiError
    from flows.evaluation.dask_pool import connect

    closed = []

    class Cluster:
        def __init__(self, **_):
            pass

        def close(self, timeout):
            closed.append(self)

    def busy(*_, **__):
        raise TimeoutError("timed out after 15 s")

    monkeypatch.setattr(distributed, "LocalCluster", Cluster)
    monkeypatch.setattr(distributed, "Client", busy)
    with pytest.raises(AesiError, match=r"cluster on this machine does not answer .* use the runner local"):
        connect(None, 1)
    assert len(closed) == 1


def test_a_dask_worker_that_was_restarted_twice_over_hung_candidates_was_gone_for_good():
    """Two restarts 15 s apart, made one by a limit that the time of one exceeds."""
    import dask

    from flows.evaluation.dask_pool import connect

    with dask.config.set({"distributed.deploy.lost-worker-timeout": "1s"}):
        client, cluster = connect(None, 1)
        try:
            (worker,) = client.scheduler_info()["workers"]
            hung = client.submit(time.sleep, 60, pure=False)
            time.sleep(1)
            client.cancel([hung], force=True)
            told = client.restart_workers([worker], timeout=40, raise_for_error=False)
        finally:
            client.close()
            cluster.close()
    assert told == {worker: "OK"}
