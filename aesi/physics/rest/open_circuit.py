"""State of charge from a rest voltage by the open-circuit potentials, with its standard deviation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC, ZERO_CELSIUS_K
from aesi.errors import CellError, DataError, InputError, in_words
from aesi.numerics.typing import Array
from aesi.physics.arguments import check_cell, checked_volts
from aesi.physics.balance import aged_range
from aesi.physics.cell import Cell
from aesi.physics.espm.plain import shifted_ocp
from aesi.records import Measurement
from aesi.records.checked import check_plain_volts, is_finite_number

GIVEN_SD = 0.0005
"""Standard deviation of a state of charge that the user gives, and the smallest of any."""
GIVEN_BY = "--soc0"
"""Option by which a user gives a state of charge."""
READING_V = 9e-3
"""Standard deviation of the open-circuit voltage of a cell file, V: RMS error of calibrated and published files on a
measured drive (geometric mean of eight development records of `aesi bench real`)."""
GOOD_READING_V = 3e-3
"""The same, V, in a fit, which moves the potentials or finds other errors: half the RMS error of a calibration on a
C/20 discharge."""
CHARGED_V = 0.03
"""How far a full cell's voltage falls at rest: 6 to 30 mV in the charged records of four measured cells."""
NEARLY_FULL, LINGERING_V = 0.98, 0.1
"""A full cell of a flat potential rests anywhere between its plateau and its cut-off, an LFP cell at 3.40 to 3.54 V of
3.65. So it is full, too, if it rests this many volts above what it does at this state of charge, which is more than a
charge that was broken off there leaves. Above the cut-off, so of no account, where the potential is steep."""
BEYOND_V = 0.05
"""A voltage this far beyond the declared full or empty still belongs to a full or an empty cell of this kind. A
convention: with half or twice as much `aesi bench start --set cuts=16` refuses none of 48 rows, and what it is to
refuse, cells of another chemistry, lies hundreds of millivolts off."""
AROUND = np.linspace(-2.0, 2.0, 17)
"""Voltages that a reading may be off by, in its standard deviations."""
GRID = 4001
"""Number of states of charge in the table of open-circuit voltages."""


def initial_soc(cell: Cell, voltage_v: float, kelvin: float | None = None) -> float:
    """State of charge of a cell that rests at `voltage_v` (V): 1 for a full charge, else by the open-circuit voltage.

    kelvin : temperature, K; None takes the cell file's initial temperature.
    Voltages up to `BEYOND_V` beyond full and empty are accepted. Raises DataError outside, naming the range;
    InputError for what is no Cell, no voltage or no temperature of a cell.
    """
    check_cell(cell)
    rest_v = checked_volts(voltage_v, "voltage_v")
    if kelvin is not None and not (
        is_finite_number(kelvin) and COLDEST_DEGC <= kelvin - ZERO_CELSIUS_K <= WARMEST_DEGC
    ):
        coldest, warmest = COLDEST_DEGC + ZERO_CELSIUS_K, WARMEST_DEGC + ZERO_CELSIUS_K
        raise InputError(
            f"kelvin = {in_words(kelvin)} is not from {coldest:g} to {warmest:g} K, where cells work; 25 degC is "
            "298.15 K."
        )
    return OpenCircuit(cell, kelvin).soc_at_rest(rest_v, rest_v)


