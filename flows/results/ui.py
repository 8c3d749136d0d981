"""`aesi ui`: MLflow on what is tracked, Optuna on the searches, Prefect on the flow runs; on loopback."""

from __future__ import annotations

import errno
import os
import socket
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from aesi.errors import InputError, first_line
from aesi.logins import login_left_out, without_login
from flows.base import environment
from flows.base.store_address import PLACE, checked_address
from flows.tracking.store import Store
from flows.tracking.view import TRAINING, VIEW_TAG, view_of

if TYPE_CHECKING:
    from optuna.storages import BaseStorage

LOOPBACK = ("localhost", "127.0.0.1", "::1")
EVERY_ADDRESS = ("0.0.0.0", "::")
"""Hosts that stand for all addresses of this machine."""
# The jobs that MLflow would run beside the server are for language models, and take eight processes.
QUIETLY = {
    "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",
    "MLFLOW_LOGGING_LEVEL": "ERROR",
    "PYTHONWARNINGS": "ignore:starlette.middleware.wsgi is deprecated",  # MLflow's own use of it
}


def serve(port: int, host: str, uri: str | None) -> None:
    """Serve until interrupted. A store that is a server already has its UI there: its address is printed."""
    named, uri = uri is not None, checked_address(uri)
    if uri.startswith(("http://", "https://")):
        print(f"The runs are at {without_login(uri)}")
        return
    _check_free(host, port)
    # Of the workspace the tables are made, so that its first run can be watched; of a named store they are there.
    store = Store.to_read(uri) if named else Store(uri)
    command = [sys.executable, "-m", "mlflow", "server"]
    command += ["--host", host, "--port", str(port), "--workers", "1"]
    address = f"http://{_shown(host)}:{port}/"
    print(f"MLflow shows the runs at {address}#/experiments?{TRAINING} (Ctrl-C ends it)")
    for name, view in _views(store):
        print(f"  {name}: {address}{view}")
    if not store.all_jobs():
        print(f"  Nothing is tracked in {without_login(uri)} yet; {PLACE}.")
    sys.stdout.flush()
    # The address may hold a password: everyone on the machine may read a command line, its owner alone these.
    stores = {"MLFLOW_BACKEND_STORE_URI": uri, "MLFLOW_REGISTRY_STORE_URI": uri}
    surroundings = _admitted(host, port) | os.environ | QUIETLY | stores
    os.execve(sys.executable, command, surroundings)  # so that whatever ends this process ends the server


def _shown(host: str) -> str:
    """A host as it is written in an address; where all of this machine's are served, its name."""
    host = socket.gethostname() if host in EVERY_ADDRESS else host
    return f"[{host}]" if ":" in host else host


def _admitted(host: str, port: int) -> dict[str, str]:
    """MLflow's settings by which other machines are answered under each name and address of this one.

    Without them it refuses whoever names another host than localhost, and what a page asks for from such an address.
    """
    if host in LOOPBACK:
        return {}
    names = [*LOOPBACK, host, socket.gethostname(), socket.getfqdn(), *_addresses()]
    hosts = list(dict.fromkeys(f"[{name}]" if ":" in name else name for name in names))
    return {
        "MLFLOW_SERVER_ALLOWED_HOSTS": ",".join(f"{one},{one}:{port}" for one in hosts),
        "MLFLOW_SERVER_CORS_ALLOWED_ORIGINS": ",".join(f"http://{one}:{port}" for one in hosts),
    }


def _addresses() -> list[str]:
    """The addresses of this machine, IPv4 and IPv6."""
    import psutil

    known = [one for each in psutil.net_if_addrs().values() for one in each]
    return [
        one.address
        for one in known
        if one.family in (socket.AF_INET, socket.AF_INET6) and "%" not in one.address
    ]


def _views(store: Store) -> list[tuple[str, str]]:
    """Name of each experiment that has a table of its own, and the address below the server's that opens it."""
    return [
        (each.name, view_of(each.experiment_id))
        for each in store.client.search_experiments()
        if VIEW_TAG in each.tags
    ]


def serve_studies(port: int, host: str, url: str | None) -> None:
    """Optuna's dashboard on the studies of the workspace, or of the database at `url`, until interrupted."""
    from optuna_dashboard import run_server

    from flows.search.published_study import journal, study_storage

    if not url and not journal().exists():
        raise InputError(
            f"no search has been run in this workspace ({journal()} is not there); `aesi run` makes one."
        )
    _check_free(host, port)
    storage = _there(url) if url else study_storage()
    print(
        f"Optuna's dashboard shows the searches at http://{_shown(host)}:{port}/ (Ctrl-C ends it)", flush=True
    )
    run_server(storage, host=host, port=port)


def _there(url: str) -> BaseStorage:
    """Optuna's storage in a database that is there.  Raises InputError, which names it without its login."""
    from sqlalchemy.engine import make_url

    from flows.search.published_study import study_storage

    try:
        place = make_url(url)
        file = place.database if place.get_backend_name() == "sqlite" else None
        if file and not Path(file).is_file():  # SQLite would make one
            raise FileNotFoundError(f"there is no file {file}")
        return study_storage(url)
    except Exception as error:
        raise InputError(
            f"--storage {without_login(url)} cannot be shown ({login_left_out(first_line(error), url)}); give the "
            "address that "
            "runner.storage of the experiment's file has."
        ) from None


def serve_flows(port: int, host: str) -> None:
    """Prefect's server on the flow runs of the workspace, until interrupted."""
    _check_free(host, port)
    environment.prepare_process()
    environment.make_prefect_home()
    address = f"http://{_shown(host)}:{port}"
    print(f"Prefect shows the flow runs at {address}/runs (Ctrl-C ends it)", flush=True)
    command = [sys.executable, "-m", "prefect", "server", "start", "--host", host, "--port", str(port)]
    api = {
        "PREFECT_UI_API_URL": f"{address}/api"
    }  # which a browser asks, from whatever machine it shows the page on
    os.execve(sys.executable, command, api | os.environ)


def _check_free(host: str, port: int) -> None:
    """Raises InputError where nothing can listen there, with the reason."""
    try:
        ((family, kind, _, _, address), *_) = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        with socket.socket(family, kind) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except (OSError, UnicodeError) as error:
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            raise InputError(f"port {port} on {host} is taken; give another with --port.") from None
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"nothing can be served at {host}, port {port} ({reason}); give another --host or --port."
        ) from None
