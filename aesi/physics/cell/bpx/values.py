"""Checks of the values in a cell's file; an error is one sentence on the first value that no cell has.

The limits are wide: they detect a wrong unit or sign, not a poor parametrisation.
"""

from __future__ import annotations

import numpy as np

from aesi.constants import COLDEST_DEGC, SECONDS_PER_HOUR, WARMEST_DEGC, ZERO_CELSIUS_K
from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.bpx.transport import POINTS, inside_window
from aesi.physics.cell.parts import (
    CAPACITY_SHARES,
    CONTACT_RESISTANCE,
    DOUBLE_LAYERS,
    FILM_ENERGIES,
    FILM_RESISTANCES,
    FITTED_AT,
    HEAT_TRANSFER,
    RATE_FACTORS,
    TESTED_ON,
    THERMAL_CONDUCTIVITY,
    CellParameters,
    Electrode,
    Electrolyte,
    require_positive,
)
from aesi.physics.cell.relations import LookupTable, Relation

OTHER_UNIT = 10.0
"""Largest ratio, in both directions, of the nominal capacity to that of an electrode's window, or of the capacity of a
record to that of the file: units differ by thousands and per cent by a hundred, cells by less."""

FARTHEST_V = 1.0
"""Largest distance of a full cell's open-circuit voltage from the upper cut-off: 0.01 to 0.05 V in the shipped files,
0.18 V in LFP's, which is steep there; for cycling in a part of the range the cut-off is some 0.6 V lower. With swapped
electrodes it is 5.9 V or more."""
LEAST_ENERGY_J_MOL = 600.0
"""Least declared activation energy: 4 to 89 kJ/mol in the shipped files that are no fits and in twelve published sets
(of PyBaMM). In kJ/mol the numbers would be 4 to 89; the limit is the middle of 89 and 4,000 on a logarithmic scale. A
fit may end at any value down to 0."""
KILO = 1000.0
LARGEST_ENTROPIC_V_K = 0.01
"""Largest entropic coefficient in the window of an electrode: 4e-5 to 6e-4 V/K in the shipped files and in four
published sets (of PyBaMM), and 0.0036 V/K in a fifth, whose formula rises at its end (Mohtat 2020). In mV/K the
smallest number would be 0.04."""
HEAT_J_K_AH = (0.5, 1000.0)
"""Range of heat capacity over nominal capacity: 9 to 52 J/(K Ah) in the shipped files, 7 to 27 by the layers of eight
published sets (of PyBaMM), and a thousand times more or less where one of its factors is in another unit."""
LEAST_LAYER_F_M2 = 1e-4
"""Least declared capacity of a double layer: a molecular layer has 0.05 to 0.5 F/m2, fits in the shipped files 1.6 to
31; 20 uF/cm2 written as 2e-5 F/cm2 are below the limit."""
CONDUCTS_W_M_K = (0.01, 100.0)
"""Range of the thermal conductivity across a winding: 0.15 to 0.2 W/(m K) as measured (Drake et al. 2014), 0.18 to 0.69
in the shipped files. Still air has 0.026, foils along their plane some 30. In W/(cm K) or mW/(m K) values are outside.
"""
SALT_MOL_M3 = (20.0, 2e4)
"""Range of the salt's concentration at rest: 1000 or 1200 mol/m3 in the shipped files; 0.1 to 5 mol/L in electrolytes
that were tried in cells, which is 100 to 5000 mol/m3. The limits are a factor of four to five beyond, halfway to the
number 5 in mol/L."""
BEYOND_FILLING = 0.5
"""Largest distance of a table's stoichiometries from 0 to 1: 0 in the shipped files. In per cent, or in mAh, a table
ends at 50 or more."""
LEAST_CUT_OFF_V = 0.1
"""Least lower cut-off: they are 1 V or more (LFP|LTO), which is 0.001 kV; 0.06 V is halfway between 1 and the 0.004 kV
of the highest."""


