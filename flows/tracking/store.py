"""The tracking store, spoken to through MLflow's client with explicit run ids.

Nothing here decides what is tracked (`flows.tracking.tracker`), how an item gets there (`flows.tracking.delivery`) or
what may be an address (`flows.base.store_address`): this opens a store, makes experiments and runs, finds them, and
knows whether a failure passes.
"""

from __future__ import annotations

import errno
import logging
import sqlite3
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from aesi.errors import AesiError, InputError, first_line
from aesi.logins import login_left_out, without_login
from aesi.numerics.files.whole import check_writable
from flows.base import environment
from flows.base.databases import limits
from flows.base.locks import ProcessLock
from flows.base.store_address import (
    DATABRICKS,
    PLACE,
    SQLITE,
    checked_address,
    database_file,
)
from flows.tracking.relocation import FOLDER, artifact_folder, follow
from flows.tracking.whole_run import read_runs

PARENT = "mlflow.parentRunId"
NUMBER = "aesi.number"
KIND = "aesi.kind"
JOB, EXPERIMENT = "aesi.job", "experiment"
"""Tag of a whole run: experiment, discovery, batch or benchmark. Runs of earlier versions have none."""
OTHER_JOBS = {"cases": "benchmark", "cells": "batch"}
"""Parameter that no experiment has -> the job that has it, by which runs of earlier versions are told apart."""
SERVED = ("http://", "https://")
"""How the address of a tracking server begins."""
REACH_S = 5.0
"""Wait for the answer of a tracking server."""
PASSING = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EAGAIN, errno.EMFILE)
SHORTEST_ID = 4
"""Letters at the beginning of a run's id that may stand for it."""
PAGE = 1000
"""Runs asked for at a time."""


def one_of(runs: Sequence[Any], begin: str) -> Any | None:
    """The run whose id begins so, or that wrote the folder of that name; None where there is none, and where the text
    is too short to stand for an id.  Raises InputError where there are several."""
    begin = Path(begin).name
    found = [run for run in runs if run.info.run_id.startswith(begin)] if len(begin) >= SHORTEST_ID else []
    if len(found) > 1:
        raise InputError(f"{begin!r} is the beginning of {len(found)} run ids; give more of it.")
    return found[0] if found else None


def job_of(run: Any) -> str:
    """What a whole run is: experiment, discovery, batch or benchmark, which may be tracked under one name."""
    tags, params = run.data.tags, run.data.params
    if JOB in tags:
        return str(tags[JOB])
    if "verdict" in tags:
        return "discovery"
    return next((job for name, job in OTHER_JOBS.items() if name in params), EXPERIMENT)


def is_of_experiment(run: Any) -> bool:
    """Whether a whole run is that of an experiment, and no discovery, batch or benchmark of the same name."""
    return job_of(run) == EXPERIMENT


class StoreAway(AesiError):
    """The tracking store does not answer."""


def check_reached(uri: str | None) -> None:
    """Raises as a `Store` would, before the work that leads to one; of a SQLite file only its address is looked at."""
    if not checked_address(uri).startswith(SQLITE):
        Store(uri)


