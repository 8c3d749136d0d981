"""The changes of the laboratory's cell: ids as in the catalogue of effects, physics by PyBaMM.

A change acts by model options, by parameters, on the current of the cell, or on its terminal voltage.
No code is shared with the search for effects, so that a test of that search is independent.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.laboratory.change import Change, Values
from aesi.errors import DataError, did_you_mean
from aesi.numerics.typing import Array

CONTACT_RESISTANCE = "Contact resistance [Ohm]"


def find_change(name: str) -> Change:
    """A change by id. Raises DataError for an unknown one, with the nearest."""
    if name not in CHANGES:
        raise DataError(
            f"The laboratory knows no change {name!r}{did_you_mean(name, CHANGES)} Known: {', '.join(CHANGES)}."
        )
    return CHANGES[name]


def _update(parameters: Any, new: Mapping[str, Any]) -> None:
    parameters.update(dict(new), check_already_exists=False)


def _times(function: Any, factor: float) -> Any:
    if callable(function):
        return lambda *inputs: factor * function(*inputs)
    return factor * function


def _scale(parameters: Any, name: str, factor: float) -> None:
    if factor != 1.0:
        _update(parameters, {name: _times(parameters[name], factor)})


def _heat(parameters: Any, values: Values) -> None:
    _update(parameters, {"Total heat transfer coefficient [W.m-2.K-1]": values["cooling_w_m2_k"]})


def _ambient(parameters: Any, values: Values) -> None:
    for name in ("Ambient temperature [K]", "Initial temperature [K]"):
        _update(parameters, {name: float(parameters[name]) + values["shift_k"]})


def _temperature_course(parameters: Any, values: Values) -> None:
    """The cell's temperature rises from reference plus shift towards a plateau, as under constant load in a chamber."""
    import pybamm

    start = float(parameters["Initial temperature [K]"]) + values["shift_k"]

    def ambient(y: Any, z: Any, t: Any) -> Any:
        return start + values["rise_k"] * (1 - pybamm.exp(-t / values["constant_s"]))

    _update(parameters, {"Ambient temperature [K]": ambient, "Initial temperature [K]": start})


def _resistance(parameters: Any, values: Values) -> None:
    there = float(parameters.get(CONTACT_RESISTANCE, 0.0))
    _update(parameters, {CONTACT_RESISTANCE: there + values["resistance_ohm"]})


def _film(time_s: Array, current_a: Array, voltage_v: Array, values: Values) -> Array:
    """V - R(t) I, (n,) V, with R growing with charge throughput and with time."""
    through = np.concatenate(
        [[0.0], np.cumsum(0.5 * (np.abs(current_a[1:]) + np.abs(current_a[:-1])) * np.diff(time_s))]
    )
    resistance = (
        values["growth_ohm_ah"] * through / SECONDS_PER_HOUR
        + values["growth_ohm_h"] * time_s / SECONDS_PER_HOUR
    )
    return voltage_v - resistance * current_a


def _hysteresis(parameters: Any, values: Values) -> None:
    """One-state hysteresis as in Axen 2022: half the gap up on delithiation, down on lithiation, per electrode."""
    for electrode, gap in (("Negative", values["negative_v"]), ("Positive", values["positive_v"])):
        middle = parameters[f"{electrode} electrode OCP [V]"]
        _update(
            parameters,
            {
                f"{electrode} electrode delithiation OCP [V]": _plus(middle, gap),
                f"{electrode} electrode lithiation OCP [V]": _plus(middle, -gap),
                f"{electrode} particle hysteresis decay rate": values["decay"],
                f"{electrode} particle lithiation hysteresis decay rate": values["decay"],
                f"{electrode} particle delithiation hysteresis decay rate": values["decay"],
                f"Initial hysteresis state in {electrode.lower()} electrode": values["initial"],
            },
        )


def _plus(function: Any, shift: float) -> Any:
    return lambda sto: function(sto) + shift


