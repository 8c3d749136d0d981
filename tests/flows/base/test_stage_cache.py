"""Results of stages by content: found again, computed anew where damaged, and never in the way."""

from types import SimpleNamespace

import numpy as np
import pytest

from aesi.records import Failed
from flows.base.stage_cache import Cache


@pytest.fixture
def counted():
    """A computation that counts its calls."""
    calls = []

    def compute(value=None):
        calls.append(True)
        return np.arange(3.0) if value is None else value

    return SimpleNamespace(compute=compute, calls=calls)


def stored(workspace):
    return list((workspace / ".aesi/cache/stages").glob("*.bin"))


def test_a_result_is_found_again_under_the_same_parts_alone(workspace, counted, said):
    for parts in (("a", "b"), ("a", "b"), ("a", "c")):
        assert np.array_equal(Cache(said.append).get("models", parts, counted.compute), np.arange(3.0))
    assert len(counted.calls) == 2
    assert said == ["models: from the cache"]


@pytest.mark.parametrize("harm", [lambda data: data[:-9], lambda data: b"", lambda data: b"\x80\x05" + data])
def test_a_damaged_entry_is_computed_again_and_said(workspace, counted, said, harm):
    Cache(said.append).get("models", ("a",), counted.compute)
    (path,) = stored(workspace)
    path.write_bytes(harm(path.read_bytes()))
    assert np.array_equal(Cache(said.append).get("models", ("a",), counted.compute), np.arange(3.0))
    assert len(counted.calls) == 2
    assert "'models' is damaged" in said[0]
    assert "computed again" in said[0]
    Cache(said.append).get("models", ("a",), counted.compute)
    assert len(counted.calls) == 2


def test_without_reuse_it_is_computed_and_kept(workspace, counted, said):
    Cache(said.append).get("models", ("a",), counted.compute)
    Cache(said.append, reuse=False).get("models", ("a",), counted.compute)
    assert len(counted.calls) == 2
    assert len(stored(workspace)) == 1


def test_what_is_no_data_is_not_kept_and_said(workspace, said):
    fitted = object()
    assert Cache(said.append).get("models", ("a",), lambda: fitted) is fitted
    assert not stored(workspace)
    (sentence,) = said
    assert sentence.startswith("models: done (not stored: where this run is stopped")


def test_a_full_disk_is_said_and_costs_nothing_else(workspace, said, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("flows.base.stage_cache.write_whole", full)
    assert Cache(said.append).get("models", ("a",), lambda: Failed("no")) == Failed("no")
    assert "could not be stored (No space left on device)" in said[0]
