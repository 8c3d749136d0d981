"""The model that a simulation solves: a cell and the constitutive choices that effects may change.

Frozen and hashable by value: effects return changed copies, and everything derived is cached by value.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.cell.parts import NO_FILM, UNITY
from aesi.physics.cell.relations import Constant, hashed_once

DEFAULT_SOLID_ORDER = 12
"""Error of the voltage against 24 polynomials: 0.001 mV RMS at most (LG M50 to 2C, the load of `aesi bench espm`); with
8, 0.03 mV. Where diffusion is ten times as slow, under a third of the load, 0.02 mV; with 8, 0.3. Where a diffusivity
falls with the stoichiometry, as in the calibrated files, 0.07 to 1.3 mV on the records of their fits; with 16, 0.01 to
0.8, with 8, 0.4 to 3.2."""
DEFAULT_ELECTROLYTE_ORDER = 3
"""Error of that voltage against order 8: 0.007 mV RMS at most; with 2, 0.09 mV."""
DEFAULT_ELECTRODE_POINTS = 7
"""Error of the voltage against 14 points (with twice the modes and half the steps): 0.13 mV RMS at worst, LG M50 at 2C
to its cut-off, where the salt is nearly depleted; with 6, 0.24 mV at 0.78 of the time, with 8, 0.13 mV at 1.12 of
it."""
DEFAULT_SUBSTEP_S = 1.0
"""A convention; the effect `numerical_error` shows the influence of a shorter step."""
ANY_NUMBER = 2**31
"""No limit."""


class SolvedRows(NamedTuple):
    """The rows (7, n) that each solver of a model gives, by name, (n,) each.

    voltage_v : V.  surface_n, surface_p : stoichiometries at the surface of the particles, negative and positive.
    c_e0, c_el : mol/m3, salt at the collector of the negative and of the positive electrode.
    mean_n, mean_p : mean stoichiometries of the particles.
    """

    voltage_v: Array
    surface_n: Array
    surface_p: Array
    c_e0: Array
    c_el: Array
    mean_n: Array
    mean_p: Array


@dataclass(frozen=True)
class Plating:
    """Lithium metal on the negative electrode: rate (m/s) and transfer coefficient of plating."""

    rate_m_s: float
    transfer_coefficient: float


NO_PLATING = Plating(0.0, 0.5)


@dataclass(frozen=True)
class Interface:
    """Properties of the particles of one electrode that a cell file does not declare.

    transfer_coefficient : of delithiation, 0.5 for symmetric kinetics.  double_layer_f_m2 : F per m2 of reactive area.
    bins : (share of the reactive area, radius over the declared radius), one pair per particle size.
    plating : of lithium metal; None for none.
    """

    transfer_coefficient: float = 0.5
    double_layer_f_m2: float = 0.0
    bins: tuple[tuple[float, float], ...] = ((1.0, 1.0),)
    plating: Plating | None = None


@dataclass(frozen=True)
class HeatBalance:
    """Lumped heat balance of the cell: heat capacity (J/K), conductance to its surroundings (W/K).

    The surroundings are the ambient air, or the cell's own case where its temperature was measured.
    """

    heat_capacity_j_k: float
    conductance_w_k: float


PLAIN = Interface()


@hashed_once
@dataclass(frozen=True)
class EspmModel:
    """A cell with its constitutive and numerical choices, for the single particle ("espm") and the porous electrode
    ("dfn") alike.

    Effects return changed copies of it. Its name comes from the extended single-particle model, its first use.

    regions : number of layers into which each electrode is cut, with a particle (or one of each size) in each.
    heat : None for a temperature that is given or constant; see `of_record`.
    solid_order : number of even Legendre polynomials per particle.  electrolyte_order : polynomial degree per layer.
    electrode_points : points across a porous electrode at which reaction and salt are resolved.
    substep_s : longest step of states that are not stepped exactly, s.  most_substeps : most steps between two samples.
    step_refinement : divisor of the step, which is the shorter of the row and `substep_s`.
    """

    cell: Cell
    negative: Interface = PLAIN
    positive: Interface = PLAIN
    regions: int = 1
    heat: HeatBalance | None = None
    solid_order: int = DEFAULT_SOLID_ORDER
    electrolyte_order: int = DEFAULT_ELECTROLYTE_ORDER
    electrode_points: int = DEFAULT_ELECTRODE_POINTS
    substep_s: float = DEFAULT_SUBSTEP_S
    most_substeps: int = ANY_NUMBER
    step_refinement: float = 1.0

    def of(self, cell: Cell) -> EspmModel:
        """The same model of another cell."""
        return replace(self, cell=cell)

    def with_cell(self, **changes: Any) -> EspmModel:
        """A copy whose cell has the given fields replaced."""
        return replace(self, cell=replace(self.cell, **changes))

    @property
    def is_plain(self) -> bool:
        """True where solid diffusion is linear and the kinetics have a closed form, at one temperature."""
        solids = (self.cell.negative.diffusivity, self.cell.positive.diffusivity)
        return (
            self.negative == PLAIN
            and self.positive == PLAIN
            and self.regions == 1
            and self.heat is None
            and all(isinstance(d, Constant) for d in solids)
            and all(
                x.rate_factor == UNITY and x.double_layer_f_m2 == 0.0 and x.film_ohm_m2 == NO_FILM
                for x in (self.cell.negative, self.cell.positive)
            )
        )


def activation_energies(cell: Cell) -> Array:
    """(8,) J/mol: diffusion (n, p), kinetics (n, p), electrolyte diffusion and conductivity, films (n, p)."""
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    return np.array(
        [
            n.diffusivity_ea_j_mol, p.diffusivity_ea_j_mol, n.rate_ea_j_mol, p.rate_ea_j_mol,
            e.diffusivity_ea_j_mol, e.conductivity_ea_j_mol, n.film_ea_j_mol, p.film_ea_j_mol,
        ]
    )  # fmt: skip


def of_record(model: EspmModel, measured: bool) -> EspmModel:
    """The model for a record with or without a measured temperature of the case.

        C dT/dt = Q - (T - T_case)/R

    A measured case takes the place of the surroundings: the heat capacity C of a heat balance stays, or else that of
    the file counts, and R is the file's. The winding has the temperature of the case where the file declares no
    resistance R between them (`Cell.winding_resistance_k_w`).
    """
    if not measured:
        return model
    resistance = model.cell.winding_resistance_k_w
    capacity = model.cell.heat_capacity_j_k if model.heat is None else model.heat.heat_capacity_j_k
    heat = None if capacity is None or not resistance else HeatBalance(capacity, 1.0 / resistance)
    return model if heat == model.heat else replace(model, heat=heat)


def case_k(model: EspmModel, winding_k: Array) -> Array | None:
    """(n,) K, temperature of the case for a simulated temperature of the winding `winding_k` (n,).

        T_case = T_amb + (1 - R G) (T - T_amb)

    A simulation with this case temperature (`of_record`) reproduces the one with the heat balance. None where
    G R >= 1: the balance dissipates more heat than the winding can conduct to a case.
    """
    if model.heat is None:
        return winding_k
    share = model.cell.case_share(model.heat.conductance_w_k)
    ambient_k = model.cell.ambient_temperature_k
    return ambient_k + share * (winding_k - ambient_k) if share > 0.0 else None


def heat_numbers(model: EspmModel) -> Array:
    """(3,) heat capacity J/K (0 for none), conductance W/K, surroundings K where no case was measured."""
    if model.heat is None:
        return np.zeros(3)
    balance = model.heat
    return np.array([balance.heat_capacity_j_k, balance.conductance_w_k, model.cell.ambient_temperature_k])
