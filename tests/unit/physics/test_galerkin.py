"""The projections against closed forms of diffusion."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erf

from aesi.numerics.modes.galerkin import ohmic_shares, sphere_modes, stack_modes
from aesi.physics.model import DEFAULT_SOLID_ORDER

PI = np.pi


def test_the_slowest_rates_of_a_sphere_are_the_roots_of_tan_z_equals_z():
    roots = [brentq(lambda z: np.tan(z) - z, (k + 0.01) * PI, (k + 0.4999) * PI) for k in (1, 2, 3)]
    assert np.sqrt(sphere_modes(16).lam[1:4]) == pytest.approx(roots, rel=1e-8)


def test_the_surface_under_a_constant_flux_follows_crank():
    # J. Crank, The Mathematics of Diffusion, eq. 6.45 at r = a: 3 t + 1/5 - 2 sum exp(-z_n^2 t) / z_n^2.
    modes, t = sphere_modes(16), 0.03
    z = np.array(
        [brentq(lambda z: np.tan(z) - z, (k + 1e-3) * PI, (k + 0.499999) * PI) for k in range(1, 200)]
    )
    crank = 3.0 * t + 0.2 - 2.0 * np.sum(np.exp(-(z**2) * t) / z**2)
    ours = modes.gain[0] * t + np.sum(modes.gain[1:] * -np.expm1(-modes.lam[1:] * t) / modes.lam[1:])
    assert ours == pytest.approx(crank, rel=1e-5)  # what 16 modes leave at this time


def test_the_surface_follows_the_half_space_soon_after_a_step_of_the_flux():
    # Laplace transform 1 / (s (sqrt(s) - 1)) of a sphere in which nothing has come to the centre yet.
    modes, t = sphere_modes(DEFAULT_SOLID_ORDER), np.logspace(-5, -2, 50)
    early = np.exp(t) * (1.0 + erf(np.sqrt(t))) - 1.0
    grown = -np.expm1(-modes.lam[1:] * t[:, None]) / modes.lam[1:] @ modes.gain[1:]
    assert modes.gain[0] * t + grown == pytest.approx(
        early, abs=6e-5
    )  # 4.1e-5 is reached; radius itself: 9.8e-4


def test_projection_and_evaluation_are_inverse_in_the_sphere():
    modes = sphere_modes(8)
    assert modes.at[-1] == pytest.approx(1.0)  # on the surface
    assert modes.project @ modes.at == pytest.approx(np.eye(8), abs=1e-9)


LAYERS = ((5e-5, 2e-5, 6e-5), (0.3, 0.5, 0.35), (0.15, 0.3, 0.2))


def test_a_uniform_stack_has_the_rates_of_a_slab():
    modes = stack_modes((1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), 8)
    slab = (np.arange(1, 5) * PI / 3.0) ** 2
    assert modes.lam[1:5] == pytest.approx(slab, rel=1e-8)  # degree 8 a layer


@pytest.mark.parametrize("regions", [1, 4])
def test_the_steady_profile_of_the_stack_is_the_closed_form(regions):
    """Flux i x / L_n in the negative electrode, i in the separator: drops add up layer by layer."""
    (ln, ls, lp), eps, (bn, bs, bp) = LAYERS
    modes = stack_modes((ln, ls, lp), eps, (bn, bs, bp), 4, regions)
    source = np.repeat([1.0, -1.0], regions) / regions @ modes.gain
    profile = modes.to_nodes[:, 1:] @ (source[1:] / modes.lam[1:])
    assert profile[0] - profile[-1] == pytest.approx(ln / (2 * bn) + ls / bs + lp / (2 * bp), rel=1e-9)
    assert modes.salt @ profile == pytest.approx(0.0, abs=1e-12)


def test_the_modes_of_the_electrolyte_keep_salt():
    modes = stack_modes(*LAYERS, 4, 3)
    both = modes.gain[:3].sum(axis=0) - modes.gain[3:].sum(axis=0)
    assert both[0] == pytest.approx(0.0, abs=1e-9 * abs(modes.gain[0, 0]))
    assert modes.project @ modes.to_nodes == pytest.approx(np.eye(len(modes.lam)), abs=1e-9)


@pytest.mark.parametrize("regions", [1, 2, 5])
def test_a_uniform_reaction_loses_a_third_on_average_in_any_number_of_regions(regions):
    solid, salt = ohmic_shares(regions)
    uniform = np.full(regions, 1.0 / regions)
    assert (solid @ uniform).mean() == pytest.approx(1.0 / 3.0)
    assert (salt.sum(axis=1) @ uniform).mean() == pytest.approx(1.0 / 3.0)


def test_the_farthest_region_pays_the_whole_way():
    # All the reaction in the half next to the collector: the solid is crossed within it alone, and the salt within
    # it (to its mean) and through the whole other half.
    solid, salt = ohmic_shares(2)
    y = np.array([1.0, 0.0])
    assert (solid @ y)[0] == pytest.approx(0.5 / 3.0)
    assert (salt.sum(axis=1) @ y)[0] == pytest.approx(0.5 / 3.0 + 0.5)
