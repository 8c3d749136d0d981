"""The platform of docker-compose.yml without Docker: its own command lines as processes on loopback."""

import json
import os
import pwd
import re
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
import yaml

from flows.tracking.leftovers import deliver_leftovers
from flows.tracking.store import KIND, Store

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
SERVICES = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]
LOGIN = "${POSTGRES_USER:-aesi}:${POSTGRES_PASSWORD:?set POSTGRES_PASSWORD in .env}@postgres:5432"
PROGRAMS = str(Path(sys.executable).parent)


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
def process(command, ready, timeout_s=300, **options):
    """A process, once it is ready; ended with the block."""
    with tempfile.NamedTemporaryFile("w+") as said:  # a pipe that nobody empties would stop it
        started = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, **options)
        try:
            deadline = time.monotonic() + timeout_s
            while not ready():
                assert started.poll() is None, Path(said.name).read_text()
                assert time.monotonic() < deadline, f"not ready after {timeout_s} s: {command}"
                time.sleep(0.2)
            yield started
        finally:
            started.terminate()
            try:
                started.wait(timeout=20)
            except subprocess.TimeoutExpired:
                started.kill()
                started.wait()


def answers(address):
    def ready():
        try:
            urllib.request.urlopen(address, timeout=2).close()
        except OSError:
            return False
        return True

    return ready


def listens(port):
    def ready():
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    return ready


def here(text, changes):
    """A word of the compose file as it reads on this machine, nothing of the containers left in it."""
    for old, new in changes.items():
        text = text.replace(old, new)
    assert not re.search(r"\$\{|0\.0\.0\.0|/srv/", text), text
    return text