def check_values(cell: CellParameters, where: str) -> None:
    """Raises CellError, naming `where` and the value."""
    _check_electrode(cell.negative, f"{where}: Negative electrode")
    _check_electrode(cell.positive, f"{where}: Positive electrode")
    require_positive(
        where,
        {
            "Electrode area [m2]": cell.electrode_area_m2,
            "Number of electrode pairs connected in parallel to make a cell": cell.electrode_pairs,
            "Nominal cell capacity [A.h]": cell.nominal_capacity_ah,
        },
    )
    require_positive(
        f"{where}: Separator",
        {
            "Thickness [m]": cell.separator.thickness_m,
            "Porosity": cell.separator.porosity,
            "Transport efficiency": cell.separator.transport_efficiency,
        },
    )
    _check_share(f"{where}: Separator", "porosity", cell.separator.porosity)
    _check_share(f"{where}: Separator", "transport efficiency", cell.separator.transport_efficiency)
    _check_electrolyte(cell.electrolyte, where)
    if not LEAST_CUT_OFF_V <= cell.lower_voltage_v < cell.upper_voltage_v:
        raise CellError(
            f"{where}: the lower cut-off ({cell.lower_voltage_v:g} V) has to be at least {LEAST_CUT_OFF_V:g} V and "
            f"below the upper one ({cell.upper_voltage_v:g} V); both are in V, so that 2500 mV is 2.5."
        )
    for name, kelvin in (
        ("Reference temperature [K]", cell.reference_temperature_k),
        ("Initial temperature [K]", cell.initial_temperature_k),
        ("Ambient temperature [K]", cell.ambient_temperature_k),
        *((f"User-defined: {FITTED_AT}: {record}", kelvin) for record, kelvin in cell.fitted_at_k),
    ):
        if not COLDEST_DEGC <= kelvin - ZERO_CELSIUS_K <= WARMEST_DEGC:
            raise CellError(f"{where}: {name} = {kelvin:g} is no temperature of a cell; 25 degC is 298.15 K.")
    _check_own_fields(cell, f"{where}: User-defined")
    _check_capacity(cell, where)
    _check_full(cell, where)
    _check_temperature_dependence(cell, where)
    _check_thermal(cell, where)


def _check_own_fields(cell: CellParameters, what: str) -> None:
    """Check contacts, films, double layers and rate factors, and the capacities and days of records."""
    # A cell whose contacts drop the whole voltage window at 1C would be useless at any size. Those of the shipped files
    # drop 0.001 to 0.02 of the window; with milliohms read as ohms it would be 1.5 to 20 times the window.
    drop_v = cell.contact_resistance_ohm * cell.nominal_capacity_ah
    window_v = cell.upper_voltage_v - cell.lower_voltage_v
    if drop_v > window_v:
        raise CellError(
            f"{what}: {CONTACT_RESISTANCE} = {cell.contact_resistance_ohm:g} takes {drop_v:.3g} V at "
            f"{cell.nominal_capacity_ah:g} A, more than the {window_v:.3g} V between the cut-offs; it is in ohms, so "
            "that 5 mOhm is 0.005."
        )
    stoichiometry = np.linspace(0.0, 1.0, POINTS)
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        _check_positive(electrode.rate_factor, stoichiometry, f"{what}: {RATE_FACTORS[side]}", "")
        _check_positive(
            electrode.film_ohm_m2, stoichiometry, f"{what}: {FILM_RESISTANCES[side]}", "", none=True
        )
        _check_surface(cell, electrode, side, window_v, what)
    for name, share in cell.capacity_shares:
        if not 1.0 / OTHER_UNIT <= share <= OTHER_UNIT:
            raise CellError(
                f"{what}: {CAPACITY_SHARES}: {name} = {share:g} is no share of the file's capacity; 95 % is 0.95."
            )
    without = [name for name, _ in cell.tested_on if name not in dict(cell.capacity_shares)]
    if without:
        raise CellError(
            f"{what}: {TESTED_ON}: {without[0]} has no share of the capacity; give it one in {CAPACITY_SHARES!r}, or "
            "take its day out."
        )


