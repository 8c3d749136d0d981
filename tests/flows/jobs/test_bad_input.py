"""What is refused has not run: the tracking store and the workspace hold nothing of it."""

from pathlib import Path

import pytest

from aesi.errors import AesiError, DataAway, DataError, FitError, InputError
from flows.base.console import Console
from flows.jobs.run_session import tracked_job
from flows.tracking.run_records import records
from flows.tracking.tracker import Subject

CELL = Path(__file__).resolve().parents[3] / "experiments" / "cells" / "lg_m50_chen2020.bpx.json"
EXPERIMENT = """
name: refused
data: {kind: files, train: [bad.csv], test: [good.csv]}
cell: {bpx: CELL}
"""


def statuses(name):
    from flows.tracking.store import Store

    store = Store()
    experiment = store.find_experiment(name)
    return [] if experiment is None else [run.info.status for run in store.runs(experiment, "")]


def test_an_invalid_data_file_leaves_no_failed_run(tracked):
    from flows.jobs.start import start

    (tracked / "bad.csv").write_text("time_s,current_a,voltage_v\n0,1,3.9\n1,x,3.8\n")
    (tracked / "good.csv").write_text("time_s,current_a,voltage_v\n0,1,3.9\n1,1,3.8\n")
    path = tracked / "refused.yaml"
    path.write_text(EXPERIMENT.replace("CELL", str(CELL)))
    with pytest.raises(DataError, match="'x', which is not a number"):
        start(path, use_prefect=False)
    assert statuses("refused") == []
    assert records("refused") == []


def test_an_address_that_is_none_is_refused_before_the_data_are_read(workspace):
    from flows.jobs.start import start

    path = workspace / "refused.yaml"
    path.write_text(EXPERIMENT.replace("CELL", str(CELL)))
    for name in ("bad", "good"):
        (workspace / f"{name}.csv").write_text("never read")
    with pytest.raises(InputError, match=r"runner\.storage is no database that can be used"):
        start(path, ["runner.storage=blah"], use_prefect=False)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["runner.storage=postgresql://me:secret@127.0.0.1:9/none"], r"runner\.storage .* cannot be used"),
        (
            ["runner.kind=dask", "runner.address=tcp://127.0.0.1:9"],
            r"scheduler tcp://127\.0\.0\.1:9 does not answer",
        ),
        (["runner.kind=dask", "runner.address=scheduler"], r"'scheduler' is no address .* tcp://HOST:PORT"),
    ],
)
@pytest.mark.parametrize("job", ["run", "worker"])
def test_what_a_run_needs_and_is_away_was_told_after_half_a_minute_of_work(
    workspace, monkeypatch, capsys, overrides, words, job
):
    from flows.evaluation import dask_pool
    from flows.jobs.start import start
    from flows.jobs.worker import work

    monkeypatch.setattr(dask_pool, "CONNECT_S", 0.5)
    path = workspace / "refused.yaml"
    path.write_text(EXPERIMENT.replace("CELL", str(CELL)))
    for name in ("bad", "good"):
        (workspace / f"{name}.csv").write_text("never read")
    with pytest.raises(AesiError, match=words) as told:
        start(path, overrides, use_prefect=False) if job == "run" else work(path, overrides)
    assert "secret" not in str(told.value)
    assert capsys.readouterr().err == ""
    assert not (workspace / "mlflow.db").exists()


def test_data_too_few_for_the_library_leave_no_folder_nor_a_word_of_a_run(tracked, capsys):
    from flows.jobs.start import start

    for name, rows, slope in (("bad", 3, 1e-3), ("good", 120, 2e-4)):
        lines = "".join(f"{k},1,{3.9 - slope * k:.4f}\n" for k in range(rows))
        (tracked / f"{name}.csv").write_text(f"time_s,current_a,voltage_v\n{lines}")
    path = tracked / "refused.yaml"
    path.write_text(EXPERIMENT.replace("CELL", str(CELL)))
    with pytest.raises(InputError, match="needs more than the 2 training"):
        start(path, use_prefect=False)
    assert statuses("refused") == []
    assert [p for p in (tracked / "runs").rglob("*") if p.is_file()] == []
    assert "started" not in capsys.readouterr().err


