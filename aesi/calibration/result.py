"""What a calibration gives back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from aesi.calibration.model import Model
from aesi.constants import MV_PER_V
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Interval:
    """A parameter with its 95 % interval, its unit and where its prior is from."""

    value: float
    low: float
    high: float
    unit: str
    source: str


@dataclass(frozen=True)
class RecordError:
    """RMSE of one record's rows, V: as the start file declares the cell, and calibrated."""

    name: str
    temperature_degc: float | None
    before_v: float
    after_v: float


@dataclass(frozen=True)
class Open:
    """A combination of parameters that the data do not determine.

    weights : of the parameters in it, in deviations of their priors.  narrowed : what the data leave of the prior's
    deviation along it (1: nothing was learnt).
    """

    weights: tuple[tuple[str, float], ...]
    narrowed: float

    @property
    def sentence(self) -> str:
        """For a reader."""
        names = " with ".join(f"{name} ({weight:+.2f})" for name, weight in self.weights)
        return f"the data do not determine {names}: {100 * self.narrowed:.0f} % of the prior's width is left"


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated cell, and how sure it is.

    parameters : name -> value with its interval.  undetermined : combinations that the data leave open.
    at_bounds : parameters that ended on a bound.  errors : of each record.  capacities : share of the cell's capacity
    that each record's has.  x, covariance : working vector and its covariance, for the posterior.
    """

    cell: Cell
    declared: Cell
    parameters: Mapping[str, Interval]
    undetermined: tuple[Open, ...]
    at_bounds: tuple[str, ...]
    errors: tuple[RecordError, ...]
    capacities: Mapping[str, float]
    notes: tuple[str, ...]
    seconds: float
    model: Model
    x: Array
    covariance: Array

    def __repr__(self) -> str:
        errors = ", ".join(
            f"{e.name} {MV_PER_V * e.before_v:.1f} -> {MV_PER_V * e.after_v:.1f} mV" for e in self.errors
        )
        return f"Calibration(cell {self.cell.name!r}, {errors})"

    def to_frame(self) -> pd.DataFrame:
        """The parameters with their 95 % intervals, units and where their priors are from."""
        import pandas as pd

        rows = {name: asdict(interval) for name, interval in self.parameters.items()}
        return pd.DataFrame.from_dict(rows, orient="index")
