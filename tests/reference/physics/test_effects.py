"""Each effect against PyBaMM with the matching option, over the same random drive load.

`agrees` compares what the effect changes in ours with what it changes in the peer: the share of the change that is
not reproduced. The peer's own surface form moves the voltage by 0.2 mV, so an option that needs it is compared with
that form, not with the default.
"""

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE

from .conftest import Peer

DOUBLE_LAYER_F_M2 = 5.0


def rms(values):
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))


def ours(peer, name, **values):
    """What the effect adds to our voltage, (n,) V."""
    with_effect = simulate(
        peer.cell, peer.time, peer.current, soc0=peer.soc0, effects=[CATALOGUE[name].activate(**values)]
    )
    return with_effect.voltage_v - simulate(peer.cell, peer.time, peer.current, soc0=peer.soc0).voltage_v


def agrees(change, theirs, share, least_v=1e-3):
    """The effect is there (more than least_v RMS), and ours reproduces it but for `share`."""
    assert rms(theirs) > least_v
    assert rms(change - theirs) < share * rms(theirs)


def test_self_heating_is_thermal_lumped_with_the_heat_of_mixing(peer, plain_v):
    """Of the salt a lump leaves out the heat of mixing; lithium that is on its way within a particle gives its own."""
    coefficient = 5.0
    solution = peer.solve(
        options={"thermal": "lumped", "heat of mixing": "true"},
        update={"Total heat transfer coefficient [W.m-2.K-1]": coefficient},
    )
    conductance = coefficient * peer.cell.surface_area_m2
    agrees(
        ours(peer, "self_heating", heat_transfer_w_k=conductance),
        solution["Voltage [V]"](peer.time) - plain_v,
        0.02,
        5e-4,
    )
    effect = CATALOGUE["self_heating"].activate(heat_transfer_w_k=conductance)
    run = simulate(peer.cell, peer.time, peer.current, soc0=peer.soc0, effects=[effect])
    theirs = solution["Volume-averaged cell temperature [K]"](peer.time)
    assert theirs.max() - theirs[0] > 0.5
    assert run.series["temperature_k"] == pytest.approx(theirs, abs=0.02)


def test_a_double_layer_gives_back_what_it_stored_and_heated_the_cell_by_it(peer):
    coefficient, capacity = 5.0, 20.0
    update = {
        f"{side} electrode double-layer capacity [F.m-2]": capacity for side in ("Negative", "Positive")
    }
    solution = peer.solve(
        options={"thermal": "lumped", "heat of mixing": "true", "surface form": "differential"},
        update={**update, "Total heat transfer coefficient [W.m-2.K-1]": coefficient},
    )
    theirs = solution["Volume-averaged cell temperature [K]"](peer.time)
    effects = [
        CATALOGUE["self_heating"].activate(heat_transfer_w_k=coefficient * peer.cell.surface_area_m2),
        CATALOGUE["double_layer"].activate(negative_f_m2=capacity, positive_f_m2=capacity),
    ]
    assert theirs.max() - theirs[0] > 0.5
    for model in ("espm", "dfn"):
        run = simulate(peer.cell, peer.time, peer.current, peer.soc0, effects, model=model)
        assert run.series["temperature_k"] == pytest.approx(theirs, abs=0.02)


def test_ambient_temperature_is_another_temperature_of_the_peer(peer, plain_v):
    cold = {"Ambient temperature [K]": 283.15, "Initial temperature [K]": 283.15}
    agrees(ours(peer, "ambient_temperature", shift_k=-15.0), peer.voltage(update=cold) - plain_v, 0.002)


def test_series_resistance_is_contact_resistance(peer, plain_v):
    theirs = peer.voltage(options={"contact resistance": "true"}, update={"Contact resistance [Ohm]": 5e-4})
    agrees(ours(peer, "series_resistance", resistance_ohm=5e-4), theirs - plain_v, 1e-6)


def test_a_constant_film_is_sei_constant(peer, plain_v):
    thickness, resistivity = 2e-8, 2e5
    theirs = peer.voltage(
        options={"SEI": "constant", "SEI film resistance": "average"},
        update={
            "Initial SEI thickness [m]": thickness,
            "SEI resistivity [Ohm.m]": resistivity,
            "SEI partial molar volume [m3.mol-1]": 9.585e-5,
        },
    )
    n = peer.cell.negative
    area = n.area_per_volume_1_m * n.thickness_m * peer.cell.total_area_m2
    agrees(
        ours(peer, "series_resistance", resistance_ohm=thickness * resistivity / area), theirs - plain_v, 1e-6
    )


