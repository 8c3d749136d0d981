"""The product: ESPM, the effects added to it, the sparse correction of what is left, and prediction bands.

A saved model is a folder of data (JSON and one .npz of plain arrays): nothing in it is executed when loaded.

    model.json        schema, what the folder holds, sampling, state of charge at the start of the training record
    cell.bpx.json     the cell
    effects.json      ids and parameters of the effects
    correction.json   the sparse model of the voltage error (where there is one)
    intervals.json, bands.json, arrays.npz     one-step intervals and free-run bands (where there are)
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from aesi.conformal import Calibrated, FreeRunBands
from aesi.data.resample import is_even, to_even
from aesi.errors import DataError, InputError
from aesi.numerics.typing import Array, BoolArray
from aesi.physics import ActiveEffect, Cell, simulate
from aesi.pipeline.load import error_series, rest_soc
from aesi.records import ErrorSeries, Hold, Measurement
from aesi.sparse import SparseModel

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = "aesi.model/1"


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted voltage with its band, a value a sample.

    voltage_v, lower_v, upper_v : (n,) V; the bounds are NaN where the model carries no calibrated band.
    physics_v : (n,) V, the ESPM with its effects alone.  soc : (n,).
    outside : (n,) True where an input lies outside the range the correction was trained on: the band is not
    calibrated there.
    """

    time_s: Array
    voltage_v: Array
    lower_v: Array
    upper_v: Array
    physics_v: Array
    soc: Array
    outside: BoolArray
    nominal: float | None = None

    def to_frame(self) -> pd.DataFrame:
        """The prediction as a table, one row a sample."""
        import pandas as pd

        names = ("time_s", "voltage_v", "lower_v", "upper_v", "physics_v", "soc", "outside")
        return pd.DataFrame({name: getattr(self, name) for name in names})


