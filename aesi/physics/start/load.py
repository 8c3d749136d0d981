"""State of charge of a record that starts under load: its current may have begun there, or long before.

    p(soc) ~ sum_h p_h N(V - V_h(soc); 0, n SHAPE_V**2 + DROP_ERROR**2 d' d'^T + C_h**2 g g^T)              (1)

V are n means over the first minutes, and V_h those of the model with state of charge soc in the first row. The current
before the record is unknown. History h assumes that there was none, or that for one of the times `FLOWED_S` the mean
current over as long a time after the first row flowed: the record's own currents are the best estimate of earlier ones.
C_h is the standard deviation of the earlier current about this mean, with one of `OTHER_C_RATES`; g is the after-effect
on the voltage of a current of 1C over that time. d is the distance of V_h below the open-circuit voltage, and d' is d
without its mean.

All rows may also be off by the same share of the mean of d, and by the error of the potentials. The shape of the
voltage does not show this error: it is added to the standard deviation of (1), by the potentials at both of its ends.
Where the model follows the record at no state, the errors in (1) are enlarged to the size of the residual. Double
layers are left out of g, as for rests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.rest.open_circuit import GIVEN_SD, OpenCircuit
from aesi.physics.simulation import ModelName, simulate
from aesi.records import Hold, Measurement

FLOWED_S = (0.0, 20.0, 200.0, 2000.0)
"""Times, s, for which the current may have flowed before the record: beyond the last, only the slowest drops still
grow."""
HISTORY_C_RATE = 0.25
"""C-rate of the current with which g of (1) is simulated."""
OTHER_C_RATES = (0.0, 0.25, 1.0, 4.0)
"""C_h of (1), C-rates, for a record of steady current: from slow discharges to pulses, as for the history of a rest."""
DROP_ERROR = 0.2
"""Relative standard deviation of the model's drop at the first row of a record."""
JUDGED_S = 300.0
"""Duration of the first part of a record that (1) uses, s, with at most JUDGED_ROWS rows."""
JUDGED_ROWS = 3000
SHAPE_V = 2e-3
"""Standard deviation of a model's error over the first minutes, without its mean; it does not average out over them.
Of 54 rows under load of nine measured records at 0 to 25 degC, by the file of their cell or another, the readings are
off by 1.5 points of charge and 0.57 of their deviations RMS, and by 1.9 deviations at most; with twice of it by 1.5
points and 0.51 deviations, with half of `DROP_ERROR` by 1.4 points and 0.67 deviations."""
JUDGED_PARTS = 8
"""Number of parts of the first minutes whose means (1) uses. The first is one row, and each is longer than the one
before, since the voltage relaxes ever more slowly."""
NODES = 13
MORE_NODES = 6
TURNS = 3
"""Numbers of states of charge at which the model is simulated: NODES from empty to full, denser near both ends, then
MORE_NODES where (1) is most likely, in each of TURNS rounds."""
BETWEEN = 12
"""Number of states of charge between two nodes at which (1) is evaluated."""
ROUNDS = 4
"""Fixed-point iterations of drop and state of charge; the drop depends little on the state of charge."""
FLOWS = np.concatenate([[0.0], np.geomspace(0.02, 1.0, 8)])
LINGERS = np.geomspace(1e-4, 1.0, 40)
"""Rows at which g is simulated, as shares of the time for which its current flows, and of the time of the record."""


@dataclass(frozen=True, eq=False)
class _FirstMinutes:
    """The first minutes of a record.

    rows : the first rows.  average : (p, n) weights of the means over p parts.  seen_v : (p,) V, means of the voltage
    without instrument faults and effects in series.  moved : (p,) share of the capacity discharged since the first row.
    """

    rows: Measurement
    average: Array
    seen_v: Array
    moved: Array

    @property
    def time_s(self) -> Array:
        """(n,) s since the first row."""
        return np.asarray(self.rows.time_s - self.rows.time_s[0])


@dataclass(frozen=True)
class _History:
    """A history h of (1).  kind : number of its time in `FLOWED_S`, without the first.  began : True where the mean
    current before the record is zero.  prior : p_h.  sd : C_h."""

    kind: int
    began: bool
    prior: float
    sd: float


