"""Log a saved hybrid model to MLflow: pyfunc from code, with signature and input example, registered."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import aesi

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.models.model import ModelInfo

CODE = Path(__file__).with_name("hybrid_pyfunc.py")
DEFAULT_SOC0 = 0.5
NEEDS = ("bpx", "numba", "numpy", "pandas", "pyarrow", "pydantic", "quantile-forest", "scikit-learn", "scipy")


def log_hybrid(uri: str, run_id: str, folder: Path, registered_as: str | None) -> None:
    """Log the model folder under the run, and register it where a name is given."""
    import mlflow
    import pandas as pd
    from mlflow.models import ModelSignature
    from mlflow.types import ColSpec, ParamSchema, ParamSpec, Schema

    if not folder.is_dir():
        raise ValueError(f"the model folder {folder} is gone")
    hybrid = aesi.HybridModel.load(folder)
    soc0 = DEFAULT_SOC0 if hybrid.soc0 is None else hybrid.soc0
    signature = ModelSignature(
        inputs=Schema(
            [
                ColSpec("double", "time_s"),
                ColSpec("double", "current_a"),
                ColSpec("double", "voltage_v", required=False),
            ]
        ),
        outputs=Schema([ColSpec("double", name) for name in ("voltage_v", "lower_v", "upper_v")]),
        params=ParamSchema([ParamSpec("soc0", "double", soc0)]),
    )
    time_s = [float(t) for t in range(10)]
    example = pd.DataFrame({"time_s": time_s, "current_a": [hybrid.cell.capacity_ah / 2] * len(time_s)})
    before = mlflow.get_tracking_uri()
    mlflow.set_tracking_uri(uri)
    mlflow.set_registry_uri(uri)
    try:
        with mlflow.start_run(run_id=run_id, log_system_metrics=False):
            logged = mlflow.pyfunc.log_model(
                name="model",
                python_model=str(CODE),
                artifacts={"model": str(folder)},
                code_paths=[str(Path(aesi.__file__).parent)],
                pip_requirements=[f"{name}=={version(name)}" for name in NEEDS],
                signature=signature,
                input_example=example,
            )
        if registered_as:  # resolves the model through the global address, so before that is put back
            _register(mlflow.MlflowClient(uri, uri), registered_as, run_id, logged)
    finally:
        mlflow.set_tracking_uri(before)


def _register(client: MlflowClient, name: str, run_id: str, logged: ModelInfo) -> None:
    """A new version of the registered model; the name is made where it is new."""
    from mlflow.exceptions import MlflowException

    try:
        client.create_registered_model(name)
    except MlflowException as error:
        if error.error_code != "RESOURCE_ALREADY_EXISTS":
            raise
    client.create_model_version(name, logged.model_uri, run_id, model_id=logged.model_id)
