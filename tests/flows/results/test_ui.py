"""`aesi ui` and the commands that read a store: what is not there is told, and never made."""

import errno
import os
import socket

import pytest

from aesi.errors import InputError
from flows.results import ui
from flows.tracking.store import KIND, Store


@pytest.mark.parametrize(
    "command",
    [
        ("compare", "smoke"),
        ("tables", "smoke"),
        ("candidate", "0123abcd", "--out", "c"),
        ("ui", "--port", "5599", "--uri", "sqlite:///typo.db"),
        ("compare", "smoke", "--uri", "sqlite:///typo.db"),
        ("ui", "--optuna", "--storage", "sqlite:///typo.db"),
    ],
    ids=" ".join,
)
def test_a_store_that_is_only_read_was_made_where_it_was_not(call, workspace, command):
    code, _, err = call(*command)
    assert code == 2
    assert "there is no" in err
    assert not list(workspace.glob("*.db"))


def test_the_wrong_folder_was_shown_as_an_empty_page_without_a_word(call, tracked, monkeypatch):
    monkeypatch.setattr(os, "execve", lambda *_: None)
    code, out, _ = call("ui", "--port", "5599")
    assert code == 0
    assert (
        f"Nothing is tracked in sqlite:///{tracked}/mlflow.db yet; runs are tracked in the current folder"
        in out
    )
    store = Store()
    store.create_run(store.experiment("smoke"), "one", {KIND: "run"})
    assert "Nothing is tracked" not in call("ui", "--port", "5599")[1]


def test_the_password_of_the_store_stood_in_the_list_of_processes(call, tracked, monkeypatch):
    given = []
    monkeypatch.setattr(os, "execve", lambda *started: given.extend(started[1:]))
    code, _, _ = call("ui", "--port", "5599")
    assert code == 0
    command, environment = given
    assert not [word for word in command if "mlflow.db" in word]
    assert environment["MLFLOW_BACKEND_STORE_URI"] == f"sqlite:///{tracked}/mlflow.db"


def test_a_store_where_nothing_may_be_written_asks_to_be_copied(tracked, monkeypatch):
    opened = os.open

    def refusing(path, *how, **more):
        if str(path).endswith(".tmp"):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        return opened(path, *how, **more)

    monkeypatch.setattr(os, "open", refusing)
    with pytest.raises(InputError, match=r"Read-only file system.*copy it with its artifacts"):
        Store.to_read()


@pytest.mark.parametrize(
    ("storage", "words"),
    [
        ("no address", "Could not parse SQLAlchemy URL"),
        ("sqlite:///text.db", "file is not a database"),
        ("postgresql://me:secret@127.0.0.1:1/x", "postgresql://127.0.0.1:1/x"),
    ],
)
def test_a_storage_without_searches_was_an_unexpected_error(call, workspace, storage, words):
    (workspace / "text.db").write_text("no database, " * 100)
    code, out, err = call("ui", "--optuna", "--storage", storage)
    assert (code, out) == (2, "")
    assert words in err
    assert "secret" not in err
    assert err.count("\n") == 1


def test_who_came_from_another_machine_was_refused(call, tracked, monkeypatch):
    """MLflow refuses hosts that it is not told of, and pages from there that ask it for runs."""
    from mlflow.server.security_utils import is_allowed_host_header, should_block_cors_request

    given = []
    monkeypatch.setattr(os, "execve", lambda program, command, environment: given.append(environment))
    monkeypatch.setattr(socket, "gethostname", lambda: "labserver")
    _, out, _ = call("ui", "--port", "5599", "--host", "0.0.0.0")
    assert "http://labserver:5599/#/experiments" in out
    hosts = given[0]["MLFLOW_SERVER_ALLOWED_HOSTS"].split(",")
    origins = given[0]["MLFLOW_SERVER_CORS_ALLOWED_ORIGINS"].split(",")
    for host in ("labserver:5599", "localhost:5599", "127.0.0.1:5599"):
        assert is_allowed_host_header(hosts, host)
        assert not should_block_cors_request(f"http://{host}", "POST", origins)
    assert not is_allowed_host_header(hosts, "elsewhere:5599")
    monkeypatch.setenv("MLFLOW_SERVER_ALLOWED_HOSTS", "proxy")  # what a person has set stays
    call("ui", "--port", "5599", "--host", "0.0.0.0")
    assert given[1]["MLFLOW_SERVER_ALLOWED_HOSTS"] == "proxy"
    call("ui", "--port", "5599")
    assert "MLFLOW_SERVER_CORS_ALLOWED_ORIGINS" not in given[2]


@pytest.mark.parametrize(
    ("host", "there"), [("0.0.0.0", "http://labserver:5599"), ("::1", "http://[::1]:5599")]
)
def test_the_page_of_flow_runs_asked_for_its_figures_at_an_address_that_is_none(
    call, workspace, monkeypatch, host, there
):
    """`http://0.0.0.0:4200/api` is the browser's own machine, and `http://::1:4200/api` nothing."""
    given = []
    monkeypatch.setattr(os, "execve", lambda program, command, environment: given.append(environment))
    monkeypatch.setattr(socket, "gethostname", lambda: "labserver")
    monkeypatch.setattr(ui, "_check_free", lambda host, port: None)
    monkeypatch.delenv("PREFECT_UI_API_URL", raising=False)
    _, out, _ = call("ui", "--prefect", "--port", "5599", "--host", host)
    assert f"at {there}/runs" in out
    assert given[0]["PREFECT_UI_API_URL"] == f"{there}/api"
    monkeypatch.setenv("PREFECT_UI_API_URL", "https://proxy/api")  # what a person has set stays
    call("ui", "--prefect", "--port", "5599", "--host", host)
    assert given[1]["PREFECT_UI_API_URL"] == "https://proxy/api"
    monkeypatch.setattr("optuna_dashboard.run_server", lambda *_, **__: None)
    monkeypatch.setattr("flows.search.published_study.study_storage", lambda *_: None)
    monkeypatch.setattr("flows.search.published_study.journal", lambda: workspace)
    _, out, _ = call("ui", "--optuna", "--port", "5599", "--host", host)
    assert f"searches at {there}/" in out


def test_a_host_that_is_not_here_was_told_as_a_port_that_is_taken():
    with pytest.raises(InputError, match=r"nothing can be served at 192\.0\.2\.1, port 5599"):
        ui.serve_flows(5599, "192.0.2.1")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"port {port} on 127.0.0.1 is taken"):
            ui.serve_flows(port, "127.0.0.1")
