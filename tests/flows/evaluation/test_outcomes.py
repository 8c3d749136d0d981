"""The shared store of outcomes: atomic, claimed by one process at a time, and by nobody who is dead."""

import contextlib
import os
import re
import socket
import subprocess
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from sqlalchemy.dialects import mysql, postgresql, sqlite
from sqlalchemy.exc import OperationalError
from sqlalchemy.schema import CreateTable

from aesi.errors import InputError
from flows.base.databases import limits
from flows.evaluation.outcome_database import DatabaseOutcomes, engine_of
from flows.evaluation.outcome_files import FileOutcomes
from flows.evaluation.outcome_store import open_outcomes

KEY = "ab" * 16


@pytest.fixture(params=["file", "database"])
def opened(request, tmp_path):
    """Opens the same store any number of times."""
    stores = []

    def open_one():
        url = f"sqlite:///{tmp_path}/outcomes.db" if request.param == "database" else None
        stores.append(open_outcomes(tmp_path / "outcomes", url))
        return stores[-1]

    yield open_one
    for store in stores:
        store.close()


def test_what_is_put_is_found_by_everyone(opened):
    one, other = opened(), opened()
    assert other.get(KEY) is None
    one.put(KEY, b"x" * 100_000)
    assert other.get(KEY) == b"x" * 100_000
    one.discard(KEY)
    assert other.get(KEY) is None


def test_a_claim_has_one_owner_until_it_is_released(opened):
    one, other = opened(), opened()
    assert one.claim(KEY)
    assert one.claim(KEY)
    assert not other.claim(KEY)
    one.release(KEY)
    assert other.claim(KEY)


def test_a_result_can_be_put_over_a_claim(opened):
    one, other = opened(), opened()
    one.claim(KEY)
    one.put(KEY, b"done")
    one.release(KEY)
    assert other.get(KEY) == b"done"


def test_a_run_that_uses_no_cache_waited_for_ever_for_a_result_in_a_database(opened):
    one, other = opened(), opened()
    one.claim(KEY)
    one.put(KEY, b"old")
    one.release(KEY)
    assert other.claim(KEY)  # to make it anew
    assert not one.claim(KEY)
    other.put(KEY, b"new")
    other.release(KEY)
    assert one.claim(KEY)
    one.release(KEY)
    assert other.get(KEY) == b"new"
    assert other.claim(KEY)


def test_many_threads_agree_on_one_owner(opened):
    stores = [opened() for _ in range(8)]
    won = []
    barrier = threading.Barrier(len(stores))

    def try_it(store):
        barrier.wait()
        if store.claim(KEY):
            won.append(store)

    threads = [threading.Thread(target=try_it, args=(store,)) for store in stores]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(won) == 1


HOLD = """
import sys, time
from pathlib import Path
from flows.evaluation.outcome_files import FileOutcomes
store = FileOutcomes(Path(sys.argv[1]))
print(store.claim(sys.argv[2]), flush=True)
time.sleep(60)
"""


def test_the_claim_of_a_killed_process_is_free_at_once(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path), KEY], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "True\n"
    store = FileOutcomes(tmp_path)
    assert not store.claim(KEY)
    process.kill()
    process.communicate()
    assert store.claim(KEY)
    store.close()


@pytest.fixture
def clock(monkeypatch):
    """The time of the stores in a list, s. No heart beats by itself while a test lasts."""
    now_s = [0.0]
    monkeypatch.setattr(DatabaseOutcomes, "BEAT_S", 3600.0)
    monkeypatch.setattr(DatabaseOutcomes, "_now", lambda *_: now_s[0])
    return now_s


def test_the_claim_of_a_silent_owner_is_taken_over(tmp_path, clock):
    url = f"sqlite:///{tmp_path}/outcomes.db"
    dead, alive = DatabaseOutcomes(url), DatabaseOutcomes(url)
    assert dead.claim(KEY)
    clock[0] = DatabaseOutcomes.STALE_S
    assert not alive.claim(KEY)
    clock[0] += 1.0
    assert alive.claim(KEY)


def test_a_beating_heart_keeps_the_claim(tmp_path, clock):
    url = f"sqlite:///{tmp_path}/outcomes.db"
    owner, other = DatabaseOutcomes(url), DatabaseOutcomes(url)
    assert owner.claim(KEY)
    clock[0] = DatabaseOutcomes.STALE_S
    owner.beat()
    clock[0] += 1.0
    assert not other.claim(KEY)
    owner.close()
    other.close()


