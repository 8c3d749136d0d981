"""What is known of a record's first row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Basis = Literal["given", "full charge", "rest", "load"]


@dataclass(frozen=True)
class InitialState:
    """soc : state of charge at rest before the first row, by the declared windows.  sd : its standard deviation.

    basis : what it rests on.  sentence : the same for a reader, with the figures.  contradicted : True where a given
    state of charge is far from that of the voltage.  rest_voltage_v : at which the cell rests there, as read.
    doubt : how far the reading of the voltage is from what was given.  ends : states of charge that the voltage would
    say two of its deviations lower and higher; on a flat potential far beyond soc -+ 2 sd.
    doubted : True where a given one is further from that of the voltage than this is uncertain by, and not so far that
    it is contradicted.
    by_voltage : of a full charge alone, what the open-circuit potentials say of its rest voltage instead of 1.
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

    @property
    def read_sd(self) -> float:
        """Standard deviation of a state of charge that was read from a voltage; nought of one that was given, and of a
        full charge, which is 1 by definition."""
        return self.sd if self.basis in ("rest", "load") else 0.0

    @property
    def against_voltage(self) -> bool:
        """Was a state of charge taken as it was given, though the record's voltage contradicts it?"""
        return self.contradicted and self.basis == "given"

    def off(self, soc: float) -> float:
        """How far a state of charge is from all that the voltage may mean; 0 within."""
        low, high = self.ends or (self.soc - 2.0 * self.sd, self.soc + 2.0 * self.sd)
        return max(low - soc, soc - high, 0.0)