class LoadedStart:
    """The first minutes of a record under load, simulated by `model`."""

    def __init__(self, open_circuit: OpenCircuit, record: Measurement, hold: Hold, model: ModelName) -> None:
        self.open_circuit, self.record, self.hold, self.model = open_circuit, record, hold, model
        self.cell = open_circuit.cell
        self.current_a = float(record.current_a[0])

    def state_of_charge(self, first_v: float) -> tuple[float, float, bool]:
        """(mean state of charge by (1), its standard deviation, True where the current more likely began with the
        record).

        first_v : first voltage without effects in series and instrument faults, V.
        Raises DataError where this belongs to no state of the cell.
        """
        likely = [self._by_first(first_v), *(self._flowed_since(first_v, b) for b in FLOWED_S[1:])]
        minutes, histories, before_a = self._first_minutes(first_v), self._histories(), self._before_a()
        low, high = float(self.open_circuit.soc[0]), float(self.open_circuit.soc[-1])
        across = 0.5 * (low + high - (high - low) * np.cos(np.linspace(0.0, np.pi, NODES)))
        new = np.concatenate([across, likely])
        simulated: dict[float, Array] = {}
        for _ in range(TURNS):
            simulated |= {float(node): self._simulated(minutes, before_a, float(node)) for node in new}
            nodes = np.array(sorted(simulated))
            soc = np.interp(
                np.arange(0.0, len(nodes) - 1 + 0.5 / BETWEEN, 1.0 / BETWEEN), np.arange(len(nodes)), nodes
            )
            model_v = _between(soc, nodes, np.array([simulated[node] for node in nodes.tolist()]))
            weight = self._likelihood(minutes, histories, soc, model_v) * np.gradient(soc)[:, None]
            weight /= weight.sum()
            of_soc = weight.sum(axis=1)
            below = np.cumsum(of_soc) - 0.5 * of_soc
            new = np.interp(np.linspace(0.0, 1.0, MORE_NODES + 2)[1:-1], below, soc)
        mean = float(of_soc @ soc)
        variance = float(of_soc @ (soc - mean) ** 2)
        levels_v = model_v[:, : len(FLOWED_S)].mean(axis=2)
        levels_v = levels_v[:, [0 if h.began else 1 + h.kind for h in histories]]
        doubt_v = DROP_ERROR * float(np.sqrt((weight * levels_v**2).sum()))
        spread_v = float(np.hypot(self.open_circuit.potentials_v, doubt_v))
        least, most = self.open_circuit.ends(self.open_circuit.voltage_at(mean), 0.5 * spread_v)
        began = weight.sum(axis=0) @ [h.began for h in histories]
        sd = float(np.hypot(np.sqrt(variance), 0.5 * (most - least)))
        return mean, max(sd, GIVEN_SD), bool(began >= 0.5)

    def drop(self, voltage_v: float, current_a: float, before_s: float) -> float:
        """Voltage drop of the model below the open-circuit voltage, V, for a terminal voltage `voltage_v` and a current
        that has flowed for `before_s`."""
        drop = 0.0
        for _ in range(ROUNDS):
            soc = self.open_circuit.soc_at(voltage_v + drop)
            time = np.array([0.0, before_s]) if before_s else np.zeros(1)
            voltage = self._run(time, np.full(len(time), current_a), soc + self._moved(current_a, before_s))
            drop = self.open_circuit.voltage_at(soc) - float(voltage[-1])
        return drop

    def _by_first(self, first_v: float) -> float:
        """State of charge by the first voltage, for a current that began with the record."""
        drop = self.drop(first_v, self.current_a, 0.0)
        typical_a = HISTORY_C_RATE * self.cell.capacity_ah
        begun = first_v + drop
        history_v = self.drop(begun, typical_a, FLOWED_S[-1]) - self.drop(begun, typical_a, 0.0)
        spread_v = float(np.hypot(max(history_v, self.open_circuit.potentials_v), DROP_ERROR * drop))
        return self.open_circuit.reading(begun, spread_v)[0]

    def _flowed_since(self, first_v: float, before_s: float) -> float:
        return self.open_circuit.soc_at(first_v + self.drop(first_v, self.current_a, before_s))

    def _first_minutes(self, first_v: float) -> _FirstMinutes:
        stop = int(np.searchsorted(self.record.time_s, self.record.time_s[0] + JUDGED_S, side="right"))
        rows = self.record.take(slice(0, min(stop, JUDGED_ROWS)))
        average = _longer_and_longer(len(rows))
        moved = rows.discharged_ah(self.hold) / self.cell.capacity_ah
        return _FirstMinutes(
            rows, average, average @ (rows.voltage_v - rows.voltage_v[0]) + first_v, average @ moved
        )

    def _before_a(self) -> Array:
        """(b,) A, mean current over each of the times `FLOWED_S` after the first row, or over the record if shorter."""
        passed = self.record.time_s - self.record.time_s[0]
        if len(passed) == 1:
            return np.full(len(FLOWED_S), self.current_a)
        over_s = np.clip(FLOWED_S, passed[1], passed[-1])
        return np.asarray(
            np.interp(over_s, passed, self.record.discharged_ah(self.hold)) / over_s * SECONDS_PER_HOUR
        )

    def _histories(self) -> list[_History]:
        passed = self.record.time_s - self.record.time_s[0]
        found = []
        for kind, flowed_s in enumerate(FLOWED_S[1:]):
            own = float(self.record.current_a[passed <= flowed_s].std()) / self.cell.capacity_ah
            for c_rate in OTHER_C_RATES:
                sd = float(np.hypot(own, c_rate))
                # No current before has the same prior as each of the times.
                found.append(_History(kind, True, 1.0 / len(FLOWED_S[1:]), sd))
                found.append(_History(kind, False, 1.0, sd))
        return found

    def _likelihood(
        self, minutes: _FirstMinutes, histories: Sequence[_History], soc: Array, model_v: Array
    ) -> Array:
        """(s, h) terms of (1), relative to the largest.  model_v : (s, 2 b, p) V, d and g, see `_simulated`."""
        drops, left = model_v[:, : len(FLOWED_S)], model_v[:, len(FLOWED_S) :]
        parts = left.shape[2]
        ocv = np.interp(soc[:, None] - minutes.moved, self.open_circuit.soc, self.open_circuit.ocv)
        squares, nats = np.empty((2, len(soc), len(histories)))
        for h, history in enumerate(histories):
            drop = drops[:, 0 if history.began else 1 + history.kind]
            doubts = [
                DROP_ERROR * (drop - drop.mean(axis=1, keepdims=True)),
                history.sd * left[:, history.kind],
            ]
            off = minutes.seen_v - (ocv - drop)
            squares[:, h], logdet = _squares_and_logdet(off, np.stack(doubts, axis=2), parts * SHAPE_V**2)
            nats[:, h] = np.log(history.prior) - 0.5 * logdet
        nats -= 0.5 * squares / max(1.0, float(squares.min()) / parts)
        return np.asarray(np.exp(nats - nats.max()))

    def _simulated(self, minutes: _FirstMinutes, before_a: Array, soc: float) -> Array:
        """(2 b, p) V: d of (1) for each of `FLOWED_S`, and g for all but the first.

        before_a : (b,) A, mean current before the record over each of these times.
        """
        ocv = np.interp(soc - minutes.moved, self.open_circuit.soc, self.open_circuit.ocv)
        times = zip(FLOWED_S, before_a, strict=True)
        drops = [ocv - minutes.average @ self._since(minutes, flowed_s, a, soc) for flowed_s, a in times]
        left = [minutes.average @ self._left_of(soc, flowed_s, minutes.time_s) for flowed_s in FLOWED_S[1:]]
        return np.array([*drops, *left])

    def _since(self, minutes: _FirstMinutes, flowed_s: float, before_a: float, soc: float) -> Array:
        """(n,) V of the model at the rows, after a current of `before_a` for `flowed_s` before the first row."""
        # The current cannot have flowed for longer than since the cell was full, or empty.
        rate = before_a / SECONDS_PER_HOUR / self.cell.capacity_ah
        if flowed_s and rate:
            flowed_s = min(flowed_s, max(((1.0 if rate > 0.0 else 0.0) - soc) / rate, 1.0))
        step_s = float(minutes.time_s[1]) if len(minutes.time_s) > 1 else flowed_s
        earlier = np.array([-flowed_s, -step_s] if step_s < flowed_s else [-flowed_s] if flowed_s else [])
        current_a = np.full(len(earlier), before_a if step_s < flowed_s else self.current_a)
        time = np.concatenate([earlier, minutes.time_s])
        current = np.concatenate([current_a, minutes.rows.current_a])
        whole = Measurement(time, current, np.zeros(len(time)))
        moved = float(whole.discharged_ah(self.hold)[len(earlier)]) / self.cell.capacity_ah
        return self._run(time, current, soc + moved)[len(earlier) :]

    def _left_of(self, soc: float, flowed_s: float, time_s: Array) -> Array:
        """(n,) V per C-rate, g of (1), at times after its current stopped."""
        cell = self.cell.with_negative(double_layer_f_m2=0.0).with_positive(double_layer_f_m2=0.0)
        # It comes from the middle of the range, so that it does not begin beyond full or empty.
        rate = HISTORY_C_RATE if soc < 0.5 else -HISTORY_C_RATE
        current_a = rate * self.cell.capacity_ah
        after = max(float(time_s[-1]), 1.0) * LINGERS
        time = np.concatenate([flowed_s * FLOWS, flowed_s + after])
        current = np.where(time <= flowed_s, current_a, 0.0)
        voltage = self._run(time, current, soc + self._moved(current_a, flowed_s), cell, "backward")
        away = (voltage[len(FLOWS) :] - self.open_circuit.voltage_at(soc)) / rate
        return np.interp(time_s, after, away)

    def _moved(self, current_a: float, for_s: float) -> float:
        return current_a * for_s / SECONDS_PER_HOUR / self.cell.capacity_ah

    def _run(
        self, time_s: Array, current_a: Array, soc: float, cell: Cell | None = None, hold: Hold | None = None
    ) -> Array:
        degc = self.open_circuit.kelvin - ZERO_CELSIUS_K
        run = simulate(
            cell or self.cell,
            time_s,
            current_a,
            soc,
            (),
            degc,
            hold or self.hold,
            on_depletion="clip",
            model=self.model,
        )
        return run.voltage_v


