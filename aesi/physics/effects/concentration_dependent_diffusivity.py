"""Solid diffusivity that depends on stoichiometry.

    D(x) = D_declared(x) exp(b1 (s - 1/2) + b2 ((2 s - 1)**2 - 1/3)),   s = (x - x_min) / (x_max - x_min)

so that b1 is the natural logarithm of D at x_max over D at x_min, and b2 that of D at the ends over D in the middle.

Leaves out staging, hysteresis of D and the fine structure of the thermodynamic factor. Holds within the declared
stoichiometry limits; further than a tenth of their span beyond them, D is constant.

Source: measured D(x): Ecker et al., J. Electrochem. Soc. 162 (2015) A1836, doi:10.1149/2.0551509jes.
"""

from dataclasses import replace

import numpy as np

from aesi.parameters import Parameter
from aesi.physics.cell import Electrode
from aesi.physics.cell.relations import Constant, LookupTable, Product, scaled
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

POINTS = 129
"""Number of points of the table of the diffusivity, which is linear between them."""
BEYOND_LIMITS = 0.1
"""Extension of the table beyond the stoichiometry limits, as a share of their span: surfaces exceed them under load."""
RANGE = "measured curves span some two orders of magnitude; the slope may go to e**10, so that no steep one is cut off"
ENDS = (
    "convention: D at the ends is e**4 times that in the middle at most, or one part in e**4 of it; no source"
)
SLOPE, CURVATURE = 10.0, 4.0
"""Largest |b1|, by RANGE, and largest |b2|, by ENDS."""


def _parameter(default: float, reach: float, side: str, what: str) -> Parameter:
    source = RANGE if what == "b1" else ENDS
    return Parameter(
        default, "dimensionless", (-reach, reach), source, neutral=0.0, description=f"{what}, {side}"
    )


PARAMETERS = {
    "negative_slope": _parameter(-2.0, SLOPE, "negative", "b1"),
    "negative_curvature": _parameter(0.0, CURVATURE, "negative", "b2"),
    "positive_slope": _parameter(-2.0, SLOPE, "positive", "b1"),
    "positive_curvature": _parameter(0.0, CURVATURE, "positive", "b2"),
}


def vary_diffusivities(
    model: EspmModel,
    *,
    negative_slope: float,
    negative_curvature: float,
    positive_slope: float,
    positive_curvature: float,
) -> EspmModel:
    """The model with both solid diffusivities depending on stoichiometry."""
    cell = model.cell
    return model.with_cell(
        negative=_varied(cell.negative, negative_slope, negative_curvature),
        positive=_varied(cell.positive, positive_slope, positive_curvature),
    )


def _varied(electrode: Electrode, slope: float, curvature: float) -> Electrode:
    if slope == 0.0 and curvature == 0.0:
        return electrode
    s = np.linspace(-BEYOND_LIMITS, 1.0 + BEYOND_LIMITS, POINTS)
    factor = np.exp(slope * (s - 0.5) + curvature * ((2.0 * s - 1.0) ** 2 - 1.0 / 3.0))
    x = electrode.theta_min + s * (electrode.theta_max - electrode.theta_min)
    table = LookupTable(tuple(x.tolist()), tuple(factor.tolist()))
    if isinstance(electrode.diffusivity, Constant):
        return replace(electrode, diffusivity=scaled(table, electrode.diffusivity.value))
    return replace(electrode, diffusivity=Product(electrode.diffusivity, table))


EFFECT = Effect(
    "concentration_dependent_diffusivity",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=vary_diffusivities,
    of_material=True,
    of_every_record=True,
    experiment="GITT over the whole range of state of charge",
)