def test_a_record_too_short_to_decide_was_told_after_a_server_had_been_started(call, workspace):
    rows = "".join(f"{k},{1 + k % 2},{3.9 - 0.001 * k - 0.02 * (k % 2)}\n" for k in range(100))
    (workspace / "short.csv").write_text(f"time_s,current_a,voltage_v\n{rows}")
    code, _, err = call("discover", "--cell", CELL, "--data", "short.csv", "--out", "found", "--prefect")
    assert code == 2
    assert "are too little to decide" in err
    assert "Prefect" not in err
    assert not (workspace / "found").exists()
    assert not (workspace / "mlflow.db").exists()


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("{bpx: CELL}", "bad and good hold the same rows and are both among the data and the tests"),
        ("{bpx: CELL, effects: {self_heatin: {}}}", "did you mean 'self_heating'?"),
        ("good.csv", "good.csv"),
    ],
)
def test_records_and_a_cell_that_cannot_be_used_were_told_after_a_server_had_been_started(
    call, workspace, cell, words
):
    rows = "".join(f"{k},{1 + k % 2},{3.9 - 0.001 * k - 0.02 * (k % 2)}\n" for k in range(100))
    for name in ("bad", "good"):
        (workspace / f"{name}.csv").write_text(f"time_s,current_a,voltage_v\n{rows}")
    text = EXPERIMENT.replace("{bpx: CELL}", cell).replace("CELL", str(CELL))
    (workspace / "refused.yaml").write_text(text)
    code, _, err = call("run", "refused.yaml", "--prefect")
    assert code == 2
    assert words in err.replace("\n", " ")
    assert "Prefect" not in err
    assert not (workspace / "mlflow.db").exists()


def test_the_records_of_a_run_are_read_once_and_it_is_said_before(workspace, monkeypatch, capsys):
    from aesi.pipeline.experiment import sources
    from flows.jobs import start as module

    class Loading(Exception):
        """The data are at hand."""

    def loads(config, found, begins):
        assert [record.name for record in found.records.values()] == ["bad", "good"]
        raise Loading

    reading, names, said = sources.read, [], []

    def counted(path, *given):
        said.append(capsys.readouterr().err)
        names.append(path.name)
        return reading(path, *given)

    monkeypatch.setattr(sources, "read", counted)
    monkeypatch.setattr("flows.jobs.experiment_stages.load", loads)
    for name, slope in (("bad", 1e-3), ("good", 2e-4)):
        lines = "".join(f"{k},1,{3.9 - slope * k:.4f}\n" for k in range(120))
        (workspace / f"{name}.csv").write_text(f"time_s,current_a,voltage_v\n{lines}")
    (workspace / "refused.yaml").write_text(EXPERIMENT.replace("CELL", str(CELL)))
    with pytest.raises(Loading):
        module.start(workspace / "refused.yaml", use_prefect=False)
    assert names == ["bad.csv", "good.csv"]
    assert "Reading bad.csv, good.csv ..." in said[0]


@pytest.mark.parametrize(
    ("error", "left"),
    [(InputError("no."), []), (DataAway("no network."), ["FAILED"]), (FitError("it fails."), ["FAILED"])],
)
def test_only_what_was_refused_is_taken_back(tracked, error, left):
    with pytest.raises(type(error)), tracked_job(Subject("job", 0, "key", "batch"), "title", Console()):
        raise error
    assert statuses("job") == left


