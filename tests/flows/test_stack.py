"""The platform of docker-compose.yml without Docker: PostgreSQL, MLflow and Prefect as processes on loopback."""

import json
import os
import pwd
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from flows.mlflow_store import KIND, Store
from flows.tracking import deliver_leftovers

pytestmark = pytest.mark.slow


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def postgres_programs():
    """The folder of initdb and postgres: on the path, or where Debian puts it."""
    found = shutil.which("initdb")
    folders = [Path(found).parent] if found else sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not folders:
        pytest.skip("PostgreSQL is not installed here (apt-get install postgresql)")
    return folders[-1]


@contextmanager
def process(command, ready, timeout_s=120, **options):
    """A process, once it is ready; ended with the block."""
    started = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
    )
    try:
        deadline = time.monotonic() + timeout_s
        while not ready():
            assert started.poll() is None, started.communicate()[0]
            assert time.monotonic() < deadline, f"{command[0]} is not ready after {timeout_s} s"
            time.sleep(0.2)
        yield started
    finally:
        started.terminate()
        try:
            started.communicate(timeout=20)
        except subprocess.TimeoutExpired:
            started.kill()
            started.communicate()


def answers(address):
    def ready():
        try:
            urllib.request.urlopen(address, timeout=2).close()
        except OSError:
            return False
        return True

    return ready


@contextmanager
def postgres():
    """A PostgreSQL of its own with the databases mlflow, prefect and aesi; yields its port."""
    import psycopg2

    programs, port = postgres_programs(), free_port()
    user = {"user": pwd.getpwnam("postgres").pw_uid} if os.geteuid() == 0 else {}  # it refuses to run as root
    folder = Path(tempfile.mkdtemp(prefix="aesi-postgres-", dir="/tmp"))
    if user:
        os.chown(folder, user["user"], -1)

    def connect(database="postgres"):
        return psycopg2.connect(host="127.0.0.1", port=port, user="aesi", dbname=database, connect_timeout=2)

    def ready():
        try:
            connect().close()
        except psycopg2.OperationalError:
            return False
        return True

    try:
        subprocess.run(
            [programs / "initdb", "-D", folder / "data", "-A", "trust", "-U", "aesi"],
            check=True,
            capture_output=True,
            cwd=folder,
            **user,
        )
        command = [str(programs / "postgres"), "-D", str(folder / "data"), "-p", str(port), "-k", str(folder)]
        with process([*command, "-c", "listen_addresses=127.0.0.1"], ready, cwd=folder, **user):
            connection = connect()
            connection.autocommit = True
            for name in ("mlflow", "prefect", "aesi"):
                connection.cursor().execute(f"CREATE DATABASE {name}")
            connection.close()
            yield port
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture
def stack(workspace):
    """Addresses of the running platform."""
    with ExitStack() as running:
        database = f"aesi@127.0.0.1:{running.enter_context(postgres())}"
        mlflow, prefect = free_port(), free_port()
        server = [sys.executable, "-m", "mlflow", "server", "--host", "127.0.0.1", "--port", str(mlflow)]
        server += ["--backend-store-uri", f"postgresql+psycopg2://{database}/mlflow", "--workers", "1"]
        server += ["--artifacts-destination", str(workspace / "artifacts")]
        running.enter_context(process(server, answers(f"http://127.0.0.1:{mlflow}/health")))
        environment = os.environ | {
            "PREFECT_API_DATABASE_CONNECTION_URL": f"postgresql+asyncpg://{database}/prefect",
            "PREFECT_HOME": str(workspace / "prefect-server"),
        }
        server = [str(Path(sys.executable).with_name("prefect")), "server", "start"]
        server += ["--host", "127.0.0.1", "--port", str(prefect)]
        running.enter_context(
            process(server, answers(f"http://127.0.0.1:{prefect}/api/health"), env=environment)
        )
        yield {
            "storage": f"postgresql://{database}/aesi",
            "mlflow": f"http://127.0.0.1:{mlflow}",
            "prefect": f"http://127.0.0.1:{prefect}/api",
        }


def completed_flow_runs(api):
    request = urllib.request.Request(
        f"{api}/flow_runs/filter", data=b"{}", headers={"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request, timeout=10) as answer:
        return [run["state"]["type"] for run in json.load(answer)]


def test_a_run_and_two_workers_on_one_study_and_one_of_them_killed(
    stack, aesi, arguments, finished, workspace
):
    shared = arguments(f"runner.storage={stack['storage']}", f"tracking.uri={stack['mlflow']}")
    experiment = [shared[0], shared[1], *shared[3:]]  # with Prefect
    work = ["worker", *experiment[1:]]
    victim, worker = (aesi(*work, AESI_HOME=str(workspace / name)) for name in ("victim", "worker"))
    time.sleep(8)
    victim.kill()
    run = aesi(*experiment, PREFECT_API_URL=stack["prefect"])
    _, said = run.communicate(timeout=300)
    assert run.returncode == 0, said
    _, worked = worker.communicate(timeout=120)
    assert worker.returncode == 0, worked
    assert completed_flow_runs(stack["prefect"]) == ["COMPLETED"]
    tables = aesi("tables", "smoke", "--uri", stack["mlflow"])
    text, said = tables.communicate(timeout=60)
    assert tables.returncode == 0, said
    (whole,) = (finished / "runs/smoke").glob("*/tables.md")
    first = whole.read_text().split("\n\n")[1].splitlines()
    assert [line.split("|")[:6] for line in text.split("\n\n")[1].splitlines()] == [
        line.split("|")[:6] for line in first
    ]
    store = Store(stack["mlflow"])
    (parent,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    children = store.children(store.find_experiment("smoke"), parent.info.run_id)
    assert sum(label.startswith("candidate:") for label in children) == 6


def test_a_server_that_goes_away_in_mid_run_gets_everything_when_it_is_back(workspace, aesi, arguments):
    port = free_port()
    server = [sys.executable, "-m", "mlflow", "server", "--host", "127.0.0.1", "--port", str(port)]
    server += ["--backend-store-uri", f"sqlite:///{workspace}/server.db", "--workers", "1"]
    server += ["--artifacts-destination", str(workspace / "artifacts")]
    ready, uri = answers(f"http://127.0.0.1:{port}/health"), f"http://127.0.0.1:{port}"
    with process(server, ready, start_new_session=True):
        run = aesi(*arguments(f"tracking.uri={uri}"))
        deadline = time.monotonic() + 120
        while not list((workspace / ".aesi/cache/candidates").glob("??/*.bin")):
            assert run.poll() is None, run.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.05)
    time.sleep(5)
    with process(server, ready, start_new_session=True):
        _, said = run.communicate(timeout=240)
        assert run.returncode == 0, said
        assert "does not answer" in said
        store = Store(uri)
        deliver_leftovers(store, print)  # as the next `aesi run` or `aesi tables` does
        (parent,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
        assert parent.info.status == "FINISHED"
        children = store.children(store.find_experiment("smoke"), parent.info.run_id)
        assert sum(label.startswith("candidate:") for label in children) == 6
        assert {run.info.status for run in children.values()} == {"FINISHED"}