class Store:
    """One tracking store. `notes` : what was found when it was opened, one sentence each.  local : a SQLite file.

    Raises InputError for what is no address, StoreAway where it does not answer, with what to do.
    """

    def __init__(self, uri: str | None = None) -> None:
        # A database that fails reaches the caller as an exception, and need not be told twice, with a traceback.
        logging.getLogger("mlflow.store.db.utils").setLevel(logging.CRITICAL)
        self.uri = checked_address(uri)
        self.local = self.uri.startswith(SQLITE)
        self._places: dict[str, str] = {}
        self.notes: tuple[str, ...] = ()
        if self.uri.startswith(SERVED):
            _reach(self.uri)
        elif not self.local and not self.uri.startswith(DATABRICKS):
            _reach_database(self.uri)
        with _alone(self._path if self.local else None):
            if self.local:
                self.notes = _opened(self._path, self.uri)
            try:
                from mlflow import MlflowClient

                self.client = MlflowClient(tracking_uri=self.uri, registry_uri=self.uri)
                self.client.search_experiments(max_results=1)
            except Exception as error:
                raise _unusable(self.uri, error) from None

    @classmethod
    def to_read(cls, uri: str | None = None) -> Store:
        """The store that is there; none is made where it is not.

        Raises InputError for a SQLite file that is not there, or lies where nothing may be written.
        """
        uri = checked_address(uri)
        if not uri.startswith(SQLITE):
            return cls(uri)
        database = database_file(uri)
        if not database.is_file():
            raise InputError(f"nothing is tracked in {database}: there is no such file; {PLACE}.")
        try:
            check_writable(database)
        except OSError as error:
            raise InputError(
                f"{database} cannot be read where it is: SQLite keeps a log beside it ({error.filename}: "
                f"{error.strerror}); copy it with its artifacts, and name the copy."
            ) from None
        return cls(uri)

    def experiment(self, name: str) -> str:
        """Id of the experiment of that name, made if it is not there.

        Raises StoreAway where it keeps the files of its runs in a folder of another machine.
        """
        with _alone(self._path if self.local else None):
            found = self.client.get_experiment_by_name(name)
            if found is not None:
                if found.lifecycle_stage == "deleted":
                    self.client.restore_experiment(found.experiment_id)
                self._check_artifacts(name, found.artifact_location)
                return str(found.experiment_id)
            place = self._new_artifact_place(name)
            number = str(self.client.create_experiment(name, place))
            if place:  # by which the machine is known that made the experiment
                _local(place).mkdir(parents=True, exist_ok=True)
            return number

    def _check_artifacts(self, name: str, place: str) -> None:
        """Whoever made the folder of another machine here would keep files that the other one never finds."""
        if (
            place.startswith("file:")
            and place != self._new_artifact_place(name)
            and not _local(place).is_dir()
        ):
            raise StoreAway(
                f"the experiment {name} of the tracking store {without_login(self.uri)} keeps its artifacts in "
                f"{_local(place)}, which is not on this machine; mount that folder here at the same path, track on a "
                "server (http://HOST:PORT), which keeps them itself, or give the experiment another name."
            )

    @property
    def database(self) -> Any:
        """MLflow's own store below the client, of a local database."""
        return self.client._tracking_client.store

    def artifact_place(self, experiment_id: str) -> str:
        """The address below which the runs of an experiment keep their files; asked for once."""
        if experiment_id not in self._places:
            self._places[experiment_id] = str(self.client.get_experiment(experiment_id).artifact_location)
        return self._places[experiment_id]

    def _new_artifact_place(self, name: str) -> str | None:
        """The address below which a new experiment keeps its files; None of a server, which has a place for them.

        Of a database MLflow would keep them in mlruns/ of the folder that the command happens to be started in.
        """
        if self.uri.startswith((*SERVED, *DATABRICKS)):
            return None
        home = self._path.parent if self.local else environment.workspace()
        return artifact_folder(home, name).as_uri()

    @property
    def _path(self) -> Path:
        return database_file(self.uri)

    def run(self, run_id: str) -> Any:
        """A run by its id; one that is a whole job also by its beginning. Raises InputError where there is none."""
        from mlflow.exceptions import MlflowException

        try:
            return self.client.get_run(run_id)
        except MlflowException:
            begun = one_of(self.all_jobs(), run_id)
            if begun is None:
                raise InputError(
                    f"no run {run_id!r} is tracked in {without_login(self.uri)}; give the whole id of a candidate, or "
                    f"the beginning of that of a run, at least {SHORTEST_ID} letters."
                ) from None
            return begun

    def holds(self, run_id: str) -> bool:
        """Whether a run of that id is there, and not deleted."""
        from mlflow.exceptions import MlflowException

        try:
            return bool(self.client.get_run(run_id).info.lifecycle_stage == "active")
        except MlflowException as error:
            if error.error_code != "RESOURCE_DOES_NOT_EXIST":
                raise
            return False

    def files_away(self, run: Any) -> str:
        """Where a run keeps its files, and what to do, if that folder is not on this machine; else ''."""
        if not str(run.info.artifact_uri).startswith("file:"):
            return ""
        # That of its experiment: that of a run without files is not made.
        folder = _local(run.info.artifact_uri).parents[1]
        if folder.is_dir():
            return ""
        # Where the files of a moved database are looked for, see `follow`.
        beside = artifact_folder(self._path.parent, folder.name) if self.local else folder
        copied = f", or copy it to {beside}" if folder.parent.name == FOLDER and folder != beside else ""
        return f"its files are in {folder}, which is not here; mount or restore it at that path{copied}"

    def artifact(self, run: Any, name: str) -> Path | None:
        """A file at the top of a run's artifacts, or None where the store lists none of that name; one that is not on
        this machine (`files_away`) is not listed.

        Raises InputError for one that is listed and cannot be read.
        """
        listed = self.client.list_artifacts(run.info.run_id)
        if not any(one.path == name and not one.is_dir for one in listed):
            return None
        return self.read(run, name)

    def read(self, run: Any, name: str) -> Path:
        """An artifact of a run, a file or a folder, as it lies on disk or is fetched from a server.

        Raises InputError where the run carries none of that name.
        """
        from mlflow.exceptions import MlflowException

        if str(run.info.artifact_uri).startswith("file:"):  # where it lies: MLflow would leave a copy behind
            path = _local(run.info.artifact_uri) / name
            if path.exists():
                return path
            reason = self.files_away(run) or f"there is no {path}"
            raise InputError(f"run {run.info.run_id} carries no {name}: {reason}.")
        try:
            return Path(self.client.download_artifacts(run.info.run_id, name))
        except (OSError, ValueError, MlflowException) as error:
            raise InputError(
                f"run {run.info.run_id} carries no readable {name} ({first_line(error)})."
            ) from None

    def find_experiment(self, name: str) -> str | None:
        """Id of the experiment of that name, or None."""
        found = self.client.get_experiment_by_name(name)
        return None if found is None else str(found.experiment_id)

    def create_run(self, experiment_id: str, name: str, tags: dict[str, str]) -> str:
        """A new running run."""
        return str(self.client.create_run(experiment_id, run_name=name, tags=tags).info.run_id)

    def runs(self, experiment_id: str, condition: str) -> Iterator[Any]:
        """All runs of an experiment that meet an MLflow filter, newest first."""
        token = None
        while True:
            page = self.client.search_runs([experiment_id], condition, max_results=PAGE, page_token=token)
            yield from page
            token = page.token
            if not token:
                return

    def jobs(self, experiment_id: str) -> list[Any]:
        """The runs of an experiment that are whole jobs and nested in none, newest first."""
        if self.local:
            return read_runs(self.database, experiment_id, (KIND, "run"))
        return list(self.runs(experiment_id, f"tags.`{KIND}` = 'run'"))

    def all_jobs(self) -> list[Any]:
        """Those of every experiment."""
        experiments = [each.experiment_id for each in self.client.search_experiments()]
        return [run for number in experiments for run in self.jobs(number)]

    def children(self, experiment_id: str, parent: str) -> dict[str, Any]:
        """Nested runs of a parent by the label they were given (`candidate:7`, `model:AESI I`)."""
        condition = f"tags.`{PARENT}` = '{parent}'"
        return {
            run.data.tags[NUMBER]: run
            for run in self.runs(experiment_id, condition)
            if NUMBER in run.data.tags
        }

    def child(self, experiment_id: str, parent: str, label: str) -> Any:
        """The nested run of a label, or None."""
        if "'" in label:  # which would end the text in the condition
            return self.children(experiment_id, parent).get(label)
        condition = f"tags.`{PARENT}` = '{parent}' and tags.`{NUMBER}` = '{label}'"
        return next(self.runs(experiment_id, condition), None)

    def away(self, error: Exception) -> bool:
        """True for a failure that passes: no connection, a locked database, a full disk, a server in trouble."""
        return _passes(error) or not self._answers()

    @contextmanager
    def in_use(self) -> Iterator[None]:
        """Within, a failure of the opened store raises StoreAway, as one at its opening does, with what to do."""
        from mlflow.exceptions import MlflowException

        try:
            yield
        except MlflowException as error:
            raise _unusable(self.uri, error) from error

    def _answers(self) -> bool:
        try:
            self.client.search_experiments(max_results=1)
        except Exception:
            return False
        return True


