"""Virtual records that come with the package are met by their content, before the user's cache."""

import numpy as np
import pytest

from aesi.data.laboratory import cache


def test_a_shipped_entry_is_found_first_and_an_unknown_one_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "cache"))
    cache._store(tmp_path / "shipped" / "known.npz", {"voltage_v": np.arange(3.0)})
    found = cache.cached("laboratory", "known", lambda: pytest.fail("it is there"))
    np.testing.assert_array_equal(found["voltage_v"], np.arange(3.0))
    made = cache.cached("laboratory", "new", lambda: {"voltage_v": np.ones(2)})
    np.testing.assert_array_equal(made["voltage_v"], np.ones(2))
    assert (tmp_path / "cache" / "laboratory" / "new.npz").is_file()
