"""Effects of the catalogue as this generator makes them, scaled by a magnitude m.

A recipe states the change in the laboratory, or in the instrument, at m = 1. Where a model option by itself changes the
voltage (surface form, size distribution), `reference` is the same option without the effect. The difference of the two
runs is added to the base run, so that a recipe adds only its effect.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from aesi.data.blind.case import RecordKind
from aesi.data.blind.cells import CELLS
from aesi.data.blind.spread import BEYOND, SPREADS
from aesi.data.laboratory.change import Values
from aesi.data.laboratory.simulator import Applied
from aesi.data.virtual import stoichiometry_span
from aesi.numerics.typing import Array


@dataclass(frozen=True, eq=False)
class Written:
    """Channels on their way to the file: time_s, current_a, voltage_v, each (n,)."""

    time_s: Array
    current_a: Array
    voltage_v: Array


FINER = 10
"""Number of simulated rows per row of an instrument that reads between its rows: linear interpolation between rows 1 s
apart is wrong by up to 25 mV where the current jumps."""


def _as_is(written: Written, values: Values) -> Written:
    return written


@dataclass(frozen=True)
class Recipe:
    """One effect.

    values : (magnitude m, capacity in Ah, initial state of charge) -> values of the laboratory's change, or of the
    instrument's fault.
    change : the laboratory's change, or None for a fault of the instrument.
    also : answers that a lenient judge also accepts.  least, most : range of magnitudes: below it, a wrong parameter is
    within the differences of parametrisations of one cell; above, it is not physical.
    test : test that shows the effect, in place of a drive.  cells : cells on which it can be made.
    warm : True where it concerns the temperature, which is then in no column.  radial_points : of the two runs whose
    difference is used; their mesh error cancels.
    between : simulated rows per row, for an instrument that reads between rows.
    as_named : converts the values to the package's parameters, by the declared cell file; a value without a parameter
    of the same meaning keeps its own name, and is not compared.
    """

    label: str
    values: Callable[[float, float, float], dict[str, float]]
    change: str | None = None
    reference: Callable[[], Applied] | None = None
    instrument: Callable[[Written, Values], Written] = _as_is
    also: tuple[str, ...] = ()
    least: float = 0.02
    most: float = 8.0
    test: RecordKind = "drive"
    cells: tuple[str, ...] = tuple(CELLS)
    warm: bool = False
    radial_points: int | None = None
    between: int = 1
    as_named: Callable[[Values, Path], Values] = lambda values, declared: values


def _beyond(parameter: str, base: float) -> float:
    """Magnitude m from which base**-m exceeds the differences of parametrisations of one cell."""
    return BEYOND * SPREADS[parameter] / math.log(base)


def _over_windows(values: Values, declared: Path) -> Values:
    """Slopes of a diffusivity over the stoichiometry window of an electrode, from the laboratory's slopes per unit of
    stoichiometry."""
    electrodes = {"negative_slope": "Negative electrode", "positive_slope": "Positive electrode"}
    return {
        name: value * stoichiometry_span(declared, electrodes[name]) if name in electrodes else value
        for name, value in values.items()
    }


def _called(**names: str) -> Callable[[Values, Path], Values]:
    """Conversion to the package's names (name in the laboratory -> there) of the same quantities, in the same units."""
    return lambda values, declared: {names.get(name, name): value for name, value in values.items()}


def _of_both_electrodes(values: Values, declared: Path) -> Values:
    """The double layers of the two electrodes, which the laboratory gives one capacity."""
    return {f"{side}_f_m2": values["capacity_f_m2"] for side in ("negative", "positive")}


def _of_the_cell(values: Values, declared: Path) -> Values:
    """Half the gap between the branches of the cell: one electrode is delithiated while the other one is lithiated, so
    that theirs add. The laboratory's rate of change is of another charge than the package's."""
    return {"magnitude_v": values["negative_v"] + values.get("positive_v", 0.0)}


def _algebraic() -> Applied:
    return Applied("algebraic_surface")


def _one_size() -> Applied:
    return Applied("particle_size_distribution", {"negative_spread": 0.02, "positive_spread": 0.02})