def _local(uri: str) -> Path:
    """The path of a `file:` address."""
    from mlflow.utils.file_utils import local_file_uri_to_path

    return Path(local_file_uri_to_path(uri))


def now_ms() -> int:
    """Milliseconds since the epoch, as MLflow counts."""
    return int(time.time() * 1000)


@contextmanager
def _alone(database: Path | None) -> Iterator[None]:
    """One process at a time makes tables and experiments in a SQLite file, `database`; None for another store."""
    if database is None:
        yield
        return
    lock = ProcessLock(
        database.with_name(f"{database.name}.lock"),
        str(database.parent),
        "setting up the tracking store at the same time",
    )
    lock.acquire(wait=True)
    try:
        yield
    finally:
        lock.release()


def _opened(database: Path, uri: str) -> tuple[str, ...]:
    """Ready a database for several readers, and let the artifacts that were moved with it be found."""
    try:
        _write_ahead(database)
        _make_tables(database)
        return follow(database)
    except sqlite3.Error as error:
        raise _unusable(uri, error) from None


def _write_ahead(database: Path) -> None:
    """With a write-ahead log readers (the UI, another run) never block the writer; the mode stays."""
    database.parent.mkdir(parents=True, exist_ok=True)
    connection = sqlite3.connect(database, timeout=30)
    try:
        connection.execute("PRAGMA journal_mode=WAL")
    finally:
        connection.close()


