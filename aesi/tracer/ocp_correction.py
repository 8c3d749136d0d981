"""A smooth correction of the positive electrode's open-circuit potential, for calibration.

    U_p(x) = U_p,declared(x) + d(x)     d a cubic spline through knots evenly spaced over the stoichiometry range

What the full cell shows at rest is the difference of both potentials, so that one correction serves for both; it is
given to the positive electrode. Holds within the declared stoichiometry range; constant beyond it.

Source: interpolation; sizes from half-cell to half-cell scatter, Chen et al., J. Electrochem. Soc. 167 (2020) 080534,
doi:10.1149/1945-7111/ab9050.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel
from aesi.physics.relations import Sum, Table

KNOTS = 19
GRID = 241
BEYOND = 0.06
"""Stoichiometry to which the table goes on beyond the declared range."""

PARAMETERS = {
    f"knot_{k:02d}_v": Parameter(
        0.0,
        "V",
        bounds=(-0.2, 0.2),
        neutral=0.0,
        linear=True,
        source="half-cell to half-cell scatter, tens of millivolts",
        description=f"shift of the potential at {100 * (1 - k / (KNOTS - 1)):.0f} % state of charge",
    )
    for k in range(KNOTS)
}


def correct(model: EspmModel, **volts: float) -> EspmModel:
    """The model with the corrected potential; volts : at the knots, from full to empty cell (V)."""
    p = model.cell.positive
    at = np.linspace(p.theta_min, p.theta_max, KNOTS)
    spline = CubicSpline(at, [volts[name] for name in PARAMETERS], bc_type="natural")
    x = np.linspace(max(p.theta_min - BEYOND, 1e-3), min(p.theta_max + BEYOND, 1.0 - 1e-3), GRID)
    y = spline(np.clip(x, p.theta_min, p.theta_max))
    table = Table(tuple(map(float, x)), tuple(map(float, y)))
    return model.with_cell(positive=replace(p, ocp=Sum(p.ocp, table)))


EFFECT = Effect("ocp_correction", "parameter", __doc__ or "", PARAMETERS, on_model=correct)
