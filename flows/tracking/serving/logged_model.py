"""Log a saved hybrid model to MLflow: pyfunc from code, with signature, registered."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import aesi

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.models import ModelSignature

CODE = Path(__file__).with_name("served_model.py")
ADDRESS = "MLFLOW_TRACKING_URI"
TOLD = {
    "soc0": "state of charge at the first row; left out, it is read from voltage_v where that is given, else it is the "
    "one that the training records began at",
    "voltage_v": "V, measured; given: one step ahead, left out: free run",
    "current_a": "A, positive on discharge",
    "temperature_degc": "of the cell, where it was measured",
}
"""What a user of a logged model is told of its inputs, in its metadata."""
NEEDS = ("bpx", "numba", "numpy", "pandas", "pyarrow", "pydantic", "quantile-forest", "scikit-learn", "scipy")


def log_hybrid(uri: str, run_id: str, folder: Path, registered_as: str | None) -> None:
    """Log the model folder under the run, and register it where a name is given; what is there already stays."""
    import mlflow

    if not folder.is_dir():
        raise ValueError(f"the model folder {folder} is gone")
    client = mlflow.MlflowClient(uri, uri)
    with _addressed(uri):
        model_id = _logged_before(client, run_id) or _log(run_id, folder)
        if registered_as and not client.search_model_versions(f"run_id = '{run_id}'"):
            _register(client, registered_as, run_id, model_id)


@contextmanager
def _addressed(uri: str) -> Iterator[None]:
    """MLflow's global address, through which registering resolves a model; setting it sets the environment, too, where
    it would be taken for the address that the next run of this process is to be tracked at."""
    import mlflow

    before, environment = mlflow.get_tracking_uri(), os.environ.get(ADDRESS)
    mlflow.set_tracking_uri(uri)
    mlflow.set_registry_uri(uri)
    try:
        yield
    finally:
        mlflow.set_tracking_uri(before)
        if environment is None:
            os.environ.pop(ADDRESS, None)
        else:
            os.environ[ADDRESS] = environment


def _logged_before(client: MlflowClient, run_id: str) -> str | None:
    """Id of the run's whole logged model; one that was killed while it was written is deleted."""
    from mlflow.entities import LoggedModelStatus

    experiment_id = client.get_run(run_id).info.experiment_id
    for model in client.search_logged_models([experiment_id], f"source_run_id = '{run_id}'"):
        if model.status == LoggedModelStatus.READY:
            return str(model.model_id)
        client.delete_logged_model(model.model_id)
    return None


def _log(run_id: str, folder: Path) -> str:
    """Id of the model as it is logged now.

    Without an example of its input, which MLflow would run the model on: the porous electrode was compiled for that,
    11 of 14 s of processor at the end of a run. MLflow warns that a signature is safer with
    one; ours is declared.
    """
    import mlflow

    warnings.filterwarnings("ignore", ".*An input example was not provided")

    with mlflow.start_run(run_id=run_id, log_system_metrics=False):
        logged = mlflow.pyfunc.log_model(
            name="model",
            python_model=str(CODE),
            artifacts={"model": str(folder)},
            code_paths=[str(Path(aesi.__file__).parent)],
            pip_requirements=[f"{name}=={version(name)}" for name in NEEDS],
            signature=_signature(),
            metadata={"inputs": TOLD},
        )
    return str(logged.model_id)


def _signature() -> ModelSignature:
    """No number for the state of charge: MLflow hands a default on as if it had been given, so that it would be taken
    instead of what a measured voltage says."""
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, ParamSchema, ParamSpec, Schema

    return ModelSignature(
        inputs=Schema(
            [
                ColSpec("double", "time_s"),
                ColSpec("double", "current_a"),
                ColSpec("double", "voltage_v", required=False),
                ColSpec("double", "temperature_degc", required=False),
            ]
        ),
        outputs=Schema([ColSpec("double", name) for name in ("voltage_v", "lower_v", "upper_v")]),
        params=ParamSchema([ParamSpec("soc0", "double", None)]),
    )


def _register(client: MlflowClient, name: str, run_id: str, model_id: str) -> None:
    """A new version of the registered model; the name is made where it is new."""
    from mlflow.exceptions import MlflowException

    try:
        client.create_registered_model(name)
    except MlflowException as error:
        if error.error_code != "RESOURCE_ALREADY_EXISTS":
            raise
    client.create_model_version(name, f"models:/{model_id}", run_id, model_id=model_id)
