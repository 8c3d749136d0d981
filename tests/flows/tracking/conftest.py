"""The store that tracked items are delivered to."""

import pytest

from flows.tracking.store import Store


@pytest.fixture
def store(tracked):
    return Store()
