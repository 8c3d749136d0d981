"""The queue between a run and its store: in order, nothing lost, nothing doubled."""

import json
import threading
import time
from pathlib import Path

import pytest

from flows.tracking import outbox as module
from flows.tracking.outbox import Outbox


class Away(Exception):
    """The store does not answer."""


class Store:
    """Takes items, unless it is away."""

    def __init__(self):
        self.items, self.again, self.here = [], [], threading.Event()
        self.here.set()

    def deliver(self, item, again):
        if not self.here.is_set():
            raise Away("connection refused\nwith details")
        if item.get("bad"):
            raise ValueError("cannot take this")
        self.items.append(item["n"])
        self.again.append(again)


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(module, "RETRY_S", (0.05,))


@pytest.fixture
def store():
    return Store()


def opened(tmp_path, store, said):
    return Outbox(tmp_path / "box", store.deliver, lambda error: isinstance(error, Away), said.append)


def test_items_arrive_in_order(tmp_path, store, said):
    box = opened(tmp_path, store, said)
    for n in range(20):
        box.put({"n": n})
    assert box.flush(5) == 0
    assert store.items == list(range(20))
    assert not any(store.again)
    assert not said


def test_the_folder_of_each_run_was_kept_for_good(tmp_path, store, said):
    store.here.clear()
    waiting = opened(tmp_path, store, said)
    waiting.put({"n": 1})
    waiting.close()
    assert (tmp_path / "box" / "00000001.json").is_file()
    store.here.set()
    later = opened(tmp_path, store, said)
    assert later.flush(5) == 0
    later.close()
    assert not (tmp_path / "box").exists()


def test_a_store_that_is_away_in_mid_run_loses_nothing(tmp_path, store, said):
    box = opened(tmp_path, store, said)
    box.put({"n": 0})
    assert box.flush(5) == 0
    store.here.clear()
    for n in range(1, 6):
        box.put({"n": n})
    assert box.flush(0.3) == 5
    assert len(said) == 1
    assert "does not answer (connection refused)" in said[0]
    store.here.set()
    assert box.flush(5) == 0
    assert store.items == list(range(6))
    assert "answers again" in said[1]


def test_what_is_left_is_delivered_by_the_next(tmp_path, store, said):
    store.here.clear()
    box = opened(tmp_path, store, said)
    box.put({"n": 1})
    box.put({"n": 2})
    box.close()
    store.here.set()
    later = opened(tmp_path, store, said)
    later.put({"n": 3})
    assert later.flush(5) == 0
    assert store.items == [1, 2, 3]
    assert store.again == [True, True, False]


def test_an_item_that_is_refused_is_put_aside_and_said(tmp_path, store, said):
    box = opened(tmp_path, store, said)
    box.put({"n": 1, "bad": True})
    box.put({"n": 2})
    assert box.flush(5) == 0
    assert store.items == [2]
    assert "refused an item (cannot take this)" in said[0]
    (aside,) = (tmp_path / "box" / "refused").iterdir()
    assert json.loads(aside.read_text())["n"] == 1


def test_closing_does_not_wait_for_a_store_that_is_away(tmp_path, store, said):
    store.here.clear()
    box = opened(tmp_path, store, said)
    box.put({"n": 1})
    started = time.monotonic()
    box.close()
    assert time.monotonic() - started < 2


def test_an_item_that_takes_long_is_waited_for(tmp_path, said):
    delivered = []

    def slowly(item, again):
        time.sleep(0.6)
        delivered.append(item["n"])

    box = Outbox(tmp_path / "box", slowly, lambda error: False, said.append)
    box.put({"n": 1})
    box.put({"n": 2})
    assert box.flush(0.2) == 0
    assert delivered == [1, 2]
    assert not said


def test_an_item_that_cannot_be_crossed_off_kept_an_ending_run_waiting_for_ever(
    tmp_path, store, said, monkeypatch
):
    refused, remove = threading.Event(), Path.unlink
    refused.set()

    def unlink(path, missing_ok=False):
        if refused.is_set() and path.suffix == ".json":
            raise PermissionError(13, "Permission denied", str(path))
        remove(path, missing_ok=missing_ok)

    monkeypatch.setattr(Path, "unlink", unlink)
    box = opened(tmp_path, store, said)
    box.put({"n": 0})
    ended = threading.Thread(target=box.flush, args=(0.3,), daemon=True)
    ended.start()
    ended.join(5)
    assert not ended.is_alive()
    assert len(said) == 1
    assert "cannot be removed" in said[0]
    refused.clear()
    assert box.flush(5) == 0
    assert store.again[-1]  # a store is told that it may have been sent before
    box.close()


def test_what_was_left_was_read_while_it_was_delivered_and_gone(tmp_path, store, said):
    store.here.clear()
    box = opened(tmp_path, store, said)
    for n in range(3):
        box.put({"n": n})
    box.close()
    store.here.set()
    again = opened(tmp_path, store, said)
    assert again.flush(5) == 0
    assert [item["n"] for item in again.left] == [0, 1, 2]


def test_a_second_refused_item_took_the_place_of_the_first(tmp_path, store, said):
    for n in range(2):
        box = opened(tmp_path, store, said)
        box.put({"n": n, "bad": True})
        assert box.flush(5) == 0
        box.close()
    kept = sorted((tmp_path / "box" / "refused").iterdir())
    assert [json.loads(path.read_text())["n"] for path in kept] == [0, 1]


def test_a_refused_item_that_could_not_be_put_aside_was_called_delivered(tmp_path, store, said):
    (tmp_path / "box").mkdir()
    (tmp_path / "box" / "refused").write_text("no folder")
    box = opened(tmp_path, store, said)
    box.put({"n": 0, "bad": True})
    deadline = time.monotonic() + 10
    while not said and time.monotonic() < deadline:
        time.sleep(0.02)
    box.close()
    (line,) = said
    assert "refused an item" in line
    assert "delivered" not in line
    assert box.pending == 1


def test_every_item_had_the_whole_folder_listed(tmp_path, store, said, monkeypatch):
    listed, glob = [], Path.glob

    def counted(path, pattern):
        listed.append(path)
        return glob(path, pattern)

    box = opened(tmp_path, store, said)
    monkeypatch.setattr(Path, "glob", counted)
    for n in range(20):
        box.put({"n": n})
    assert box.flush(5) == 0
    assert store.items == list(range(20))
    assert not listed