def test_a_heart_beats_by_itself(tmp_path, monkeypatch):
    beaten = threading.Event()
    monkeypatch.setattr(DatabaseOutcomes, "BEAT_S", 0.01)
    monkeypatch.setattr(DatabaseOutcomes, "beat", lambda self: beaten.set())
    store = DatabaseOutcomes(f"sqlite:///{tmp_path}/outcomes.db")
    assert beaten.wait(30.0)
    store.close()


def test_a_claim_that_could_not_be_given_back_was_held_until_its_owner_ended(tmp_path, monkeypatch, clock):
    url = f"sqlite:///{tmp_path}/outcomes.db"
    owner, other = DatabaseOutcomes(url), DatabaseOutcomes(url)
    assert owner.claim(KEY)
    assert owner.claim("cd" * 16)  # so that its heart beats on
    with monkeypatch.context() as away:
        away.setattr(owner, "_engine", engine_of(f"sqlite:///{tmp_path}/nowhere/outcomes.db"))
        with pytest.raises(OSError, match="unable to open"):
            owner.release(KEY)
    clock[0] = DatabaseOutcomes.STALE_S
    owner.beat()
    clock[0] += 1.0
    assert other.claim(KEY)
    assert not other.claim("cd" * 16)
    owner.close()
    other.close()


@pytest.mark.parametrize("address", ["postgresql://127.0.0.1:9/none", "postgres://127.0.0.1:9/none"])
def test_the_study_in_postgresql_asked_for_another_driver_than_its_candidates(address):
    from flows.search.published_study import study_storage

    with pytest.raises(OperationalError, match="Connection refused"):
        engine_of(address).connect()
    with pytest.raises(OperationalError, match="Connection refused"):
        study_storage(address)


@pytest.mark.parametrize(
    "address", ["me:secret@127.0.0.1:9/none", "127.0.0.1:9/none?user=me&password=secret"]
)
def test_a_database_that_is_not_there_is_one_sentence(address):
    with pytest.raises(InputError, match=r"runner\.storage .* cannot be used") as caught:
        DatabaseOutcomes(f"postgresql://{address}")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("address", ["postgresql://me@127.0.0.1:PORT/none", "sqlite://host/none.db"])
def test_a_wrong_address_of_a_database_ended_in_an_unexpected_error_or_in_several_lines(address):
    with pytest.raises(InputError, match=r"runner\.storage is no database that can be used: .*\.$") as caught:
        DatabaseOutcomes(address)
    assert "\n" not in str(caught.value)


@pytest.fixture
def silent():
    """Address of what accepts connections and never says a word."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        yield f"postgresql://me:secret@127.0.0.1:{listening.getsockname()[1]}/none"


def test_a_database_that_accepts_and_never_answers_kept_a_command_for_ever(silent, monkeypatch):
    from flows.search.published_study import study_storage

    assert int(os.environ["PGCONNECT_TIMEOUT"]) <= 10
    monkeypatch.setenv("PGCONNECT_TIMEOUT", "2")
    started = time.monotonic()
    with pytest.raises(InputError, match=r"runner\.storage .* cannot be used: .*timeout expired"):
        DatabaseOutcomes(silent)
    assert time.monotonic() - started < 4.0  # one wait, not one for each try
    with pytest.raises(OperationalError, match="timeout expired"):
        study_storage(silent)


def test_a_statement_in_postgresql_waited_for_ever_for_a_lock():
    class Connection:
        def __init__(self):
            self.executed = []

        def cursor(self):
            return contextlib.nullcontext(SimpleNamespace(execute=self.executed.append))

        def commit(self):
            self.executed.append("COMMIT")

    options = limits("postgresql://127.0.0.1/none?tcp_user_timeout=5")
    ((limit, when),) = options["pool_events"]
    connection = Connection()
    limit(connection, None)
    assert (when, connection.executed) == ("connect", ["SET statement_timeout = '30s'", "COMMIT"])
    assert "tcp_user_timeout" not in options["connect_args"]  # the address says it
    assert "pool_events" not in limits("postgres://h/none?options=-c%20statement_timeout%3D5s")
    assert limits("postgresql+pg8000://127.0.0.1/none") == {}


@pytest.mark.parametrize(
    ("dialect", "beat", "data"),
    [
        (mysql, "DOUBLE", "LONGBLOB"),
        (postgresql, "DOUBLE PRECISION", "BYTEA"),
        (sqlite, "DOUBLE", "BLOB"),
    ],
)
def test_mysql_held_a_claim_to_two_minutes_and_no_outcome_above_64_kb(tmp_path, dialect, beat, data):
    store = DatabaseOutcomes(f"sqlite:///{tmp_path}/outcomes.db")
    store.close()
    made = str(CreateTable(store._table).compile(dialect=dialect.dialect()))
    assert re.search(rf"beat_s {beat},\s+data {data},", made), made