def test_ocv_hysteresis_is_one_state_hysteresis(peer, plain_v):
    import pybamm

    half_gap, decay = 0.02, 40.0
    values = pybamm.ParameterValues.create_from_bpx_obj(peer.cell.to_bpx())
    declared = values["Positive electrode OCP [V]"]
    theirs = peer.voltage(
        options={"open-circuit potential": ("single", "one-state hysteresis")},
        update={
            "Positive electrode lithiation OCP [V]": lambda x: declared(x) - half_gap,
            "Positive electrode delithiation OCP [V]": lambda x: declared(x) + half_gap,
            "Positive particle lithiation hysteresis decay rate": decay,
            "Positive particle delithiation hysteresis decay rate": decay,
            "Initial hysteresis state in positive electrode": 0.0,
        },
    )
    # The peer counts throughput in stoichiometry of the electrode and halves the rate.
    rate = 0.5 * decay * peer.cell.nominal_capacity_ah / peer.cell.electrode_capacity_ah(peer.cell.positive)
    agrees(ours(peer, "ocv_hysteresis", magnitude_v=half_gap, rate=rate), theirs - plain_v, 1e-3)


def test_double_layer_is_surface_form_differential(peer):
    capacities = {
        f"{side} electrode double-layer capacity [F.m-2]": DOUBLE_LAYER_F_M2
        for side in ("Negative", "Positive")
    }
    charged = peer.voltage(options={"surface form": "differential"}, update=capacities)
    instant = peer.voltage(options={"surface form": "algebraic"})
    change = ours(peer, "double_layer", negative_f_m2=DOUBLE_LAYER_F_M2, positive_f_m2=DOUBLE_LAYER_F_M2)
    agrees(change, charged - instant, 0.05)


def test_concentration_dependent_diffusivity_is_a_function_of_stoichiometry(peer, plain_v):
    import pybamm

    def diffusivity(electrode, slope, curvature):
        def of(x, temperature):
            s = (x - electrode.theta_min) / (electrode.theta_max - electrode.theta_min)
            shape = slope * (s - 0.5) + curvature * ((2 * s - 1) ** 2 - 1 / 3)
            return electrode.diffusivity.value * pybamm.exp(shape)

        return of

    theirs = peer.voltage(
        update={
            "Negative particle diffusivity [m2.s-1]": diffusivity(peer.cell.negative, -2.0, 1.0),
            "Positive particle diffusivity [m2.s-1]": diffusivity(peer.cell.positive, 1.5, -1.0),
        }
    )
    change = ours(
        peer,
        "concentration_dependent_diffusivity",
        negative_slope=-2.0,
        negative_curvature=1.0,
        positive_slope=1.5,
        positive_curvature=-1.0,
    )
    agrees(change, theirs - plain_v, 0.02)


def test_solid_diffusivity_is_another_constant(peer, plain_v):
    n, p = peer.cell.negative.diffusivity.value, peer.cell.positive.diffusivity.value
    update = {
        "Negative particle diffusivity [m2.s-1]": 0.5 * n,
        "Positive particle diffusivity [m2.s-1]": 2.0 * p,
    }
    change = ours(peer, "solid_diffusivity", negative_factor=0.5, positive_factor=2.0)
    agrees(change, peer.voltage(update=update) - plain_v, 0.02)


def test_asymmetric_kinetics_is_asymmetric_butler_volmer(peer):
    names = "electrode Butler-Volmer transfer coefficient"
    skewed = peer.voltage(
        options={"intercalation kinetics": "asymmetric Butler-Volmer"},
        update={f"Negative {names}": 0.35, f"Positive {names}": 0.6},
    )
    even = peer.voltage(options={"surface form": "algebraic"})
    agrees(ours(peer, "asymmetric_kinetics", negative_alpha=0.35, positive_alpha=0.6), skewed - even, 0.03)


def test_active_material_loss_is_a_smaller_volume_fraction(peer, plain_v):
    import pybamm

    from aesi.physics.balance import same_rest, with_active_material

    name = "Negative electrode active material volume fraction"
    values = pybamm.ParameterValues.create_from_bpx_obj(peer.cell.to_bpx())
    aged = with_active_material(peer.cell, 0.85, 1.0)
    theta_n, theta_p = aged.stoichiometries(same_rest(peer.cell, aged, peer.soc0))
    theirs = peer.voltage(
        update={
            name: 0.85 * values[name],
            "Initial concentration in negative electrode [mol.m-3]": theta_n * aged.negative.c_max_mol_m3,
            "Initial concentration in positive electrode [mol.m-3]": theta_p * aged.positive.c_max_mol_m3,
        }
    )
    agrees(ours(peer, "active_material_loss_negative", loss=0.15), theirs - plain_v, 0.02)


