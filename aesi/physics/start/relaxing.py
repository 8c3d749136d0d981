"""The voltage to which a cell relaxes, from a record that begins with a rest of unknown length and history.

    V(t) = U + a g(t) + e,     a ~ N(0, C**2),     e ~ N(0, RELAXED_SHAPE_V**2 + (RELAXED_SHAPE (V - V_last))**2)  (1)

g is the distance of the model's voltage from rest, per C-rate, after a history: a current that flowed for one of
several times and stopped one of several times before the record. C is one of several C-rates. U is averaged over these
histories, weighted by how well each explains the means of the rest over equal parts. Its uncertainty has two parts: the
posterior over the histories, and the error of the shape for the relaxation still to come. With one row only the
histories remain. Double layers are left out of g: they relax within a second, and the charge that they take is lost to
the particles for good.

g is simulated with a small current, and is proportional to the current where kinetics and diffusion are linear. In the
cold they are not, and a drive has many currents: hence the errors in proportion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aesi.constants import SECONDS_PER_HOUR, ZERO_CELSIUS_K
from aesi.numerics.blocks import block_means
from aesi.numerics.typing import Array
from aesi.physics.record_checks import ROWS_APART
from aesi.physics.rest.open_circuit import OpenCircuit
from aesi.physics.simulation import ModelName, simulate
from aesi.physics.start.load import FLOWED_S, FLOWS, HISTORY_C_RATE, OTHER_C_RATES
from aesi.records import Hold, Measurement

C_RATE_SDS = OTHER_C_RATES[1:]
"""C of (1): from slow discharges to pulses. On 62 rests of `aesi bench start --set cuts=60 --set seed=1` the readings
are off by 0.44 points of charge RMS with the three, 0.44 and 0.45 with the first and the second alone, and 1.11 where
the voltage is taken as it stands; six of a drive by 1.1 of the deviations that they claim at most, 2.2 and 2.5."""
STOPPED_S = (0.0, 2.0, 20.0, 200.0, 2000.0)
"""Times before the record at which the current may have stopped, s: decades, as in `FLOWED_S`, since relaxation slows
down with time."""
RELAXED_SHAPE_V = 5e-4
"""Standard deviation of a model's error over one part of a rest, without its mean. With a fifth, twice and four times
of it those readings are off by 0.44, 0.44 and 0.45 points."""
RELAXED_SHAPE = 0.1
TO_COME = 0.3
"""The same, relative to the distance of a part from the last voltage (RELAXED_SHAPE) and to the relaxation still to
come (TO_COME). On rests of 100, 300 and 1000 s after drives and steady currents of four cells with their own file, at 0
and -10 degC, readings are off by 0.9, 1.2 and 0.8 deviations RMS and 2.5, 1.6 and 0.7 points, at 25 degC by 0.8, 0.6
and 0.6 deviations; with 0.03 and 0.1 by 1.7, 2.2 and 1.3 deviations and 3.6, 1.7 and 0.7 points, and by 2.0, 1.3 and
0.9; without either by 3.7, 4.9 and 1.9 deviations and 4.0, 2.2 and 0.7 points. The 62 measured rests are off by 0.46
points with and without."""
PARTS = 8
"""Number of equal parts of a rest whose means are used; rows where there are fewer."""
UNKNOWN_V = 1.0
"""Prior standard deviation of U about the last voltage of the rest, V."""


@dataclass(frozen=True, eq=False)
class Rest:
    """The rest at the beginning of a record.

    rows : those before a load starts, without the ROWS_APART of them whose voltage may be that of the load already, or
    before a small current has changed the state of charge; at least the first.
    flows : True where a small current goes on after these rows, and has probably flowed before them.
    """

    rows: Measurement
    flows: bool


def resting_rows(record: Measurement, limit_a: float, most_ah: float, hold: Hold) -> Rest:
    """The rest at the beginning of a record.

    limit_a : current below which a cell rests, A.  most_ah : largest charge, in either direction, that its rows may
    move, Ah.  hold : how the current runs between rows.
    """
    current = np.abs(record.current_a)
    small = current <= max(float(current[0]), limit_a)
    one_state = np.abs(record.discharged_ah(hold)) <= most_ah
    both = small & one_state
    n = len(record) if both.all() else int(np.argmin(both))
    flows = n < len(record) and bool(small[n])
    if n < len(record) and not flows:
        n = max(n - ROWS_APART, 1)
    return Rest(record.take(slice(0, n)), flows)


def settled_voltage(open_circuit: OpenCircuit, rest: Measurement, model: ModelName) -> tuple[float, float]:
    """(U of (1), its standard deviation), V.

    rest : rows without a current.  model : with which g is simulated.
    """
    starts = np.linspace(0, len(rest), min(PARTS, len(rest)) + 1).astype(int)[:-1]
    last = float(rest.voltage_v[starts[-1] :].mean())
    seen = block_means(rest.voltage_v - last, starts)
    histories = list(_histories(open_circuit, rest.time_s - rest.time_s[0], open_circuit.soc_at(last), model))
    shape_v = np.hypot(RELAXED_SHAPE_V, RELAXED_SHAPE * seen)
    found = [
        _explained(seen, block_means(away, starts), rate_sd, shape_v)
        for away in histories
        for rate_sd in C_RATE_SDS
    ]
    nats, to_come, variance = (np.array(column) for column in zip(*found, strict=True))
    variance += (TO_COME * to_come) ** 2
    # A voltage at which the cell cannot rest is discarded: 8 s of a drive of an LFP cell were to relax to 20 V.
    outside_v = last + to_come - np.clip(last + to_come, open_circuit.ocv[0], open_circuit.ocv[-1])
    nats -= 0.5 * outside_v**2 / (variance + open_circuit.potentials_v**2)
    weight = np.exp(nats - nats.max())
    weight /= weight.sum()
    mean = float(weight @ to_come)
    return last + mean, float(np.sqrt(weight @ (variance + (to_come - mean) ** 2)))


def _explained(seen: Array, away: Array, rate_sd: float, shape_v: Array) -> tuple[float, float, float]:
    """(log likelihood of one history for the means over parts of a rest, nats; mean of U, V; variance of U, V**2).

    seen : (p,) V, the means relative to the last voltage.  away : (p,) V per C-rate, means of g of (1) for this
    history.  shape_v : (p,) V, standard deviations of e.
    """
    slopes = np.column_stack([np.ones(len(seen)), away]) / shape_v[:, None]
    prior = np.diag([UNKNOWN_V**-2, rate_sd**-2])
    covariance = np.linalg.inv(slopes.T @ slopes + prior)
    best = covariance @ slopes.T @ (seen / shape_v)
    left = seen / shape_v - slopes @ best
    volume = np.linalg.slogdet(covariance)[1] - 2.0 * np.log(rate_sd)
    return 0.5 * float(volume - left @ left - best @ prior @ best), float(best[0]), float(covariance[0, 0])


def _histories(open_circuit: OpenCircuit, time_s: Array, soc: float, model: ModelName) -> Iterator[Array]:
    """(n,) V per C-rate, g of (1) at the rows of a rest, for each history."""
    # With the charge of its double layers a cell rests away from the open-circuit voltage of its state of charge, and
    # far away where that is steep: layers of 7 and 11 F/m2 made 60 mV of 20 s of C/4 at a full LFP cell, and of a rest
    # that is constant within 0.2 mV a state of charge of 0.996 +/- 0.48.
    whole = open_circuit.cell
    cell = whole.with_negative(double_layer_f_m2=0.0).with_positive(double_layer_f_m2=0.0)
    # The history comes from the middle of the range, so that it does not begin beyond full or empty.
    rate = HISTORY_C_RATE if soc < 0.5 else -HISTORY_C_RATE
    current_a = rate * cell.capacity_ah
    after = np.geomspace(0.1, STOPPED_S[-1] + max(float(time_s[-1]), 1.0), 60)
    for flowed_s in FLOWED_S[1:]:
        time = np.concatenate([flowed_s * FLOWS, flowed_s + after])
        current = np.where(time <= flowed_s, current_a, 0.0)
        before = soc + current_a * flowed_s / SECONDS_PER_HOUR / cell.capacity_ah
        degc = open_circuit.kelvin - ZERO_CELSIUS_K
        run = simulate(cell, time, current, before, (), degc, "backward", on_depletion="clip", model=model)
        away = (run.voltage_v - open_circuit.voltage_at(float(run.series["soc"][-1]))) / rate
        for stopped_s in STOPPED_S:
            yield np.interp(flowed_s + stopped_s + time_s, time, away)
