"""The model in the frequency domain: its own equations, linearised about rest.

    V(w) = -Z(w) I(w)     about a cell at rest, I > 0 on discharge

The surface stoichiometry x of a particle responds to a current y through the modes of solid diffusion, the salt through
the modes of the electrolyte. Kinetics are a resistance R T/(F j0), in series with that of the film; a double layer,
where there is one, is parallel to both:

    x_u = -(lump/(jw) + sum gains/(jw + rates)) y_u,      phi_u = U' x_u + R_u y_u,      i_r = sum_u y_u + jw C phi_r

All regions of an electrode share one potential, as in the time domain; the porous electrode is in `dfn.linear`. Left
out is what has no linear response at rest: plating, and the heat of losses, which is of second order. Two of first
order are left out, too. A hysteresis follows the charge, M k/(jw Q): 1.8 mohm at 1 mHz for 10 mV, a rate of 20 and 5
Ah. The heat of entropy gives T (dU/dT)**2 / (jw C + G) for a cell that warms itself: 0.03 mohm at 0.1 mV/K and 0.1 W/K,
below the thermal time constant.

Source: Meddings et al., J. Power Sources 480 (2020) 228742, doi:10.1016/j.jpowsour.2020.228742, for the practice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import cast

import numpy as np

from aesi.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K, ZERO_CELSIUS_K
from aesi.errors import DataError, InputError
from aesi.numerics.typing import Array, ComplexArray, Numbers
from aesi.physics.arguments import check_cell, check_choice, check_temperature, checked_effects, checked_soc
from aesi.physics.balance import same_rest
from aesi.physics.cell import Cell
from aesi.physics.cell.relations import Relation
from aesi.physics.effect import ActiveEffect, Contribution, Record, Trace, as_cell_saw
from aesi.physics.espm.extended import interface_capacity, ohmic_drops, particle_units
from aesi.physics.espm.layout import Units
from aesi.physics.espm.plain import rate_factor, shifted_ocp, stack_of
from aesi.physics.espm.tables import solid_diffusion
from aesi.physics.model import EspmModel
from aesi.physics.simulation import ModelName, model_with, simulate
from aesi.records import Run
from aesi.records.checked import numbers

SLOPE_STEP = 1e-4
"""Step of stoichiometry for the slope of a potential: tables of potentials have steps of 1.2e-4."""
INSTANT_S = np.array([0.0, 1e-9])
"""Times, s, so close that a current moves no appreciable charge between them."""
SMALL_A = 1e-6
"""Current, A, for a linear response: far below any exchange current, far above round-off."""


def impedance(
    cell: Cell,
    frequency_hz: Numbers,
    soc: float,
    temperature_degc: float = 25.0,
    effects: Iterable[ActiveEffect] = (),
    *,
    model: ModelName = "espm",
) -> ComplexArray:
    """Impedance of `cell` at rest.

    frequency_hz : (n,) Hz, positive.  soc : state of charge, 0 to 1, in the declared stoichiometry windows; where an
    effect moves these, the cell rests at the same voltage in the new ones, as in `simulate`.  temperature_degc : of the
    whole cell, degC; the default is 25, not the temperature in the file.  effects : as in `simulate`. An effect on the
    voltage counts with its immediate response to a current; faults of the instruments leave Z unchanged.
    model : "espm" (default) or "dfn".
    Returns (n,) ohm, complex; the imaginary part is negative where capacitive.
    Raises DataError for frequencies that are not positive and for a state of charge outside the electrodes' range;
    InputError for a wrong type of cell, effect, state of charge or temperature, and for lithium plating.
    """
    frequency = _checked_frequency(frequency_hz)
    active = checked_effects(effects)
    check_choice("model", model, ModelName)
    at_rest = _at_rest(cell, soc, temperature_degc, active)
    changed, rest, kelvin = at_rest.model, at_rest.rest, at_rest.kelvin
    if changed.negative.plating is not None:
        raise InputError("lithium plating has no linear answer at rest; leave the effect out.")
    omega: Array = 2.0 * np.pi * frequency
    if model == "dfn":
        from aesi.physics.dfn.linear import porous_impedance
        from aesi.physics.dfn.run import check_whole

        check_whole(changed)
        z = porous_impedance(changed, _slopes(changed.cell, rest, kelvin), rest, kelvin, omega)
    else:
        z = at_rest.impedance(omega)
    acting = [(one, one.effect.on_voltage) for one in active if one.effect.on_voltage is not None]
    if not acting:
        return z
    on_model = [one for one in active if one.effect.on_model is not None]
    really = kelvin - ZERO_CELSIUS_K
    rest_run = simulate(cell, INSTANT_S, np.zeros(2), soc, on_model, really, "backward", model=model)
    return z + sum(_series_ohm(changed, one, function, rest_run) for one, function in acting)


def _checked_frequency(frequency_hz: Numbers) -> Array:
    """(n,) Hz, checked.  Raises DataError for anything but a row of positive numbers."""
    frequency = np.atleast_1d(numbers(frequency_hz, "frequency_hz"))
    if frequency.ndim != 1 or not (
        np.isfinite(frequency).all() and (frequency > 0.0).all() and len(frequency)
    ):
        raise DataError("frequency_hz has to be one row of positive numbers, at least one.")
    return frequency


def _checked_kelvin(temperature_degc: float) -> float:
    """The temperature, K, checked.  Raises InputError for several temperatures, and for one that no cell has."""
    degc = numbers(temperature_degc, "temperature_degc")
    if degc.ndim:
        raise InputError(
            f"temperature_degc has the shape {degc.shape}; a cell at rest is at one temperature."
        )
    check_temperature(degc)
    return float(degc) + ZERO_CELSIUS_K


def _at_rest(cell: Cell, soc: float, temperature_degc: float, active: tuple[ActiveEffect, ...]) -> _Linear:
    """`cell` with the effects applied, at the rest voltage that it has without them.  Raises as `impedance` does."""
    check_cell(cell)
    share = checked_soc(soc, "soc")
    if share is None:
        raise InputError(
            "soc = None is no state of charge; give a share of the capacity, so that 90 % is 0.9."
        )
    stated_k = _checked_kelvin(temperature_degc)
    model = model_with(cell, active)
    rest = np.array(model.cell.stoichiometries(same_rest(cell, model.cell, share)))
    if not ((rest > 0.0) & (rest < 1.0)).all():
        raise DataError(
            f"{cell.name} has no state of charge of {share:g}: a stoichiometry leaves (0, 1) there."
        )
    return _Linear(model, rest, _true_kelvin(model, active, stated_k))


def slowest_diffusion_hz(
    cell: Cell, soc: float, temperature_degc: float = 25.0, effects: Iterable[ActiveEffect] = ()
) -> float:
    """Frequency, Hz, of the slowest diffusion of `cell` at rest (in a particle or in the salt): its rate over 2 pi,
    where it lags by 45 degrees. Well below it diffusion follows the current, and Z is that of a capacitance.

    Arguments and errors as of `impedance`; both models have the same particles and salt.
    """
    at_rest = _at_rest(cell, soc, temperature_degc, checked_effects(effects))
    model, rest, kelvin = at_rest.model, at_rest.rest, at_rest.kelvin
    units = particle_units(model)
    faster = [_diffusion_factor(model, side, float(rest[side]), kelvin) for side in units.place[:, 0]]
    solid = float(np.min(np.array(faster)[:, None] * units.rates))
    return min(solid, float(np.min(_salt_rates(model, kelvin)[1:]))) / (2.0 * np.pi)


def _diffusion_factor(model: EspmModel, side: int, at: float, kelvin: float) -> float:
    """Factor of an electrode's rates of diffusion at a stoichiometry and a temperature."""
    cell = model.cell
    electrode = (cell.negative, cell.positive)[side]
    faster = rate_factor(electrode.diffusivity_ea_j_mol, kelvin, cell.reference_temperature_k)
    return (
        faster * float(electrode.diffusivity(np.array([at]))[0]) / solid_diffusion(electrode.diffusivity).d0
    )


