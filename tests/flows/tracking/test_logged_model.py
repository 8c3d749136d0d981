"""A model is logged through MLflow's global address, which is left as it was."""

import os

import pytest

from flows.tracking.serving import logged_model
from flows.tracking.store import Store


@pytest.mark.parametrize("before", [None, "sqlite:///elsewhere.db"])
def test_logging_a_model_left_its_address_in_the_environment(tmp_path, monkeypatch, before):
    if before is not None:
        monkeypatch.setenv(logged_model.ADDRESS, before)
    seen = []

    def logged(client, run_id):
        seen.append(os.environ[logged_model.ADDRESS])
        return "m-1"

    monkeypatch.setattr(logged_model, "_logged_before", logged)
    uri = f"sqlite:///{tmp_path}/mlflow.db"
    logged_model.log_hybrid(uri, "run", tmp_path, None)
    assert seen == [uri]
    assert os.environ.get(logged_model.ADDRESS) == before


def test_mlflow_does_not_ask_for_an_example_of_the_input(finished, tracked, recwarn):
    client = Store().client
    run = client.create_run(client.create_experiment("again"))
    (folder,) = (finished / "runs" / "smoke").glob("*/model")
    logged_model.log_hybrid(Store().uri, run.info.run_id, folder, None)
    assert client.search_logged_models([run.info.experiment_id])
    assert not [one for one in recwarn if "input example" in str(one.message)]
