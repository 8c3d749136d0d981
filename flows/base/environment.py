"""What has to be set before numpy, Prefect and MLflow load: threads, telemetry, where state lives.

Anything the user has set already wins.
"""

from __future__ import annotations

import os
from pathlib import Path

from aesi.numerics.files.whole import check_writable

THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)

QUIET = {
    "DO_NOT_TRACK": "1",
    "PYBAMM_DISABLE_TELEMETRY": "true",
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "PREFECT_CLI_PROMPT": "false",
    # The temporary server takes up to 24 s to start on a slow disk; Prefect gives up after 20 s by default. How long a
    # run waits for it is in flows/jobs/temporary_server.py.
    "PREFECT_SERVER_EPHEMERAL_STARTUP_TIMEOUT_SECONDS": "120",
    "PREFECT_CLIENT_MAX_RETRIES": "3",  # pauses of 2, 4 and 8 s; by default a minute goes by before a loss is seen
    # Errors are told once, in one sentence, by the command line; Prefect's own log keeps them in full.
    "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL": "CRITICAL",
    "PREFECT_LOGGING_INTERNAL_LEVEL": "CRITICAL",  # a server that is lost is said once, not event by event
    "PREFECT_SERVER_LOGGING_LEVEL": "CRITICAL",  # what goes wrong is said by the run, in one sentence
    "PREFECT_LOGGING_TO_API_WHEN_MISSING_FLOW": "ignore",
    "PREFECT_LOGGING_EXTRA_LOGGERS": "aesi",  # what a run says shows in Prefect's log of it
    "MLFLOW_HTTP_REQUEST_MAX_RETRIES": "2",
    "MLFLOW_HTTP_REQUEST_TIMEOUT": "20",
    "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR": "false",
    "MLFLOW_LOGGING_LEVEL": "WARNING",
    # The client tells where each run is on stdout, amidst tables that are written there.
    "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    "GIT_PYTHON_REFRESH": "quiet",
    # s; PostgreSQL's own client waits for ever for one that accepts and says nothing. One that sleeps until it is asked
    # wakes within a few seconds.
    "PGCONNECT_TIMEOUT": "10",
}


def workspace() -> Path:
    """The folder that holds runs/, the tracking store and .aesi/: $AESI_HOME, else the current folder."""
    return Path(os.environ.get("AESI_HOME") or Path.cwd()).expanduser().resolve()


def state() -> Path:
    """The workspace's .aesi/: caches, Prefect's home, the journal of the searches, records of unfinished runs, and what
    the tracking store has not taken yet. Who deletes it loses the last three."""
    return workspace() / ".aesi"


def run_folder(experiment: str, run_id: str) -> Path:
    """Where a run of an experiment keeps its results."""
    return workspace() / "runs" / experiment / run_id


def prepare_process() -> None:
    """Set what is not set: one thread a process (processes are the unit of parallel work), no telemetry."""
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    for name, value in QUIET.items():
        os.environ.setdefault(name, value)
    os.environ.setdefault("PREFECT_HOME", str(state() / "prefect"))


def make_prefect_home() -> None:
    """Prefect makes its home folder but not the folders above it, and cannot start its server without.

    Raises OSError where it cannot be made, or where a server that is started here could not keep its files in it.
    """
    home = Path(os.environ["PREFECT_HOME"]).expanduser()
    home.mkdir(parents=True, exist_ok=True)
    if not os.environ.get("PREFECT_API_URL"):
        check_writable(home / "any")
