"""Electrode balance: stoichiometry windows after lithium or active material was lost.

Full and empty are defined by the rest voltages of the declared windows, or by an electrode that is full or empty
before they are reached. In both states the two electrodes together hold the cyclable lithium that is left. Active
material is lost with the lithium it holds, at a state of charge whose stoichiometries stay.
Birkl et al., J. Power Sources 341 (2017) 373, doi:10.1016/j.jpowsour.2016.12.011.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from aesi.errors import SimulationError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell

EDGE = 1e-6
"""How near a stoichiometry comes to 0 or 1, where potentials have poles."""
SOC_BEYOND = 0.05
"""How far beyond full and empty voltages are looked up; GRID points over that range, between which a root is
bracketed."""
GRID = 257


def without_lithium(cell: Cell, fraction: float) -> Cell:
    """The cell with `fraction` of its cyclable lithium gone; same electrodes, new windows.

    Raises SimulationError where no window satisfies the voltages.
    """
    if fraction == 0.0:
        return cell
    q_n, q_p = cell.electrode_capacity_ah(cell.negative), cell.electrode_capacity_ah(cell.positive)
    lithium = q_n * cell.negative.theta_max + q_p * cell.positive.theta_min - fraction * cell.capacity_ah
    full, empty = (float(cell.rest_voltage_v(s)[0]) for s in (1.0, 0.0))
    return _with_windows(cell, _at(cell, lithium, full), _at(cell, lithium, empty))


def with_active_material(cell: Cell, negative: float, positive: float, lost_at_soc: float = 1.0) -> Cell:
    """The cell with fractions of its active material left (1 = all).

    lost_at_soc : state of charge at which the material went, with the lithium that it held there; the stoichiometries
    of that state stay.  Full and empty are at the declared rest voltages again.
    """
    if negative == 1.0 and positive == 1.0:
        return cell
    full, empty = (float(cell.rest_voltage_v(s)[0]) for s in (1.0, 0.0))
    n, p = cell.negative, cell.positive
    aged = cell.with_negative(area_per_volume_1_m=n.area_per_volume_1_m * negative)
    aged = aged.with_positive(area_per_volume_1_m=p.area_per_volume_1_m * positive)
    q_n, q_p = aged.electrode_capacity_ah(aged.negative), aged.electrode_capacity_ah(aged.positive)
    x_n = n.theta_min + lost_at_soc * (n.theta_max - n.theta_min)
    x_p = p.theta_max - lost_at_soc * (p.theta_max - p.theta_min)
    lithium = q_n * x_n + q_p * x_p
    kept = (n.theta_max, p.theta_min) if lost_at_soc == 1.0 else _at(aged, lithium, full)
    return _with_windows(aged, kept, _at(aged, lithium, empty))


def same_rest(declared: Cell, aged: Cell, soc: float) -> float:
    """State of charge in the windows of `aged` at which it rests where `declared` rests at `soc`.

    By the potentials of `aged` on both sides: an open-circuit potential that is off does not move a state of charge
    that is known, and windows that are the same leave it the same. Beyond both ends of the new windows the nearer end;
    where a potential that turns beyond its window rests there twice, the nearer to `soc`.
    """
    if _windows(declared) == _windows(aged):
        return soc
    alike = declared.with_negative(ocp=aged.negative.ocp).with_positive(ocp=aged.positive.ocp)
    voltage = float(alike.rest_voltage_v(soc)[0])

    def excess(z: float) -> float:
        return float(aged.rest_voltage_v(z)[0]) - voltage

    low, high = aged_range(aged)
    grid = np.linspace(low, high, GRID)
    above = aged.rest_voltage_v(grid) >= voltage
    crossed = np.flatnonzero(above[1:] & ~above[:-1])  # a rest voltage rises with the charge
    if not len(crossed):
        return low if above[0] else high
    k = crossed[np.argmin(np.abs(grid[crossed] - soc))]
    return float(brentq(excess, grid[k], grid[k + 1], xtol=1e-13))


def aged_range(cell: Cell) -> tuple[float, float]:
    """States of charge at which both electrodes are within (0, 1), at most 5 % beyond the windows."""
    low, high = -SOC_BEYOND, 1.0 + SOC_BEYOND
    n, p = cell.negative, cell.positive
    span_n, span_p = n.theta_max - n.theta_min, p.theta_max - p.theta_min
    low = max(low, (EDGE - n.theta_min) / span_n, (p.theta_max - 1.0 + EDGE) / span_p)
    high = min(high, (1.0 - EDGE - n.theta_min) / span_n, (p.theta_max - EDGE) / span_p)
    return low, high


def _windows(cell: Cell) -> tuple[float, ...]:
    n, p = cell.negative, cell.positive
    return n.theta_min, n.theta_max, p.theta_min, p.theta_max


def _at(cell: Cell, lithium_ah: float, voltage_v: float) -> tuple[float, float]:
    """Stoichiometries (negative, positive) that hold `lithium_ah` together and rest at `voltage_v`."""
    q_n, q_p = cell.electrode_capacity_ah(cell.negative), cell.electrode_capacity_ah(cell.positive)

    def positive(theta_n: Array) -> Array:
        return (lithium_ah - q_n * theta_n) / q_p

    def excess(theta_n: Array) -> Array:
        return cell.positive.ocp(positive(theta_n)) - cell.negative.ocp(theta_n) - voltage_v

    low = max(EDGE, (lithium_ah - q_p * (1.0 - EDGE)) / q_n)
    high = min(1.0 - EDGE, (lithium_ah - q_p * EDGE) / q_n)
    theta_n = _root(excess, low, high, cell.name)
    return theta_n, (lithium_ah - q_n * theta_n) / q_p


def _root(excess: Callable[[Array], Array], low: float, high: float, name: str) -> float:
    """Where a rising function crosses nought, or the nearer end; a grid narrows the bracket in one evaluation."""
    if not low < high:
        raise SimulationError(
            f"{name}: after this loss no stoichiometries are left; a smaller loss is needed."
        )
    grid = np.linspace(low, high, GRID)
    values = excess(grid)
    if values[0] >= 0.0:
        return low
    if values[-1] <= 0.0:
        return high
    k = int(np.flatnonzero(values > 0.0)[0])
    return float(brentq(lambda x: float(excess(np.array([x]))[0]), grid[k - 1], grid[k], xtol=1e-13))


def _with_windows(cell: Cell, full: tuple[float, float], empty: tuple[float, float]) -> Cell:
    aged = cell.with_negative(theta_min=empty[0], theta_max=full[0])
    return aged.with_positive(theta_min=full[1], theta_max=empty[1])
