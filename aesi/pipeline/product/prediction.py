"""The prediction of a hybrid model for a record: voltage, band, and the physics behind it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import over_time, range_words
from aesi.records import ErrorSeries

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted voltage with its band, one value per sample.

    time_s : (n,) s.  voltage_v, lower_v, upper_v : (n,) V; the bounds are NaN where the model has no calibrated band.
    physics_v : (n,) V, the physics with its effects, without the correction.  soc : (n,) state of charge.
    outside : (n,) True where an input, or the temperature, lies outside the range that the correction was trained on.
    weight : (n,) share of the correction that is applied, 0 to 1: it fades towards the physics with the distance from
    the training data. 1 for a correction that does not fade, NaN without one.
    nominal : coverage of the band, 0 to 1; None without one.  temperature_degc : (n,) degC, of the simulated cell.
    collector_mol_m3 : (n,) the lower one of the salt concentrations at the two collectors, mol/m3, by the physics.
    diverged_s : time, s, from which a correction that feeds back is held, since it left ten times its trained range;
    None where it did not.
    persistence_v : (n,) V, one step ahead: the physics plus the last error that was known, which a prediction has to
    beat; NaN at the first sample, before which none was known. None in free run.
    """

    time_s: Array
    voltage_v: Array
    lower_v: Array
    upper_v: Array
    physics_v: Array
    soc: Array
    outside: BoolArray
    weight: Array
    nominal: float | None = None
    temperature_degc: Array | None = None
    collector_mol_m3: Array | None = None
    diverged_s: float | None = None
    persistence_v: Array | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        band = "no band" if self.nominal is None else f"{100 * self.nominal:g} % band"
        outside = (
            f", {100 * self.outside.mean():.0f} % outside the trained range" if self.outside.any() else ""
        )
        across = range_words(f"{self.voltage_v.min():.3f}", f"{self.voltage_v.max():.3f}")
        return f"Prediction({len(self):,} rows, {across} V, {band}{outside})"

    def plot(self) -> Figure:
        """Voltage with its band beside the physics alone, and state of charge, over time: a plotly figure."""
        voltage = {"predicted": self.voltage_v, "physics alone": self.physics_v}
        panels = {"voltage, V": voltage, "state of charge": {"state of charge": self.soc}}
        band = (
            None if self.nominal is None else (f"{100 * self.nominal:g} % band", self.lower_v, self.upper_v)
        )
        return over_time(self.time_s, panels, band)

    def to_frame(self) -> pd.DataFrame:
        """The prediction as a table, one row per sample."""
        import pandas as pd

        names = ("time_s", "voltage_v", "lower_v", "upper_v", "physics_v", "soc", "outside", "weight")
        return pd.DataFrame({name: getattr(self, name) for name in names})

    @classmethod
    def of(
        cls,
        series: ErrorSeries,
        error_v: Array,
        low_v: Array,
        high_v: Array,
        outside: BoolArray,
        weight: Array,
        alpha: float | None,
    ) -> Prediction:
        """The physics of `series` plus a predicted error_v (n,) V.  low_v, high_v : (n,) V, limits of the band.

        alpha : miss rate of the band; None without a band.
        """
        voltage = series.model_v + error_v
        return cls(
            time_s=series.time_s,
            voltage_v=voltage,
            lower_v=voltage + low_v,
            upper_v=voltage + high_v,
            physics_v=series.model_v,
            soc=series.soc,
            outside=outside,
            weight=weight,
            nominal=None if alpha is None else 1.0 - alpha,
            temperature_degc=series.temperature_degc,
            collector_mol_m3=series.collector_mol_m3,
        )
