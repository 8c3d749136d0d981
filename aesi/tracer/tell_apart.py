"""Which experiment would tell two look-alikes apart: what to do, and what each of the two would show."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

CAPACITY = "a full C/20 discharge between the voltage limits and the coulombs that go back in"
EXPERIMENTS: dict[frozenset[str], str] = {
    frozenset(pair): text
    for pair, text in (
        (
            ("leakage_current", "current_sensor_offset"),
            "a rest of some days: a leak lowers the voltage of the open cell, an offset of the sensor "
            "does not; or a "
            "second current sensor in series",
        ),
        (
            ("current_sensor_gain", "active_material_loss_negative"),
            f"a second current sensor in series, or {CAPACITY}: a gain scales all charges, a loss moves the steps "
            "of dV/dQ",
        ),
        (
            ("current_sensor_gain", "active_material_loss_positive"),
            f"a second current sensor in series, or {CAPACITY}: a gain scales all charges, a loss moves the steps "
            "of dV/dQ",
        ),
        (
            ("series_resistance", "electrolyte_transport"),
            "impedance at 1 kHz at two temperatures: contacts hardly change, the electrolyte by 2 % a "
            "kelvin; or pulses "
            "after a long discharge at high rate, where the electrolyte has been depleted",
        ),
        (
            ("series_resistance", "charge_transfer_kinetics"),
            "pulses from C/10 to 5C with 10 ms sampling: an ohmic drop is linear and instant, a kinetic "
            "one bends and "
            "takes milliseconds",
        ),
        (
            ("series_resistance", "film_growth"),
            "the same pulse at the same state of charge before and after some hundred hours or cycles",
        ),
        (
            ("voltage_sensor_offset", "ocp_shape"),
            "a second voltmeter on the terminals at rest",
        ),
        (
            ("voltage_sensor_offset", "lithium_inventory_loss"),
            f"a second voltmeter at rest, or {CAPACITY}",
        ),
        (
            ("self_heating", "ambient_temperature"),
            "a thermocouple on the case: one rises with load and the other stands off from the start",
        ),
        (
            ("solid_diffusivity", "particle_size_distribution"),
            "GITT: a distribution relaxes over a spread of times, one radius with one time after each pulse",
        ),
        (
            ("solid_diffusivity", "concentration_dependent_diffusivity"),
            "GITT over the whole range of state of charge",
        ),
    )
}

SENSOR = "a second sensor of the same quantity: an instrument's fault does not show there"
BY_EFFECT = {
    "ambient_temperature": "the same profile in a climate chamber at two temperatures",
    "self_heating": "a thermocouple on the case",
    "ocv_hysteresis": "rests of some hours at the same state of charge, reached by charge and by discharge",
    "ocp_shape": "C/50 discharge and charge, or GITT",
    "double_layer": "impedance from 1 Hz to 10 kHz, or pulses sampled at 1 ms",
    "solid_diffusivity": "GITT: long pulses and long rests over the range of state of charge",
    "concentration_dependent_diffusivity": "GITT over the whole range of state of charge",
    "particle_size_distribution": "relaxation after a long pulse, sampled over hours",
    "electrolyte_transport": "a discharge above 3C, where the electrolyte is depleted, and its relaxation",
    "charge_transfer_kinetics": "pulses from C/10 to 5C: the kinetic drop bends with current",
    "asymmetric_kinetics": "charge and discharge pulses of the same size, from C/10 to 5C",
    "reaction_nonuniformity": "discharges at 2C and above beside a full porous-electrode simulation",
    "series_resistance": "impedance at 1 kHz",
    "film_growth": "the same pulse before and after some hundred hours or cycles",
    "lithium_inventory_loss": CAPACITY,
    "active_material_loss_negative": f"{CAPACITY}, read as dV/dQ",
    "active_material_loss_positive": f"{CAPACITY}, read as dV/dQ",
    "leakage_current": "a rest of some days at open circuit",
    "lithium_plating": "a charge pulse at low temperature and the voltage plateau of the rest after it",
}


def experiment(effects: Sequence[str], kinds: dict[str, str]) -> str:
    """A sentence for a group of look-alikes.

    effects : ids.  kinds : id -> kind, so that an instrument's fault is told from what it imitates.
    """
    pairs = [EXPERIMENTS[frozenset(p)] for p in combinations(effects, 2) if frozenset(p) in EXPERIMENTS]
    if len(pairs) >= len(effects) - 1:
        return "; ".join(dict.fromkeys(pairs))
    named = [f"for {e}: {BY_EFFECT[e]}" for e in effects if e in BY_EFFECT]
    if any(kinds.get(e) == "instrument" for e in effects):
        named.append(SENSOR)
    return (
        "; ".join(dict.fromkeys([*pairs, *named])) or "data at other rates, temperatures and states of charge"
    )
