"""Particles of several sizes in an electrode, all at one potential.

    Phi = U(x_u) + eta(i_u, x_u),  sum i_u = I        u particle sizes, lognormal by reactive area
    mean radius as declared, which keeps the declared volume; standard deviation sd times the mean

Leaves out contact of particles with each other, and a distribution of properties other than size. Holds where small and
large particles are in the same electrolyte.

Source: Kirk, Evans, Please & Chapman, J. Electrochem. Soc. 2022, arXiv:2006.12208 (many-particle model).
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

SIZES = 5
"""Number of particles that represent the distribution."""
RANGE = "laser diffraction of battery powders gives none to 60 %; the rest, to 100 %, is room for a fit"
PARAMETERS = {
    f"{side}_sd": Parameter(
        0.3,
        "dimensionless",
        (0.0, 1.0),
        RANGE,
        even=True,
        neutral=0.0,
        description=f"relative spread of the radius, {side}",
    )
    for side in ("negative", "positive")
}


def spread_sizes(model: EspmModel, *, negative_sd: float, positive_sd: float) -> EspmModel:
    """The model with lognormal particle sizes."""
    return replace(
        model,
        negative=replace(model.negative, bins=lognormal_bins(negative_sd)),
        positive=replace(model.positive, bins=lognormal_bins(positive_sd)),
    )


@lru_cache(maxsize=256)
def lognormal_bins(sd: float, sizes: int = SIZES) -> tuple[tuple[float, float], ...]:
    """(share of area, radius over mean) by Gauss-Hermite quadrature; one bin for sd = 0."""
    if sd == 0.0:
        return ((1.0, 1.0),)
    x, w = np.polynomial.hermite_e.hermegauss(sizes)
    width = np.sqrt(np.log1p(sd**2))
    share = w / w.sum()
    radius = np.exp(width * x)
    radius /= share @ radius
    return tuple(zip(share.tolist(), radius.tolist(), strict=True))


EFFECT = Effect(
    "particle_size_distribution",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=spread_sizes,
    of_every_record=True,
    experiment="relaxation after a long pulse, sampled over hours",
)