def _window(parameters: Any, electrode: str) -> tuple[float, float]:
    """Stoichiometries of an electrode in the empty and in the full cell."""
    low = float(parameters[f"{electrode} electrode minimum stoichiometry"])
    high = float(parameters[f"{electrode} electrode maximum stoichiometry"])
    return (low, high) if electrode == "Negative" else (high, low)


def _ocp(parameters: Any, values: Values) -> None:
    """A Gaussian bump on the open-circuit potential of either electrode, with centre and width in state of charge."""
    import pybamm

    for electrode in ("Negative", "Positive"):
        height = values[f"{electrode.lower()}_v"]
        if height:
            name = f"{electrode} electrode OCP [V]"
            empty, full = _window(parameters, electrode)
            centre = empty + values["centre_soc"] * (full - empty)
            width = values["width_soc"] * abs(full - empty)
            _update(parameters, {name: _bump(parameters[name], height, centre, width, pybamm.exp)})


def _bump(function: Any, height: float, centre: float, width: float, exp: Any) -> Any:
    return lambda sto: function(sto) + height * exp(-(((sto - centre) / width) ** 2))


def _sloped_diffusivity(parameters: Any, values: Values) -> None:
    """D(x) = D exp(slope (x - centre)), per electrode; the centre is the stoichiometry at a state of charge."""
    import pybamm

    for electrode in ("Negative", "Positive"):
        slope = values[f"{electrode.lower()}_slope"]
        if slope:
            name = f"{electrode} particle diffusivity [m2.s-1]"
            empty, full = _window(parameters, electrode)
            centre = empty + values["centre_soc"] * (full - empty)
            _update(parameters, {name: _tilted(parameters[name], slope, centre, pybamm.exp)})


def _tilted(function: Any, slope: float, centre: float, exp: Any) -> Any:
    def tilted(sto: Any, temperature: Any) -> Any:
        base = function(sto, temperature) if callable(function) else function
        return base * exp(slope * (sto - centre))

    return tilted


def _diffusivity(parameters: Any, values: Values) -> None:
    _scale(parameters, "Negative particle diffusivity [m2.s-1]", values["negative_factor"])
    _scale(parameters, "Positive particle diffusivity [m2.s-1]", values["positive_factor"])


def _electrolyte(parameters: Any, values: Values) -> None:
    _scale(parameters, "Electrolyte conductivity [S.m-1]", values["conductivity_factor"])
    _scale(parameters, "Electrolyte diffusivity [m2.s-1]", values["diffusivity_factor"])


def _kinetics(parameters: Any, values: Values) -> None:
    _scale(parameters, "Negative electrode exchange-current density [A.m-2]", values["negative_factor"])
    _scale(parameters, "Positive electrode exchange-current density [A.m-2]", values["positive_factor"])


def _asymmetry(parameters: Any, values: Values) -> None:
    _update(
        parameters,
        {
            "Negative electrode Butler-Volmer transfer coefficient": values["negative_alpha"],
            "Positive electrode Butler-Volmer transfer coefficient": values["positive_alpha"],
        },
    )


def _double_layer(parameters: Any, values: Values) -> None:
    _update(
        parameters,
        {
            "Negative electrode double-layer capacity [F.m-2]": values["capacity_f_m2"],
            "Positive electrode double-layer capacity [F.m-2]": values["capacity_f_m2"],
        },
    )


def _lost_lithium(parameters: Any, values: Values) -> None:
    """The negative electrode starts with less lithium than the positive one's state implies."""
    name = "Initial concentration in negative electrode [mol.m-3]"
    full = float(parameters["Maximum concentration in negative electrode [mol.m-3]"])
    _update(parameters, {name: float(parameters[name]) - values["negative_stoichiometry"] * full})


def _lost_material(electrode: str) -> Callable[[Any, Values], None]:
    def alter(parameters: Any, values: Values) -> None:
        _scale(parameters, f"{electrode} electrode active material volume fraction", 1 - values["share"])

    return alter


def _leak(time_s: Array, current_a: Array, values: Values) -> Array:
    return current_a + values["leak_a"]


