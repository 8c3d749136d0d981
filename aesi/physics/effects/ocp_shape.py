"""The declared open-circuit potentials are off by a smooth function of state of charge.

    U_p(z) = U_p,declared(z) + w d(z),   U_n(z) = U_n,declared(z) - (1 - w) d(z)
    d(z) = sum_k a_k sqrt(2) cos(k pi z),  k = 0 (without the sqrt(2)) to 8

z is the state of charge at which the cell at rest has an electrode's stoichiometry, so that the rest voltage of the
cell changes by d(z) for every w. Under load each electrode uses the z of its own surface stoichiometries.

Leaves out features sharper than an eighth of the range. Holds within the declared stoichiometry limits; beyond them d
is constant.

Source: smooth functions as cosine series of a Gaussian process, Solin & Sarkka, Stat. Comput. 30 (2020) 419,
doi:10.1007/s11222-019-09886-w; sizes from half-cell to half-cell scatter, Chen et al., J. Electrochem. Soc. 167 (2020)
080534, doi:10.1149/1945-7111/ab9050.
"""

from dataclasses import replace

import numpy as np

from aesi.numerics.typing import Array
from aesi.parameters import Parameter, Spread
from aesi.physics.cell import Electrode
from aesi.physics.cell.relations import LookupTable, Sum
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

ORDER = 8
"""Highest k: with LENGTH, the expected size of higher ones is negligible."""
EXPECTED_V = 0.01
"""Expected root mean square of d over the range, V."""
LENGTH = 0.12
"""Share of the range over which d changes; it sets how fast the expected size of a_k falls with k."""
BOUND_V = 0.06
"""Largest |a_k|, V: six times EXPECTED_V."""
POINTS = 129
"""Number of points of the table of the potential's correction."""


def _expected_v() -> Array:
    """(ORDER + 1,) standard deviation of each coefficient: the spectrum of a squared-exponential covariance."""
    power = np.exp(-0.5 * (np.pi * np.arange(ORDER + 1) * LENGTH) ** 2)
    return EXPECTED_V * np.sqrt(power / power.sum())


PARAMETERS = {
    f"a{k}_v": Parameter(
        0.005 if k == 1 else 0.0,
        "V",
        bounds=(-BOUND_V, BOUND_V),
        neutral=0.0,
        expected=float(expected),
        spread=Spread(None, float(expected), "half-cell to half-cell scatter, Chen et al. 2020"),
        source="scatter of half-cell measurements, tens of millivolts",
        description=f"coefficient of cos({k} pi z)" if k else "constant part",
    )
    for k, expected in enumerate(_expected_v())
} | {
    "positive_share": Parameter(
        0.5,
        "dimensionless",
        bounds=(0.0, 1.0),
        source="all of it in one electrode or in the other",
        description="share of the correction that belongs to the positive electrode, w",
    )
}


def reshape(model: EspmModel, *, positive_share: float, **volts: float) -> EspmModel:
    """The model with corrected open-circuit potentials; volts : the coefficients a0_v, a1_v, ... (V)."""
    z = np.linspace(0.0, 1.0, POINTS)
    waves = np.sqrt(2.0) * np.cos(np.pi * np.outer(np.arange(ORDER + 1), z))
    waves[0] = 1.0
    change = np.array([volts[f"a{k}_v"] for k in range(ORDER + 1)]) @ waves
    cell = model.cell
    p = cell.positive
    return model.with_cell(
        negative=_corrected(cell.negative, (positive_share - 1.0) * change),
        positive=_corrected(
            p, positive_share * change[::-1]
        ),  # its stoichiometry falls with the state of charge
    )


def _corrected(electrode: Electrode, change_v: Array) -> Electrode:
    if not change_v.any():
        return electrode
    x = np.linspace(electrode.theta_min, electrode.theta_max, POINTS)
    table = LookupTable(tuple(x.tolist()), tuple(change_v.tolist()))
    return replace(electrode, ocp=Sum(electrode.ocp, table))


EFFECT = Effect(
    "ocp_shape",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=reshape,
    of_design=True,
    of_material=True,
    experiment="C/50 discharge and charge, or GITT",
)
