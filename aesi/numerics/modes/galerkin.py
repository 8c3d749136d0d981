"""Galerkin projections of diffusion, diagonalised: in a sphere, and through a stack of three layers.

Both give modes of   d q_k / dt = -lambda_k D q_k + beta_k u   with lambda_0 = 0 for the conserved mean, so
that time stepping is exact mode by mode where D is constant, and the mean is the integral of the input to
round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from aesi.numerics.typing import Array


def _locked(array: Array) -> Array:
    out = np.ascontiguousarray(array, dtype=float)
    out.flags.writeable = False
    return out


SURFACE_SLOPE = 0.2
"""dr/dx at the surface, of the coordinate x in which a particle's profile is a polynomial; 1 would be polynomials in r.
Those resolve the surface to about 1/n**2 of the radius, and slow diffusion leaves thinner layers. Twelve on the LG M50
at a tenth of its diffusivities under a drive err by 0.44 mV RMS with 1, 0.11 with 0.5, 0.03 with 0.3, 0.02 with 0.2
and 0.1, 0.03 with 0.05; at the declared ones under a drive to 2C by 0.019, 0.002, 0.001, 0.001, 0.002 and 0.002."""
QUADRATURE_POINTS = 16
"""Beyond four an order: the stiffness is divided by the coordinate's slope, which no number of them integrates exactly;
so many more do to round-off, at any order (four modes without them: rates off by 6e-7)."""


@dataclass(frozen=True, eq=False)
class SphereModes:
    """Diffusion in the unit sphere with a prescribed outward flux, in even Legendre polynomials of x.

    r = x (1 + (1 - s) (1 - x**2) / 2), of slope s at the surface and (3 - s) / 2 in the centre.
    With z_k the surface value of mode k:  dz_k/dt = -lam_k (D/R^2) z_k - gain_k (flux/R),  surface = sum z_k.
    lam : (n,) ascending, lam[0] = 0.  gain : (n,) gain[0] = 3.
    at : (m, n) values at m collocation points from z, the last of them on the surface.
    project : (n, m) z from values there, which its inverse interpolates.
    """

    lam: Array
    gain: Array
    at: Array
    project: Array


@lru_cache(maxsize=32)
def sphere_modes(order: int) -> SphereModes:
    """Modes of the projection on P_0, P_2, ..., P_{2 (order - 1)} of a coordinate drawn out at the surface."""
    x, w = legendre.leggauss(4 * order + QUADRATURE_POINTS)
    x, w = 0.5 * (x + 1.0), 0.5 * w  # [0, 1]
    r, r_slope = _radius(x)
    basis = np.eye(2 * order - 1)[::2]
    value = np.array([legendre.legval(x, c) for c in basis])
    slope = np.array([legendre.legval(x, legendre.legder(c)) for c in basis])
    mass = (value * w * r**2 * r_slope) @ value.T
    stiff = (slope * w * r**2 / r_slope) @ slope.T
    lam, v = eigh(stiff, mass)
    lam[0] = 0.0
    at_surface = legendre.legval(1.0, basis.T) @ v
    # Gauss-Lobatto points of the even extension hold x = 1 and resolve as many even polynomials as there are
    # modes.
    nodes = np.sort(np.abs(gauss_lobatto(2 * order)[0][order:]))
    at = legendre.legval(nodes, basis.T).T @ v / at_surface
    return SphereModes(
        lam=_locked(lam),
        gain=_locked(at_surface**2),
        at=_locked(at),
        project=_locked(np.linalg.inv(at)),
    )


def _radius(x: Array) -> tuple[Array, Array]:
    """Radius at the coordinate x of the polynomials, and its slope there; see `SphereModes`."""
    bend = 0.5 * (1.0 - SURFACE_SLOPE)
    return x * (1.0 + bend * (1.0 - x**2)), 1.0 + bend * (1.0 - 3.0 * x**2)


@lru_cache(maxsize=32)
def gauss_lobatto(points: int) -> tuple[Array, Array]:
    """Nodes in [-1, 1] with both ends, and weights; exact to degree 2 points - 3."""
    c = np.zeros(points)
    c[-1] = 1.0
    inner = legendre.legroots(legendre.legder(c))
    x = np.concatenate([[-1.0], np.sort(inner), [1.0]])
    w = 2.0 / (points * (points - 1) * legendre.legval(x, c) ** 2)
    return _locked(x), _locked(w)


@dataclass(frozen=True, eq=False)
class StackModes:
    """Diffusion through negative electrode, separator, positive electrode, by one polynomial a layer.

    q_k :  dq_k/dt = -lam_k (project Phi(c))_k + (gain^T i)_k,  c = c0 + to_nodes q, for Phi' = D(c).
    lam : (n,), lam[0] = 0.  gain : (2 regions, n) of a source i_r, spread evenly over a region; regions
    count from the current collector of the negative electrode, then from that of the positive.
    to_nodes : (m, n).  project : (n, m).  gauss : (6 regions + 3, m) three Gauss points in each region, then
    in the separator.
    mean : (m,) weights of the average over the whole thickness.  salt : (m,) weights of the salt content.
    """

    lam: Array
    gain: Array
    to_nodes: Array
    project: Array
    gauss: Array
    mean: Array
    salt: Array


GAUSS_3 = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
"""Gauss-Legendre points on [0, 1], exact to degree five."""


@lru_cache(maxsize=256)
def stack_modes(
    thickness: tuple[float, float, float],
    porosity: tuple[float, float, float],
    efficiency: tuple[float, float, float],
    order: int,
    regions: int = 1,
) -> StackModes:
    """Modes for layers of given thickness (m), porosity and transport efficiency.

    order : polynomial degree of a layer.  regions : equal parts of each electrode that carry currents of
    their own.
    """
    mass, stiff, integral = _stack_matrices(thickness, porosity, efficiency, order)
    lam, v = eigh(stiff, mass)
    lam[0] = 0.0
    source, gauss = _region_matrices(order, regions)
    return StackModes(
        lam=_locked(lam),
        gain=_locked(source @ v),
        to_nodes=_locked(v),
        project=_locked(v.T @ mass),
        gauss=_locked(gauss),
        mean=_locked(integral / sum(thickness)),
        salt=_locked(mass.sum(axis=0)),
    )


def _stack_matrices(
    thickness: tuple[float, float, float],
    porosity: tuple[float, float, float],
    efficiency: tuple[float, float, float],
    order: int,
) -> tuple[Array, Array, Array]:
    """(mass (m, m), stiffness (m, m), integral over the thickness (m,)) of the values at the nodes of the stack."""
    m = 3 * order + 1
    x, w = legendre.leggauss(order + 2)
    to_coefficients = _layer_coefficients(order)
    value = legendre.legvander(x, order) @ to_coefficients
    derivative = np.array([legendre.legval(x, legendre.legder(c)) for c in np.eye(order + 1)]).T
    slope = derivative @ to_coefficients
    mass, stiff, integral = np.zeros((m, m)), np.zeros((m, m)), np.zeros(m)
    for layer in range(3):
        rows = slice(layer * order, layer * order + order + 1)
        half = 0.5 * thickness[layer]
        mass[rows, rows] += porosity[layer] * half * (value.T * w) @ value
        stiff[rows, rows] += efficiency[layer] / half * (slope.T * w) @ slope
        integral[rows] += half * w @ value
    return mass, stiff, integral


def _region_matrices(order: int, regions: int) -> tuple[Array, Array]:
    """(source (2 regions, m) of a source spread over each region, gauss as in `StackModes`) at the nodes."""
    m = 3 * order + 1
    x, w = legendre.leggauss(order + 2)
    to_coefficients = _layer_coefficients(order)
    source, gauss = np.zeros((2 * regions, m)), np.zeros((6 * regions + 3, m))
    gauss[6 * regions :, order : 2 * order + 1] = (
        legendre.legvander(2.0 * GAUSS_3 - 1.0, order) @ to_coefficients
    )
    for side, rows in enumerate((slice(0, order + 1), slice(2 * order, m))):
        for part in range(regions):
            at = part if side == 0 else regions - 1 - part  # position from the left
            row = side * regions + part
            points = 2.0 * (at + 0.5 * (x + 1.0)) / regions - 1.0
            source[row, rows] = 0.5 * w @ (legendre.legvander(points, order) @ to_coefficients)
            points = 2.0 * (at + GAUSS_3) / regions - 1.0
            gauss[3 * row : 3 * row + 3, rows] = legendre.legvander(points, order) @ to_coefficients
    return source, gauss


def _layer_coefficients(order: int) -> Array:
    """(order + 1, order + 1) Legendre coefficients over a layer from values at its Gauss-Lobatto points."""
    return np.asarray(np.linalg.inv(legendre.legvander(gauss_lobatto(order + 1)[0], order)))


def ohmic_shares(regions: int) -> tuple[Array, Array]:
    """Mean ohmic drops in an electrode cut into equal regions, per current that reacts in each.

    Currents y_r are counted from the collector. Returns solid (regions, regions) and salt (regions, regions,
    regions): L/sigma solid @ y is the drop from the collector to the mean of each region's solid, and the
    sum over m of L/kappa_m salt[:, m] @ y that from the mean of each region's electrolyte through the
    regions m to the separator. One region: 1/3 and 1/3.
    """
    total = np.ones(regions)
    ionic = np.tril(
        np.ones((regions + 1, regions)), -1
    )  # ionic current at each interface, from the collector
    solid_current = total - ionic
    solid, salt = np.zeros((regions, regions)), np.zeros((regions, regions, regions))
    for r in range(regions):
        solid[r] = solid_current[r] / 3.0 + solid_current[r + 1] / 6.0
        salt[r, r] = ionic[r] / 6.0 + ionic[r + 1] / 3.0
        for before in range(r):
            solid[r] += 0.5 * (solid_current[before] + solid_current[before + 1])
        for after in range(r + 1, regions):
            salt[r, after] = 0.5 * (ionic[after] + ionic[after + 1])
    return _locked(solid / regions), _locked(salt / regions)
