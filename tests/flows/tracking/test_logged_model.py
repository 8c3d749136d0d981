"""A model is logged through MLflow's global address, which is left as it was."""

import os
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from aesi.errors import DataError
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


@pytest.fixture(scope="module")
def served(finished):
    """The model of the small experiment as MLflow serves it, and a table of ten minutes of rest and load."""
    from flows.tracking.serving.served_model import HybridPyfunc

    (folder,) = (finished / "runs" / "smoke").glob("*/model")
    model = HybridPyfunc()
    model.load_context(SimpleNamespace(artifacts={"model": str(folder)}))
    time_s = np.arange(0.0, 600.0, 2.0)
    table = pd.DataFrame({"time_s": time_s, "current_a": np.where(time_s < 60.0, 0.0, 20.0)})
    return model, table


def test_a_voltage_with_a_gap_was_served_as_a_free_run(served):
    model, table = served
    free = model.predict(None, table)
    measured = table.assign(voltage_v=free["voltage_v"] + 0.01)
    assert not np.allclose(model.predict(None, measured)["voltage_v"], free["voltage_v"], atol=1e-3)
    measured.loc[200, "voltage_v"] = np.nan
    with pytest.raises(DataError, match=r"voltage_v has no value at 400 s"):
        model.predict(None, measured)
    assert model.predict(None, measured.assign(voltage_v=np.nan)).equals(free)


def test_a_measured_temperature_was_served_as_none(served):
    model, table = served
    cold = table.assign(temperature_degc=0.0)
    assert "temperature_degc" in logged_model._signature().inputs.input_names()
    assert (model.predict(None, cold)["voltage_v"] < model.predict(None, table)["voltage_v"] - 1e-3)[
        60:
    ].all()
