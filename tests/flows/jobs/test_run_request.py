"""Who evaluates the candidates: by the experiment file, and by what the command line says over it."""

import inspect
from types import SimpleNamespace

import pytest

from aesi.errors import ConfigError, InputError
from aesi.pipeline.experiment.config import parse_experiment
from flows.jobs.run_request import RunRequest
from flows.jobs.run_session import resume_key

THERE, ELSEWHERE = "tcp://there:8786", "tcp://elsewhere:8786"


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "x.yaml"
    runner = f"runner: {{kind: dask, address: '{THERE}'}}"
    file.write_text(f"name: x\ndata: {{kind: files, train: [a.csv], test: [b.csv]}}\n{runner}\n")
    return str(file)


@pytest.mark.parametrize(
    ("runner", "address", "kind", "goes_to"),
    [
        (None, None, "dask", THERE),
        ("dask", None, "dask", THERE),
        ("dask", ELSEWHERE, "dask", ELSEWHERE),
        (None, ELSEWHERE, "dask", ELSEWHERE),
        ("local", None, "local", None),
    ],
)
def test_runner_dask_forgot_the_address_of_the_file(path, runner, address, kind, goes_to):
    asked = RunRequest(path, runner=runner, address=address).config.runner
    assert (asked.kind, asked.address) == (kind, goes_to)


def test_an_address_that_nobody_would_go_to_is_refused(path):
    with pytest.raises(InputError, match="names a Dask scheduler, and --runner local uses none"):
        RunRequest(path, runner="local", address=ELSEWHERE).config
    with pytest.raises(ConfigError, match="runner: `address` names a Dask scheduler; give `kind: dask`"):
        RunRequest(path, ("runner.kind=local",)).config


def test_an_address_meant_dask_for_a_file_of_the_local_runner_where_a_batch_refuses_it(path):
    local = ("runner={kind: local}",)
    with pytest.raises(InputError, match=r"--address tcp://elsewhere:8786 .*; give --runner dask beside it"):
        RunRequest(path, local, address=ELSEWHERE).config
    asked = RunRequest(path, local, "dask", ELSEWHERE).config.runner
    assert (asked.kind, asked.address) == ("dask", ELSEWHERE)


def test_a_run_was_gone_on_with_on_other_data_or_by_another_version(tmp_path, monkeypatch):
    for name in ("cell.json", "a.csv", "b.csv"):
        (tmp_path / name).write_text(name)
    content = {
        "name": "x",
        "cell": "cell.json",
        "data": {"kind": "files", "train": ["a.csv"], "test": ["b.csv"]},
    }
    config = parse_experiment(content, base=tmp_path)
    before = resume_key(config)
    assert resume_key(config) == before
    (tmp_path / "a.csv").write_text("corrected")
    changed = resume_key(config)
    assert changed != before
    monkeypatch.setattr("flows.jobs.run_session.source_digest", lambda: "another")
    assert resume_key(config) != changed


@pytest.mark.parametrize("edited", ["drive.csv", "pulses.csv", "cell.bpx.json"])
def test_a_run_was_gone_on_with_over_an_edited_copy_of_the_catalogue(tmp_path, monkeypatch, edited):
    folder = tmp_path / "lg_m50t_w8"
    folder.mkdir()
    for name in ("drive.csv", "pulses.csv", "cell.bpx.json", "unused.csv"):
        (folder / name).write_text(name)
    monkeypatch.setenv("AESI_DATA", str(tmp_path))
    data = {"kind": "catalogue", "set": "lg_m50t_w8", "train": ["pulses"], "test": ["drive"]}
    config = parse_experiment({"name": "x", "cell": {"bpx": "catalogue"}, "data": data}, base=tmp_path)
    before = resume_key(config)
    (folder / "unused.csv").write_text("corrected")
    assert resume_key(config) == before
    (folder / edited).write_text("corrected")
    assert resume_key(config) != before


def test_a_run_was_gone_on_with_though_its_candidates_may_take_longer_now(path):
    config = RunRequest(path).config
    longer, more = (
        RunRequest(path, (text,)).config for text in ("search.timeout_s=500", "search.memory_mb=9000")
    )
    assert len({resume_key(each) for each in (config, longer, more)}) == 3
    assert resume_key(RunRequest(path, ("search.workers=3", "runner.kind=dask")).config) == resume_key(config)


