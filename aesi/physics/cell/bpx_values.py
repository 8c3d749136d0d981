"""What the values of a cell's file cannot be: one sentence for the first that no cell has.

The limits are wide: they tell a wrong unit or sign, not a poor parametrisation.
"""

from __future__ import annotations

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC, ZERO_CELSIUS_K
from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.bpx_transport import POINTS, inside_window
from aesi.physics.cell.parts import CellParameters, Electrode, require_positive
from aesi.physics.cell.relations import Relation

ELECTRODE_ENERGIES = ("diffusivity_ea_j_mol", "rate_ea_j_mol", "film_ea_j_mol")
ELECTROLYTE_ENERGIES = ("conductivity_ea_j_mol", "diffusivity_ea_j_mol")
OTHER_UNIT = 10.0
"""Nominal capacity over that of an electrode's window, or the other way round: units differ by thousands, cells by
less."""

FARTHEST_V = 1.0
"""Of the open-circuit voltage of a full cell from the upper cut-off: 0.01 to 0.05 V as looked at in the shipped files,
0.18 V in LFP's, which falls steeply there; who cycles a part of the range cuts off some 0.6 V less. Swapped electrodes
are 5.9 V off and more."""
LEAST_ENERGY_J_MOL = 600.0
"""Of the largest activation energy: 30 to 89 kJ/mol in the shipped files, 5 to 81 in twelve published sets (of PyBaMM),
which without the kilo are 5 to 89; this is the middle of 89 and 5,000 on a logarithmic scale."""
KILO = 1000.0
LARGEST_ENTROPIC_V_K = 0.01
"""Within the window of an electrode 4e-5 to 6e-4 V/K in the shipped files and in four published sets (of PyBaMM) and
0.0036 V/K in a fifth, whose formula rises at its end (Mohtat 2020); in mV/K the least of them is 0.04."""
HEAT_J_K_AH = (0.5, 1000.0)
"""Heat capacity over nominal capacity: 9 to 52 J/(K Ah) in the shipped files, 7 to 27 by the layers of eight published
sets (of PyBaMM), and a thousand times more or less where one of its factors is in another unit."""
LEAST_CUT_OFF_V = 0.1
"""Lower cut-offs are 1 V and more (LFP|LTO), which is 0.001 kV; 0.06 V is half way to the 0.004 kV of the highest."""


def check_values(cell: CellParameters, where: str) -> None:
    """Raises CellError, naming `where` and the value."""
    _check_electrode(cell.negative, f"{where}: Negative electrode")
    _check_electrode(cell.positive, f"{where}: Positive electrode")
    require_positive(
        where,
        electrode_area_m2=cell.electrode_area_m2,
        electrode_pairs=cell.electrode_pairs,
        nominal_capacity_ah=cell.nominal_capacity_ah,
        separator_thickness_m=cell.separator.thickness_m,
        separator_porosity=cell.separator.porosity,
        separator_transport_efficiency=cell.separator.transport_efficiency,
        electrolyte_concentration_mol_m3=cell.electrolyte.c0_mol_m3,
    )
    _check_share(f"{where}: Separator", "porosity", cell.separator.porosity)
    _check_share(f"{where}: Separator", "transport efficiency", cell.separator.transport_efficiency)
    _check_share(f"{where}: Electrolyte", "transference", cell.electrolyte.transference)
    at_rest = np.array([cell.electrolyte.c0_mol_m3])
    for name in ("conductivity", "diffusivity"):
        _check_positive(getattr(cell.electrolyte, name), at_rest, f"{where}: Electrolyte: {name}", "mol/m3")
    if not LEAST_CUT_OFF_V <= cell.lower_voltage_v < cell.upper_voltage_v:
        raise CellError(
            f"{where}: the lower cut-off ({cell.lower_voltage_v:g} V) has to be at least {LEAST_CUT_OFF_V:g} V and "
            f"below the upper one ({cell.upper_voltage_v:g} V); both are in V, so that 2500 mV is 2.5."
        )
    for name in ("reference", "initial", "ambient"):
        kelvin = getattr(cell, f"{name}_temperature_k")
        if not COLDEST_DEGC <= kelvin - ZERO_CELSIUS_K <= WARMEST_DEGC:
            raise CellError(
                f"{where}: {name}_temperature_k = {kelvin:g} K is no temperature of a cell; 25 degC is 298.15 K."
            )
    _check_capacity(cell, where)
    _check_full(cell, where)
    _check_temperature_dependence(cell, where)
    _check_thermal(cell, where)


def _check_capacity(cell: CellParameters, where: str) -> None:
    """Each electrode holds about the nominal capacity."""
    for label, electrode in (("negative", cell.negative), ("positive", cell.positive)):
        window = (electrode.theta_max - electrode.theta_min) * cell.electrode_capacity_ah(electrode)
        if not 1.0 / OTHER_UNIT <= cell.nominal_capacity_ah / window <= OTHER_UNIT:
            raise CellError(
                f"{where}: the nominal capacity is {cell.nominal_capacity_ah:g} A.h, but the {label} electrode holds "
                f"{window:.4g} A.h between its stoichiometry limits; one of them is in another unit, or the number of "
                "electrode pairs is another."
            )


