"""Particle sizes of the laboratory's cell: moments of the distribution, and how many of them it takes."""

import numpy as np
import pytest

from aesi.data.laboratory import simulator
from aesi.data.laboratory.simulator import Applied, Setup, simulate_truth
from aesi.data.laboratory.sizes import gauss_sizes
from aesi.data.profiles.profile import ProfileBuilder

pytestmark = pytest.mark.usefixtures("laboratory_cache")


@pytest.mark.parametrize("scatter", [0.02, 0.3, 0.6])
def test_mean_and_scatter_are_those_that_were_asked_for(scatter):
    import pybamm
    from pybamm.parameters.size_distribution_parameters import lognormal

    mean_m = 5e-6
    limits = {"R_n": {"min": pybamm.Scalar(0), "max": pybamm.Scalar(4 * mean_m)}}
    mesh = gauss_sizes(mean_m, scatter * mean_m)(limits, {"R_n": 5})
    density = np.array([lognormal(pybamm.Scalar(r), mean_m, scatter * mean_m).evaluate() for r in mesh.nodes])
    share = np.ravel(density) * mesh.d_edges  # as PyBaMM weights them
    # Five points of the rule leave 8e-8 of the mean and 1.3e-4 of the scatter at 60 %, by hand in numpy.
    assert share.sum() == pytest.approx(1.0, abs=1e-12)
    assert share @ mesh.nodes == pytest.approx(mean_m, rel=1e-6)
    assert np.sqrt(share @ (mesh.nodes - mean_m) ** 2) == pytest.approx(scatter * mean_m, rel=2e-4)


def test_the_number_of_sizes_had_decided_the_voltage_by_millivolts(nmc, monkeypatch):
    builder = ProfileBuilder(30.0, 1.0)
    pieces = [
        builder.rest(10),
        builder.pulse(2.0, 60),
        builder.rest(60),
        builder.pulse(-3.0, 30),
        builder.rest(60),
    ]
    profile = builder.profile("pulses", pieces, 0.6)
    spread = {"negative_spread": 0.6, "positive_spread": 0.6}
    setup = Setup(nmc, "SPMe", (Applied("particle_size_distribution", spread),), radial_points=30)

    def voltage_v(sizes):
        monkeypatch.setitem(simulator.MESH, "SPMe", simulator.MESH["SPMe"] | {"R_n": sizes, "R_p": sizes})
        return simulate_truth(setup, profile).voltage_v

    # Even divisions err by 0.6 mV RMS with eight sizes; 5 sizes of the Gauss rule by 0.04 under US06.
    assert 1e3 * np.sqrt(np.mean((voltage_v(5) - voltage_v(9)) ** 2)) < 0.1


def test_a_cell_of_many_sizes_that_warms_itself_can_be_made(nmc):
    """PyBaMM has no heat of mixing for it."""
    builder = ProfileBuilder(30.0, 1.0)
    profile = builder.profile("pulse", [builder.rest(10), builder.pulse(2.0, 60)], 0.6)
    sizes = Applied("particle_size_distribution", {"negative_spread": 0.3, "positive_spread": 0.3})
    truth = simulate_truth(Setup(nmc, "SPMe", (sizes, Applied("self_heating")), radial_points=30), profile)
    assert truth.temperature_degc[-1] > truth.temperature_degc[0] + 0.1
