"""State of charge at the first row of a record, what it is uncertain by, and on what it rests.

One rule for every command. In this order:

    given         the user says it
    full charge   the cell rests within `CHARGED_V` below its upper cut-off voltage: a charge that ended there is state
                  of charge 1 by definition, whatever the open-circuit potentials of the cell file say
    rest          the open-circuit voltage, at the temperature of the record
    load          the open-circuit voltage after the drop of the model under that current; the current may have begun
                  with the record or long before it, and the first minutes tell how likely either is

A voltage is as good as the open-circuit potentials, so that a flat potential gives a wide state of charge.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from aesi.constants import SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.physics.balance import aged_range, same_rest
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Trace
from aesi.physics.espm.plain import shifted_ocp
from aesi.physics.model import EspmModel
from aesi.physics.simulation import ModelName, model_with, simulate
from aesi.records import Hold, Measurement

Basis = Literal["given", "full charge", "rest", "load"]

GIVEN_SD = 0.0005
"""What a state of charge is known to by one who gives it."""
REST_C_RATE = 1.0 / 50.0
"""Below this current a cell rests: the drop at C/50 is within what the potentials are uncertain by."""
READING_V = 3e-3
"""What a good open-circuit potential misses: half of what remains of a C/20 discharge after a calibration."""
CHARGED_V = 0.03
"""How far a full cell's voltage falls at rest: 6 to 30 mV in the charged records of four measured cells."""
MOVING_V = 4e-3
"""A voltage that moves more than this over the rest before the current is not yet that of a rest."""
BEYOND_V = 0.05
"""A voltage this far beyond the declared full or empty still belongs to a full or an empty cell of this kind."""
CALM_ROWS = 60
"""First rows that are looked at for a rest."""
GRID = 4001
"""States of charge at which potentials are looked up."""
FLOWED_S = (0.0, 20.0, 200.0, 2000.0)
"""How long the first current may have flowed: after the last, it has drawn all but the slowest of its drops."""
HISTORY_C_RATE = 0.25
"""A record that starts under load was cut from something: what its voltage remembers of that is taken to be as large as
what this current leaves once it has flowed for long."""
DROP_ERROR = 0.2
"""Share of its drop that a model misses at the first row of a record."""
JUDGED_S = 300.0
"""First part of a record whose shape tells how long its current had flowed, of at most JUDGED_ROWS rows."""
JUDGED_ROWS = 3000
SHAPE_V = 2e-3
"""What the shape of a voltage over the first minutes is simulated to."""
ROUNDS = 4
"""Of drop and state of charge in turn: the drop hardly depends on it."""
OTHER_STATE = 0.05
OTHER_STATE_LOADED = 0.15
"""A given state of charge further than this from that of a record's voltage is contradicted by it."""


@dataclass(frozen=True)
class InitialState:
    """soc : state of charge at rest before the first row, by the declared windows.  sd : its standard deviation.

    basis : what it rests on.  sentence : the same for a reader, with the figures.  contradicted : True where a given
    state of charge is far from that of the voltage.  rest_voltage_v : at which the cell rests there, as read.
    doubt : how far the reading of the voltage is from what was given.
    """

    soc: float
    sd: float
    basis: Basis
    sentence: str
    contradicted: bool = False
    rest_voltage_v: float | None = None
    doubt: float = 0.0


def initial_state(
    cell: Cell,
    record: Measurement,
    soc0: float | None = None,
    hold: Hold = "backward",
    effects: Iterable[ActiveEffect] = (),
    *,
    shared: bool = False,
    model: ModelName = "espm",
) -> InitialState:
    """State of charge at the first row of `record`, see above.

    record : its temperature is used where it was measured.  soc0 : given by the user, for this record, or (`shared`)
    for several, so that one whose voltage contradicts it starts where its voltage says.
    hold : how the current runs between rows.  effects : what the cell has beyond its file.  model : that a
    loaded start is simulated with.
    Raises DataError where the voltage belongs to no state of this cell, or there is neither voltage nor `soc0`.
    """
    active = tuple(effects)
    start = _Start(cell, record, hold, active, model)
    if not np.isfinite(record.voltage_v[0]):
        if soc0 is None:
            raise DataError(f"{record.name} has no voltage to start from; give --soc0.")
        return _given(record, soc0, None)
    if soc0 is not None:
        try:
            read = start.read()
        except DataError:
            return _given(record, soc0, None)
        allowed = OTHER_STATE if read.basis in ("rest", "full charge") else OTHER_STATE_LOADED
        if abs(read.soc - soc0) <= allowed + 2.0 * read.sd:
            return replace(_given(record, soc0, None), doubt=abs(read.soc - soc0))
        if shared:
            return _read_instead(read, soc0)
        return replace(_given(record, soc0, read), doubt=abs(read.soc - soc0))
    return start.read()


def _read_instead(read: InitialState, soc0: float) -> InitialState:
    """The reading, with a sentence that says why what was given for several records is not believed for this one."""
    words = f"{read.sentence[:-1]}; not the {soc0:.4g} that was given, which its voltage contradicts."
    return InitialState(read.soc, read.sd, read.basis, words, True, read.rest_voltage_v)


