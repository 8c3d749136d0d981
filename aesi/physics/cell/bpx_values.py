"""What the values of a cell's file cannot be: one sentence for the first that no cell has.

The limits are wide: they tell a wrong unit or sign, not a poor parametrisation.
"""

from __future__ import annotations

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC, ZERO_CELSIUS_K
from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.parts import CellParameters, Electrode, require_positive
from aesi.physics.cell.relations import Relation

POINTS = 101
"""Stoichiometries between empty and full at which relations are looked at."""
OTHER_UNIT = 10.0
"""Nominal capacity over that of an electrode's window, or the other way round: units differ by thousands, cells by
less."""


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
    at_rest = np.array([cell.electrolyte.c0_mol_m3])
    for name in ("conductivity", "diffusivity"):
        _check_positive(getattr(cell.electrolyte, name), at_rest, f"{where}: Electrolyte: {name}", "mol/m3")
    if not 0.0 < cell.lower_voltage_v < cell.upper_voltage_v:
        raise CellError(
            f"{where}: the lower cut-off ({cell.lower_voltage_v:g} V) has to be above 0 and below the upper one "
            f"({cell.upper_voltage_v:g} V)."
        )
    for name in ("reference", "initial", "ambient"):
        kelvin = getattr(cell, f"{name}_temperature_k")
        if not COLDEST_DEGC <= kelvin - ZERO_CELSIUS_K <= WARMEST_DEGC:
            raise CellError(
                f"{where}: {name}_temperature_k = {kelvin:g} K is no temperature of a cell; 25 degC is 298.15 K."
            )
    for label, electrode in (("negative", cell.negative), ("positive", cell.positive)):
        window = (electrode.theta_max - electrode.theta_min) * cell.electrode_capacity_ah(electrode)
        if not 1.0 / OTHER_UNIT <= cell.nominal_capacity_ah / window <= OTHER_UNIT:
            raise CellError(
                f"{where}: the nominal capacity is {cell.nominal_capacity_ah:g} A.h, but the {label} electrode holds "
                f"{window:.4g} A.h between its stoichiometry limits; one of them is in another unit, or the number of "
                "electrode pairs is another."
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
    if not 0.0 <= electrode.theta_min < electrode.theta_max <= 1.0:
        raise CellError(
            f"{what}: stoichiometry limits [{electrode.theta_min:g}, {electrode.theta_max:g}] "
            "have to satisfy 0 <= minimum < maximum <= 1."
        )
    inside = np.linspace(electrode.theta_min, electrode.theta_max, POINTS)[
        1:-1
    ]  # potentials may be infinite at 0 or 1
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
