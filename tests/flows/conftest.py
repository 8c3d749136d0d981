"""A workspace of its own for every test, so that no test sees another's runs."""

import pytest

from flows import environment


@pytest.fixture(autouse=True)
def workspace(tmp_path, monkeypatch):
    """An empty workspace, in the environment and as the current folder."""
    monkeypatch.setenv("AESI_HOME", str(tmp_path))
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.chdir(tmp_path)
    environment.prepare()
    return tmp_path


@pytest.fixture
def said():
    """What was said; pass `said.append` where a function to say things is wanted."""
    return []
