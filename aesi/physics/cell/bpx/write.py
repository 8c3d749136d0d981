"""Conversion of a cell to the content of a BPX file; values without a BPX field are written where `read` looks."""

from __future__ import annotations

from typing import Any

from aesi.physics.cell.parts import (
    CAPACITY_SHARES,
    CONTACT_RESISTANCE,
    DOUBLE_LAYERS,
    FILM_ENERGIES,
    FILM_RESISTANCES,
    FITTED_AT,
    FITTED_WITH,
    HEAT_TRANSFER,
    INITIAL_SOC,
    NO_FILM,
    RATE_FACTORS,
    TESTED_ON,
    THERMAL_CONDUCTIVITY,
    UNITY,
    CellParameters,
    Electrode,
    Electrolyte,
)
from aesi.physics.cell.relations import to_bpx

BPX_VERSION = "1.1.0"
ELECTROLYTE_TABLE_MOL_M3 = (1.0, 4000.0)
"""Range of the table that replaces a function which BPX cannot express."""


def write_bpx(cell: CellParameters) -> dict[str, Any]:
    """See `Cell.to_bpx`."""
    header = {"BPX": BPX_VERSION, "Title": cell.name, "Model": "DFN"}
    if cell.description:
        header["Description"] = cell.description
    if cell.references:
        header["References"] = cell.references
    parts: dict[str, Any] = {
        "Cell": _write_cell(cell),
        "Electrolyte": _write_electrolyte(cell.electrolyte),
        "Negative electrode": _write_electrode(cell.negative),
        "Positive electrode": _write_electrode(cell.positive),
        "Separator": {
            "Thickness [m]": cell.separator.thickness_m,
            "Porosity": cell.separator.porosity,
            "Transport efficiency": cell.separator.transport_efficiency,
        },
    }
    own = _own_fields(cell)
    if own:
        parts["User-defined"] = own
    return {"Header": header, "Parameterisation": parts, "State": _write_state(cell)}


def _write_cell(cell: CellParameters) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "Reference temperature [K]": cell.reference_temperature_k,
        "Lower voltage cut-off [V]": cell.lower_voltage_v,
        "Upper voltage cut-off [V]": cell.upper_voltage_v,
        "Nominal cell capacity [A.h]": cell.nominal_capacity_ah,
        "Electrode area [m2]": cell.electrode_area_m2,
        "Number of electrode pairs connected in parallel to make a cell": cell.electrode_pairs,
    }
    optional = {
        "Density [kg.m-3]": cell.density_kg_m3,
        "Specific heat capacity [J.K-1.kg-1]": cell.specific_heat_j_kg_k,
        "Volume [m3]": cell.volume_m3,
        "External surface area [m2]": cell.surface_area_m2,
    }
    return fields | {name: value for name, value in optional.items() if value is not None}


def _write_electrolyte(electrolyte: Electrolyte) -> dict[str, Any]:
    return {
        "Cation transference number": electrolyte.transference,
        "Conductivity [S.m-1]": to_bpx(electrolyte.conductivity, *ELECTROLYTE_TABLE_MOL_M3),
        "Diffusivity [m2.s-1]": to_bpx(electrolyte.diffusivity, *ELECTROLYTE_TABLE_MOL_M3),
        "Conductivity activation energy [J.mol-1]": electrolyte.conductivity_ea_j_mol,
        "Diffusivity activation energy [J.mol-1]": electrolyte.diffusivity_ea_j_mol,
    }


def _own_fields(cell: CellParameters) -> dict[str, Any]:
    """The cell's values for which BPX has no field."""
    own: dict[str, Any] = {
        CONTACT_RESISTANCE: cell.contact_resistance_ohm,
        THERMAL_CONDUCTIVITY: cell.thermal_conductivity_w_m_k,
        **{field: float(model == cell.fitted_with) for model, field in FITTED_WITH.items()},
        CAPACITY_SHARES: dict(cell.capacity_shares),
        TESTED_ON: {name: int(f"{day:%Y%m%d}") for name, day in cell.tested_on},
        FITTED_AT: dict(cell.fitted_at_k),
    }
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        if electrode.rate_factor != UNITY:
            own[RATE_FACTORS[side]] = to_bpx(electrode.rate_factor)
        own[DOUBLE_LAYERS[side]] = electrode.double_layer_f_m2
        if electrode.film_ohm_m2 != NO_FILM:
            own[FILM_RESISTANCES[side]] = to_bpx(electrode.film_ohm_m2)
        own[FILM_ENERGIES[side]] = electrode.film_ea_j_mol
    return {name: value for name, value in own.items() if value}


def _write_state(cell: CellParameters) -> dict[str, Any]:
    surroundings = {"Ambient temperature [K]": cell.ambient_temperature_k}
    if cell.heat_transfer_w_m2_k is not None:
        surroundings[HEAT_TRANSFER] = cell.heat_transfer_w_m2_k
    return {
        "Initial conditions": {
            INITIAL_SOC: cell.initial_soc,
            "Initial temperature [K]": cell.initial_temperature_k,
            "Initial electrolyte concentration [mol.m-3]": cell.electrolyte.c0_mol_m3,
        },
        "Thermal environment": surroundings,
    }


def _write_electrode(electrode: Electrode) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "Particle radius [m]": electrode.particle_radius_m,
        "Thickness [m]": electrode.thickness_m,
        "Diffusivity [m2.s-1]": to_bpx(electrode.diffusivity),
        "OCP [V]": to_bpx(electrode.ocp),
        "Entropic change coefficient [V.K-1]": to_bpx(electrode.entropic),
        "Conductivity [S.m-1]": electrode.conductivity_s_m,
        "Surface area per unit volume [m-1]": electrode.area_per_volume_1_m,
        "Porosity": electrode.porosity,
        "Transport efficiency": electrode.transport_efficiency,
        "Reaction rate constant [mol.m-2.s-1]": electrode.rate_constant,
        "Minimum stoichiometry": electrode.theta_min,
        "Maximum stoichiometry": electrode.theta_max,
        "Maximum concentration [mol.m-3]": electrode.c_max_mol_m3,
        "Diffusivity activation energy [J.mol-1]": electrode.diffusivity_ea_j_mol,
        "Reaction rate constant activation energy [J.mol-1]": electrode.rate_ea_j_mol,
    }
    if electrode.ocp_lithiation is not None:
        fields["OCP (lithiation) [V]"] = to_bpx(electrode.ocp_lithiation)
    if electrode.ocp_delithiation is not None:
        fields["OCP (delithiation) [V]"] = to_bpx(electrode.ocp_delithiation)
    if electrode.hysteresis_decay is not None:
        fields["OCP hysteresis decay constant"] = electrode.hysteresis_decay
    return fields