class OpenCircuit:
    """The open-circuit voltage of a cell (effects folded in) at one temperature.

    kelvin : K; None is the cell file's initial temperature.  name : of the record whose voltages are read, if any.
    potentials_v : V, standard deviation of this voltage.  given_by : option by which a user gives the state of charge
    instead.
    Raises CellError where a potential is not finite within `SOC_BEYOND` of the cell's range.
    """

    def __init__(
        self,
        cell: Cell,
        kelvin: float | None = None,
        name: str = "",
        potentials_v: float = READING_V,
        given_by: str = GIVEN_BY,
    ) -> None:
        self.cell, self.name, self.potentials_v, self.given_by = cell, name, potentials_v, given_by
        self.kelvin = cell.initial_temperature_k if kelvin is None else kelvin
        self.soc = np.linspace(*aged_range(cell), GRID)
        ocv = _ocv(cell, self.soc, self.kelvin)
        finite = np.isfinite(ocv)
        if not finite.all():
            raise CellError(
                f"{cell.name}: by its potentials the open-circuit voltage is not finite at a state of charge of "
                f"{self.soc[int(np.argmin(finite))]:.3f}; write there tables, or formulas that hold from 0 to 1."
            )
        self.ocv = np.maximum.accumulate(ocv)

    @classmethod
    def at_start(
        cls, cell: Cell, record: Measurement, potentials_v: float = READING_V, given_by: str = GIVEN_BY
    ) -> OpenCircuit:
        """At the temperature of a record's first row, where it was measured."""
        degc = record.temperature_degc
        kelvin = None if degc is None else float(degc[0]) + ZERO_CELSIUS_K
        return cls(cell, kelvin, record.name, potentials_v, given_by)

    def soc_at(self, voltage_v: float) -> float:
        """State of charge at an open-circuit voltage (V), clipped to the range of the cell."""
        return float(np.interp(voltage_v, self.ocv, self.soc))

    def soc_at_rest(self, terminal_v: float, ocv_v: float) -> float:
        """State of charge of a resting cell: 1 for a full charge, judged by the terminal voltage, else that at the
        open-circuit voltage; effects in series may make the two differ.  Raises DataError as `reading` does."""
        return 1.0 if self.charged(terminal_v) else self.reading(ocv_v, self.potentials_v)[0]

    def voltage_at(self, soc: float) -> float:
        """V, the open-circuit voltage."""
        return float(np.interp(soc, self.soc, self.ocv))

    def with_potentials(self, cell: Cell) -> OpenCircuit:
        """That of the same windows with the potentials of another cell; itself where they are the same."""
        own = self.cell
        n, p = (
            {"ocp": electrode.ocp, "entropic": electrode.entropic} for electrode in cell.electrodes.values()
        )
        if all(
            getattr(own.negative, name) == n[name] and getattr(own.positive, name) == p[name] for name in n
        ):
            return self
        return OpenCircuit(
            own.with_negative(**n).with_positive(**p),
            self.kelvin,
            self.name,
            self.potentials_v,
            self.given_by,
        )

    def reread(self, other: OpenCircuit, soc: float, sd: float, higher_v: float) -> float:
        """State of charge that `other` gives for a rest `higher_v` (V) above the one that reads `soc` here.

        It is the mean over the voltages that the reading, known to `sd`, may be off by: it changes smoothly where a
        potential is flat.
        """
        rest_v = self.voltage_at(soc)
        spread_v = 0.5 * (self.voltage_at(soc + sd) - self.voltage_at(soc - sd))
        around_v = rest_v + spread_v * AROUND
        there = np.interp(around_v + higher_v, other.ocv, other.soc)
        return soc + float((there - np.interp(around_v, self.ocv, self.soc)).mean())

    def full_sd(self, voltage_v: float, doubt_v: float = 0.0) -> float:
        """Standard deviation of the state of charge of a full cell that rests at `voltage_v`.

        doubt_v : V that this may be off by, beside the potentials.
        """
        spread_v = float(np.hypot(self.potentials_v, doubt_v))
        return max(0.5 * abs(1.0 - self.soc_at(voltage_v)), self.reading(self.voltage_at(1.0), spread_v)[1])

    def charged(self, voltage_v: float, drop_v: float = 0.0) -> bool:
        """True where this rest voltage (V) is that of a full charge.  drop_v : part of it that the model added for a
        load, which may be far too much."""
        as_read = voltage_v - max(drop_v, 0.0)
        highest = max(float(self.ocv[-1]), self.cell.upper_voltage_v)
        return voltage_v >= self.charged_from_v and as_read <= highest + BEYOND_V

    @property
    def charged_from_v(self) -> float:
        """The least rest voltage of a full charge."""
        return min(self.cell.upper_voltage_v - CHARGED_V, self.lingers_from_v)

    @property
    def lingers_from_v(self) -> float:
        """The least rest voltage of a full charge whose voltage falls far."""
        return self.voltage_at(NEARLY_FULL) + LINGERING_V

    def reading(self, voltage_v: float, spread_v: float) -> tuple[float, float]:
        """(state of charge at an open-circuit voltage, half the range that voltage +/- `spread_v` covers). Beyond full
        and empty the range is that at the limit, with `spread_v` enlarged by the distance from it.

        voltage_v : V.  spread_v : its standard deviation, V.  Raises DataError where `admits` does not hold.
        """
        if not self.admits(voltage_v, spread_v):
            check_plain_volts(np.array([voltage_v]), lambda _: self.name or "the rest voltage")
            low, high = np.interp([0.0, 1.0], self.soc, self.ocv)
            of_record = f"{self.name}: " if self.name else ""
            raise DataError(
                f"{of_record}a rest voltage of {voltage_v:.4f} V lies outside [{low:.3f}, {high:.3f}] V, what "
                f"the open-circuit potentials and stoichiometry limits of {self.cell.name} allow; check that the "
                f"record belongs to this cell, or give {self.given_by}."
            )
        # Beyond full and empty the potentials say as little as they are far from it, and not that it is known.
        inside_v = float(np.clip(voltage_v, self.ocv[0], self.ocv[-1]))
        spread_v += abs(voltage_v - inside_v)
        ends = np.interp([inside_v - spread_v, inside_v + spread_v], self.ocv, self.soc)
        sd = max(0.5 * float(ends[1] - ends[0]), GIVEN_SD)
        return self.soc_at(voltage_v), sd

    def ends(self, voltage_v: float, spread_v: float) -> tuple[float, float]:
        """States of charge at voltage_v - 2 spread_v and at voltage_v + 2 spread_v."""
        return self.soc_at(voltage_v - 2.0 * spread_v), self.soc_at(voltage_v + 2.0 * spread_v)

    def admits(self, voltage_v: float, spread_v: float) -> bool:
        """True where some state of this cell rests within 2 `spread_v` of the voltage."""
        low, high = np.interp([0.0, 1.0], self.soc, self.ocv)
        beyond = max(BEYOND_V, 2.0 * spread_v)
        return bool(low - beyond <= voltage_v <= high + beyond)


def _ocv(cell: Cell, soc: Array, kelvin: float) -> Array:
    rise = kelvin - cell.reference_temperature_k
    ocp_n, ocp_p = shifted_ocp(cell.negative, rise), shifted_ocp(cell.positive, rise)
    return replace(cell.balance, ocp_n=ocp_n, ocp_p=ocp_p).rest_voltage_v(soc)
