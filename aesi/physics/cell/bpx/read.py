"""Conversion of the fields of a BPX file to a cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from datetime import date, datetime
from os import PathLike
from typing import Any

from aesi.errors import CellError
from aesi.physics.cell.bpx.schema import load_bpx
from aesi.physics.cell.bpx.transport import check_kinetics, check_transport
from aesi.physics.cell.bpx.unread import (
    capacity_sentences,
    flat_voltage_sentences,
    replaced_relation_sentences,
    rising_potential_sentences,
    unread_field_sentences,
    version_0_sentences,
)
from aesi.physics.cell.bpx.values import check_energies, check_values
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
    Separator,
)
from aesi.physics.cell.relations import Constant, Relation, relation

DEFAULT_TEMPERATURE_K = 298.15
"""Reference temperature of a file that states none."""

Fields = Mapping[str, Any]


def read_bpx(source: str | PathLike[str] | Mapping[str, Any], fitted: bool) -> CellParameters:
    """See `Cell.from_bpx`."""
    v1, where, left_behind = load_bpx(source)
    try:
        cell = _cell(v1, where)
    except KeyError as error:
        raise CellError(f"{where}: the field {error.args[0]!r} is missing, which this model needs.") from None
    check_values(cell, where)
    if not fitted:
        check_transport(cell, where)
        check_kinetics(cell, where)
        if not cell.fitted_with:
            check_energies(cell, where)
    return replace(
        cell,
        unread=(
            *cell.unread,
            *version_0_sentences(left_behind),
            *replaced_relation_sentences(cell),
            *rising_potential_sentences(cell),
            *flat_voltage_sentences(cell),
            *capacity_sentences(cell),
        ),
    )


def _cell(v1: dict[str, Any], where: str) -> CellParameters:
    parts = v1["Parameterisation"]
    fields, header = parts["Cell"], v1["Header"]
    state = v1.get("State") or {}
    initial = state.get("Initial conditions") or {}
    thermal = state.get("Thermal environment") or {}
    reference = _optional_kelvin(fields, "Reference temperature [K]", DEFAULT_TEMPERATURE_K)
    user = parts.get("User-defined") or {}
    if not isinstance(user, Mapping):
        raise CellError(
            f"{where}: the section 'User-defined' is {type(user).__name__}, and has to hold names and values."
        )
    return CellParameters(
        negative=_electrode(parts["Negative electrode"], user, "Negative", where),
        separator=_separator(parts["Separator"]),
        positive=_electrode(parts["Positive electrode"], user, "Positive", where),
        electrolyte=_electrolyte(parts["Electrolyte"], initial, f"{where}: Electrolyte"),
        electrode_area_m2=float(fields["Electrode area [m2]"]),
        electrode_pairs=int(fields["Number of electrode pairs connected in parallel to make a cell"]),
        nominal_capacity_ah=float(fields["Nominal cell capacity [A.h]"]),
        lower_voltage_v=float(fields["Lower voltage cut-off [V]"]),
        upper_voltage_v=float(fields["Upper voltage cut-off [V]"]),
        reference_temperature_k=reference,
        initial_soc=_initial_soc(initial, where),
        initial_temperature_k=_optional_kelvin(initial, "Initial temperature [K]", reference),
        ambient_temperature_k=_optional_kelvin(thermal, "Ambient temperature [K]", reference),
        density_kg_m3=_optional(fields, "Density [kg.m-3]"),
        specific_heat_j_kg_k=_optional(fields, "Specific heat capacity [J.K-1.kg-1]"),
        volume_m3=_optional(fields, "Volume [m3]"),
        surface_area_m2=_optional(fields, "External surface area [m2]"),
        thermal_conductivity_w_m_k=_thermal_conductivity(user, where),
        heat_transfer_w_m2_k=_optional(thermal, HEAT_TRANSFER),
        contact_resistance_ohm=_own_number(user, CONTACT_RESISTANCE, where),
        capacity_shares=_numbers_by_record(user, CAPACITY_SHARES, where),
        tested_on=_tested_on(user, where),
        fitted_at_k=_numbers_by_record(user, FITTED_AT, where),
        fitted_with=_fitted_with(user, where),
        name=str(header.get("Title") or "cell").rstrip(". ") or "cell",  # it is used within sentences
        description=str(header.get("Description") or ""),
        references=str(header.get("References") or ""),
        unread=unread_field_sentences(v1),
    )


def _initial_soc(initial: Fields, where: str) -> float:
    """The initial state of charge. A simulation gets its own, but a value outside [0, 1] is in another unit, and then
    other values of the section may be, too."""
    soc = _optional(initial, INITIAL_SOC)
    if soc is None:
        return 1.0
    if not 0.0 <= soc <= 1.0:
        raise CellError(
            f"{where}: {INITIAL_SOC} = {soc:g} has to be from 0 (empty) to 1 (full); 90 % is 0.9."
        )
    return soc


def _optional_kelvin(fields: Fields, name: str, without: float) -> float:
    """A temperature, K, or `without` where the file states none; 0 is refused with all others that no cell has."""
    value = _optional(fields, name)
    return without if value is None else value


def _optional(fields: Fields, name: str) -> float | None:
    """A number, None where the file has none."""
    value = fields.get(name)
    return None if value is None else float(value)


def _own_number(user: Fields, name: str, where: str) -> float:
    """A number of the section User-defined, which the schema does not check; 0 where the field is missing."""
    value = user.get(name)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise CellError(f"{where}: User-defined: {name} = {value!r} has to be a number from 0 on.")
    return float(value)


def _thermal_conductivity(user: Fields, where: str) -> float | None:
    """The thermal conductivity across the winding, W/(m K); None where the file states none. 0 is refused with all
    others that no winding has."""
    declared = user.get(THERMAL_CONDUCTIVITY) is not None
    return _own_number(user, THERMAL_CONDUCTIVITY, where) if declared else None


def _fitted_with(user: Fields, where: str) -> str:
    """Name of the model that the file was fitted with; '' for none.  Raises CellError for both."""
    marks = {model: _own_number(user, field, where) for model, field in FITTED_WITH.items()}
    for model, mark in marks.items():
        if mark not in (0.0, 1.0):
            raise CellError(f"{where}: User-defined: {FITTED_WITH[model]} = {mark:g} has to be 1 or 0.")
    marked = [model for model, mark in marks.items() if mark]
    if len(marked) > 1:
        both = " and ".join(repr(FITTED_WITH[model]) for model in marked)
        raise CellError(
            f"{where}: User-defined: {both} are both 1; leave the one that the parameters are of."
        )
    return "".join(marked)


def _numbers_by_record(user: Fields, field: str, where: str) -> tuple[tuple[str, float], ...]:
    """(record, number) pairs of a field of the section User-defined; empty where the field is missing."""
    numbers = user.get(field)
    if numbers is None:
        return ()
    if not isinstance(numbers, Mapping):
        raise CellError(f"{where}: User-defined: {field} = {numbers!r} has to hold a number for each record.")
    return tuple((str(name), _own_number(numbers, name, where)) for name in numbers)


def _tested_on(user: Fields, where: str) -> tuple[tuple[str, date], ...]:
    return tuple(
        (name, _day(number, name, where)) for name, number in _numbers_by_record(user, TESTED_ON, where)
    )


def _day(number: float, name: str, where: str) -> date:
    """The day that is written as a number: 20181113 for 13 November 2018."""
    text = f"{number:.10g}"
    try:
        return datetime.strptime(text if len(text) == len("20181113") else "", "%Y%m%d").date()
    except ValueError:
        raise CellError(
            f"{where}: User-defined: {TESTED_ON}: {name} = {text} is no day; 13 November 2018 is 20181113."
        ) from None


def _electrode(fields: Fields, user: Fields, side: str, where: str) -> Electrode:
    what = f"{where}: {side} electrode"
    if fields["OCP [V]"] == 0:
        raise CellError(
            f"{what}, OCP [V] is 0 at all stoichiometries; write there the open-circuit potential against lithium."
        )
    factor, film = user.get(RATE_FACTORS[side]), user.get(FILM_RESISTANCES[side])

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
        double_layer_f_m2=_own_number(user, DOUBLE_LAYERS[side], where),
        film_ohm_m2=NO_FILM if film is None else relation(film, f"{where}: {FILM_RESISTANCES[side]}"),
        film_ea_j_mol=_own_number(user, FILM_ENERGIES[side], where),
        rate_factor=UNITY if factor is None else relation(factor, f"{where}: {RATE_FACTORS[side]}"),
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
