"""The result of a simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from aesi.numerics.typing import Array
from aesi.over_time import extent, over_time, range_words
from aesi.records.measurement import Hold

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure


@dataclass(frozen=True, eq=False)
class Run:
    """One simulation: voltage and internal states, one value per sample.

    series : name -> (n,) array. Always there: c_sp, c_sn (surface, mol/m3), c_e0, c_eL (electrolyte at the
    negative and the positive current collector, mol/m3), soc, temperature_k (of the winding); effects add their own.
    profiles : name -> array across the electrodes; empty where they were not asked for. x_m (places,) is the distance
    from the negative collector; (n, places) have surface_stoichiometry, reaction_a_m2 (per particle surface,
    delithiation positive), electrolyte_mol_m3, and potential_v of the solid against the electrolyte. Through the
    separator as well run electrolyte_nodes_mol_m3 (n, nodes) at the distances electrolyte_x_m (nodes,).
    hold : how the current was taken to run between the samples.
    """

    time_s: Array
    current_a: Array
    voltage_v: Array
    series: dict[str, Array] = field(default_factory=dict)
    profiles: dict[str, Array] = field(default_factory=dict)
    hold: Hold = "linear"

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        across = range_words(f"{self.voltage_v.min():.3f}", f"{self.voltage_v.max():.3f}")
        return f"Run({extent(self.time_s)}, {across} V, states {', '.join(self.series)})"

    def to_frame(self) -> pd.DataFrame:
        """Time, current, voltage and states as a table, one row per sample."""
        import pandas as pd

        columns = {"time_s": self.time_s, "current_a": self.current_a, "voltage_v": self.voltage_v}
        return pd.DataFrame(columns | self.series)

    def plot(self) -> Figure:
        """Voltage, current and state of charge over time: a plotly figure."""
        panels = {"voltage, V": {"simulated": self.voltage_v}, "current, A": {"current": self.current_a}}
        if "soc" in self.series:
            panels["state of charge"] = {"state of charge": self.series["soc"]}
        return over_time(self.time_s, panels, held=("current",) if self.hold == "backward" else ())

    @property
    def collector_mol_m3(self) -> Array:
        """(n,) mol/m3, the lower one of the salt concentrations at the two collectors."""
        return np.minimum(self.series["c_e0"], self.series["c_eL"])

    @property
    def states(self) -> pd.DataFrame:
        """The series as a table, one row per sample."""
        import pandas as pd

        return pd.DataFrame(self.series)