@dataclass(frozen=True, eq=False)
class HybridModel:
    """ESPM + effects + correction + intervals; the last two may be absent.

    dt_s : s, the step of the correction; records sampled otherwise are brought to it and back.
    """

    cell: Cell
    effects: tuple[ActiveEffect, ...] = ()
    correction: SparseModel | None = None
    intervals: Calibrated | None = None
    bands: FreeRunBands | None = None
    dt_s: float = 1.0
    hold: Hold = "linear"
    soc0: float | None = None

    def predict(
        self,
        time_s: Array,
        current_a: Array,
        soc0: float | None = None,
        voltage_v: Array | None = None,
        temperature_degc: Array | None = None,
        error0_v: float = 0.0,
    ) -> Prediction:
        """Voltage under a current, with its band.

        time_s, current_a : (n,) s, A (discharge positive).  voltage_v : (n,) V measured: one step ahead, each
        sample predicted from those before it; None: free run, from the voltage error `error0_v` at the start.
        soc0 : state of charge at the first sample; None takes it from the first measured voltage at rest, else
        the model's own.

        Raises DataError where the record cannot be simulated or soc0 is unknown.
        """
        measured = np.full(len(time_s), np.nan) if voltage_v is None else np.asarray(voltage_v, dtype=float)
        record = Measurement(
            np.asarray(time_s, float), np.asarray(current_a, float), measured, temperature_degc, "the record"
        )
        if voltage_v is not None and not np.isfinite(measured).all():
            row = int(np.flatnonzero(~np.isfinite(measured))[0])
            raise DataError(
                f"voltage_v has no value in row {row} ({record.time_s[row]:g} s); predict the parts before and after "
                "the gap as records of their own, or leave voltage_v out for a free run."
            )
        soc0 = self._soc0(record, soc0, voltage_v is not None)
        even = self._even(record)
        series = self._series(even, soc0)
        if voltage_v is None:
            prediction = self._free_run(series, error0_v)
        else:
            prediction = self._one_step(series)
        return prediction if even is record else self._back(prediction, record, soc0)

    def save(self, folder: str | Path) -> Path:
        """Write the model to a folder, made where it is missing; returns the folder."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        arrays: dict[str, Array] = {}
        parts: dict[str, Any] = {
            "cell.bpx": self.cell.to_bpx(),
            "effects": [effect.to_dict() for effect in self.effects],
        }
        for name in ("correction", "intervals", "bands"):
            part = getattr(self, name)
            if part is not None:
                parts[name] = _without_arrays(part.to_dict(), name, arrays)
        for name, content in parts.items():
            _write_json(folder / f"{name}.json", content)
        np.savez_compressed(folder / "arrays.npz", allow_pickle=False, **arrays)
        head = {
            "schema": SCHEMA,
            "parts": sorted(parts),
            "dt_s": self.dt_s,
            "hold": self.hold,
            "soc0": self.soc0,
        }
        _write_json(folder / "model.json", head)
        return folder

    @staticmethod
    def load(folder: str | Path) -> HybridModel:
        """Read a model folder. Raises InputError naming the file that is missing or not as written by `save`."""
        folder = Path(folder)
        head = _read_json(folder / "model.json", "a model folder is written by `aesi run` or `aesi discover`")
        if head.get("schema") != SCHEMA:
            raise InputError(
                f"{folder / 'model.json'} has schema {head.get('schema')!r}; this version reads {SCHEMA!r}."
            )
        arrays = _read_arrays(folder / "arrays.npz")

        def part(name: str) -> Any:
            if name not in head["parts"]:
                return None
            return _with_arrays(_read_json(folder / f"{name}.json"), arrays)

        correction, intervals, bands = (part(name) for name in ("correction", "intervals", "bands"))
        try:
            return HybridModel(
                cell=Cell.from_bpx(folder / "cell.bpx.json"),
                effects=tuple(ActiveEffect.from_dict(content) for content in part("effects") or ()),
                correction=SparseModel.from_dict(correction) if correction else None,
                intervals=Calibrated.from_dict(intervals) if intervals else None,
                bands=FreeRunBands.from_dict(bands) if bands else None,
                dt_s=float(head["dt_s"]),
                hold=head["hold"],
                soc0=head["soc0"],
            )
        except (KeyError, TypeError) as error:
            raise InputError(f"{folder} is not a whole model: {error}; save it again.") from None

    def _soc0(self, record: Measurement, soc0: float | None, measured: bool) -> float:
        if soc0 is not None:
            return soc0
        if measured:
            return rest_soc(self.cell, record)
        if self.soc0 is None:
            raise DataError("a free run needs soc0, the state of charge at the first sample; give it.")
        return self.soc0

    def _even(self, record: Measurement) -> Measurement:
        """The record at the correction's step, or itself where that is nothing to do."""
        if self.correction is None or is_even(record.time_s, self.dt_s):
            return record
        return to_even(record, self.dt_s)

    def _series(self, record: Measurement, soc0: float) -> ErrorSeries:
        run = simulate(
            self.cell, record.time_s, record.current_a, soc0, self.effects, record.temperature_degc, self.hold
        )
        return error_series(record, run, self.dt_s)

    def _free_run(self, series: ErrorSeries, error0_v: float) -> Prediction:
        n = len(series)
        error, outside = np.zeros(n), np.zeros(n, dtype=bool)
        if self.correction is not None:
            run = self.correction.free_run(series, error0_v)
            error, outside = run.error_v, run.outside
        low = high = np.full(n, np.nan)
        if self.bands is not None:
            low, high = self.bands.along(self.dt_s, series.current_a, series.soc)
        alpha = None if self.bands is None else self.bands.alpha
        return _prediction(series, error, low, high, outside, alpha)

    def _one_step(self, series: ErrorSeries) -> Prediction:
        n = len(series)
        if self.correction is None:
            none = np.full(n, np.nan)
            return _prediction(series, np.zeros(n), none, none, np.zeros(n, dtype=bool), None)
        error = self.correction.one_step(series)
        error[0] = 0.0  # nothing was measured before the first sample
        low = high = np.full(n, np.nan)
        if self.intervals is not None:
            residual = series.error_v - error
            residual[0] = np.nan
            band = self.intervals.intervals(residual, series.current_a)
            low, high = band.lower_v, band.upper_v
        alpha = None if self.intervals is None else self.intervals.alpha
        return _prediction(series, error, low, high, self.correction.outside(series), alpha)

    def _back(self, prediction: Prediction, record: Measurement, soc0: float) -> Prediction:
        """Onto the record's own rows: the physics simulated there, the correction and its band interpolated."""
        physics = self._series(record, soc0)
        time = record.time_s

        def onto(values: Array) -> Array:
            return np.interp(time, prediction.time_s, values)

        return replace(
            prediction,
            time_s=time,
            voltage_v=physics.model_v + onto(prediction.voltage_v - prediction.physics_v),
            lower_v=physics.model_v + onto(prediction.lower_v - prediction.physics_v),
            upper_v=physics.model_v + onto(prediction.upper_v - prediction.physics_v),
            physics_v=physics.model_v,
            soc=physics.soc,
            outside=onto(prediction.outside.astype(float)) > 0,
        )


def _prediction(
    series: ErrorSeries, error: Array, low: Array, high: Array, outside: BoolArray, alpha: float | None
) -> Prediction:
    voltage = series.model_v + error
    return Prediction(
        time_s=series.time_s,
        voltage_v=voltage,
        lower_v=voltage + low,
        upper_v=voltage + high,
        physics_v=series.model_v,
        soc=series.soc,
        outside=outside,
        nominal=None if alpha is None else 1.0 - alpha,
    )


ARRAY_KEY = "array:"
"""Prefix of a string that stands for an array of arrays.npz."""


def _without_arrays(value: Any, path: str, arrays: dict[str, Array]) -> Any:
    """The value with every numpy array moved to `arrays` and a reference left in its place."""
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return ARRAY_KEY + path
    if isinstance(value, Mapping):
        return {key: _without_arrays(item, f"{path}.{key}", arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_arrays(item, f"{path}.{index}", arrays) for index, item in enumerate(value)]
    return value.item() if isinstance(value, np.generic) else value


def _with_arrays(value: Any, arrays: Mapping[str, Array]) -> Any:
    """Inverse of `_without_arrays`."""
    if isinstance(value, str) and value.startswith(ARRAY_KEY):
        return arrays[value.removeprefix(ARRAY_KEY)]
    if isinstance(value, dict):
        return {key: _with_arrays(item, arrays) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_arrays(item, arrays) for item in value]
    return value


def _write_json(path: Path, content: Any) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False), encoding="utf-8")


def _read_json(path: Path, hint: str = "save the model again") -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path} does not exist; {hint}.") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}); {hint}.") from None


def _read_arrays(path: Path) -> dict[str, Array]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{path} cannot be read ({error}); save the model again.") from None