def test_a_run_without_prefect_was_told_to_go_on_with_it(path):
    assert RunRequest(path, use_prefect=False).resuming == f"aesi run {path} --no-prefect --resume"
    assert RunRequest(path).resuming == f"aesi run {path} --resume"


def test_a_run_was_told_to_go_on_with_the_password_of_its_store(path):
    login = "tracking.uri=postgresql://me:secret@host/db?sslmode=require"
    resuming = RunRequest(path, (login, "seed=1")).resuming
    shown = "'tracking.uri=postgresql://USER:PASSWORD@host/db?sslmode=require'"
    assert resuming == f"aesi run {path} --set {shown} --set seed=1 --resume"


def test_the_password_of_the_second_of_two_addresses_was_shown(path):
    laid = (
        'runner={"storage":"postgresql://me:secret@host/db","address":"tcp://me:secret@host:1","kind":"dask"}'
    )
    request = RunRequest(path, (laid,), address="tcp://me:secret@host:2")
    assert "secret" not in request.resuming
    assert "--address tcp://USER:PASSWORD@host:2" in request.resuming


def test_a_run_without_cache_was_told_to_go_on_from_it(path):
    assert RunRequest(path, use_cache=False).resuming == f"aesi run {path} --no-cache --resume"


@pytest.mark.parametrize(
    "way", ["plain", pytest.param("as a flow", marks=pytest.mark.slow), "without the decorator"]
)
def test_a_file_that_was_edited_after_the_command_had_read_it_was_what_was_run(workspace, monkeypatch, way):
    from flows.jobs import start as module
    from flows.jobs.prefect_flows import experiment

    file = workspace / "x.yaml"
    file.write_text("name: x\nseed: 1\ndata: {kind: virtual}\n")
    seen = []

    def runs(request, run, console):
        seen.append(request.config.seed)
        return workspace

    def edits(*_):
        file.write_text("name: x\nseed: 2\nnonsense: 3\n")

    for target in ("flows.jobs.start.run_experiment", "flows.jobs.prefect_flows.run_experiment"):
        monkeypatch.setattr(target, runs)
    monkeypatch.setattr("flows.evaluation.in_reach.check_in_reach", edits)
    if way == "without the decorator":
        monkeypatch.setattr("flows.jobs.prefect_flows.experiment", experiment.fn)
        monkeypatch.setattr(module, "start_server", lambda: None)
    module.start(file, use_prefect=way != "plain")
    assert seen == [1]


def test_runs_that_differ_by_what_was_laid_over_their_file_had_one_name(path):
    assert RunRequest(path).title == "x, seed 0"
    laid = ("data.dt_s=2", "seed=3", "search.candidates=8", "search.workers=2", "note=again")
    assert RunRequest(path, laid).title == "x, seed 3: data.dt_s=2, search.candidates=8"
    secret = ("tracking.uri=http://me:secret@there:5000", "runner.storage=postgresql://me:secret@there/x")
    assert RunRequest(path, secret).title == "x, seed 0"


@pytest.mark.parametrize("job", ["experiment", "discovery"])
def test_the_password_of_an_address_was_kept_and_shown_by_prefect(workspace, monkeypatch, job):
    from flows.jobs import prefect_flows
    from flows.jobs import start as module

    file = workspace / "x.yaml"
    file.write_text("name: x\ndata: {kind: virtual}\n")
    flow = getattr(prefect_flows, job)
    kept = []

    def keeps(*given, **named):
        parameters = inspect.signature(flow.fn).bind(*given, **named).arguments
        kept.append(flow.serialize_parameters(parameters | {"case": None}))
        return workspace

    monkeypatch.setattr(prefect_flows, job, keeps)
    monkeypatch.setattr(module, "start_server", lambda: None)
    monkeypatch.setattr("flows.tracking.store.check_reached", lambda uri: None)
    monkeypatch.setattr("flows.evaluation.in_reach.check_in_reach", lambda runner: None)
    monkeypatch.setattr(module, "check_case", lambda case: None)
    overrides = ("tracking.uri=postgresql://me:secret@host/db", "seed=1")
    if job == "experiment":
        module.start(file, overrides, "dask", "tcp://me:secret@host:1")
    else:
        request = RunRequest(str(file), overrides)
        case = SimpleNamespace(cell=file, measurements=())
        module.discover(case, workspace, request=request)
    assert "secret" not in str(kept)
    assert kept[0]["overrides"] == ["tracking.uri=postgresql://host/db", "seed=1"]