def of_compose(service, changes):
    """Command line and environment that the compose file gives a service, for this machine."""
    given = SERVICES[service]
    told = {name: value for name, value in given.get("environment", {}).items() if value is not None}
    settings = {name: here(value, changes) for name, value in told.items()}
    paths = {"PATH": f"{PROGRAMS}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    return [here(word, changes) for word in given["command"]], os.environ | settings | paths


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
    """Addresses of the running platform, and what to change in the compose file to get there."""
    with ExitStack() as running:
        database = f"aesi@127.0.0.1:{running.enter_context(postgres())}"
        mlflow, prefect = free_port(), free_port()
        everywhere = {LOGIN: database, "0.0.0.0": "127.0.0.1", "/srv/cache": str(workspace / "cache")}
        artifacts = {"${AESI_ARTIFACTS:-/artifacts}": str(workspace / "artifacts")}
        command, env = of_compose("mlflow", everywhere | artifacts | {"port=5000": f"port={mlflow}"})
        running.enter_context(process(command, answers(f"http://127.0.0.1:{mlflow}/health"), env=env))
        command, env = of_compose("prefect-server", everywhere | {"4200": str(prefect)})
        env["PREFECT_HOME"] = str(workspace / "prefect-server")
        running.enter_context(process(command, answers(f"http://127.0.0.1:{prefect}/api/health"), env=env))
        yield {
            "storage": f"postgresql://{database}/aesi",
            "mlflow": f"http://127.0.0.1:{mlflow}",
            "prefect": f"http://127.0.0.1:{prefect}/api",
            "changes": everywhere
            | {"mlflow:5000": f"127.0.0.1:{mlflow}", "prefect-server:4200": f"127.0.0.1:{prefect}"},
        }


@pytest.fixture
def dask(stack):
    """Address of a Dask scheduler with two workers."""
    with ExitStack() as running:
        port, dashboard = free_port(), free_port()
        address = f"127.0.0.1:{port}"
        ours = {"8786": str(port), ":8787": f"127.0.0.1:{dashboard}"}
        command, env = of_compose("dask-scheduler", stack["changes"] | ours)
        running.enter_context(process(command, listens(port), env=env))
        for _ in range(2):
            own = free_port()
            changes = {"dask-scheduler:8786": address, "9000": str(own)}
            command, env = of_compose("dask-worker", stack["changes"] | changes)
            running.enter_context(process(command, listens(own), env=env))
        yield f"tcp://{address}"


@pytest.fixture
def deployed(stack, workspace):
    """A Prefect worker that has deployed the flows from a folder as its container has it; how to run one."""
    folder = workspace / "srv"
    folder.mkdir()
    for name in ("experiments", "prefect.yaml"):
        (folder / name).symlink_to(ROOT / name)
    port = free_port()
    command, env = of_compose("prefect-worker", stack["changes"] | {"8080": str(port)})
    env |= {"AESI_HOME": str(folder), "PREFECT_HOME": str(workspace / "prefect-worker")}

    def run(name, **parameters):
        given = ["prefect", "deployment", "run", name, "--params", json.dumps(parameters), "--watch"]
        return subprocess.run(
            [f"{PROGRAMS}/{given[0]}", *given[1:]],
            env=env,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=400,
            check=False,
        )

    with process(command, answers(f"http://127.0.0.1:{port}/health"), env=env, cwd=folder):
        yield run


def ask(api, what, **condition):
    request = urllib.request.Request(
        f"{api}/{what}/filter",
        data=json.dumps(condition).encode(),
        headers={"Content-Type": "application/json"},
    )
    with urllib.request.urlopen(request, timeout=10) as answer:
        return json.load(answer)


def states(api):
    return [run["state"]["type"] for run in ask(api, "flow_runs")]


def first_table(text):
    """The rows of the first table, without their last columns, which hold seconds."""
    return [line.split("|")[:6] for line in text.split("\n\n")[1].splitlines()]


def assert_read_back(stack, aesi, finished):
    """One run of six candidates is in the server's store, and its tables are those of an undisturbed run."""
    tables = aesi("tables", "smoke", "--uri", stack["mlflow"])
    text, said = tables.communicate(timeout=60)
    assert tables.returncode == 0, said
    (whole,) = (finished / "runs/smoke").glob("*/tables.md")
    assert first_table(text) == first_table(whole.read_text())
    store = Store(stack["mlflow"])
    (parent,) = store.runs(store.find_experiment("smoke"), f"tags.`{KIND}` = 'run'")
    children = store.children(store.find_experiment("smoke"), parent.info.run_id)
    assert sum(label.startswith("candidate:") for label in children) == 6


def test_a_run_and_two_workers_on_one_study_and_one_of_them_killed(
    stack, aesi, arguments, finished, workspace
):
    shared = (f"runner.storage={stack['storage']}", f"tracking.uri={stack['mlflow']}")
    experiment = arguments(*shared, prefect=True)
    work = ["worker", *(word for word in experiment[1:] if word != "--prefect")]
    victim, worker = (aesi(*work, AESI_HOME=str(workspace / name)) for name in ("victim", "worker"))
    time.sleep(8)
    victim.kill()
    run = aesi(*experiment, PREFECT_API_URL=stack["prefect"])
    _, said = run.communicate(timeout=300)
    assert run.returncode == 0, said
    _, worked = worker.communicate(timeout=120)
    assert worker.returncode == 0, worked
    assert states(stack["prefect"]) == ["COMPLETED"]
    assert_read_back(stack, aesi, finished)


def test_a_deployment_is_run_to_its_end_by_a_worker_with_candidates_on_dask(
    stack, dask, deployed, aesi, arguments, finished
):
    done = deployed(
        "experiment/any-experiment",
        path="experiments/smoke.yaml",
        overrides=arguments()[4::2],
        runner="dask",
        address=dask,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert states(stack["prefect"]) == ["COMPLETED"]
    told = "\n".join(line["message"] for line in ask(stack["prefect"], "logs"))
    for line in ("run .* started", "candidates: 6/6 in", "report: done in", "Report: runs/smoke/"):
        assert re.search(line, told), told
    assert_read_back(stack, aesi, finished)
    of_deployments = {each["name"]: each for each in ask(stack["prefect"], "deployments")}
    (weekly,) = of_deployments["measured-nmc-drive"]["schedules"]
    assert (weekly["schedule"]["cron"], weekly["active"]) == ("0 3 * * 1", False)


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
