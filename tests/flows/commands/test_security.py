"""Nothing leaves the machine and nothing listens beyond loopback, in a whole run with every process it starts."""

import json
import os
import socket
import time

import psutil
import pytest

from flows.base import environment

WATCH = """
import json, os, sys

def note(event, arguments):
    if event in ("socket.connect", "socket.bind"):
        where = arguments[1]
        host = where[0] if isinstance(where, tuple) else "a file"
    elif event == "socket.getaddrinfo":
        host = arguments[0]
    else:
        return
    host = host.decode() if isinstance(host, bytes) else host
    with open(os.environ["WATCH_FILE"], "a") as stream:
        stream.write(json.dumps([event, host]) + "\\n")

sys.addaudithook(note)
note("socket.bind", (None, "watching"))
"""
HERE = {"127.0.0.1", "::1", "localhost", "a file", socket.gethostname()}


@pytest.fixture
def watched(tmp_path, aesi):
    """Runs `aesi` with every address that it or a child of it turns to written down: (event, host) pairs."""
    (tmp_path / "hook").mkdir()
    (tmp_path / "hook" / "sitecustomize.py").write_text(WATCH)
    log = tmp_path / "addresses"
    log.touch()

    def run(*arguments):
        path = os.pathsep.join([str(tmp_path / "hook"), str(environment.__file__).rsplit("/flows/", 1)[0]])
        process = aesi(*arguments, PYTHONPATH=path, WATCH_FILE=str(log))
        _, said = process.communicate(timeout=300)
        assert process.returncode == 0, said
        seen = [tuple(json.loads(line)) for line in log.read_text().splitlines()]
        assert seen  # the hook was there
        return seen

    return run


def assert_stays_here(seen):
    assert not {pair for pair in seen if pair[1] not in HERE and pair[1] is not None}
    assert not {pair for pair in seen if pair[0] == "socket.bind" and pair[1] in ("", "0.0.0.0", "::", None)}


def test_a_run_turns_to_nobody(watched, arguments, tracked):
    assert_stays_here(watched(*arguments()))


@pytest.mark.slow
def test_a_run_under_prefect_and_dask_stays_on_loopback(watched, arguments, tracked):
    seen = watched(*arguments(prefect=True), "--runner", "dask")
    assert ("socket.bind", "127.0.0.1") in seen  # the hook sees the servers that were started
    assert_stays_here(seen)


def test_telemetry_is_off_unless_the_user_says_otherwise(monkeypatch):
    names = ("DO_NOT_TRACK", "MLFLOW_DISABLE_TELEMETRY", "PYBAMM_DISABLE_TELEMETRY")
    for name in (*names, "PREFECT_SERVER_ANALYTICS_ENABLED"):
        monkeypatch.delenv(name, raising=False)
    environment.prepare_process()
    assert all(os.environ[name] in ("1", "true") for name in names)
    assert os.environ["PREFECT_SERVER_ANALYTICS_ENABLED"] == "false"
    monkeypatch.setenv("MLFLOW_DISABLE_TELEMETRY", "false")
    environment.prepare_process()
    assert os.environ["MLFLOW_DISABLE_TELEMETRY"] == "false"


def test_the_ui_listens_on_loopback_by_default():
    import inspect

    from flows.commands.experiment import ui

    assert inspect.signature(ui).parameters["host"].default == "127.0.0.1"


@pytest.mark.slow
def test_the_ui_listens_on_loopback_and_ends_with_its_command(aesi, tracked):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    process = aesi("ui", "--port", port)
    found, deadline = [], time.monotonic() + 60
    while not found:
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < deadline
        time.sleep(0.2)
        found = listeners(port)
    assert {address.ip for address in found} == {"127.0.0.1"}
    process.terminate()
    process.communicate(timeout=30)
    assert not listeners(port)


def listeners(port):
    return [
        one.laddr
        for one in psutil.net_connections("tcp")
        if one.status == "LISTEN" and one.laddr.port == port
    ]