def _plating(parameters: Any, values: Values) -> None:
    """Reversible plating, exchange-current densities as in O'Kane et al. 2020, with the set's constants."""
    import pybamm

    source = pybamm.ParameterValues("OKane2022")
    wanted = ("plating", "stripping", "plated", "Lithium metal", "SEI", "Dead lithium")
    extra = {
        name: source[name]
        for name in source
        if any(word.lower() in name.lower() for word in wanted) and name not in parameters
    }
    _update(parameters, extra)
    _update(parameters, {"Lithium plating kinetic rate constant [m.s-1]": values["rate_m_s"]})


def _sizes(parameters: Any, values: Values) -> None:
    """Log-normal particle radii by area, the declared radius as their mean, in both electrodes."""
    import pybamm

    spread = {"sd_n": values["negative_spread"], "sd_p": values["positive_spread"]}
    pybamm.get_size_distribution_parameters(parameters, **spread)


CHANGES: dict[str, Change] = {
    change.id: change
    for change in (
        Change(
            "self_heating",
            {"cooling_w_m2_k": 10.0},
            {"thermal": "lumped", "heat of mixing": "true"},
            _heat,
        ),
        Change("ambient_temperature", {"shift_k": -5.0}, alter=_ambient),
        Change(
            "temperature_course",
            {"shift_k": 0.0, "rise_k": 5.0, "constant_s": 1000.0},
            alter=_temperature_course,
        ),
        Change("series_resistance", {"resistance_ohm": 5e-4}, {"contact resistance": "true"}, _resistance),
        Change("film_growth", {"growth_ohm_ah": 0.0, "growth_ohm_h": 0.0}, terminal_voltage=_film),
        Change(
            "ocv_hysteresis",
            {"negative_v": 0.01, "positive_v": 0.0, "decay": 50.0, "initial": 0.0},
            {"open-circuit potential": "one-state hysteresis"},
            _hysteresis,
        ),
        Change(
            "ocp_shape",
            {"negative_v": 0.0, "positive_v": 0.01, "centre_soc": 0.5, "width_soc": 0.2},
            alter=_ocp,
        ),
        Change(
            "concentration_dependent_diffusivity",
            {"negative_slope": 0.0, "positive_slope": 0.0, "centre_soc": 0.5},
            alter=_sloped_diffusivity,
        ),
        Change("solid_diffusivity", {"negative_factor": 1.0, "positive_factor": 1.0}, alter=_diffusivity),
        Change(
            "electrolyte_transport",
            {"conductivity_factor": 1.0, "diffusivity_factor": 1.0},
            alter=_electrolyte,
        ),
        Change("charge_transfer_kinetics", {"negative_factor": 1.0, "positive_factor": 1.0}, alter=_kinetics),
        Change(
            "asymmetric_kinetics",
            {"negative_alpha": 0.5, "positive_alpha": 0.5},
            {"intercalation kinetics": "asymmetric Butler-Volmer", "surface form": "algebraic"},
            _asymmetry,
        ),
        Change("double_layer", {"capacity_f_m2": 10.0}, {"surface form": "differential"}, _double_layer),
        Change("algebraic_surface", {}, {"surface form": "algebraic"}),
        Change("lithium_inventory_loss", {"negative_stoichiometry": 0.02}, alter=_lost_lithium),
        Change("active_material_loss_negative", {"share": 0.05}, alter=_lost_material("Negative")),
        Change("active_material_loss_positive", {"share": 0.05}, alter=_lost_material("Positive")),
        Change("leakage_current", {"leak_a": 0.1}, cell_current=_leak),
        Change(
            "particle_size_distribution",
            {"negative_spread": 0.3, "positive_spread": 0.3},
            {"particle size": "distribution", "surface form": "algebraic"},
            _sizes,
        ),
        Change(
            "lithium_plating",
            {"rate_m_s": 1e-9},
            {"lithium plating": "reversible", "surface form": "algebraic"},  # else no current is shared
            _plating,
        ),
    )
}