@pytest.mark.parametrize(
    ("name", "loss"), [("lithium_inventory_loss", 0.08), ("active_material_loss_positive", 0.2)]
)
def test_windows_after_a_loss_are_the_peers_electrode_balance(peer, name, loss):
    import pybamm

    from aesi.physics.simulation import model_with

    aged = model_with(peer.cell, [CATALOGUE[name].activate(loss=loss)]).cell
    q_n, q_p = aged.electrode_capacity_ah(aged.negative), aged.electrode_capacity_ah(aged.positive)
    values = pybamm.ParameterValues.create_from_bpx_obj(peer.cell.to_bpx())
    full, empty = (float(peer.cell.rest_voltage_v(soc)[0]) for soc in (1.0, 0.0))
    values.update(
        {
            "Lower voltage cut-off [V]": empty,
            "Upper voltage cut-off [V]": full,
            "Open-circuit voltage at 0% SOC [V]": empty,
            "Open-circuit voltage at 100% SOC [V]": full,
        },
        check_already_exists=False,
    )
    solver = pybamm.lithium_ion.ElectrodeSOHSolver(values, known_value="cyclable lithium capacity")
    lithium = q_n * aged.negative.theta_max + q_p * aged.positive.theta_min
    found = solver.solve({"Q_n": q_n, "Q_p": q_p, "Q_Li": lithium})
    windows = (
        aged.negative.theta_min,
        aged.negative.theta_max,
        aged.positive.theta_min,
        aged.positive.theta_max,
    )
    # A positive electrode that is full before the voltage is reached ends at 1 here, and up to 3e-4 below it in the
    # peer, whose open-circuit potentials bend to a wall there.
    assert windows == pytest.approx([float(found[k]) for k in ("x_0", "x_100", "y_100", "y_0")], abs=3e-4)


def test_lithium_plating_is_reversible_plating(peer, reversible_plating):
    charge = Peer(peer.content, peer.cell, peer.time, -np.abs(peer.current), 0.5)
    rate, options = reversible_plating
    theirs = charge.solve(**options)
    without = charge.voltage(options={"surface form": "algebraic"})
    change = ours(charge, "lithium_plating", rate_m_s=rate)
    agrees(change, theirs["Voltage [V]"](charge.time) - without, 0.05, 2e-4)
    effect = CATALOGUE["lithium_plating"].activate(rate_m_s=rate)
    run = simulate(charge.cell, charge.time, charge.current, soc0=0.5, effects=[effect])
    plated = theirs["X-averaged negative lithium plating concentration [mol.m-3]"](charge.time)
    assert run.series["plated_mol_m3"] == pytest.approx(plated, abs=0.02 * plated.max())


@pytest.mark.slow
def test_particle_size_distribution_is_the_many_particle_model(peer):
    import pybamm

    values = pybamm.ParameterValues.create_from_bpx_obj(peer.cell.to_bpx())
    spread = pybamm.get_size_distribution_parameters(values, sd_n=0.3, sd_p=0.3, R_max_n=3.2, R_max_p=3.2)
    sizes = {
        name: spread[name] for name in dict(spread) if "area-weighted" in name or "radius" in name.lower()
    }
    change = ours(peer, "particle_size_distribution", negative_sd=0.3, positive_sd=0.3)
    agrees(
        change,
        peer.voltage(model="MPM", update=sizes, radial=30) - peer.voltage(model="SPM", radial=30),
        0.03,
    )


@pytest.mark.slow
def test_reaction_nonuniformity_is_what_the_porous_electrode_model_adds(peer):
    """The peer's porous-electrode model converges to first order in its mesh (1.5 mV at 20 points): extrapolated."""
    content = peer.cell.to_bpx()
    for side in ("Negative electrode", "Positive electrode"):
        content["Parameterisation"][side]["Transport efficiency"] *= 0.4  # poor transport, so that it shows
    poor = Peer(content, Cell.from_bpx(content), peer.time, peer.current, peer.soc0)
    coarse, fine = (poor.voltage(model="DFN", through=points, radial=40) for points in (20, 40))
    theirs = 2.0 * fine - coarse - poor.voltage(radial=40)
    # Four regions leave 0.34 of 1.75 mV, five 0.26, twelve 0.14: what remains is their width.
    agrees(ours(poor, "reaction_nonuniformity"), theirs, 0.25)