def _longer_and_longer(rows: int) -> Array:
    """(p, rows) weights of means over p parts, the first of one row, the lengths of the others in a geometric
    series."""
    starts = np.unique(np.append(0, np.geomspace(1.0, max(rows, 1), JUDGED_PARTS + 1)[:-1].astype(int)))
    starts = starts[starts < rows]
    part = np.searchsorted(starts, np.arange(rows), side="right") - 1
    of_part = part == np.arange(len(starts))[:, None]
    return np.asarray(of_part / of_part.sum(axis=1, keepdims=True))


def _between(soc: Array, nodes: Array, values: Array) -> Array:
    """(s, ...) values at states of charge (s,), interpolated linearly between values (n, ...) at the nodes (n,)."""
    columns = values.reshape(len(nodes), -1)
    between = np.column_stack([np.interp(soc, nodes, column) for column in columns.T])
    return between.reshape(len(soc), *values.shape[1:])


def _squares_and_logdet(off: Array, doubts: Array, variance: float) -> tuple[Array, Array]:
    """((s,) off' C^-1 off, (s,) log |C|) for C = variance I + doubts doubts'.  off : (s, p).  doubts : (s, p, k).

    It uses the singular values of the doubts, since C cannot be inverted numerically where they are large: the formula
    of a potential may rise by 1e9 V beyond full.
    """
    across, size, _ = np.linalg.svd(doubts, full_matrices=False)
    along = (across * off[:, :, None]).sum(axis=1)
    rest = off - (across * along[:, None, :]).sum(axis=2)
    doubtful = variance + size**2
    squares = (rest**2).sum(axis=1) / variance + (along**2 / doubtful).sum(axis=1)
    logdet = (off.shape[1] - size.shape[1]) * np.log(variance) + np.log(doubtful).sum(axis=1)
    return np.asarray(squares), np.asarray(logdet)