def _check_surface(cell: CellParameters, electrode: Electrode, side: str, window_v: float, what: str) -> None:
    """Check films and double layers by their effect over the whole reactive surface, as contacts: no film drops the
    whole voltage window at 1C, and no double layer stores as much charge as the cell over that window.

    In the shipped files films drop 0.0006 to 0.008 of the window, double layers store 0.0004 to 0.009 of the charge.
    """
    reactive_m2 = cell.reactive_area_m2(electrode)
    film = float(np.median(electrode.film_ohm_m2(inside_window(electrode))))
    drop_v = film * cell.nominal_capacity_ah / reactive_m2
    if drop_v > window_v:
        raise CellError(
            f"{what}: {FILM_RESISTANCES[side]} = {film:g} takes {drop_v:.3g} V at {cell.nominal_capacity_ah:g} A over "
            f"{reactive_m2:.3g} m2 of reactive surface, more than the {window_v:.3g} V between the cut-offs; it is in "
            "Ohm.m2, so that 1 mOhm.m2, or 10 Ohm.cm2, is 0.001."
        )
    layer = electrode.double_layer_f_m2
    held_ah = layer * reactive_m2 * window_v / SECONDS_PER_HOUR
    if held_ah > cell.nominal_capacity_ah or 0.0 < layer < LEAST_LAYER_F_M2:
        raise CellError(
            f"{what}: {DOUBLE_LAYERS[side]} = {layer:g} is no double layer's; it is in F/m2, so that 20 uF/cm2 is 0.2."
        )


def _check_capacity(cell: CellParameters, where: str) -> None:
    """Check that each electrode holds about the nominal capacity."""
    for label, electrode in cell.electrodes.items():
        window_ah = cell.window_capacity_ah(electrode)
        if not 1.0 / OTHER_UNIT <= cell.nominal_capacity_ah / window_ah <= OTHER_UNIT:
            raise CellError(
                f"{where}: the nominal capacity is {cell.nominal_capacity_ah:g} A.h, but the {label} electrode holds "
                f"{window_ah:.4g} A.h between its stoichiometry limits; one of them is in another unit, or the number "
                "of electrode pairs is another."
            )


def _check_full(cell: CellParameters, where: str) -> None:
    """Check that the open-circuit voltage of the full cell is about the upper cut-off."""
    full = 1.0 - 1.0 / POINTS  # potentials may be infinite at the very end
    positive, negative = cell.positive, cell.negative
    theta_p = positive.theta_max - full * (positive.theta_max - positive.theta_min)
    theta_n = negative.theta_min + full * (negative.theta_max - negative.theta_min)
    rest_v = float(positive.ocp(np.array([theta_p]))[0] - negative.ocp(np.array([theta_n]))[0])
    if abs(rest_v - cell.upper_voltage_v) > FARTHEST_V:
        raise CellError(
            f"{where}: the full cell rests at {rest_v:.4g} V by its open-circuit potentials, and the upper cut-off is "
            f"{cell.upper_voltage_v:g} V; one of them is in another unit, or the electrodes are swapped."
        )


def _check_temperature_dependence(cell: CellParameters, where: str) -> None:
    """Check that activation energies are not negative and not a thousand times too large, and that entropic
    coefficients are in V/K."""
    for name, value in _energies(cell).items():
        if not value >= 0.0:
            raise CellError(f"{where}: {name} = {value:g} has to be 0 or more: with warmth all of them rise.")
        if value > KILO * LEAST_ENERGY_J_MOL:
            raise CellError(
                f"{where}: {name} = {value:g} is {value / KILO:g} kJ/mol, and no activation energy of a cell is; it is "
                "in J/mol, so that 30 kJ/mol is 30000."
            )
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        largest = float(np.max(np.abs(electrode.entropic(inside_window(electrode)))))
        if not largest <= LARGEST_ENTROPIC_V_K:
            raise CellError(
                f"{where}: {side} electrode: the entropic change coefficient is {largest:g} V/K, more than any "
                "electrode's; it is in V/K, so that 0.1 mV/K is 0.0001."
            )


def check_energies(cell: CellParameters, where: str) -> None:
    """Raises CellError, naming `where` and the value, for declared activation energies in kJ/mol."""
    for name, value in _energies(cell).items():
        if 0.0 < value < LEAST_ENERGY_J_MOL:
            raise CellError(
                f"{where}: {name} = {value:g} is as good as none; it is in J/mol, so that 30 kJ/mol is 30000."
            )


