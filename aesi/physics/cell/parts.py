"""The parameters of a cell, as its file declares them: frozen, in SI units, hashable by value.

Sign convention of the whole package: current is positive on discharge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import date
from typing import Any, Self, TypeVar

import numpy as np

from aesi.constants import FARADAY_C_MOL, SECONDS_PER_HOUR
from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.health import Soh, checked_soh, day_of, shares_by_day
from aesi.physics.cell.relations import Constant, Relation, hashed_once, value_at

Soc = TypeVar("Soc", float, Array)

NO_ENTROPY = Constant(0.0)
NO_FILM = Constant(0.0)
UNITY = Constant(1.0)
CONTACT_RESISTANCE = "Contact resistance [Ohm]"
"""The field of `contact_resistance_ohm` in the user-defined section of a file: BPX itself has none for it."""
THERMAL_CONDUCTIVITY = "Thermal conductivity [W.m-1.K-1]"
"""The field of `thermal_conductivity_w_m_k` in the user-defined section."""
INITIAL_SOC = "Initial state-of-charge"
HEAT_TRANSFER = "Heat transfer coefficient [W.m-2.K-1]"
FITTED_WITH = {model: f"Fitted with {model}" for model in ("espm", "dfn")}
"""Fields of `fitted_with`, one of them 1: the standard takes numbers there, and reads words as formulas."""
CAPACITY_SHARES = "Capacity share by record"
TESTED_ON = "Day of test by record [YYYYMMDD]"
"""The fields of `capacity_shares` and `tested_on` in the user-defined section; days as numbers, see `FITTED_WITH`."""
FITTED_AT = "Mean temperature by record [K]"
"""The field of `fitted_at_k` in the user-defined section."""
FILM_RESISTANCES = {side: f"{side} electrode film resistance [Ohm.m2]" for side in ("Negative", "Positive")}
FILM_ENERGIES = {
    side: f"{side} electrode film resistance activation energy [J.mol-1]" for side in ("Negative", "Positive")
}
RATE_FACTORS = {side: f"{side} electrode reaction rate factor" for side in ("Negative", "Positive")}
"""The fields of `Electrode.rate_factor` in the user-defined section."""
DOUBLE_LAYERS = {side: f"{side} electrode double-layer capacity [F.m-2]" for side in ("Negative", "Positive")}


@hashed_once
@dataclass(frozen=True)
class Electrode:
    """A porous electrode of one active material.

    Relations are of the stoichiometry x, at the reference temperature.
    theta_min, theta_max : limits of x; those of the empty and of the full cell for the negative electrode, of the full
    and of the empty cell for the positive one.
    ocp : V against Li/Li+.  entropic : V/K.  diffusivity : m2/s.  conductivity_s_m : effective, of the solid.
    rate_constant K, rate_factor f : mol/(m2 s) and 1; the exchange current density is
    F K f(x) sqrt(c_e / c_e0 x (1 - x)).
    film_ohm_m2 : ohm m2 of reactive surface, between reaction and electrolyte.
    double_layer_f_m2 : F per m2 of reactive surface.
    *_ea_j_mol : activation energies, J/mol.
    ocp_lithiation, ocp_delithiation (V against Li/Li+), hysteresis_decay : as declared, for other programs; None where
    they are not. No simulation uses them.
    """

    thickness_m: float
    particle_radius_m: float
    area_per_volume_1_m: float
    porosity: float
    transport_efficiency: float
    conductivity_s_m: float
    theta_min: float
    theta_max: float
    c_max_mol_m3: float
    diffusivity: Relation
    ocp: Relation
    rate_constant: float
    entropic: Relation = NO_ENTROPY
    rate_factor: Relation = UNITY
    double_layer_f_m2: float = 0.0
    film_ohm_m2: Relation = NO_FILM
    diffusivity_ea_j_mol: float = 0.0
    rate_ea_j_mol: float = 0.0
    film_ea_j_mol: float = 0.0
    ocp_lithiation: Relation | None = None
    ocp_delithiation: Relation | None = None
    hysteresis_decay: float | None = None

    @property
    def active_fraction(self) -> float:
        """Volume fraction of active material, a R / 3."""
        return self.area_per_volume_1_m * self.particle_radius_m / 3.0


@dataclass(frozen=True)
class Separator:
    """Thickness in m; porosity and transport efficiency are fractions."""

    thickness_m: float
    porosity: float
    transport_efficiency: float


@hashed_once
@dataclass(frozen=True)
class Electrolyte:
    """Concentration in mol/m3, conductivity in S/m and diffusivity in m2/s as functions of concentration."""

    c0_mol_m3: float
    transference: float
    conductivity: Relation
    diffusivity: Relation
    conductivity_ea_j_mol: float = 0.0
    diffusivity_ea_j_mol: float = 0.0


@dataclass(frozen=True)
class Balance:
    """The parameters of a cell at rest: open-circuit potentials of the electrodes (V against Li/Li+), and the
    stoichiometry limits (empty, full) of each."""

    ocp_n: Relation
    ocp_p: Relation
    window_n: tuple[float, float]
    window_p: tuple[float, float]

    def stoichiometries(self, soc: Soc) -> tuple[Soc, Soc]:
        """(negative, positive) at a state of charge."""
        (empty_n, full_n), (empty_p, full_p) = self.window_n, self.window_p
        return empty_n + soc * (full_n - empty_n), empty_p - soc * (empty_p - full_p)

    def rest_voltage_v(self, soc: float | Array) -> Array:
        """(n,) V at the reference temperature."""
        theta_n, theta_p = self.stoichiometries(np.atleast_1d(np.asarray(soc, dtype=float)))
        return self.ocp_p(theta_p) - self.ocp_n(theta_n)

    def rest_voltage_at(self, soc: float) -> float:
        """V at the reference temperature, for a single state of charge."""
        theta_n, theta_p = self.stoichiometries(soc)
        return value_at(self.ocp_p, theta_p) - value_at(self.ocp_n, theta_n)


@dataclass(frozen=True)
class CellParameters:
    """Everything a simulation needs to know about a cell; `aesi.Cell` adds how it is read and written.

    electrode_area_m2 : of one electrode pair.
    density_kg_m3 to heat_transfer_w_m2_k : None where the file has no thermal data.
    thermal_conductivity_w_m_k : from the inside of the winding to the case, see `winding_resistance_k_w`.
    initial_soc : as declared, for other programs; simulations take `soc0` instead.
    contact_resistance_ohm : in series with the whole cell, of metal, independent of temperature.
    fitted_with : "espm" or "dfn", the model that the parameters were fitted with; '' where they were not fitted.
    capacity_shares : (record, capacity of the cell then over the capacity in the file), for the records of that fit.
    tested_on : (record, day of its test), where known.  fitted_at_k : (record, its mean temperature, K).
    unread : sentences on declarations of the file that no simulation uses (a hysteresis, a state of ageing).
    """

    negative: Electrode
    separator: Separator
    positive: Electrode
    electrolyte: Electrolyte
    electrode_area_m2: float
    electrode_pairs: int
    nominal_capacity_ah: float
    lower_voltage_v: float
    upper_voltage_v: float
    reference_temperature_k: float = 298.15
    initial_soc: float = 1.0
    initial_temperature_k: float = 298.15
    ambient_temperature_k: float = 298.15
    density_kg_m3: float | None = None
    specific_heat_j_kg_k: float | None = None
    volume_m3: float | None = None
    surface_area_m2: float | None = None
    thermal_conductivity_w_m_k: float | None = None
    heat_transfer_w_m2_k: float | None = None
    contact_resistance_ohm: float = 0.0
    fitted_with: str = ""
    capacity_shares: tuple[tuple[str, float], ...] = ()
    tested_on: tuple[tuple[str, date], ...] = ()
    fitted_at_k: tuple[tuple[str, float], ...] = ()
    name: str = "cell"
    description: str = ""
    references: str = ""
    unread: tuple[str, ...] = field(default=(), compare=False)

    @property
    def electrodes(self) -> dict[str, Electrode]:
        """ "negative" and "positive" -> the electrode."""
        return {"negative": self.negative, "positive": self.positive}

    @property
    def total_area_m2(self) -> float:
        """Area of all electrode pairs, m2."""
        return self.electrode_area_m2 * self.electrode_pairs

    def electrode_capacity_ah(self, electrode: Electrode) -> float:
        """Charge between stoichiometry 0 and 1 of an electrode, Ah."""
        volume = self.total_area_m2 * electrode.thickness_m
        return FARADAY_C_MOL * electrode.active_fraction * volume * electrode.c_max_mol_m3 / SECONDS_PER_HOUR

    def window_capacity_ah(self, electrode: Electrode) -> float:
        """Charge between the stoichiometry limits of an electrode, Ah."""
        return (electrode.theta_max - electrode.theta_min) * self.electrode_capacity_ah(electrode)

    def reactive_area_m2(self, electrode: Electrode) -> float:
        """Surface of all particles of an electrode, m2."""
        return self.total_area_m2 * electrode.thickness_m * electrode.area_per_volume_1_m

    @property
    def capacity_ah(self) -> float:
        """Charge between the stoichiometry limits of the negative electrode, Ah."""
        return self.window_capacity_ah(self.negative)

    @property
    def contacts_and_films_ohm(self) -> float:
        """Resistance of the contacts and of both electrodes' films over the whole cell, half charged and at the
        reference temperature."""
        half = self.stoichiometries(0.5)
        ohm = self.contact_resistance_ohm
        for electrode, theta in zip((self.negative, self.positive), half, strict=True):
            ohm += float(electrode.film_ohm_m2(np.array([theta]))[0]) / self.reactive_area_m2(electrode)
        return ohm

    @property
    def winding_resistance_k_w(self) -> float:
        """Thermal resistance between the mean of the winding and its case, K/W; 0 where the file declares no thermal
        conductivity or no heat capacity.

        For a long cylinder with uniform heat release, k its conductivity, V its volume and A its surface, it is
        (V/A)/(2 k A), from the mean of q (r0^2 - r^2)/(4 k). A plate of the same V and A has two thirds of it.
        """
        k, surface, volume = self.thermal_conductivity_w_m_k, self.surface_area_m2, self.volume_m3
        if k is None or surface is None or volume is None or self.heat_capacity_j_k is None:
            return 0.0
        return volume / surface / (2.0 * k * surface)

    @property
    def conductance_w_k(self) -> float | None:
        """Thermal conductance from the winding through the case to the surroundings, W/K; None where the file does not
        declare it."""
        if self.heat_transfer_w_m2_k is None or self.surface_area_m2 is None:
            return None
        outside = self.heat_transfer_w_m2_k * self.surface_area_m2
        return outside / (1.0 + outside * self.winding_resistance_k_w)

    def case_share(self, conductance_w_k: float) -> float:
        """Temperature rise of the case over that of the winding, both above the surroundings: 1 - R G.

        conductance_w_k : G, W/K, from the winding to the surroundings; it includes the winding's resistance R.
        Returns 1 where the file declares no R, and 0 or less where G exceeds the winding's own conductance 1/R.
        """
        return 1.0 - self.winding_resistance_k_w * conductance_w_k

    @property
    def heat_capacity_j_k(self) -> float | None:
        """Density times specific heat times volume, J/K; None where one of them is not declared."""
        if self.density_kg_m3 is None or self.specific_heat_j_kg_k is None or self.volume_m3 is None:
            return None
        return self.density_kg_m3 * self.specific_heat_j_kg_k * self.volume_m3

    @property
    def balance(self) -> Balance:
        """The open-circuit potentials and stoichiometry limits of the cell."""
        n, p = self.negative, self.positive
        return Balance(n.ocp, p.ocp, (n.theta_min, n.theta_max), (p.theta_max, p.theta_min))

    def stoichiometries(self, soc: float) -> tuple[float, float]:
        """Rest stoichiometries (negative, positive) at a state of charge, by the declared limits."""
        return self.balance.stoichiometries(soc)

    def soc_of(self, mean_n: Array) -> Array:
        """(n,) state of charge at mean stoichiometries of the negative electrode (n,), by the declared limits; the
        inverse of `stoichiometries`, below 0 and above 1 too."""
        n = self.negative
        return (mean_n - n.theta_min) / (n.theta_max - n.theta_min)

    def rest_voltage_v(self, soc: float | Array) -> Array:
        """(n,) V, the open-circuit voltage at the reference temperature."""
        return self.balance.rest_voltage_v(soc)

    def with_negative(self, **changes: Any) -> Self:
        """A copy with fields of the negative electrode replaced."""
        return replace(self, negative=replace(self.negative, **changes))

    def with_positive(self, **changes: Any) -> Self:
        """A copy with fields of the positive electrode replaced."""
        return replace(self, positive=replace(self.positive, **changes))

    def with_electrolyte(self, **changes: Any) -> Self:
        """A copy with fields of the electrolyte replaced."""
        return replace(self, electrolyte=replace(self.electrolyte, **changes))

    def with_soh(self, soh: Soh) -> Self:
        """The cell at a state of health, see `with_material`.

        soh : remaining share of the file's capacity, or a day, for the share of that day.
        Raises CellError as `checked_soh` and `soh_on` do.
        """
        checked = checked_soh(soh)
        return self.with_material(self.soh_on(checked) if isinstance(checked, date) else checked)

    def soh_on(self, day: date) -> float:
        """Capacity of the cell on a day over the capacity in its file, from the records that it was fitted to
        (`health`).

        Raises CellError where none of these records has a date, and for a day before the first or after the last one.
        """
        days, shares = shares_by_day(self.capacity_shares, dict(self.tested_on))
        if not days:
            raise CellError(
                f"the state of health of {day}: the file of {self.name} knows no day of its cell; give the share of "
                "its capacity that was left, or calibrate it with the dates of its records."
            )
        at = day_of(day)
        if not days[0] <= at <= days[-1]:
            when = f"on {days[0]} alone" if days[0] == days[-1] else f"from {days[0]} to {days[-1]}"
            raise CellError(
                f"the state of health of {at}: the file of {self.name} knows its cell {when}; give the share of its "
                "capacity that was left."
            )
        return float(np.interp(at.toordinal(), [known.toordinal() for known in days], shares))

    def with_material(self, share: float) -> Self:
        """The cell with this share of its active material and of the lithium in it, the same in both electrodes, so
        that the stoichiometry limits stay. Its `capacity_shares` become relative to the new capacity."""
        n, p = self.negative, self.positive
        changed = self.with_negative(c_max_mol_m3=n.c_max_mol_m3 * share).with_positive(
            c_max_mol_m3=p.c_max_mol_m3 * share
        )
        return replace(
            changed, capacity_shares=tuple((name, then / share) for name, then in self.capacity_shares)
        )


def require_positive(what: str, values: Mapping[str, float]) -> None:
    """Check the values of a part `what`, by field of the file.  Raises CellError for the first that is not positive."""
    for name, value in values.items():
        if not value > 0 or not np.isfinite(value):
            raise CellError(f"{what}: {name} = {value:g} has to be a positive number.")
