"""The state of charge at a record's first row, with its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Basis = Literal["given", "full charge", "rest", "load"]


@dataclass(frozen=True)
class InitialState:
    """The state of charge at the first row of a record.

    soc : at rest before the first row, 0 to 1, in the declared stoichiometry windows.  sd : its standard deviation.
    basis : its source.  sentence : source and figures, for a reader.  rest_voltage_v : V, at which the cell rests
    there; None where it was given.  ends : states of charge at the voltage lowered and raised by two of its standard
    deviations, or None; on a flat potential far beyond soc -+ 2 sd.
    doubt : difference between a given state of charge and the one read from the voltage.  contradicted : True where
    this difference is large.  doubted : True where it exceeds the uncertainty of the reading without being that large.
    flowed : True where a current has probably flowed before the first row: the model, which begins at rest, then lacks
    what it left for some minutes.
    by_voltage : of a full charge alone, the state of charge by its rest voltage and the open-circuit potentials.
    """

    soc: float
    sd: float
    basis: Basis
    sentence: str
    contradicted: bool = False
    rest_voltage_v: float | None = None
    doubt: float = 0.0
    ends: tuple[float, float] | None = None
    by_voltage: float | None = None
    doubted: bool = False
    flowed: bool = False

    @property
    def read_sd(self) -> float:
        """Standard deviation of a state of charge that was read from a voltage; 0 for one that was given, and for a
        full charge, which is 1 by definition."""
        return self.sd if self.basis in ("rest", "load") else 0.0

    @property
    def against_voltage(self) -> bool:
        """True where a given state of charge was kept although the record's voltage contradicts it."""
        return self.contradicted and self.basis == "given"

    def off(self, soc: float) -> float:
        """Distance of a state of charge from the interval `ends`; 0 within it."""
        low, high = self.ends or (self.soc - 2.0 * self.sd, self.soc + 2.0 * self.sd)
        return max(low - soc, soc - high, 0.0)
