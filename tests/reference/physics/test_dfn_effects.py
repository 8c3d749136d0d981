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
MIXING_THROUGH, MIXING_RADIAL = 20, 30
"""A coarser mesh for the heat of mixing, by which the peer's temperature depends on every concentration at once: 0.17
mV and 0.051 K apart in 29 s, where 12 and 20 volumes leave 0.39 mV and 0.057 K, and 20 and 40 take 42 s for 0.16 and
0.051."""


@pytest.fixture(scope="module")
def pulsed(peer):
    """The peer's cell under pulses to 3C."""
    time, current = pulses(peer.cell.nominal_capacity_ah, 3.0, 240)
    return Peer(read("nmc_30ah"), peer.cell, time, current)


def theirs(peer, through=THROUGH, radial=RADIAL, **options):
    return peer.solve(model="DFN", through=through, radial=radial, graded=True, **options)


def ours(peer, effect, **parameters):
    active = [CATALOGUE[effect].activate(**parameters)]
    return simulate(peer.cell, peer.time, peer.current, peer.soc0, active, model="dfn")


@pytest.mark.slow
def test_self_heating_is_thermal_lumped_with_the_heat_of_mixing(pulsed):
    update = {"Total heat transfer coefficient [W.m-2.K-1]": COEFFICIENT_W_M2_K}
    heated = {"thermal": "lumped", "heat of mixing": "true"}
    solution = theirs(pulsed, MIXING_THROUGH, MIXING_RADIAL, options=heated, update=update)
    run = ours(pulsed, "self_heating", heat_transfer_w_k=COEFFICIENT_W_M2_K * pulsed.cell.surface_area_m2)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV
    temperature = solution["Volume-averaged cell temperature [K]"](pulsed.time)
    assert temperature.max() - temperature[0] > 0.2
    # Gradients hold some of it for a while: 0.05 K, where without the heat of mixing theirs differs for good.
    assert run.series["temperature_k"] == pytest.approx(temperature, abs=0.06)


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


@pytest.fixture(scope="module")
def plain_dfn_v(pulsed):
    """PyBaMM's porous electrode without an effect, (n,) V."""
    return np.asarray(theirs(pulsed)["Voltage [V]"](pulsed.time))


def test_hysteresis_is_one_state_hysteresis_in_the_mean(pulsed, plain_dfn_v):
    """Ours is one state of the cell, PyBaMM's one at every place: the change differs by how the reaction does."""
    import pybamm

    half_gap, decay = 0.02, 40.0
    values = pybamm.ParameterValues.create_from_bpx_obj(pulsed.cell.to_bpx())
    declared = values["Positive electrode OCP [V]"]
    solution = theirs(
        pulsed,
        options={"open-circuit potential": ("single", "one-state hysteresis")},
        update={
            "Positive electrode lithiation OCP [V]": lambda x: declared(x) - half_gap,
            "Positive electrode delithiation OCP [V]": lambda x: declared(x) + half_gap,
            "Positive particle lithiation hysteresis decay rate": decay,
            "Positive particle delithiation hysteresis decay rate": decay,
            "Initial hysteresis state in positive electrode": 0.0,
        },
    )
    rate = (
        0.5
        * decay
        * pulsed.cell.nominal_capacity_ah
        / pulsed.cell.electrode_capacity_ah(pulsed.cell.positive)
    )
    run = ours(pulsed, "ocv_hysteresis", magnitude_v=half_gap, rate=rate)
    voltage = solution["Voltage [V]"](pulsed.time)
    assert rmse_mv(voltage, plain_dfn_v) > 2.0
    assert rmse_mv(run.voltage_v, voltage) < REACHED_MV


def test_asymmetric_kinetics_is_asymmetric_butler_volmer(pulsed):
    names = "electrode Butler-Volmer transfer coefficient"
    solution = theirs(
        pulsed,
        options={"intercalation kinetics": "asymmetric Butler-Volmer"},
        update={f"Negative {names}": 0.35, f"Positive {names}": 0.6},
    )
    run = ours(pulsed, "asymmetric_kinetics", negative_alpha=0.35, positive_alpha=0.6)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](pulsed.time)) < REACHED_MV


def test_lithium_plating_is_reversible_plating(pulsed, reversible_plating):
    charged = Peer(pulsed.content, pulsed.cell, pulsed.time, -np.abs(pulsed.current), 0.5)
    rate, options = reversible_plating
    solution = theirs(charged, **options)
    run = ours(charged, "lithium_plating", rate_m_s=rate)
    assert rmse_mv(run.voltage_v, solution["Voltage [V]"](charged.time)) < REACHED_MV
    plated = solution["X-averaged negative lithium plating concentration [mol.m-3]"](charged.time)
    assert plated.max() > 0.0
    assert run.series["plated_mol_m3"] == pytest.approx(plated, abs=0.02 * plated.max())


@pytest.mark.slow
def test_particle_sizes_are_the_size_distribution(pulsed):
    import pybamm

    values = pybamm.ParameterValues.create_from_bpx_obj(pulsed.cell.to_bpx())
    spread = pybamm.get_size_distribution_parameters(values, sd_n=0.3, sd_p=0.3, R_max_n=3.2, R_max_p=3.2)
    sizes = {k: spread[k] for k in dict(spread) if "area-weighted" in k or "radius" in k.lower()}
    voltages = [
        pulsed.solve(model="DFN", through=12, radial=20, graded=True, options=options, update=update)[
            "Voltage [V]"
        ](pulsed.time)
        for options, update in (
            ({"particle size": "distribution", "surface form": "algebraic"}, sizes),
            ({}, None),
        )
    ]
    moved = np.asarray(voltages[0]) - np.asarray(voltages[1])
    run = ours(pulsed, "particle_size_distribution", negative_sd=0.3, positive_sd=0.3)
    bare = simulate(pulsed.cell, pulsed.time, pulsed.current, pulsed.soc0, model="dfn")
    change = run.voltage_v - bare.voltage_v
    assert rmse_mv(moved, 0.0 * moved) > 1.0
    assert rmse_mv(change, moved) < 0.1 * rmse_mv(moved, 0.0 * moved)
