"""`aesi ui`: MLflow on what is tracked, Optuna on the searches, Prefect on the flow runs; on loopback."""

from __future__ import annotations

import os
import socket
import sys

from aesi.errors import InputError
from flows.base import environment
from flows.tracking.store import Store, default_uri, without_login
from flows.tracking.view import VIEW, view_of

TRAINING = "#/experiments?workflowType=machine_learning"
"""MLflow opens on what it has for language models, where runs are hard to find."""
# The jobs that MLflow would run beside the server are for language models, and take eight processes.
QUIETLY = {
    "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",
    "MLFLOW_LOGGING_LEVEL": "ERROR",
    "PYTHONWARNINGS": "ignore:starlette.middleware.wsgi is deprecated",  # MLflow's own use of it
}


def serve(port: int, host: str, uri: str | None) -> None:
    """Serve until interrupted. A store that is a server already has its UI there: its address is printed."""
    uri = uri or default_uri()
    if uri.startswith(("http://", "https://")):
        print(f"The runs are at {without_login(uri)}")
        return
    if not _free(host, port):
        raise InputError(f"port {port} on {host} is taken; give another with --port.")
    store = Store(uri)  # makes or migrates the tables, so that an empty workspace shows an empty UI
    command = [
        sys.executable,
        "-m",
        "mlflow",
        "server",
        "--backend-store-uri",
        uri,
        "--registry-store-uri",
        uri,
    ]
    command += ["--host", host, "--port", str(port), "--workers", "1"]
    address = f"http://{host}:{port}/"
    print(f"MLflow shows the runs at {address}{TRAINING} (Ctrl-C ends it)")
    for name, view in _views(store):
        print(f"  {name}: {address}{view}")
    sys.stdout.flush()
    os.execve(
        sys.executable, command, os.environ | QUIETLY
    )  # so that whatever ends this process ends the server


def _views(store: Store) -> list[tuple[str, str]]:
    """Name of each experiment that has a table of its own, and the address below the server's that opens it."""
    return [
        (each.name, view_of(each.experiment_id))
        for each in store.client.search_experiments()
        if f"mlflow.sharedViewState.{VIEW}" in each.tags
    ]


def serve_studies(port: int, host: str, url: str | None) -> None:
    """Optuna's dashboard on the studies of the workspace, or of the database at `url`, until interrupted."""
    from optuna_dashboard import run_server

    from flows.search.published_study import journal, study_storage

    if not url and not journal().exists():
        raise InputError(
            f"no search has been run in this workspace ({journal()} is not there); `aesi run` makes one."
        )
    if not _free(host, port):
        raise InputError(f"port {port} on {host} is taken; give another with --port.")
    print(f"Optuna's dashboard shows the searches at http://{host}:{port}/ (Ctrl-C ends it)", flush=True)
    run_server(study_storage(url), host=host, port=port)


def serve_flows(port: int, host: str) -> None:
    """Prefect's server on the flow runs of the workspace, until interrupted."""
    if not _free(host, port):
        raise InputError(f"port {port} on {host} is taken; give another with --port.")
    environment.prepare_process()
    environment.make_prefect_home()
    print(f"Prefect shows the flow runs at http://{host}:{port}/runs (Ctrl-C ends it)", flush=True)
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", host, "--port", str(port)]
    api = {"PREFECT_UI_API_URL": f"http://{host}:{port}/api"}
    os.execve(sys.executable, command, os.environ | api)


def _free(host: str, port: int) -> bool:
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError:
            return False
    return True
