"""`simulate`: current in, voltage and internal states out, by one of two models of the same cell.

"espm", the default, is the extended single-particle model: solid diffusion in one particle an electrode, electrolyte
diffusion through the three layers, Butler-Volmer kinetics averaged over each electrode with the surface and local
electrolyte concentrations, electrolyte potential with the conductivity at the mean concentration, ohmic drop of the
solid. It is the SPMe of Marquis et al., J. Electrochem. Soc. 166 (2019) A3693, doi:10.1149/2.0341915jes.
"dfn" is the porous electrode, see `aesi.physics.dfn`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from sys import float_info
from typing import Literal

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.errors import DataError, InputError, NoNumberError, SimulationError
from aesi.numerics.typing import Array, IntArray, Numbers
from aesi.over_time import stamp
from aesi.physics.arguments import (
    FARTHEST_SOC,
    check_cell,
    check_choice,
    check_temperature,
    checked_effects,
    checked_soc,
    checked_volts,
)
from aesi.physics.balance import same_rest
from aesi.physics.cell import Cell
from aesi.physics.depletion import depletion_sentence
from aesi.physics.effect import (
    ActiveEffect,
    Record,
    as_cell_saw,
    instruments_first,
    materials_first,
)
from aesi.physics.espm.plain import run_plain
from aesi.physics.model import EspmModel, SolvedRows, of_record
from aesi.physics.rest.open_circuit import OpenCircuit
from aesi.physics.rest.voltage import as_read, freed_of_instruments, freed_of_series, with_effects_in_series
from aesi.records import Hold, Run
from aesi.records.checked import check_row, check_times, numbers, of_columns

ModelName = Literal["espm", "dfn"]
"""Name of the model that is solved. The argument is `model` in public functions, and `model_name` in functions where
`model` is an `EspmModel`, the parameters that either solver takes."""
MODEL_WORDS: Mapping[str, str] = {"espm": "the single particle (espm)", "dfn": "the porous electrode (dfn)"}
"""How reports call the models."""
OnDepletion = Literal["raise", "clip"]
MOST_ROWS = 20_000
"""Longest record, rows, whose solutions are cached; longer ones would fill the memory."""
Solution = tuple[Array, dict[str, Array], int, int]
"""The result of a solver: (rows, further, fault_at, fault).

