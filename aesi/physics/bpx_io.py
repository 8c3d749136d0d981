"""BPX files to cells and back.

The schema is checked by the `bpx` package. Its own check of the stoichiometry limits runs the text of the
open-circuit potentials as Python code, so these are read by `aesi.physics.expression` first and withheld
from it.
"""

from __future__ import annotations

import copy
import json
import warnings
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from aesi.errors import CellError
from aesi.physics.cell import Cell, Electrode, Electrolyte, Separator, require_positive
from aesi.physics.relations import Constant, Relation, relation, to_bpx

BPX_VERSION = "1.1.0"
CONTACT_RESISTANCE = "Contact resistance [Ohm]"
STANDIN_TABLE = {"x": [0.0, 1.0], "y": [1.0, 0.0]}
OCP_FIELDS = ("OCP [V]", "OCP (lithiation) [V]", "OCP (delithiation) [V]")
ELECTROLYTE_TABLE_MOL_M3 = (1.0, 4000.0)
DEFAULT_TEMPERATURE_K = 298.15

Fields = Mapping[str, Any]


def read_bpx(source: str | PathLike[str] | Mapping[str, Any]) -> Cell:
    """See `Cell.from_bpx`."""
    raw, where = _load(source)
    v1 = _as_v1(raw, where)
    _refuse_what_is_not_modelled(v1, where)
    _check_schema(v1, where)
    try:
        return _cell(v1, where)
    except KeyError as error:
        raise CellError(f"{where}: the field {error.args[0]!r} is missing, which this model needs.") from None