def test_a_job_that_is_refused_after_it_tracked_something_keeps_it(tracked):
    def work():
        with tracked_job(Subject("job", 0, "key", "batch"), "title", Console()) as tracker:
            tracker.nested("candidate:1", "one", "candidate", {}, {})
            raise InputError("too late.")

    with pytest.raises(InputError, match="too late"):
        work()
    assert sorted(statuses("job")) == ["FAILED", "FINISHED"]


def test_a_run_that_the_store_does_not_take_back_is_closed_as_failed(tracked, monkeypatch):
    from flows.tracking.tracker import Tracker

    def away(*_, **__):
        raise ConnectionError("no answer")

    monkeypatch.setattr(Tracker, "withdraw", away)
    with (
        pytest.raises(InputError, match="no"),
        tracked_job(Subject("job", 0, "key", "batch"), "title", Console()),
    ):
        raise InputError("no.")
    assert statuses("job") == ["FAILED"]
    (record,) = records("job")
    assert record.status == "failed"


@pytest.fixture
def closed(workspace, monkeypatch):
    """A workspace in which nothing can be written, whoever asks: it would lie below a file."""
    (workspace / "file").write_text("kept")
    monkeypatch.setenv("AESI_HOME", str(workspace / "file" / "home"))


def test_a_workspace_that_cannot_be_written_to_ended_a_job_whose_results_lie_elsewhere(closed, capsys):
    done = []
    with tracked_job(Subject("job", 0, "key", "batch"), "title", Console()) as tracker:
        done.append(tracker)
    assert done == [None]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("file: Not a directory; AESI_HOME can name a folder for what is tracked.")
    assert "not tracked: " in line


def test_a_worker_evaluated_what_it_could_hand_to_nobody(closed, call, workspace, monkeypatch):
    monkeypatch.setattr("flows.jobs.experiment_stages.load", lambda config: pytest.fail("work was begun"))
    path = workspace / "small.yaml"
    path.write_text("name: small\ndata: {kind: virtual}\n")
    code, _, err = call("worker", path)
    assert code == 1
    assert "file: Not a directory; nobody could use the candidates that a worker evaluates here" in err


@pytest.mark.parametrize(
    ("uri", "code", "words"),
    [
        ("foo", 2, r"'foo' is no address of a tracking store; give http://HOST:PORT"),
        ("http://", 2, "is no address"),
        ("sqlite://runs.db", 2, "is no address"),
        (
            "http://me:secret@127.0.0.1:9",
            1,
            r"http://127\.0\.0\.1:9 cannot be used .*refused.* start the server",
        ),
        ("postgresql://me:secret@127.0.0.1:9/none", 1, "cannot be used .*refused.* that the database runs"),
    ],
)
def test_a_tracking_address_that_is_none_or_away_was_told_after_a_server_had_been_started(
    workspace, monkeypatch, uri, code, words
):
    from flows.jobs import start

    def started():
        raise AssertionError("Prefect's server is started")

    monkeypatch.setattr(start, "start_server", started)
    path = workspace / "refused.yaml"
    path.write_text(EXPERIMENT.replace("CELL", str(CELL)))
    for name in ("bad", "good"):
        (workspace / f"{name}.csv").write_text("never read")
    with pytest.raises(AesiError, match=words) as told:
        start.start(path, [f"tracking.uri={uri}"])
    assert told.value.exit_code == code
    assert "secret" not in str(told.value)


def test_a_workspace_with_an_escape_in_its_name_kept_its_runs_in_another_file(workspace, monkeypatch):
    from flows.base.store_address import checked_address
    from flows.tracking.store import Store

    for name in ("a%20b", "a?b"):
        monkeypatch.setenv("AESI_HOME", str(workspace / name))
        with pytest.raises(InputError, match=r"cannot hold a tracking store.* AESI_HOME names"):
            Store()
    monkeypatch.setenv("AESI_HOME", str(workspace / "50% done"))
    assert checked_address() == f"sqlite:///{workspace}/50% done/mlflow.db"