def _check_full(cell: CellParameters, where: str) -> None:
    """The potentials of the full cell make about the upper cut-off."""
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
    """Activation energies in J/mol, entropic coefficients in V/K."""
    energies = {
        f"{side}: {name}": getattr(part, name)
        for side, part, names in (
            ("Negative electrode", cell.negative, ELECTRODE_ENERGIES),
            ("Positive electrode", cell.positive, ELECTRODE_ENERGIES),
            ("Electrolyte", cell.electrolyte, ELECTROLYTE_ENERGIES),
        )
        for name in names
    }
    for name, value in energies.items():
        if not value >= 0.0:
            raise CellError(f"{where}: {name} = {value:g} has to be 0 or more: with warmth all of them rise.")
    name = max(energies, key=lambda one: energies[one])
    if 0.0 < energies[name] < LEAST_ENERGY_J_MOL:
        raise CellError(
            f"{where}: {name} = {energies[name]:g} is the largest activation energy, and as good as none; they are in "
            "J/mol, so that 30 kJ/mol is 30000."
        )
    if energies[name] > KILO * LEAST_ENERGY_J_MOL:
        raise CellError(
            f"{where}: {name} = {energies[name]:g} is {energies[name] / KILO:g} kJ/mol, and no activation energy of a "
            "cell is; they are in J/mol, so that 30 kJ/mol is 30000."
        )
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        largest = float(np.max(np.abs(electrode.entropic(inside_window(electrode)))))
        if not largest <= LARGEST_ENTROPIC_V_K:
            raise CellError(
                f"{where}: {side} electrode: the entropic change coefficient is {largest:g} V/K, more than any "
                "electrode's; it is in V/K, so that 0.1 mV/K is 0.0001."
            )


def _check_thermal(cell: CellParameters, where: str) -> None:
    """What is there of mass, heat capacity and surface is positive, and together that of a cell."""
    names = ("density_kg_m3", "specific_heat_j_kg_k", "volume_m3")
    there = {
        name: value
        for name in (*names, "surface_area_m2", "thermal_conductivity_w_m_k")
        if (value := getattr(cell, name)) is not None
    }
    require_positive(where, **there)
    if not all(name in there for name in names):
        return
    least, most = HEAT_J_K_AH
    heat = float(np.prod([there[name] for name in names])) / cell.nominal_capacity_ah
    if not least <= heat <= most:
        raise CellError(
            f"{where}: density, specific heat capacity and volume make {heat:.3g} J/K for each ampere-hour, and "
            "cells have 7 to 52; one of them is in another unit than kg/m3, J/(kg K) and m3."
        )


def _check_electrode(electrode: Electrode, what: str) -> None:
    require_positive(
        what,
        thickness_m=electrode.thickness_m,
        particle_radius_m=electrode.particle_radius_m,
        area_per_volume_1_m=electrode.area_per_volume_1_m,
        porosity=electrode.porosity,
        transport_efficiency=electrode.transport_efficiency,
        conductivity_s_m=electrode.conductivity_s_m,
        c_max_mol_m3=electrode.c_max_mol_m3,
        rate_constant=electrode.rate_constant,
    )
    _check_share(what, "porosity", electrode.porosity)
    _check_share(what, "transport efficiency", electrode.transport_efficiency)
    if not 0.0 <= electrode.theta_min < electrode.theta_max <= 1.0:
        raise CellError(
            f"{what}: stoichiometry limits [{electrode.theta_min:g}, {electrode.theta_max:g}] "
            "have to satisfy 0 <= minimum < maximum <= 1."
        )
    inside = inside_window(electrode)
    _check_positive(electrode.diffusivity, inside, f"{what}: diffusivity", "")
    potential = electrode.ocp(inside)
    if not np.isfinite(potential).all():
        x = inside[int(np.argmin(np.isfinite(potential)))]
        raise CellError(f"{what}: the open-circuit potential is not finite at a stoichiometry of {x:.3g}.")


def _check_share(what: str, name: str, value: float) -> None:
    if value >= 1.0:
        raise CellError(f"{what}: {name} = {value:g} has to be a share below 1; 30 % is 0.3.")


def _check_positive(relation: Relation, x: Array, what: str, unit: str) -> None:
    values = relation(x)
    wrong = ~(values > 0.0) | ~np.isfinite(values)
    if wrong.any():
        at = int(np.argmax(wrong))
        place = f"{x[at]:g} {unit}" if unit else f"a stoichiometry of {x[at]:.3g}"
        raise CellError(f"{what} is {values[at]:g} at {place}; it has to be a positive number.")
