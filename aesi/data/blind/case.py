"""The specification of a blind case, and the generated case."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from aesi.data.laboratory.simulator import LaboratoryModel
from aesi.records import Measurement

RecordKind = Literal["slow", "pulses", "drive", "fast_charge"]
Warmth = Literal["none", "ambient", "course"]


@dataclass(frozen=True)
class CaseSpec:
    """Specification of one case.

    cell : name of one of `cells.CELLS`.
    recipes : names in `recipes.RECIPES` or `strangers.STRANGERS`; none for a cell that lacks nothing.
    target_mv : RMS change of the voltage that each recipe is scaled to.
    records : names of the tests, each from a rest.  rate : factor on the currents of the default vehicle.
    spread : True where the cell's parameters deviate by `spread.SPREADS`; else they are as declared.
    warmth : 'none': no temperature column, cell at its reference; 'ambient': column of a cell in a chamber at another
    temperature; 'course': column of a cell that warms up.
    soc0_given : True where the finder is told the state of charge.  dt_s : interval of rows of drives and pulses, s.
    """

    name: str
    cell: str
    recipes: tuple[str, ...] = ()
    target_mv: float = 5.0
    model: LaboratoryModel = "SPMe"
    records: tuple[RecordKind, ...] = ("drive",)
    rate: float = 1.0
    spread: bool = False
    warmth: Warmth = "none"
    soc0: float = 0.8
    soc0_given: bool = True
    dt_s: float = 1.0
    seed: int = 0

    @property
    def kind(self) -> str:
        """'none', 'single', 'pair', 'triple' or 'stranger'."""
        from aesi.data.blind.strangers import STRANGERS

        if any(name in STRANGERS for name in self.recipes):
            return "stranger"
        return ("none", "single", "pair", "triple")[len(self.recipes)]


@dataclass(frozen=True, eq=False)
class BlindCase:
    """A generated case.

    label : 'none', 'unknown', or the ids of the effects joined by '+'.  also : answers that a lenient judge takes.
    neutral : names that are neither right nor wrong here (what the reduction of a porous electrode leaves).
    soc0 : state of charge at the first sample of every record, None where the finder is not told.
    declared : the cell file that the finder is given.  truth : name with unit -> size of each change; `rms_mv` in it is
    the RMS error of the model without effects for the noise-free voltage.
    """

    spec: CaseSpec
    measurements: tuple[Measurement, ...]
    label: str
    also: tuple[str, ...]
    neutral: tuple[str, ...]
    soc0: float | None
    declared: Path
    truth: Mapping[str, float]

    @property
    def effects(self) -> tuple[str, ...]:
        """The ids in the label; empty for 'none' and 'unknown'."""
        return () if self.label in ("none", "unknown") else tuple(self.label.split("+"))
