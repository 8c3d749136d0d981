"""Synthetic views for the tests of reports and figures."""

from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def views():
    path = Path(__file__).with_name("synthetic_views.py")
    spec = spec_from_file_location("synthetic_views", path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
