"""Electrode balance: stoichiometry windows after a loss of lithium or active material.

Full and empty are defined by the rest voltages of the declared windows, or by an electrode that is full or empty
before these are reached. In both states the two electrodes together hold the remaining cyclable lithium. Active
material is lost together with the lithium in it, at a state of charge whose stoichiometries do not change.
Birkl et al., J. Power Sources 341 (2017) 373, doi:10.1016/j.jpowsour.2016.12.011.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from aesi.errors import SimulationError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.parts import Balance, Soc
from aesi.physics.cell.relations import value_at

EDGE = 1e-6
"""Least distance of a stoichiometry from 0 and 1, where potentials have poles."""
SOC_BEYOND = 0.05
"""Range of state of charge beyond full and empty in which roots are searched. GRID : points over that range, between
which a root is bracketed."""
GRID = 257
REMEMBERED = 256
"""Size of the cache of roots: few parameters of a fit shift a balance, and every simulation needs a root."""


def without_lithium(cell: Cell, fraction: float) -> Cell:
    """The cell after a loss of lithium of `fraction` of its capacity: same electrodes, new stoichiometry windows.

    Raises SimulationError where no window satisfies the voltages.
    """
    if fraction == 0.0:
        return cell
    sizes = _sizes_ah(cell)
    q_n, q_p = sizes
    lithium = q_n * cell.negative.theta_max + q_p * cell.positive.theta_min - fraction * cell.capacity_ah
    full, empty = (
        _stoichiometries_at_rest(cell.balance, soc, sizes, lithium, cell.name) for soc in (1.0, 0.0)
    )
    return _with_windows(cell, full, empty)


def with_active_material(cell: Cell, negative: float, positive: float, lost_at_soc: float = 1.0) -> Cell:
    """The cell with the remaining shares of active material in its electrodes (1: no loss).

    lost_at_soc : state of charge at which the material was lost with the lithium in it; the stoichiometries at that
    state do not change.  Full and empty are at the declared rest voltages again.
    Raises SimulationError where no window satisfies the voltages.
    """
    if negative == 1.0 and positive == 1.0:
        return cell
    n, p, balance = cell.negative, cell.positive, cell.balance
    aged = cell.with_negative(area_per_volume_1_m=n.area_per_volume_1_m * negative)
    aged = aged.with_positive(area_per_volume_1_m=p.area_per_volume_1_m * positive)
    sizes = _sizes_ah(aged)
    (q_n, q_p), (x_n, x_p) = sizes, balance.stoichiometries(lost_at_soc)
    lithium = q_n * x_n + q_p * x_p
    full = n.theta_max, p.theta_min
    if lost_at_soc != 1.0:
        full = _stoichiometries_at_rest(balance, 1.0, sizes, lithium, cell.name)
    return _with_windows(aged, full, _stoichiometries_at_rest(balance, 0.0, sizes, lithium, cell.name))


def same_rest(declared: Cell, aged: Cell, soc: float) -> float:
    """State of charge in the windows of `aged` with the same rest voltage as `soc` in the windows of `declared`.

    The potentials of `aged` are used for both: a wrong open-circuit potential does not change a known state of charge,
    and equal windows leave it unchanged. A voltage beyond the new windows gives the nearer end. Where a potential that
    turns beyond its window has the voltage twice, the solution nearer to `soc` is taken.
    """
    before, after = declared.balance, aged.balance
    if (before.window_n, before.window_p) == (after.window_n, after.window_p):
        return soc
    return _soc_at_same_rest(replace(after, window_n=before.window_n, window_p=before.window_p), after, soc)


@lru_cache(maxsize=REMEMBERED)
def _soc_at_same_rest(before: Balance, after: Balance, soc: float) -> float:
    """State of charge of `after` where it rests as `before` does at `soc`."""
    voltage = before.rest_voltage_at(soc)

    def excess(z: float) -> float:
        return after.rest_voltage_at(z) - voltage

    low, high = _aged_range(after)
    grid = np.linspace(low, high, GRID)
    above = after.rest_voltage_v(grid) >= voltage
    crossed = np.flatnonzero(above[1:] & ~above[:-1])  # a rest voltage rises with the charge
    if not len(crossed):
        return low if above[0] else high
    k = crossed[np.argmin(np.abs(grid[crossed] - soc))]
    return float(brentq(excess, grid[k], grid[k + 1], xtol=1e-13))


def aged_range(cell: Cell, beyond: float = SOC_BEYOND) -> tuple[float, float]:
    """States of charge at which both electrodes are within (0, 1), at most `beyond` outside the windows."""
    return _aged_range(cell.balance, beyond)


def _aged_range(balance: Balance, beyond: float = SOC_BEYOND) -> tuple[float, float]:
    low, high = -beyond, 1.0 + beyond
    (empty_n, full_n), (empty_p, full_p) = balance.window_n, balance.window_p
    span_n, span_p = full_n - empty_n, empty_p - full_p
    low = max(low, (EDGE - empty_n) / span_n, (empty_p - 1.0 + EDGE) / span_p)
    high = min(high, (1.0 - EDGE - empty_n) / span_n, (empty_p - EDGE) / span_p)
    return low, high


def _sizes_ah(cell: Cell) -> tuple[float, float]:
    """Capacities of the electrodes (negative, positive), from stoichiometry 0 to 1."""
    return cell.electrode_capacity_ah(cell.negative), cell.electrode_capacity_ah(cell.positive)


@lru_cache(maxsize=REMEMBERED)
def _stoichiometries_at_rest(
    declared: Balance, soc: float, sizes_ah: tuple[float, float], lithium_ah: float, name: str
) -> tuple[float, float]:
    """Stoichiometries (negative, positive) of electrodes of these sizes (Ah) that hold `lithium_ah` together and have
    the rest voltage of the declared electrodes at `soc`.

    name : of the cell, for the error.
    """
    q_n, q_p = sizes_ah
    voltage_v = declared.rest_voltage_at(soc)

    def positive(theta_n: Soc) -> Soc:
        return (lithium_ah - q_n * theta_n) / q_p

    def on_grid(theta_n: Array) -> Array:
        return declared.ocp_p(positive(theta_n)) - declared.ocp_n(theta_n) - voltage_v

    def excess(theta_n: float) -> float:
        return value_at(declared.ocp_p, positive(theta_n)) - value_at(declared.ocp_n, theta_n) - voltage_v

    low = max(EDGE, (lithium_ah - q_p * (1.0 - EDGE)) / q_n)
    high = min(1.0 - EDGE, (lithium_ah - q_p * EDGE) / q_n)
    theta_n = _increasing_root(excess, on_grid, low, high, name)
    return theta_n, (lithium_ah - q_n * theta_n) / q_p


def _increasing_root(
    excess: Callable[[float], float], on_grid: Callable[[Array], Array], low: float, high: float, name: str
) -> float:
    """Root of an increasing function, or the nearer end of the interval; a grid narrows the bracket in one evaluation.

    on_grid : the function for an array of arguments.
    """
    if not low < high:
        raise SimulationError(
            f"{name}: after this loss no stoichiometries are left; a smaller loss is needed."
        )
    grid = np.linspace(low, high, GRID)
    values = on_grid(grid)
    if values[0] >= 0.0:
        return low
    if values[-1] <= 0.0:
        return high
    k = int(np.flatnonzero(values > 0.0)[0])
    return float(brentq(excess, grid[k - 1], grid[k], xtol=1e-13))


def _with_windows(cell: Cell, full: tuple[float, float], empty: tuple[float, float]) -> Cell:
    aged = cell.with_negative(theta_min=empty[0], theta_max=full[0])
    return aged.with_positive(theta_min=full[1], theta_max=empty[1])