def _energies(cell: CellParameters) -> dict[str, float]:
    """Section and field -> activation energy, J/mol."""
    out = {}
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        section = f"{side} electrode"
        out[f"{section}: Diffusivity activation energy [J.mol-1]"] = electrode.diffusivity_ea_j_mol
        out[f"{section}: Reaction rate constant activation energy [J.mol-1]"] = electrode.rate_ea_j_mol
        out[f"User-defined: {FILM_ENERGIES[side]}"] = electrode.film_ea_j_mol
    electrolyte = cell.electrolyte
    out["Electrolyte: Conductivity activation energy [J.mol-1]"] = electrolyte.conductivity_ea_j_mol
    out["Electrolyte: Diffusivity activation energy [J.mol-1]"] = electrolyte.diffusivity_ea_j_mol
    return out


def _check_thermal(cell: CellParameters, where: str) -> None:
    """Check that the given ones of mass, heat capacity and surface are positive and together those of a cell, and that
    the heat transfer is not negative."""
    declared = {
        "Density [kg.m-3]": cell.density_kg_m3,
        "Specific heat capacity [J.K-1.kg-1]": cell.specific_heat_j_kg_k,
        "Volume [m3]": cell.volume_m3,
        "External surface area [m2]": cell.surface_area_m2,
        THERMAL_CONDUCTIVITY: cell.thermal_conductivity_w_m_k,
    }
    require_positive(where, {name: value for name, value in declared.items() if value is not None})
    conducts = cell.thermal_conductivity_w_m_k
    if conducts is not None and not CONDUCTS_W_M_K[0] <= conducts <= CONDUCTS_W_M_K[1]:
        raise CellError(
            f"{where}: User-defined: {THERMAL_CONDUCTIVITY} = {conducts:g} is no winding's; it is in W/(m K), across "
            "the winding, so that 200 mW/(m K) is 0.2."
        )
    cooled = cell.heat_transfer_w_m2_k
    if cooled is not None and not 0.0 <= cooled < np.inf:
        raise CellError(f"{where}: {HEAT_TRANSFER} = {cooled:g} has to be a number from 0 (no cooling) on.")
    if cell.heat_capacity_j_k is None:
        return
    least, most = HEAT_J_K_AH
    heat = cell.heat_capacity_j_k / cell.nominal_capacity_ah
    if not least <= heat <= most:
        raise CellError(
            f"{where}: density, specific heat capacity and volume make {heat:.3g} J/K for each ampere-hour, and "
            "cells have 7 to 52; one of them is in another unit than kg/m3, J/(kg K) and m3."
        )


def _check_electrode(electrode: Electrode, what: str) -> None:
    require_positive(
        what,
        {
            "Thickness [m]": electrode.thickness_m,
            "Particle radius [m]": electrode.particle_radius_m,
            "Surface area per unit volume [m-1]": electrode.area_per_volume_1_m,
            "Porosity": electrode.porosity,
            "Transport efficiency": electrode.transport_efficiency,
            "Conductivity [S.m-1]": electrode.conductivity_s_m,
            "Maximum concentration [mol.m-3]": electrode.c_max_mol_m3,
            "Reaction rate constant [mol.m-2.s-1]": electrode.rate_constant,
        },
    )
    _check_share(what, "porosity", electrode.porosity)
    _check_share(what, "transport efficiency", electrode.transport_efficiency)
    if not 0.0 <= electrode.theta_min < electrode.theta_max <= 1.0:
        raise CellError(
            f"{what}: stoichiometry limits [{electrode.theta_min:g}, {electrode.theta_max:g}] "
            "have to satisfy 0 <= minimum < maximum <= 1."
        )
    _check_filling(electrode, what)
    inside = inside_window(electrode)
    _check_positive(electrode.diffusivity, inside, f"{what}: diffusivity", "")
    potential = electrode.ocp(inside)
    potentials = {"the open-circuit potential": potential}
    for name, branch in (
        ("OCP (lithiation) [V]", electrode.ocp_lithiation),
        ("OCP (delithiation) [V]", electrode.ocp_delithiation),
    ):
        if branch is not None:
            potentials[name] = branch(inside)
    for name, volts in potentials.items():
        if not np.isfinite(volts).all():
            x = inside[int(np.argmin(np.isfinite(volts)))]
            raise CellError(f"{what}: {name} is not finite at a stoichiometry of {x:.3g}.")
    decay = electrode.hysteresis_decay
    if decay is not None and not 0.0 <= decay < np.inf:
        raise CellError(f"{what}: OCP hysteresis decay constant = {decay:g} has to be a number from 0 on.")
    if potential[-1] > potential[0]:
        raise CellError(
            f"{what}: the open-circuit potential rises from {potential[0]:.4g} V at a stoichiometry of {inside[0]:.3g} "
            f"to {potential[-1]:.4g} V at {inside[-1]:.3g}; that of an electrode falls as it takes up lithium: the "
            "stoichiometry may be counted the other way round."
        )