def _given(record: Measurement, soc0: float, other: InitialState | None) -> InitialState:
    words = f"{record.name} starts at a state of charge of {soc0:.4g}, as given"
    if other is not None:
        words += f"; its first voltage ({record.voltage_v[0]:.3f} V) rather says {other.soc:.3f}"
    return InitialState(soc0, GIVEN_SD, "given", words + ".", other is not None)


class _Start:
    """The start of one record, against one cell."""

    def __init__(
        self,
        cell: Cell,
        record: Measurement,
        hold: Hold,
        effects: tuple[ActiveEffect, ...],
        physics: ModelName,
    ) -> None:
        self.physics = physics
        self.declared, self.record, self.hold, self.effects = cell, record, hold, effects
        self.model = model_with(cell, effects)
        self.cell = self.model.cell
        self.current_a = float(record.current_a[0])
        self.soc = np.linspace(*aged_range(self.cell), GRID)
        self.ocv = np.maximum.accumulate(_ocv(self.cell, self.soc, self._kelvin()))

    def read(self) -> InitialState:
        """From the voltage."""
        return self._at_rest() if self._rests() else self._under_load()

    def _rests(self) -> bool:
        return abs(self.current_a) <= REST_C_RATE * self.cell.capacity_ah

    def _kelvin(self) -> float:
        measured = self.record.temperature_degc
        if measured is not None:
            return float(measured[0]) + ZERO_CELSIUS_K
        return self.cell.initial_temperature_k

    def _at_rest(self) -> InitialState:
        calm = calm_voltage_v(self.record, REST_C_RATE * self.cell.capacity_ah)
        moved = moved_v(calm)
        moving = abs(moved) > MOVING_V
        voltage = float(calm[-(len(calm) // 4) :].mean()) if moving else float(calm.mean())
        true = freed_of_instruments(self.model, self.effects, voltage)
        spread = float(np.hypot(READING_V, moved if moving else 0.0))
        if self._charged(true):
            return self._full(true, f"rests at {voltage:.3f} V", voltage)
        soc, sd = self._reading(true, spread)
        words = f"{self.record.name} rests at {voltage:.3f} V: state of charge {soc:.4f} +/- {sd:.4f}"
        if moving:
            words += f", doubtful because the voltage still moves ({1e3 * moved:+.0f} mV) before the current starts"
        return InitialState(self._declared(soc), sd, "rest", words + ".", rest_voltage_v=voltage)

    def _under_load(self) -> InitialState:
        first = freed_of_instruments(self.model, self.effects, float(self.record.voltage_v[0]))
        drops = [self._drop(first, self.current_a, before_s) for before_s in FLOWED_S]
        begun = first + drops[0]
        said = f"starts under {self.current_a:.3g} A at {self.record.voltage_v[0]:.3f} V"
        if self._charged(begun, drops[0]):
            return self._full(begun, f"{said}, at rest {begun:.3f} V", None)
        typical_a = HISTORY_C_RATE * self.cell.capacity_ah
        history_v = self._drop(begun, typical_a, FLOWED_S[-1]) - self._drop(begun, typical_a, 0.0)
        since, at = [], []
        for before_s, drop in zip(FLOWED_S, drops, strict=True):
            spread = float(np.hypot(max(history_v, READING_V), DROP_ERROR * drop))
            if self._admits(first + drop, spread) or not before_s:
                since.append(before_s)
                at.append(self._reading(first + drop, spread))
        misfit = np.array([self._misfit(soc, b) for (soc, _), b in zip(at, since, strict=True)])
        weight = np.exp(-0.5 * (misfit - misfit.min()) / SHAPE_V**2)
        weight /= weight.sum()
        soc = float(weight @ [s for s, _ in at])
        sd = float(np.sqrt(weight @ [(s - soc) ** 2 + d**2 for s, d in at]))
        likelier = "as if the current began there" if weight[0] >= 0.5 else "as if it had flowed before"
        words = (
            f"{self.record.name} {said}, {likelier}: "
            f"state of charge {soc:.3f} +/- {sd:.3f}; give --soc0 if it is known."
        )
        return InitialState(self._declared(soc), sd, "load", words)

    def _charged(self, voltage_v: float, drop_v: float = 0.0) -> bool:
        """Is this rest voltage that of a full charge?  drop_v : of it is the model's, which may be far too much."""
        as_read = voltage_v - max(drop_v, 0.0)
        return voltage_v >= self.cell.upper_voltage_v - CHARGED_V and as_read <= self._highest() + BEYOND_V

    def _highest(self) -> float:
        return max(float(self.ocv[-1]), self.cell.upper_voltage_v)

    def _full(self, true_v: float, how: str, rest_v: float | None) -> InitialState:
        inside = float(np.interp(true_v, self.ocv, self.soc))
        sd = max(0.5 * (1.0 - inside), self._reading(float(np.interp(1.0, self.soc, self.ocv)), READING_V)[1])
        words = (
            f"{self.record.name} {how}, within {1e3 * CHARGED_V:.0f} mV of the upper cut-off "
            f"({self.cell.upper_voltage_v:g} V): a full charge, state of charge 1 +/- {sd:.4f} "
            f"(by the open-circuit voltage {inside:.4f})."
        )
        return InitialState(self._declared(1.0), sd, "full charge", words, rest_voltage_v=rest_v)

    def _reading(self, voltage_v: float, spread_v: float) -> tuple[float, float]:
        """State of charge of an open-circuit voltage, and half of what the voltage +/- `spread_v` spans."""
        if not self._admits(voltage_v, spread_v):
            low, high = np.interp([0.0, 1.0], self.soc, self.ocv)
            raise DataError(
                f"{self.record.name}: a rest voltage of {voltage_v:.4f} V lies outside [{low:.3f}, {high:.3f}] V, what "
                f"the open-circuit potentials and stoichiometry limits of {self.cell.name} allow; check that the "
                "record belongs to this cell, or give --soc0."
            )
        ends = np.interp([voltage_v - spread_v, voltage_v + spread_v], self.ocv, self.soc)
        sd = max(0.5 * float(ends[1] - ends[0]), GIVEN_SD)
        return float(np.interp(voltage_v, self.ocv, self.soc)), sd

    def _admits(self, voltage_v: float, spread_v: float) -> bool:
        """Is there a state of this cell that rests within two of the given deviations of the voltage?"""
        low, high = np.interp([0.0, 1.0], self.soc, self.ocv)
        beyond = max(BEYOND_V, 2.0 * spread_v)
        return bool(low - beyond <= voltage_v <= high + beyond)

    def _drop(self, voltage_v: float, current_a: float, before_s: float) -> float:
        """V between the open-circuit voltage and `voltage_v`, under a current that flows since `before_s`."""
        drop = 0.0
        for _ in range(ROUNDS):
            soc = float(np.interp(voltage_v + drop, self.ocv, self.soc))
            time = np.array([0.0, before_s]) if before_s else np.zeros(1)
            run = self._run(time, np.full(len(time), current_a), self._earlier(soc, current_a, before_s))
            drop = float(np.interp(soc, self.soc, self.ocv) - run[-1])
        return drop

    def _earlier(self, soc: float, current_a: float, before_s: float) -> float:
        return soc + current_a * before_s / SECONDS_PER_HOUR / self.cell.capacity_ah

    def _misfit(self, soc: float, before_s: float) -> float:
        """V**2: variance of the error over the first minutes, for a current that flows since `before_s`."""
        stop = int(np.searchsorted(self.record.time_s, self.record.time_s[0] + JUDGED_S, side="right"))
        rows = self.record.take(slice(0, min(stop, JUDGED_ROWS)))
        if len(rows) < 3:
            return 0.0
        time, current = rows.time_s - rows.time_s[0], rows.current_a
        if before_s:
            time = np.concatenate([[-before_s], time])
            current = np.concatenate([[self.current_a], current])
        voltage = self._run(time, current, self._earlier(soc, self.current_a, before_s))[-len(rows) :]
        return float(np.var(rows.voltage_v - voltage))

    def _run(self, time_s: Array, current_a: Array, soc: float) -> Array:
        kelvin = self._kelvin() - ZERO_CELSIUS_K
        run = simulate(
            self.cell, time_s, current_a, soc, (), kelvin, self.hold, on_depletion="clip", model=self.physics
        )
        return run.voltage_v

    def _declared(self, soc: float) -> float:
        """In the windows of the cell file, where effects moved them."""
        return same_rest(self.cell, self.declared, soc)


def _ocv(cell: Cell, soc: Array, kelvin: float) -> Array:
    rise = kelvin - cell.reference_temperature_k
    n, p = cell.negative, cell.positive
    theta_n = n.theta_min + soc * (n.theta_max - n.theta_min)
    theta_p = p.theta_max - soc * (p.theta_max - p.theta_min)
    return shifted_ocp(p, rise)(theta_p) - shifted_ocp(n, rise)(theta_n)


def calm_voltage_v(record: Measurement, limit_a: float) -> Array:
    """(k,) V of the rows before the current starts, at least the first and at most sixty."""
    calm = np.abs(record.current_a[:CALM_ROWS]) <= max(abs(float(record.current_a[0])), limit_a)
    n = len(calm) if calm.all() else max(1, int(np.argmin(calm)))
    return record.voltage_v[:n]


def moved_v(calm_v: Array) -> float:
    """V from the first quarter of a rest to its last; nought where the rows are too few to tell it from noise."""
    part = len(calm_v) // 4
    return float(calm_v[-part:].mean() - calm_v[:part].mean()) if part > 3 else 0.0


def freed_of_instruments(model: EspmModel, effects: Sequence[ActiveEffect], voltage_v: float) -> float:
    """A voltage without what instrument faults added to its reading."""
    true, one = np.array([voltage_v]), np.zeros(1)
    for active in effects:
        if active.effect.on_reading is not None:
            trace = Trace(model, one, one, np.array([voltage_v]), {})
            true = true - (active.effect.on_reading(trace, **active.parameters) - voltage_v)
    return float(true[0])
