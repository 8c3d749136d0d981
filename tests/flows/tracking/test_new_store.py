"""A tracking store that is made anew."""

import pytest
from alembic.runtime.migration import HeadMaintainer

from flows.tracking.store import Store


def test_a_store_that_was_interrupted_while_it_was_made_could_never_be_used(tmp_path, monkeypatch):
    uri, move_on, steps = f"sqlite:///{tmp_path}/mlflow.db", HeadMaintainer.update_to_step, []

    def interrupted(self, step):
        steps.append(step)
        if len(steps) == 40:  # of some fifty that MLflow changes its tables in
            raise KeyboardInterrupt
        move_on(self, step)

    with monkeypatch.context() as patch:
        patch.setattr(HeadMaintainer, "update_to_step", interrupted)
        with pytest.raises(KeyboardInterrupt):
            Store(uri)
    assert Store(uri).experiment("again")