def _salt_rates(model: EspmModel, kelvin: float) -> Array:
    """(modes,) 1/s of the salt at rest; the first is its mean, which stays."""
    e = model.cell.electrolyte
    faster = rate_factor(e.diffusivity_ea_j_mol, kelvin, model.cell.reference_temperature_k)
    return stack_of(model).lam * float(e.diffusivity(np.array([e.c0_mol_m3]))[0]) * faster


@dataclass(frozen=True, eq=False)
class _Linear:
    """A model about rest at stoichiometries `rest` (2,), at `kelvin`."""

    model: EspmModel
    rest: Array
    kelvin: float

    def impedance(self, omega: Array) -> ComplexArray:
        """(n,) ohm.  The currents of all units and the two potentials, per ampere, from one system a frequency."""
        cell = self.model.cell
        units = particle_units(self.model)
        side_of, within = units.place.T
        n, regions = len(side_of), self.model.regions
        region = side_of * regions + within
        s: ComplexArray = np.asarray(1j * omega, dtype=np.complex128)
        local = self._unit_impedance(units, s)
        salt = self._salt_impedance(s)
        ohm = self._ohmic_drops()
        in_region = (region[None, :] == np.arange(2 * regions)[:, None]).astype(float)
        # Current of each region: its particles', and its double layer's, which is charged by the first one's potential.
        into = np.broadcast_to(in_region.astype(complex), (len(s), 2 * regions, n)).copy()
        for r in range(2 * regions):
            first = int(np.flatnonzero(region == r)[0])
            capacity = interface_capacity(self.model, int(side_of[first]))
            into[:, r, first] += s * capacity * local[:, first]
        drop = ohm[None] + salt
        matrix = np.zeros((len(s), n + 2, n + 2), dtype=complex)
        right = np.zeros((len(s), n + 2), dtype=complex)
        matrix[:, :n, :n] = drop[:, region] @ into
        matrix[:, np.arange(n), np.arange(n)] += local
        for side in range(2):
            matrix[:, np.flatnonzero(side_of == side), n + side] = -1.0
            of_side = np.arange(2 * regions) // regions == side
            matrix[:, n + side, :n] = into[:, of_side].sum(axis=1)
            right[:, n + side] = (1.0 if side == 0 else -1.0) / cell.total_area_m2
        solved = np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
        warmer = rate_factor(
            cell.electrolyte.conductivity_ea_j_mol, self.kelvin, cell.reference_temperature_k
        )
        gap = cell.separator.thickness_m / cell.separator.transport_efficiency / (self._kappa() * warmer)
        series = gap / cell.total_area_m2 + cell.contact_resistance_ohm
        return cast(ComplexArray, solved[:, n] - solved[:, n + 1] + series)

    def _unit_impedance(self, units: Units, s: ComplexArray) -> ComplexArray:
        """(frequencies, units) ohm m2: kinetics, film, and open-circuit slope times what the surface loses."""
        cell = self.model.cell
        slopes = _slopes(cell, self.rest, self.kelvin)
        out = np.zeros((len(s), len(units.place)), dtype=complex)
        for side, electrode in enumerate((cell.negative, cell.positive)):
            at = self.rest[side]
            here = np.flatnonzero(units.place[:, 0] == side)
            slope = slopes[side]
            kinetic = rate_factor(electrode.rate_ea_j_mol, self.kelvin, cell.reference_temperature_k)
            thermal = GAS_CONSTANT_J_MOL_K * self.kelvin / FARADAY_C_MOL
            faster = _diffusion_factor(self.model, side, float(at), self.kelvin)
            factor = float(electrode.rate_factor(np.array([at]))[0])
            film = float(electrode.film_ohm_m2(np.array([at]))[0])
            film /= rate_factor(electrode.film_ea_j_mol, self.kelvin, cell.reference_temperature_k)
            for u in here:
                answer = units.lump[u] / s
                answer = answer + (units.gains[u] / (s[:, None] + faster * units.rates[u])).sum(axis=1)
                resistance = thermal / (units.exchange[u] * kinetic * factor * np.sqrt(at * (1.0 - at)))
                out[:, u] = resistance + film / units.reactive[u] - slope * answer
        return out

    def _salt_impedance(self, s: ComplexArray) -> ComplexArray:
        """(frequencies, 2 regions, 2 regions) ohm m2: potential of the salt in one region per current into another."""
        regions, e, stack = self.model.regions, self.model.cell.electrolyte, stack_of(self.model)
        rates = _salt_rates(self.model, self.kelvin)
        enters = (1.0 - e.transference) / FARADAY_C_MOL * stack.gain[:, 1:]
        gauss = stack.gauss[: 6 * regions].reshape(2 * regions, 3, -1)
        seen = (np.array([5.0, 8.0, 5.0]) / 18.0 @ gauss) @ stack.to_nodes[:, 1:] / e.c0_mol_m3
        thermal = GAS_CONSTANT_J_MOL_K * self.kelvin / FARADAY_C_MOL
        chi = 2.0 * (1.0 - e.transference) * thermal
        modes = 1.0 / (s[:, None] + rates[None, 1:])
        return cast(ComplexArray, chi * np.einsum("rk,fk,vk->frv", seen, modes, enters))

    def _ohmic_drops(self) -> Array:
        """(2 regions, 2 regions) ohm m2, ohmic drop of the electrolyte, as in the time domain."""
        regions = self.model.regions
        e = self.model.cell.electrolyte
        warmer = rate_factor(e.conductivity_ea_j_mol, self.kelvin, self.model.cell.reference_temperature_k)
        solid, salt = ohmic_drops(self.model)
        out = np.zeros((2 * regions, 2 * regions))
        for side in range(2):
            own = slice(side * regions, (side + 1) * regions)
            out[own, own] = solid[side] + salt[side].sum(axis=1) / (self._kappa() * warmer)
        return out

    def _kappa(self) -> float:
        e = self.model.cell.electrolyte
        return float(e.conductivity(np.array([e.c0_mol_m3]))[0])


