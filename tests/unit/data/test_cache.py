"""The cache: made once, checked, made again when damaged."""

import numpy as np
import pytest

from aesi.data.laboratory.cache import cached, key_of
from aesi.errors import DataError
from aesi.numerics.files.cache_folder import cache_folder


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_what_was_made_is_not_made_again():
    calls = []

    def make():
        calls.append(1)
        return {"x": np.arange(3.0)}

    first, second = cached("kind", "key", make), cached("kind", "key", make)
    np.testing.assert_array_equal(first["x"], second["x"])
    assert len(calls) == 1


@pytest.mark.parametrize("harm", ["cut", "empty", "other", "flipped"])
def test_a_damaged_entry_is_made_again_and_that_is_said(folder, harm):
    cached("kind", "key", lambda: {"x": np.zeros(1000)})
    path = folder / "kind" / "key.npz"
    content = bytearray(path.read_bytes())
    if harm == "flipped":
        content[len(content) // 2] ^= 0xFF
    path.write_bytes({"cut": content[:100], "empty": b"", "other": b"hello", "flipped": content}[harm])
    with pytest.warns(UserWarning, match="computed again"):
        again = cached("kind", "key", lambda: {"x": np.ones(1000)})
    np.testing.assert_array_equal(again["x"], 1.0)
    np.testing.assert_array_equal(cached("kind", "key", dict)["x"], 1.0)


def test_a_failed_making_leaves_nothing_behind(folder):
    def fail():
        raise RuntimeError("no")

    with pytest.raises(RuntimeError):
        cached("kind", "key", fail)
    assert not list(folder.rglob("*"))


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("AESI_CACHE", str(blocked / "below"))
    with pytest.raises(DataError, match="AESI_CACHE"):
        cached("kind", "key", lambda: {"x": np.zeros(1)})


def test_keys_depend_on_every_part():
    base = {"a": np.arange(3.0), "b": "x", "c": b"y", "d": [["e", {"f": 1.0}]]}
    keys = {key_of(base)}
    for name, other in {"a": np.arange(4.0), "b": "z", "c": b"w", "d": [["e", {"f": 2.0}]]}.items():
        keys.add(key_of({**base, name: other}))
    assert len(keys) == 5


def test_the_folder_follows_the_environment(folder):
    assert cache_folder() == folder