def _make_tables(database: Path) -> None:
    """Give a database without tables all of MLflow's at once. Made one by one in the file, as MLflow does it for some
    seconds, a process that is killed meanwhile leaves some, and neither it nor any other can use the file again."""
    with closing(sqlite3.connect(database, timeout=30)) as file:
        if file.execute("SELECT 1 FROM sqlite_master").fetchone():
            return
        from mlflow.store.db.utils import _initialize_tables, create_sqlalchemy_engine

        engine = create_sqlalchemy_engine(f"{SQLITE}:memory:")
        _initialize_tables(engine)
        with closing(engine.raw_connection()) as made:
            made.driver_connection.backup(file)  # one transaction
        engine.dispose()


def _reach(uri: str) -> None:
    """Raise StoreAway unless a server answers at the address within a few seconds."""
    try:
        place = without_login(uri).rstrip("/")  # urllib would take the login for a part of the host's name
        urllib.request.urlopen(f"{place}/health", timeout=REACH_S).close()
    except urllib.error.HTTPError:
        return  # it answers, if not kindly; MLflow's own client says more
    except (OSError, ValueError) as error:
        raise _unusable(uri, error) from None


def _reach_database(uri: str) -> None:
    """Raise StoreAway unless a database answers: MLflow tries it again for minutes.

    Raises InputError where its driver is not installed.
    """
    import sqlalchemy as sa

    try:
        engine = sa.create_engine(uri, **limits(uri))
    except ImportError as error:
        package = "psycopg2-binary" if "psycopg2" in str(error) else "the driver that its address names"
        reason = login_left_out(str(error), uri)
        raise InputError(f"the tracking store {without_login(uri)} needs {package}: {reason}.") from None
    except (sa.exc.ArgumentError, ValueError) as error:
        raise _unusable(uri, error) from None
    try:
        engine.connect().close()
    except sa.exc.SQLAlchemyError as error:
        raise _unusable(uri, error.__cause__ or error) from None
    finally:
        engine.dispose()


def _unusable(uri: str, error: BaseException) -> StoreAway:
    reason = login_left_out(first_line(error), uri)
    if uri.startswith("http"):
        advice = (
            "start the server, or leave out tracking.uri and MLFLOW_TRACKING_URI to track in the workspace's own "
            "SQLite file"
        )
    elif not uri.startswith(SQLITE):
        advice = "check the address, and that the database runs"
    elif "is full" in reason:
        advice = "free some space, then start again"
    else:
        advice = (
            "check the address (sqlite:///FILE or http://HOST:PORT), or move the file away to start a new one"
        )
    return StoreAway(f"the tracking store {without_login(uri)} cannot be used ({reason}); {advice}.")


def _passes(error: BaseException | None) -> bool:
    """Whether an error or one of its causes speaks of a connection, a lock or a full disk."""
    import requests

    seen: set[int] = set()
    while error is not None and id(error) not in seen:
        seen.add(id(error))
        if isinstance(error, ConnectionError | TimeoutError | requests.exceptions.RequestException):
            return True
        if isinstance(error, OSError) and error.errno in PASSING:
            return True
        if "database is locked" in str(error) or "disk is full" in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False