def _load(source: str | PathLike[str] | Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    if isinstance(source, Mapping):
        return copy.deepcopy(dict(source)), "BPX data"
    path = Path(source)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise CellError(f"cannot read the cell file {path}: {error.strerror or error}.") from None
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        raise CellError(f"{path} is not JSON: {error.msg} in line {error.lineno}.") from None
    if not isinstance(raw, dict):
        raise CellError(f"{path} does not hold a BPX object with a Header and a Parameterisation.")
    return raw, str(path)


def _as_v1(raw: dict[str, Any], where: str) -> dict[str, Any]:
    from bpx import convert_v0_to_v1, is_legacy_bpx

    if not isinstance(raw.get("Parameterisation"), dict):
        raise CellError(
            f"{where}: no 'Parameterisation' section; a BPX file needs Header and Parameterisation."
        )
    try:
        return convert_v0_to_v1(raw) if is_legacy_bpx(raw) else raw
    except (ValueError, TypeError, AttributeError) as error:
        raise CellError(f"{where}: {str(error).rstrip('.')}.") from None


def _refuse_what_is_not_modelled(v1: dict[str, Any], where: str) -> None:
    parts = v1["Parameterisation"]
    for section in ("Cell", "Electrolyte", "Negative electrode", "Separator", "Positive electrode"):
        if not isinstance(parts.get(section), dict):
            raise CellError(
                f"{where}: no section {section!r}; this model needs the parameters of a full cell."
            )
    for section in ("Negative electrode", "Positive electrode"):
        if "Particle" in parts[section]:
            raise CellError(
                f"{where}: {section} is a blend of materials; only single materials are modelled."
            )


def _check_schema(v1: dict[str, Any], where: str) -> None:
    import bpx
    from pydantic import ValidationError

    shown = copy.deepcopy(v1)
    shown.pop("Validation", None)
    shown["Parameterisation"].pop("User-defined", None)
    for section in ("Negative electrode", "Positive electrode"):
        fields = shown["Parameterisation"][section]
        for name in OCP_FIELDS:
            if name in fields:
                relation(fields[name], f"{where}: {section}, {name}")
                fields[name] = STANDIN_TABLE
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bpx.parse_bpx_obj(shown)
    except ValidationError as error:
        raise CellError(f"{where}: {_first_fault(error)}") from None
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise CellError(f"{where} fails the BPX schema: {error}.") from None


def _first_fault(error: Any) -> str:
    faults = error.errors()
    # Where several forms of an electrode were tried, the faults of a missing field name the field itself.
    first = min(faults, key=lambda fault: fault["type"] != "missing")
    place = " > ".join(str(part) for part in first["loc"])
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if first["type"] == "missing":
        return f"the field {place!r} is missing{more}."
    return f"{place or 'the file'}: {first['msg'].rstrip('.')}{more}."


def _cell(v1: dict[str, Any], where: str) -> Cell:
    parts = v1["Parameterisation"]
    fields, header = parts["Cell"], v1["Header"]
    state = v1.get("State") or {}
    initial = state.get("Initial conditions") or {}
    thermal = state.get("Thermal environment") or {}
    reference = float(fields.get("Reference temperature [K]") or DEFAULT_TEMPERATURE_K)
    user = parts.get("User-defined") or {}
    cell = Cell(
        negative=_electrode(parts["Negative electrode"], f"{where}: Negative electrode"),
        separator=_separator(parts["Separator"]),
        positive=_electrode(parts["Positive electrode"], f"{where}: Positive electrode"),
        electrolyte=_electrolyte(parts["Electrolyte"], initial, f"{where}: Electrolyte"),
        electrode_area_m2=float(fields["Electrode area [m2]"]),
        electrode_pairs=int(fields["Number of electrode pairs connected in parallel to make a cell"]),
        nominal_capacity_ah=float(fields["Nominal cell capacity [A.h]"]),
        lower_voltage_v=float(fields["Lower voltage cut-off [V]"]),
        upper_voltage_v=float(fields["Upper voltage cut-off [V]"]),
        reference_temperature_k=reference,
        initial_temperature_k=float(initial.get("Initial temperature [K]") or reference),
        ambient_temperature_k=float(thermal.get("Ambient temperature [K]") or reference),
        density_kg_m3=_optional(fields, "Density [kg.m-3]"),
        specific_heat_j_kg_k=_optional(fields, "Specific heat capacity [J.K-1.kg-1]"),
        volume_m3=_optional(fields, "Volume [m3]"),
        surface_area_m2=_optional(fields, "External surface area [m2]"),
        contact_resistance_ohm=float(user.get(CONTACT_RESISTANCE, 0.0)),
        name=str(header.get("Title") or "cell"),
        description=str(header.get("Description") or ""),
        references=str(header.get("References") or ""),
    )
    _check_values(cell, where)
    return cell


def _optional(fields: Fields, name: str) -> float | None:
    value = fields.get(name)
    return None if value is None else float(value)


def _electrode(fields: Fields, what: str) -> Electrode:
    def optional_relation(name: str) -> Relation | None:
        return None if fields.get(name) is None else relation(fields[name], f"{what}, {name}")

    return Electrode(
        thickness_m=float(fields["Thickness [m]"]),
        particle_radius_m=float(fields["Particle radius [m]"]),
        area_per_volume_1_m=float(fields["Surface area per unit volume [m-1]"]),
        porosity=float(fields["Porosity"]),
        transport_efficiency=float(fields["Transport efficiency"]),
        conductivity_s_m=float(fields["Conductivity [S.m-1]"]),
        theta_min=float(fields["Minimum stoichiometry"]),
        theta_max=float(fields["Maximum stoichiometry"]),
        c_max_mol_m3=float(fields["Maximum concentration [mol.m-3]"]),
        diffusivity=relation(fields["Diffusivity [m2.s-1]"], f"{what}, Diffusivity [m2.s-1]"),
        ocp=relation(fields["OCP [V]"], f"{what}, OCP [V]"),
        rate_constant=float(fields["Reaction rate constant [mol.m-2.s-1]"]),
        entropic=optional_relation("Entropic change coefficient [V.K-1]") or Constant(0.0),
        diffusivity_ea_j_mol=float(fields.get("Diffusivity activation energy [J.mol-1]") or 0.0),
        rate_ea_j_mol=float(fields.get("Reaction rate constant activation energy [J.mol-1]") or 0.0),
        ocp_lithiation=optional_relation("OCP (lithiation) [V]"),
        ocp_delithiation=optional_relation("OCP (delithiation) [V]"),
        hysteresis_decay=_optional(fields, "OCP hysteresis decay constant"),
    )


def _separator(fields: Fields) -> Separator:
    return Separator(
        thickness_m=float(fields["Thickness [m]"]),
        porosity=float(fields["Porosity"]),
        transport_efficiency=float(fields["Transport efficiency"]),
    )


def _electrolyte(fields: Fields, initial: Fields, what: str) -> Electrolyte:
    name = "Initial electrolyte concentration [mol.m-3]"
    if initial.get(name) is None:
        raise KeyError(name)
    return Electrolyte(
        c0_mol_m3=float(initial[name]),
        transference=float(fields["Cation transference number"]),
        conductivity=relation(fields["Conductivity [S.m-1]"], f"{what}, Conductivity [S.m-1]"),
        diffusivity=relation(fields["Diffusivity [m2.s-1]"], f"{what}, Diffusivity [m2.s-1]"),
        conductivity_ea_j_mol=float(fields.get("Conductivity activation energy [J.mol-1]") or 0.0),
        diffusivity_ea_j_mol=float(fields.get("Diffusivity activation energy [J.mol-1]") or 0.0),
    )


def _check_values(cell: Cell, where: str) -> None:
    for label, electrode in (("Negative electrode", cell.negative), ("Positive electrode", cell.positive)):
        require_positive(
            f"{where}: {label}",
            thickness_m=electrode.thickness_m,
            particle_radius_m=electrode.particle_radius_m,
            area_per_volume_1_m=electrode.area_per_volume_1_m,
            porosity=electrode.porosity,
            transport_efficiency=electrode.transport_efficiency,
            conductivity_s_m=electrode.conductivity_s_m,
            c_max_mol_m3=electrode.c_max_mol_m3,
            rate_constant=electrode.rate_constant,
        )
        if not 0.0 <= electrode.theta_min < electrode.theta_max <= 1.0:
            raise CellError(
                f"{where}: {label}: stoichiometry limits [{electrode.theta_min:g}, {electrode.theta_max:g}] "
                "have to satisfy 0 <= minimum < maximum <= 1."
            )
    require_positive(
        where,
        electrode_area_m2=cell.electrode_area_m2,
        electrode_pairs=cell.electrode_pairs,
        nominal_capacity_ah=cell.nominal_capacity_ah,
        separator_thickness_m=cell.separator.thickness_m,
        separator_porosity=cell.separator.porosity,
        separator_transport_efficiency=cell.separator.transport_efficiency,
        electrolyte_concentration_mol_m3=cell.electrolyte.c0_mol_m3,
        reference_temperature_k=cell.reference_temperature_k,
        initial_temperature_k=cell.initial_temperature_k,
    )


def write_bpx(cell: Cell) -> dict[str, Any]:
    """See `Cell.to_bpx`."""
    header = {"BPX": BPX_VERSION, "Title": cell.name, "Model": "DFN"}
    if cell.description:
        header["Description"] = cell.description
    if cell.references:
        header["References"] = cell.references
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
    fields.update({name: value for name, value in optional.items() if value is not None})
    electrolyte = cell.electrolyte
    parts: dict[str, Any] = {
        "Cell": fields,
        "Electrolyte": {
            "Cation transference number": electrolyte.transference,
            "Conductivity [S.m-1]": to_bpx(electrolyte.conductivity, *ELECTROLYTE_TABLE_MOL_M3),
            "Diffusivity [m2.s-1]": to_bpx(electrolyte.diffusivity, *ELECTROLYTE_TABLE_MOL_M3),
            "Conductivity activation energy [J.mol-1]": electrolyte.conductivity_ea_j_mol,
            "Diffusivity activation energy [J.mol-1]": electrolyte.diffusivity_ea_j_mol,
        },
        "Negative electrode": _write_electrode(cell.negative),
        "Positive electrode": _write_electrode(cell.positive),
        "Separator": {
            "Thickness [m]": cell.separator.thickness_m,
            "Porosity": cell.separator.porosity,
            "Transport efficiency": cell.separator.transport_efficiency,
        },
    }
    if cell.contact_resistance_ohm:
        parts["User-defined"] = {CONTACT_RESISTANCE: cell.contact_resistance_ohm}
    state = {
        "Initial conditions": {
            "Initial state-of-charge": 1.0,
            "Initial temperature [K]": cell.initial_temperature_k,
            "Initial electrolyte concentration [mol.m-3]": electrolyte.c0_mol_m3,
        },
        "Thermal environment": {"Ambient temperature [K]": cell.ambient_temperature_k},
    }
    return {"Header": header, "Parameterisation": parts, "State": state}


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
