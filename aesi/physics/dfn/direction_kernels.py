"""Compiled Newton direction of the reaction at all places; see `reaction_kernels` for the equations."""

from aesi.physics.dfn.local_kernels import salt_logarithm
from aesi.physics.espm.interface_kernels import stripped
from aesi.physics.espm.kernels import compiled

UPDATE_TOLERANCE_V = 5e-5
"""Tolerance of Newton's method, which converges quadratically: after an update below this the error is about its square
over 2 R T / F, 0.05 uV."""


@compiled
def add_side_currents(e, t, n, thermal, psi, reaction, salt):  # type: ignore[no-untyped-def]
    """Add double layers and plating of each place to `reaction` (places,), A/m2, and to the conductance."""
    half = psi.shape[0] // 2
    for r in range(psi.shape[0]):
        reaction[r] += t.layer_c[r] * psi[r] - t.layer_old[r]
        n.conductance[r] += t.layer_c[r]
        if e.plating[0] > 0.0 and r < half:
            metal, slope, _ = stripped(
                e.plating[0] * e.node_share[r], e.plating[1], t.metal_before[r], t.metal_filled[r],
                e.plating[2] * max(salt[r], 0.0), psi[r], thermal,
            )  # fmt: skip
            reaction[r] += metal
            n.conductance[r] += slope


@compiled
def newton_direction(p, t, n, spread, chi, total, psi, reaction, salt, half):  # type: ignore[no-untyped-def]
    """Newton's step: d_reaction, d_psi, d_y, d_salt into `n`, and the new potentials of both collectors.

    chi : V.  total : (2,) A/m2, delithiation positive.  psi : (places,) V.  reaction : (places,) A/m2.  salt : over
    rest.  Returns phi_n, phi_p, V.
    """
    places = 2 * half
    for r in range(places):
        first = 0 if r < half else half
        logarithm, d_logarithm = salt_logarithm(salt[r])
        held = 1.0 / n.conductance[r]
        residual = psi[r] - n.excess[r] * held + chi * logarithm
        by = n.shift[r] * held + chi * d_logarithm
        for v in range(places):
            n.matrix[r, v] = by * spread[r, v]
        for v in range(half):
            residual += t.ohm[r, v] * reaction[first + v]
            n.matrix[r, first + v] += t.ohm[r, v]
        n.matrix[r, r] += held
        n.rhs[r, 0] = -residual
        n.rhs[r, 1] = 1.0 if r < half else 0.0
        n.rhs[r, 2] = 1.0 - n.rhs[r, 1]
    eliminate_three(n.matrix, n.rhs, places)
    off_n, off_p, nn, np_, pn, pp = total[0], total[1], 0.0, 0.0, 0.0, 0.0
    for r in range(half):
        off_n -= reaction[r] + n.rhs[r, 0]
        nn += n.rhs[r, 1]
        np_ += n.rhs[r, 2]
    for r in range(half, places):
        off_p -= reaction[r] + n.rhs[r, 0]
        pn += n.rhs[r, 1]
        pp += n.rhs[r, 2]
    determinant = nn * pp - np_ * pn
    phi_n = (off_n * pp - off_p * np_) / determinant
    phi_p = (off_p * nn - off_n * pn) / determinant
    for r in range(places):
        n.d_reaction[r] = n.rhs[r, 0] + phi_n * n.rhs[r, 1] + phi_p * n.rhs[r, 2]
    for r in range(places):
        s = 0.0
        for v in range(places):
            s += spread[r, v] * n.d_reaction[v]
        n.d_salt[r] = s
        n.d_psi[r] = (n.d_reaction[r] - n.excess[r] + n.shift[r] * s) / n.conductance[r]
    for u in range(n.pot.shape[0]):
        r = p.place[u]
        n.d_y[u] = (psi[r] - n.pot[u] + n.d_psi[r] - n.by_salt[u] * n.d_salt[r]) / n.slope[u]
    return phi_n, phi_p


@compiled
def eliminate_three(matrix, rhs, n):  # type: ignore[no-untyped-def]
    """Solve in place for three right-hand sides (n, 3); resistances dominate the diagonal, so no rows are swapped."""
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * pivot
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            for j in range(3):
                rhs[i, j] -= factor * rhs[k, j]
    for k in range(n - 1, -1, -1):
        pivot = 1.0 / matrix[k, k]
        for j in range(3):
            value = rhs[k, j]
            for i in range(k + 1, n):
                value -= matrix[k, i] * rhs[i, j]
            rhs[k, j] = value * pivot