rows : (7, n), `SolvedRows`.  further : other states by name, (n,) each.  fault_at : first row at
which lithium or salt has run out, -1 for none.  fault : which one, as `depletion_sentence` takes it.
"""


@of_columns
def simulate(
    cell: Cell,
    time_s: Numbers,
    current_a: Numbers,
    soc0: float | None = None,
    effects: Iterable[ActiveEffect] = (),
    temperature_degc: Numbers | None = None,
    hold: Hold = "linear",
    *,
    rest_voltage_v: float | None = None,
    on_depletion: OnDepletion = "raise",
    model: ModelName = "espm",
    profiles: bool = False,
    unresolved_heat_w: Numbers | None = None,
) -> Run:
    """Terminal voltage and states of `cell` under a current.

    time_s : (n,) s, strictly increasing, any sampling.  current_a : (n,) A, positive on discharge.
    soc0 : state of charge at rest before the first sample, 0 to 1, in the declared stoichiometry windows. Where an
    effect moves the windows, the cell starts from the same rest voltage in the new ones. None reads it from
    `rest_voltage_v` (V), as `initial_state` does for a cell at rest: within `CHARGED_V` below the upper cut-off voltage
    the cell is full.
    effects : active effects in addition to the cell file. Instrument faults act first, then functions of an electrode's
    stoichiometry (U(x), D(x)), then the others in the order given.
    temperature_degc : (n,) or one value, degC, of the cell's case; the winding follows it (see
    `aesi.physics.model.of_record`) and is warmer under load at one value, too, where the file has a thermal
    conductivity. None takes the cell file's initial temperature for the winding, or the heat balance of an effect.
    hold : "linear" joins the samples by straight lines; "backward" holds each row's value since the row before.
    on_depletion : action where a surface stoichiometry leaves [0, 1] or the electrolyte runs dry. "raise" raises
    SimulationError. "clip" (for searches) holds the kinetics at the limit, continues open-circuit potentials with 10 V
    per unit of stoichiometry, and sets `series["depleted"]` to 1 from the first such sample on.
    model : "espm", one particle per electrode, or "dfn", the porous electrode; the same effects act on both. The
    default is "espm" even for a cell whose file was fitted with "dfn" (`Cell.fitted_with`); the commands follow the
    file.
    profiles : "dfn" only: whether to return profiles across the electrodes, see `Run.profiles`.
    unresolved_heat_w : (n,) W, for rows that are averages: heat that the swing of current and voltage between them
    releases beyond that of the averages, as a mean over the step to each row (the first ends none; see
    `aesi.data.thinning.Averaged.unresolved_heat_w`). It adds to the heat of the model where the winding has a heat
    balance, and does nothing elsewhere.

    Returns a Run with series c_sp, c_sn (mol/m3), c_e0, c_eL (mol/m3), soc, temperature_k.
    Raises SimulationError with time and electrode where the cell runs out, or where a clipped simulation has no
    solution; DataError for arrays that cannot be simulated, and for a rest voltage that no state of the cell has;
    InputError for an unknown model, hold or on_depletion, for a wrong type of cell, effect, state of charge, rest
    voltage or temperature, for both soc0 and rest_voltage_v, and for an effect that the model already contains;
    CellError for a potential, a rate or a film that the models cannot tabulate, and for an effect that needs a value
    which the cell's file does not declare.
    """
    check_cell(cell)
    check_choice("hold", hold, Hold)
    check_choice("on_depletion", on_depletion, OnDepletion)
    # A search may try states that no cell has.
    soc0 = checked_soc(soc0, farthest=FARTHEST_SOC if on_depletion == "raise" else float_info.max)
    time, current = _checked_record(time_s, current_a)
    active = instruments_first(checked_effects(effects))
    profile_arrays: dict[str, Array] = {}
    solve = solver(model, profile_arrays if profiles else None)
    changed = model_with(cell, active)
    record = as_cell_saw(Record(time, current, _kelvin(temperature_degc, time)), active)
    if unresolved_heat_w is not None:
        record = replace(record, unresolved_heat_w=_checked_heat(unresolved_heat_w, time))
    if soc0 is None:
        soc0 = _soc_from_rest(changed, active, record.temperature_k, rest_voltage_v)
    elif rest_voltage_v is not None:
        raise InputError("soc0 and rest_voltage_v both say where the cell starts; give one of them.")
    else:
        soc0 = same_rest(cell, changed.cell, soc0)
    backward = hold == "backward"
    # A clock or lag effect reads the voltage between the rows of the current, at rows of their own.
    taken: Record
    written: slice | IntArray  # rows of the solution at which the voltage was read
    taken, written = (record, slice(None)) if record.read_s is None else record.with_readings(backward)
    if profiles or len(taken.time_s) > MOST_ROWS:
        rows, further, fault_at, fault = solved(solve, changed, taken, soc0, hold)
    else:
        cached = _cached_solution(model, changed, _KeyedRecord.of(taken), soc0, hold)
        rows, further, fault_at, fault = _copied(cached)
    series = _series(changed.cell, rows) | further
    written_at = -1 if fault_at < 0 else int(np.searchsorted(np.arange(len(taken.time_s))[written], fault_at))
    if fault_at >= 0 and on_depletion == "raise":
        kelvin, read_a = float(further["temperature_k"][fault_at]), taken.current_a[written]
        raise SimulationError(
            depletion_sentence(changed, time, read_a, kelvin, rows[:, written], written_at, fault)
        )
    if on_depletion == "clip":
        series["depleted"] = _depleted(fault_at, len(taken.time_s))
    voltage = with_effects_in_series(changed, active, taken, rows[0], series, backward)[written]
    series = {name: values[written] for name, values in series.items()}
    profile_arrays = {  # those of one dimension are positions
        name: values[written] if values.ndim == 2 else values for name, values in profile_arrays.items()
    }
    read = record.beside_voltage(backward)
    voltage = _writable(as_read(changed, active, read, voltage, series, backward))
    _check_finite(time, voltage, written_at)
    return Run(time, current, voltage, series, profile_arrays, hold)


def model_with(cell: Cell, effects: Iterable[ActiveEffect]) -> EspmModel:
    """The model of `cell` with the effects applied, in the order of `materials_first`."""
    return _model_with(cell, materials_first(effects))


@lru_cache(maxsize=128)
def _model_with(cell: Cell, effects: tuple[ActiveEffect, ...]) -> EspmModel:
    model = EspmModel(cell)
    for active in effects:
        if active.effect.on_model is not None:
            model = _with_effect(model, active)
    return model


@lru_cache(maxsize=256)
def _with_effect(model: EspmModel, active: ActiveEffect) -> EspmModel:
    """The model with one effect applied. Cached: the records of a case share all effects but the last."""
    assert active.effect.on_model is not None
    return active.act(active.effect.on_model, model)


Solver = Callable[[EspmModel, Array, Array, Array | None, float, Hold, Array | None], Solution]
"""(model, time, current, temperature or None, soc0, hold, unresolved heat or None) -> the solution, of a model as
`of_record` gives it."""


def solver(model_name: str, profiles: dict[str, Array] | None = None) -> Solver:
    """The solver of the model of that name. It is imported, and its compiled code loaded, at the first use.

    profiles : a dict that the solver fills with the arrays of `Run.profiles`.  Raises InputError for an unknown name.
    """
    if model_name == "espm":
        if profiles is not None:
            raise InputError("profiles across the electrodes are of the porous electrode; use model='dfn'.")
        return _run_espm
    if model_name == "dfn":
        from aesi.physics.dfn.run import run_porous_electrode

        return partial(run_porous_electrode, profiles=profiles)
    raise InputError(
        f"there is no model {model_name!r}; give 'espm' (single particle) or 'dfn' (porous electrode)."
    )


def solved(solve: Solver, model: EspmModel, record: Record, soc0: float, hold: Hold) -> Solution:
    """One solution. Where the temperature of the case was measured, the winding follows it (`of_record`); a constant
    column becomes the initial temperature of the cell."""
    temperature = record.temperature_k
    model = of_record(model, temperature is not None)
    if temperature is not None and np.ptp(temperature) == 0.0:
        model = model.with_cell(initial_temperature_k=float(temperature[0]))
        if model.heat is None:
            temperature = None
    warm = None if temperature is None else _writable(temperature)
    heat_w = None if record.unresolved_heat_w is None else _writable(record.unresolved_heat_w)
    return solve(model, _writable(record.time_s), _writable(record.current_a), warm, soc0, hold, heat_w)


def _writable(row: Array) -> Array:
    """A contiguous, writable copy of a row, as the kernels need it; the arrays that effects return are read-only."""
    return np.require(row, float, ["C", "W"])


@dataclass(frozen=True)
class _KeyedRecord:
    """A record as a cache key: equal to another one where their arrays hold the same numbers."""

    digest: bytes
    record: Record = field(compare=False)

    @classmethod
    def of(cls, record: Record) -> _KeyedRecord:
        digest = hashlib.blake2b(digest_size=16)
        for channel in (record.time_s, record.current_a, record.temperature_k, record.unresolved_heat_w):
            digest.update(b"none" if channel is None else np.ascontiguousarray(channel).data)
        return cls(digest.digest(), record)


@lru_cache(maxsize=128)
def _cached_solution(
    model_name: ModelName, model: EspmModel, keyed: _KeyedRecord, soc0: float, hold: Hold
) -> Solution:
    """One solution, from a cache: effects on the voltage and on readings do not change the states of the cell, so that
    14 to 32 % of the solutions in four blind cases were computed before."""
    return solved(solver(model_name), model, keyed.record, soc0, hold)


def forget_solutions() -> None:
    """Empty the cache of solutions, for benchmarks."""
    _cached_solution.cache_clear()


def _copied(solution: Solution) -> Solution:
    """A copy of a solution, which the caller may write to without changing the cache."""
    rows, further, fault_at, fault = solution
    return rows.copy(), {name: values.copy() for name, values in further.items()}, fault_at, fault


def _run_espm(
    model: EspmModel,
    time: Array,
    current: Array,
    temperature_k: Array | None,
    soc0: float,
    hold: Hold,
    unresolved_heat_w: Array | None,
) -> Solution:
    if model.is_plain and temperature_k is None:
        rows, fault_at, fault = run_plain(model, time, current, soc0, hold)
        kelvin = np.full(len(time), model.cell.initial_temperature_k)
        return rows, {"temperature_k": kelvin}, fault_at, fault
    from aesi.physics.espm.extended import run_extended

    return run_extended(model, time, current, temperature_k, soc0, hold, unresolved_heat_w)


def _depleted(fault_at: int, n: int) -> Array:
    """(n,) 0 before row `fault_at`, at which the cell ran out, and 1 from there on; all 0 for -1."""
    if fault_at < 0:
        return np.zeros(n)
    return (np.arange(n) >= fault_at).astype(float)


def _check_finite(time: Array, voltage: Array, fault_at: int) -> None:
    """Raises SimulationError where a clipped simulation has no solution at some row after the cell ran out, at row
    `fault_at`, and NoNumberError where one that did not run out (-1) has none."""
    if np.isfinite(voltage).all():
        return
    lost = int(np.argmin(np.isfinite(voltage)))
    if fault_at < 0:
        raise NoNumberError(
            f"the voltage is no number at {stamp(time[lost])} s: an effect gives, or makes of the cell, what is none."
        )
    raise SimulationError(
        f"there is no solution at {stamp(time[lost])} s: the cell ran out at {stamp(time[fault_at])} s, and the "
        "current went on; end the record there, or check soc0, capacity and the sign of the current."
    )


def _checked_record(time_s: object, current_a: object) -> tuple[Array, Array]:
    time, current = numbers(time_s, "time_s"), numbers(current_a, "current_a")
    if time.ndim != 1 or time.shape != current.shape or len(time) == 0:
        raise DataError(
            f"time_s and current_a have shapes {time.shape} and {current.shape}; give two rows of one length, "
            "at least one number each."
        )
    check_row(time, "time_s")
    check_row(current, "current_a")
    check_times(time, "time_s")
    return np.array(time), np.array(current)  # a run keeps them, whatever becomes of what was given


def _kelvin(temperature_degc: Numbers | None, time: Array) -> Array | None:
    if temperature_degc is None:
        return None
    degc = numbers(temperature_degc, "temperature_degc")
    if degc.shape not in ((), time.shape):
        raise DataError(f"temperature_degc has the shape {degc.shape}; give one value or {len(time)}.")
    if degc.ndim:
        check_row(degc, "temperature_degc")
    check_temperature(degc)
    kelvin = degc + ZERO_CELSIUS_K
    return np.ascontiguousarray(np.broadcast_to(kelvin, time.shape))


def _checked_heat(unresolved_heat_w: Numbers, time: Array) -> Array:
    heat = numbers(unresolved_heat_w, "unresolved_heat_w")
    if heat.shape != time.shape:
        raise DataError(f"unresolved_heat_w has the shape {heat.shape}; give {len(time)} numbers, one a row.")
    check_row(heat, "unresolved_heat_w")
    return heat


def _soc_from_rest(
    model: EspmModel, effects: Sequence[ActiveEffect], kelvin: Array | None, rest_voltage_v: float | None
) -> float:
    """State of charge from the rest voltage at the first temperature, without the part that effects add to it."""
    if rest_voltage_v is None:
        raise DataError("give soc0, or rest_voltage_v measured at rest before the record.")
    read_v = checked_volts(rest_voltage_v, "rest_voltage_v")
    open_circuit = OpenCircuit(model.cell, None if kelvin is None else float(kelvin[0]))
    terminal_v = freed_of_instruments(open_circuit, model, effects, read_v)
    return open_circuit.soc_at_rest(terminal_v, freed_of_series(open_circuit, model, effects, terminal_v))


def _series(cell: Cell, rows: Array) -> dict[str, Array]:
    n, p, solved_rows = cell.negative, cell.positive, SolvedRows(*rows)
    return {
        "c_sp": solved_rows.surface_p * p.c_max_mol_m3,
        "c_sn": solved_rows.surface_n * n.c_max_mol_m3,
        "c_e0": solved_rows.c_e0,
        "c_eL": solved_rows.c_el,
        "soc": cell.soc_of(solved_rows.mean_n),
    }
