"""The reaction is not uniform across an electrode, as in a full porous-electrode model.

    Phi = U(x_r) + eta(i_r, x_r, c_r) + ohmic_r(i) + chi ln(c_r / c_mean),   sum i_r = I        r = 1..4 regions
    ohmic_r : mean drop in solid and electrolyte between region r, the collector and the separator

Each region has its own particle, which reacts with the electrolyte there. The declared cell determines how
non-uniform the reaction is, so there is no parameter. `model="dfn"` resolves it fully and replaces this effect.

Leaves out differences within a quarter of an electrode. Holds for thick electrodes, high rates, poor electrolyte, and
flat open-circuit potentials.

Source: Doyle, Fuller & Newman, J. Electrochem. Soc. 140 (1993) 1526, doi:10.1149/1.2221597, on four regions.
"""

from dataclasses import replace

from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

REGIONS = 4
"""Layers across an electrode."""


def cut_into_regions(model: EspmModel) -> EspmModel:
    """The model with its electrodes cut into regions."""
    return replace(model, regions=REGIONS)


EFFECT = Effect(
    "reaction_nonuniformity",
    "physics",
    __doc__,
    on_model=cut_into_regions,
    refines="reduction",
    experiment="discharges at 2C and above beside a full porous-electrode simulation",
)