def _gain(written: Written, values: Values) -> Written:
    return Written(written.time_s, values["gain"] * written.current_a, written.voltage_v)


def _current_offset(written: Written, values: Values) -> Written:
    return Written(written.time_s, written.current_a + values["offset_a"], written.voltage_v)


def _voltage_offset(written: Written, values: Values) -> Written:
    return Written(written.time_s, written.current_a, written.voltage_v + values["offset_v"])


def _lag(written: Written, values: Values) -> Written:
    """The voltage channel lags behind the current channel."""
    late = np.interp(written.time_s - values["lag_s"], written.time_s, written.voltage_v)
    return Written(written.time_s, written.current_a, late)


def _rate(written: Written, values: Values) -> Written:
    """The clock runs fast: its seconds are shorter, so that rows one second apart on it are closer in true time."""
    true_s = written.time_s / (1 + values["skew"])
    return Written(
        written.time_s,
        np.interp(true_s, written.time_s, written.current_a),
        np.interp(true_s, written.time_s, written.voltage_v),
    )


RECIPES: dict[str, Recipe] = {
    "self_heating": Recipe(
        "self_heating",
        lambda m, q, s: {"cooling_w_m2_k": 10.0 / m},
        "self_heating",
        most=40.0,
        warm=True,
    ),
    "colder": Recipe(
        "ambient_temperature", lambda m, q, s: {"shift_k": -3.0 * m}, "ambient_temperature", warm=True
    ),
    "warmer": Recipe(
        "ambient_temperature", lambda m, q, s: {"shift_k": 4.0 * m}, "ambient_temperature", warm=True
    ),
    "series_resistance": Recipe(
        "series_resistance",
        lambda m, q, s: {"resistance_ohm": m * 8e-3 / q},
        "series_resistance",
        also=("electrolyte_transport",),
    ),
    "film_growth": Recipe(
        "film_growth",
        lambda m, q, s: {"growth_ohm_ah": m * 0.03 / q**2},
        "film_growth",
        as_named=_called(growth_ohm_ah="per_throughput_ohm_ah"),
    ),
    "ocv_hysteresis": Recipe(
        "ocv_hysteresis",
        lambda m, q, s: {"negative_v": 8e-3 * m, "decay": 50.0},
        "ocv_hysteresis",
        as_named=_of_the_cell,
    ),
    "positive_hysteresis": Recipe(
        "ocv_hysteresis",
        lambda m, q, s: {"negative_v": 0.0, "positive_v": 8e-3 * m},
        "ocv_hysteresis",
        as_named=_of_the_cell,
    ),
    "positive_ocp": Recipe(
        "ocp_shape",
        lambda m, q, s: {"positive_v": 8e-3 * m, "centre_soc": s - 0.12, "width_soc": 0.12},
        "ocp_shape",
    ),
    "negative_ocp": Recipe(
        "ocp_shape",
        lambda m, q, s: {
            "positive_v": 0.0,
            "negative_v": 8e-3 * m,
            "centre_soc": s - 0.12,
            "width_soc": 0.15,
        },
        "ocp_shape",
    ),
    "double_layer": Recipe(
        "double_layer",
        lambda m, q, s: {"capacity_f_m2": 2.0 * m},
        "double_layer",
        _algebraic,
        most=25.0,
        also=("clock_skew",),
        radial_points=25,
        as_named=_of_both_electrodes,
    ),
    "negative_sloped_diffusivity": Recipe(
        "concentration_dependent_diffusivity",
        lambda m, q, s: {"negative_slope": -3.0 * m, "centre_soc": 0.5},
        "concentration_dependent_diffusivity",
        as_named=_over_windows,
        also=("solid_diffusivity",),
        most=3.0,
    ),
    "positive_sloped_diffusivity": Recipe(
        "concentration_dependent_diffusivity",
        lambda m, q, s: {"positive_slope": 5.0 * m, "centre_soc": 0.5},
        "concentration_dependent_diffusivity",
        as_named=_over_windows,
        also=("solid_diffusivity",),
        most=2.8,
    ),
    "negative_diffusivity": Recipe(
        "solid_diffusivity",
        lambda m, q, s: {"negative_factor": 1.5**-m},
        "solid_diffusivity",
        least=_beyond("diffusivity", 1.5),
        most=5.0,
    ),
    "positive_diffusivity": Recipe(
        "solid_diffusivity",
        lambda m, q, s: {"positive_factor": 1.5**-m},
        "solid_diffusivity",
        least=_beyond("diffusivity", 1.5),
        most=5.0,
    ),
    "particle_size_distribution": Recipe(
        "particle_size_distribution",
        lambda m, q, s: {"negative_spread": min(0.3 * m, 0.9), "positive_spread": min(0.3 * m, 0.9)},
        "particle_size_distribution",
        _one_size,
        most=3.0,
        also=("solid_diffusivity", "concentration_dependent_diffusivity"),
        radial_points=25,
        as_named=_called(negative_spread="negative_sd", positive_spread="positive_sd"),
    ),
    "poor_electrolyte": Recipe(
        "electrolyte_transport",
        lambda m, q, s: {"conductivity_factor": 1.25**-m, "diffusivity_factor": 1.25**-m},
        "electrolyte_transport",
        least=_beyond("conductivity", 1.25),
        most=5.0,
    ),
    "slow_negative_kinetics": Recipe(
        "charge_transfer_kinetics",
        lambda m, q, s: {"negative_factor": 1.3**-m},
        "charge_transfer_kinetics",
        least=_beyond("kinetics", 1.3),
    ),
    "slow_positive_kinetics": Recipe(
        "charge_transfer_kinetics",
        lambda m, q, s: {"positive_factor": 1.3**-m},
        "charge_transfer_kinetics",
        least=_beyond("kinetics", 1.3),
    ),
    "asymmetric_kinetics": Recipe(
        "asymmetric_kinetics",
        lambda m, q, s: {"negative_alpha": 0.5 + 0.1 * m},
        "asymmetric_kinetics",
        _algebraic,
        most=3.0,
        radial_points=25,
    ),
    "lithium_inventory_loss": Recipe(
        "lithium_inventory_loss",
        lambda m, q, s: {"negative_stoichiometry": 0.02 * m},
        "lithium_inventory_loss",
    ),
    "active_material_loss_negative": Recipe(
        "active_material_loss_negative",
        lambda m, q, s: {"share": 1 - 0.92**m},
        "active_material_loss_negative",
        as_named=_called(share="loss"),
    ),
    "active_material_loss_positive": Recipe(
        "active_material_loss_positive",
        lambda m, q, s: {"share": 1 - 0.95**m},
        "active_material_loss_positive",
        as_named=_called(share="loss"),
    ),
    "leakage_current": Recipe(
        "leakage_current",
        lambda m, q, s: {"leak_a": 0.006 * m * q},
        "leakage_current",
        also=("current_sensor_offset",),
        as_named=_called(leak_a="leakage_a"),
    ),
    "lithium_plating": Recipe(
        "lithium_plating",
        lambda m, q, s: {"rate_m_s": 1e-9 * m},
        "lithium_plating",
        _algebraic,
        most=100.0,
        test="fast_charge",
        cells=("nmc",),
        radial_points=25,
    ),
    "current_sensor_gain": Recipe(
        "current_sensor_gain", lambda m, q, s: {"gain": 1 + 0.03 * m}, instrument=_gain
    ),
    "current_sensor_offset": Recipe(
        "current_sensor_offset",
        lambda m, q, s: {"offset_a": 0.006 * m * q},
        instrument=_current_offset,
        also=("leakage_current",),
    ),
    "voltage_sensor_offset": Recipe(
        "voltage_sensor_offset",
        lambda m, q, s: {"offset_v": 4e-3 * m},
        instrument=_voltage_offset,
        also=("ocp_shape",),
    ),
    "voltage_lag": Recipe(
        "clock_skew", lambda m, q, s: {"lag_s": 0.3 * m}, instrument=_lag, most=10.0, between=FINER
    ),
    "clock_rate": Recipe(
        "clock_skew", lambda m, q, s: {"skew": 0.02 * m}, instrument=_rate, most=4.0, between=FINER
    ),
}
