"""Voltage with what effects in series add and instruments make of it; a first voltage freed of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aesi.numerics.typing import Array
from aesi.physics.effect import ActiveEffect, Record, Trace, check_states
from aesi.physics.model import EspmModel
from aesi.physics.rest.open_circuit import OpenCircuit

CALM_ROWS = 60
"""Number of first rows of a rest that show where a charge has ended."""
MOVING_V = 4e-3
"""Change over these rows, V, above which only the last of them are used. A convention: a full cell falls by 6 to
30 mV."""

ROUNDS = 4
"""Fixed-point iterations of a voltage in series, which depends little on the state of charge, and of a reading, which
is nearly the voltage."""
ROUND_OFF_V = 1e-12
"""Difference of two voltages that is round-off: a reading is reproduced within it."""


def first_rows_v(rest_v: Array) -> float:
    """Voltage at the start of a rest, V: the mean of its first rows, or of their last quarter where it changes."""
    calm = rest_v[:CALM_ROWS]
    part = len(calm) // 4
    moved = float(calm[-part:].mean() - calm[:part].mean()) if part > 3 else 0.0
    return float((calm[-part:] if abs(moved) > MOVING_V else calm).mean())


def freed_of_instruments(
    open_circuit: OpenCircuit,
    model: EspmModel,
    effects: Sequence[ActiveEffect],
    reading_v: float,
    current_a: float = 0.0,
) -> float:
    """The terminal voltage in the first row, V, of which instrument faults make `reading_v`.

    Arguments as of `freed_of_series`.
    """
    faulty = any(active.effect.on_reading is not None for active in effects)
    terminal_v = reading_v
    for _ in range(ROUNDS if faulty else 0):
        cell_v = freed_of_series(open_circuit, model, effects, terminal_v, current_a)
        _, states = _with_series(open_circuit, model, effects, cell_v, current_a)
        read = as_read(model, effects, _first_row(current_a), np.array([terminal_v]), states)
        off_v = float(read[0]) - reading_v
        if abs(off_v) < ROUND_OFF_V:
            break
        terminal_v -= off_v
    return terminal_v


def freed_of_series(
    open_circuit: OpenCircuit,
    model: EspmModel,
    effects: Sequence[ActiveEffect],
    terminal_v: float,
    current_a: float = 0.0,
) -> float:
    """The first terminal voltage without the voltage of effects in series with the cell (a hysteresis), V.

    open_circuit : of the model's cell.  current_a : in this row, A.
    """
    series = any(active.effect.on_voltage is not None for active in effects)
    cell_v = terminal_v
    for _ in range(ROUNDS if series else 0):
        with_series_v, _ = _with_series(open_circuit, model, effects, cell_v, current_a)
        cell_v = terminal_v - (with_series_v - cell_v)
    return cell_v


def _with_series(
    open_circuit: OpenCircuit,
    model: EspmModel,
    effects: Sequence[ActiveEffect],
    cell_v: float,
    current_a: float,
) -> tuple[float, dict[str, Array]]:
    """(voltage of the cell, at `cell_v` by itself, with what effects in series add at the start of a record, V; its
    states and theirs, (1,) each)."""
    cell, soc = model.cell, open_circuit.soc_at(cell_v)
    theta_n, theta_p = cell.stoichiometries(soc)
    states = {
        "c_sp": theta_p * cell.positive.c_max_mol_m3,
        "c_sn": theta_n * cell.negative.c_max_mol_m3,
        "c_e0": cell.electrolyte.c0_mol_m3,
        "c_eL": cell.electrolyte.c0_mol_m3,
        "soc": soc,
        "temperature_k": open_circuit.kelvin,
    }
    series = {name: np.array([value]) for name, value in states.items()}
    voltage = with_effects_in_series(model, effects, _first_row(current_a), np.array([cell_v]), series)
    return float(voltage[0]), series


def _first_row(current_a: float) -> Record:
    return Record(np.zeros(1), np.array([current_a]))


def with_effects_in_series(
    model: EspmModel,
    effects: Sequence[ActiveEffect],
    record: Record,
    voltage: Array,
    series: dict[str, Array],
    backward: bool = False,
) -> Array:
    """(n,) V at the terminals: the model's voltage with all voltage effects added.

    series : dict to which the states of these effects are added.  backward : as of a `Trace`.
    """
    for active in effects:
        if active.effect.on_voltage is not None:
            trace = Trace(model, record.time_s, record.current_a, voltage, series, backward)
            added = active.act(active.effect.on_voltage, trace)
            check_states(active.effect, added, trace)
            voltage = voltage + added.voltage_v
            series.update(added.series)
    return voltage


def as_read(
    model: EspmModel,
    effects: Sequence[ActiveEffect],
    record: Record,
    voltage: Array,
    series: Mapping[str, Array],
    backward: bool = False,
) -> Array:
    """(n,) V, the terminal voltage as the instrument records it.  record : one row per reading."""
    for active in effects:
        if active.effect.on_reading is not None:
            trace = Trace(model, record.time_s, record.current_a, voltage, series, backward)
            voltage = active.act(active.effect.on_reading, trace)
    return voltage
