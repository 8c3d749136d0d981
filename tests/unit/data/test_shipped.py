"""Virtual records that come with the package are met by their content, before the user's cache."""

from pathlib import Path

import numpy as np
import pytest

from aesi.data.laboratory import cache, simulator
from aesi.pipeline.experiment.config import read_experiment
from aesi.pipeline.experiment.sources import cell_path, virtual_experiment

EXPERIMENTS = Path(__file__).resolve().parents[3] / "experiments"


def test_a_shipped_entry_is_found_first_and_an_unknown_one_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "SHIPPED", tmp_path / "shipped")
    monkeypatch.setenv("AESI_CACHE", str(tmp_path / "cache"))
    cache._store(tmp_path / "shipped" / "known.npz", {"voltage_v": np.arange(3.0)})
    found = cache.cached("laboratory", "known", lambda: pytest.fail("it is there"))
    np.testing.assert_array_equal(found["voltage_v"], np.arange(3.0))
    made = cache.cached("laboratory", "new", lambda: {"voltage_v": np.ones(2)})
    np.testing.assert_array_equal(made["voltage_v"], np.ones(2))
    assert (tmp_path / "cache" / "laboratory" / "new.npz").is_file()


@pytest.mark.parametrize("name", ["measured_nmc_drive", "undeclared_effect"])
def test_virtual_records_that_take_long_are_shipped(name, monkeypatch, tmp_path):
    """A change of the laboratory asks for `docs/hooks/ship.py` again, with both; without it a first run takes minutes
    more, and that of the porous electrode with its heat hours."""
    config = read_experiment(EXPERIMENTS / f"{name}.yaml").on_fallback()
    monkeypatch.setenv("AESI_CACHE", str(tmp_path))
    monkeypatch.setattr(cache, "_store", lambda path, arrays: pytest.fail(f"{path.name} is not shipped"))
    monkeypatch.setattr(simulator, "_simulate", lambda *_: pytest.fail("simulated: it is not shipped"))
    virtual_experiment(config, cell_path(config))
