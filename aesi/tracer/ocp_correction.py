"""A smooth correction of the positive electrode's open-circuit potential, for calibration.

    U_p(x) = U_p,declared(x) + d(x)     d a cubic spline through knots over the stoichiometry range

What the full cell shows at rest is the difference of both potentials, so that one correction serves for both; it is
given to the positive electrode. Holds within the declared stoichiometry range; constant beyond it.

Source: interpolation; sizes from half-cell to half-cell scatter, Chen et al., J. Electrochem. Soc. 167 (2020) 080534,
doi:10.1149/1945-7111/ab9050.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.parameters import Parameter
from aesi.physics.cell.relations import LookupTable, Sum
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

ID = "ocp_correction"
KNOTS = 19
GRID = 241
BEYOND = 0.06
"""Stoichiometry to which the table goes on beyond the declared range."""


def correction(soc: Sequence[float]) -> Effect:
    """The effect with knots at these states of charge, from full to empty."""
    parameters = {
        f"knot_{k:02d}_v": Parameter(
            0.0,
            "V",
            bounds=(-0.2, 0.2),
            neutral=0.0,
            linear=True,
            source="half-cell to half-cell scatter, tens of millivolts",
            description=f"shift of the potential at {100 * z:.0f} % state of charge",
        )
        for k, z in enumerate(soc)
    }
    return Effect(ID, "parameter", __doc__ or "", parameters, on_model=partial(correct, tuple(soc)))


def correct(soc: tuple[float, ...], model: EspmModel, **volts: float) -> EspmModel:
    """The model with the corrected potential; volts : at the knots, from full to empty cell (V)."""
    p = model.cell.positive
    at = p.theta_max - np.array(soc) * (p.theta_max - p.theta_min)
    spline = CubicSpline(at, [volts[f"knot_{k:02d}_v"] for k in range(len(soc))], bc_type="natural")
    x = np.linspace(max(p.theta_min - BEYOND, 1e-3), min(p.theta_max + BEYOND, 1.0 - 1e-3), GRID)
    y = spline(np.clip(x, p.theta_min, p.theta_max))
    table = LookupTable(tuple(map(float, x)), tuple(map(float, y)))
    return model.with_cell(positive=replace(p, ocp=Sum(p.ocp, table)))


EFFECT = correction([1.0 - k / (KNOTS - 1) for k in range(KNOTS)])
