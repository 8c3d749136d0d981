"""No password of an address that was given is shown, whatever is wrong with it or about it."""

import json

import pytest

LOGIN = "me:secret@127.0.0.1"


@pytest.fixture
def file(workspace):
    path = workspace / "x.yaml"
    path.write_text("name: x\ndata: {kind: virtual}\n")
    return path


@pytest.mark.parametrize(
    "given",
    [
        ("--set", f"tracking.uri:http://{LOGIN}"),
        ("--set", f"tracking=http://{LOGIN}"),
        ("--set", f"tracking.uri=[http://{LOGIN}"),
        ("--set", f"seed=http://{LOGIN}"),
        ("--set", f"name.of=http://{LOGIN}"),
        ("--set", f"runner.storage=[postgresql://{LOGIN}/db]"),
        ("--set", f"tracking.uri=http//{LOGIN}"),
        ("--set", "tracking.uri=http://me:se/secret@127.0.0.1"),
        ("--set", f"tracking.uri={LOGIN}"),
        ("--set", f"runner.storage=postgresql://{LOGIN}:PORT/none"),
        ("--set", "runner.storage=postgresql://me:se@secret@127.0.0.1:9/none"),
        ("--set", "tracking.uri=postgresql://me:se@secret@127.0.0.1:9/none"),
        ("--set", "tracking.uri", f"http://{LOGIN}"),
        ("--address", f"tcp://{LOGIN}:1"),
        ("--runner", "dask", "--address", f"tcp://{LOGIN}:1"),
        ("--runner", "dask", "--address", f"tcp:/{LOGIN}"),
    ],
)
def test_the_password_of_an_address_that_is_refused_was_shown(call, file, given):
    code, out, err = call("run", file, "--no-prefect", *given)
    assert code in (1, 2)
    assert err.startswith("aesi: ")
    assert "secret" not in out + err


@pytest.mark.parametrize(
    "arguments",
    [
        ("data", "get", f"http://{LOGIN}/x.csv"),
        ("simulate", "--cell", "x.json", "--current", f"http://{LOGIN}/x.csv", "--out", "y.csv"),
        ("batch", "x", "--out", "y", "--address", f"tcp://{LOGIN}:1"),
    ],
)
def test_the_password_of_an_address_in_place_of_a_name_was_shown(call, workspace, arguments):
    code, out, err = call(*arguments)
    assert code in (1, 2)
    assert "127.0.0.1" in err
    assert "secret" not in out + err


@pytest.mark.parametrize("command", [("candidate", "--out", "y"), ("compare", "--out", "y.html")])
def test_the_password_of_an_address_in_place_of_a_run_was_shown(call, tracked, command):
    name, *others = command
    code, out, err = call(name, f"http://{LOGIN}/", *others)
    assert code == 2
    assert "'http://127.0.0.1/'" in err
    assert "secret" not in out + err


def test_the_password_of_a_store_went_to_every_worker(monkeypatch):
    from aesi.pipeline.experiment.config import parse_experiment
    from flows.evaluation import dask_pool, open_pool

    given = []
    monkeypatch.setattr(dask_pool, "DaskPool", lambda *arguments: given.append(arguments))
    config = parse_experiment(
        {
            "name": "x",
            "data": {"kind": "virtual"},
            "search": {"candidates": 3},
            "tracking": {"uri": f"http://{LOGIN}"},
            "runner": {"kind": "dask", "storage": f"postgresql://{LOGIN}/db"},
        }
    )
    open_pool.open_pool(None, config, "study")
    ((content, *_),) = given
    assert "secret" not in content
    assert parse_experiment(json.loads(content)).digest == config.digest