def _slopes(cell: Cell, rest: Array, kelvin: float) -> Array:
    """(2,) V: dU/dx of both electrodes at stoichiometries `rest` (2,)."""
    rise = kelvin - cell.reference_temperature_k
    electrodes = (cell.negative, cell.positive)
    return np.array([_slope(shifted_ocp(x, rise), at) for x, at in zip(electrodes, rest, strict=True)])


def _slope(relation: Relation, at: float) -> float:
    low, high = max(at - SLOPE_STEP, 1e-6), min(at + SLOPE_STEP, 1.0 - 1e-6)
    values = relation(np.array([low, high]))
    return float((values[1] - values[0]) / (high - low))


def _true_kelvin(model: EspmModel, effects: tuple[ActiveEffect, ...], kelvin: float) -> float:
    """The true temperature of the cell, K: `kelvin` after the effects that change it, and that of the model where one
    leaves it to that."""
    seen = as_cell_saw(Record(np.zeros(1), np.zeros(1), np.array([kelvin])), effects).temperature_k
    return model.cell.initial_temperature_k if seen is None else float(seen[0])


def _series_ohm(
    model: EspmModel, active: ActiveEffect, function: Callable[..., Contribution], rest: Run
) -> float:
    """Resistance of an effect on the voltage, ohm: its immediate response to a small current.

    rest : run of the cell without current, over `INSTANT_S`.
    """
    at_rest, driven = (
        active.act(function, Trace(model, rest.time_s, current, rest.voltage_v, dict(rest.series), True))
        for current in (np.zeros(2), np.full(2, SMALL_A))
    )
    return -float(driven.voltage_v[-1] - at_rest.voltage_v[-1]) / SMALL_A
