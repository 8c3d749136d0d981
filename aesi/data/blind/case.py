"""What a blind case is asked to be, and what it is once made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from aesi.data.laboratory.simulator import Model
from aesi.records import Measurement


@dataclass(frozen=True)
class CaseSpec:
    """One case to make.

    cell : name of one of the cell files handed to `generate`.
    recipes : names in `recipes.RECIPES` or `strangers.STRANGERS`; none for a cell that is as declared.
    target_mv : RMS change of the voltage that each recipe is scaled to.
    rate : the drive's currents, as a share of those of the default vehicle (3.2C at the highest under US06).
    tolerance : largest relative error of the two solid diffusivities.
    temperature : whether there is a temperature column.
    """

    name: str
    cell: str
    recipes: tuple[str, ...] = ()
    target_mv: float = 5.0
    model: Model = "SPMe"
    rate: float = 1.0
    tolerance: float = 0.0
    temperature: bool = False
    soc0: float = 0.95
    seed: int = 0
    voltage_noise_v: float = 1e-3
    current_noise_a: float = 4e-3


@dataclass(frozen=True, eq=False)
class BlindCase:
    """A case made.

    label : 'none', 'unknown', or the ids of the effects joined by '+'.  also : answers that are right as well.
    declared : the cell file the finder is given.  truth : what was changed and by how much, units in the names;
    `rms_mv` in it is the RMS of what the model without effects leaves of the noise-free voltage.
    """

    spec: CaseSpec
    measurements: tuple[Measurement, ...]
    label: str
    also: tuple[str, ...]
    soc0: float
    declared: Path
    truth: Mapping[str, float] = field(default_factory=dict)

    @property
    def effects(self) -> tuple[str, ...]:
        """The ids in the label; empty for 'none' and 'unknown'."""
        return () if self.label in ("none", "unknown") else tuple(self.label.split("+"))
