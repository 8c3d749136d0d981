"""Synthetic views for the tests of reports and figures, and the record of the small experiment."""

import pytest
import synthetic_views
from small_experiment import write_record


@pytest.fixture(scope="session")
def views():
    return synthetic_views


@pytest.fixture(scope="session")
def record(tmp_path_factory):
    """The file of `small_experiment.write_record`; `fitted` keeps what is fitted to it."""
    return write_record(tmp_path_factory.mktemp("record"))