def _check_filling(electrode: Electrode, what: str) -> None:
    """Check that tables are over stoichiometries: beyond its ends a table is constant, so that one over per cent would
    be taken for its first value."""
    relations = {
        "OCP [V]": electrode.ocp,
        "Diffusivity [m2.s-1]": electrode.diffusivity,
        "Entropic change coefficient [V.K-1]": electrode.entropic,
        "OCP (lithiation) [V]": electrode.ocp_lithiation,
        "OCP (delithiation) [V]": electrode.ocp_delithiation,
    }
    for name, table in relations.items():
        if not isinstance(table, LookupTable):
            continue
        if table.x[0] < -BEYOND_FILLING or table.x[-1] > 1.0 + BEYOND_FILLING:
            raise CellError(
                f"{what}, {name}: x of a table runs from {table.x[0]:g} to {table.x[-1]:g}; it is a stoichiometry, "
                "from 0 to 1, so that 30 % is 0.3."
            )


def _check_electrolyte(electrolyte: Electrolyte, where: str) -> None:
    """Check the concentration at rest and the properties there. A table over the concentration has to hold that one,
    which is that of most of the cell."""
    rest, (least, most) = electrolyte.c0_mol_m3, SALT_MOL_M3
    require_positive(where, {"Initial electrolyte concentration [mol.m-3]": rest})
    _check_share(f"{where}: Electrolyte", "transference", electrolyte.transference)
    if not least <= rest <= most:
        raise CellError(
            f"{where}: Initial electrolyte concentration [mol.m-3] = {rest:g} is outside {least:g} to {most:g} mol/m3, "
            "where all electrolytes are; 1 mol/L is 1000."
        )
    relations = {"conductivity": electrolyte.conductivity, "diffusivity": electrolyte.diffusivity}
    for name, relation in relations.items():
        what = f"{where}: Electrolyte: {name}"
        if isinstance(relation, LookupTable) and not relation.x[0] <= rest <= relation.x[-1]:
            raise CellError(
                f"{what}: x of a table runs from {relation.x[0]:g} to {relation.x[-1]:g}, without the concentration at "
                f"rest ({rest:g} mol/m3); it is in mol/m3, so that 1 mol/L is 1000."
            )
        _check_positive(relation, np.array([rest]), what, "mol/m3")


def _check_share(what: str, name: str, value: float) -> None:
    if not -np.inf < value < 1.0:  # this way round, NaN fails too
        raise CellError(f"{what}: {name} = {value:g} has to be a share below 1; 30 % is 0.3.")


def _check_positive(relation: Relation, x: Array, what: str, unit: str, *, none: bool = False) -> None:
    """Raises CellError for a relation that is not positive at x.  none : 0 is admissible, too."""
    values = relation(x)
    wrong = ~(values >= 0.0 if none else values > 0.0) | ~np.isfinite(values)
    if wrong.any():
        at = int(np.argmax(wrong))
        place = f"{x[at]:g} {unit}" if unit else f"a stoichiometry of {x[at]:.3g}"
        wanted = "0 or more" if none else "a positive number"
        raise CellError(f"{what} is {values[at]:g} at {place}; it has to be {wanted}.")
