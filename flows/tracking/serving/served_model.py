"""A saved hybrid model as MLflow serves it. MLflow runs this file to load the model; nothing is pickled.

In: a table with time_s, current_a and, if measured, voltage_v (one step ahead then; free run without it) and
temperature_degc. A column without any value counts as not there; one that lacks some is refused.
Out: voltage_v, lower_v, upper_v, one row a row. Parameter soc0: state of charge at the first row; without it as
`HybridModel.predict` has it, from the first measured voltage, else the model's own.
"""

from __future__ import annotations

from typing import Any

import pandas as pd
from mlflow.models import set_model
from mlflow.pyfunc import PythonModel

import aesi


class HybridPyfunc(PythonModel):
    """`aesi.HybridModel.predict` on tables."""

    def load_context(self, context: Any) -> None:
        """Read the model folder, which is data alone."""
        self._model = aesi.HybridModel.load(context.artifacts["model"])

    def predict(
        self, context: Any, model_input: pd.DataFrame, params: dict[str, Any] | None = None
    ) -> pd.DataFrame:
        """The voltage with its band."""
        measured = {
            name: model_input[name].to_numpy(float)
            for name in ("voltage_v", "temperature_degc")
            if name in model_input and model_input[name].notna().any()
        }
        prediction = self._model.predict(
            model_input["time_s"].to_numpy(float),
            model_input["current_a"].to_numpy(float),
            soc0=(params or {}).get("soc0"),
            **measured,
        )
        return prediction.to_frame()[["voltage_v", "lower_v", "upper_v"]]


set_model(HybridPyfunc())
