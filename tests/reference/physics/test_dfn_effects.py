"""Effects in the porous electrode against the same options of PyBaMM's DFN: the voltage itself, not the change."""

import numpy as np
import pytest

from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE

from .conftest import Peer, read
from .test_dfn import RADIAL, THROUGH, pulses, rmse_mv

REACHED_MV = 0.3
"""As without an effect, 0.03 to 0.2 mV, and what the effect's own numbers add."""
DOUBLE_LAYER_F_M2 = 2.0
COEFFICIENT_W_M2_K = 5.0


@pytest.fixture(scope="module")
def pulsed(peer):
    """The peer's cell under pulses to 3C."""
    time, current = pulses(peer.cell.nominal_capacity_ah, 3.0, 240)
    return Peer(read("nmc_30ah"), peer.cell, time, current)


def theirs(peer, **options):
    return peer.solve(model="DFN", through=THROUGH, radial=RADIAL, graded=True, **options)


def ours(peer, effect, **parameters):
    active = [CATALOGUE[effect].activate(**parameters)]
    return simulate(peer.cell, peer.time, peer.current, peer.soc0, active, model="dfn")


def test_self_heating_is_thermal_lumped(pulsed):
    update = {"Total heat transfer coefficient [W.m-2.K-1]": COEFFICIENT_W_M2_K}
    solution = theirs(pulsed, options={"thermal": "lumped"}, update=update)
    run = ours(pulsed, "self_heating", heat_transfer_w_k=COEFFICIENT_W_M2_K * pulsed.cell.surface_area_m2)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV
    temperature = solution["Volume-averaged cell temperature [K]"](pulsed.time)
    assert temperature.max() - temperature[0] > 0.2
    assert run.series["temperature_k"] == pytest.approx(temperature, abs=0.01)


def test_double_layer_is_surface_form_differential(pulsed):
    capacities = {
        f"{side} electrode double-layer capacity [F.m-2]": DOUBLE_LAYER_F_M2
        for side in ("Negative", "Positive")
    }
    solution = theirs(pulsed, options={"surface form": "differential"}, update=capacities)
    run = ours(pulsed, "double_layer", negative_f_m2=DOUBLE_LAYER_F_M2, positive_f_m2=DOUBLE_LAYER_F_M2)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV


def test_a_measured_temperature_is_another_temperature_of_the_peer(pulsed):
    cold = {"Initial temperature [K]": 278.15, "Ambient temperature [K]": 278.15}
    solution = theirs(pulsed, update=cold)
    run = simulate(pulsed.cell, pulsed.time, pulsed.current, pulsed.soc0, (), 5.0, model="dfn")
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV
    drifting = np.linspace(5.0, 5.02, len(pulsed.time))
    moved = simulate(pulsed.cell, pulsed.time, pulsed.current, pulsed.soc0, (), drifting, model="dfn")
    assert rmse_mv(run.voltage_v, moved.voltage_v) < REACHED_MV


def test_a_diffusivity_that_varies_is_a_function_of_stoichiometry(pulsed):
    slopes = {"negative_slope": -1.5, "positive_slope": 1.0}
    curved = {"negative_curvature": 0.0, "positive_curvature": 0.0}
    cell = pulsed.cell

    def varied(electrode, slope):
        import pybamm

        span = electrode.theta_max - electrode.theta_min

        def diffusivity(sto, _temperature):
            return electrode.diffusivity.value * pybamm.exp(
                slope * ((sto - electrode.theta_min) / span - 0.5)
            )

        return diffusivity

    update = {
        "Negative particle diffusivity [m2.s-1]": varied(cell.negative, slopes["negative_slope"]),
        "Positive particle diffusivity [m2.s-1]": varied(cell.positive, slopes["positive_slope"]),
    }
    solution = theirs(pulsed, update=update)
    run = ours(pulsed, "concentration_dependent_diffusivity", **slopes, **curved)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV
