"""The declared solid diffusivities are off by a factor.

    D_i = f_i D_i,declared        i negative or positive

Leaves out a change of their dependence on stoichiometry (concentration_dependent_diffusivity) and
temperature. Holds at any rate; at low rates the data do not determine it.

Source: scatter of published values, Wang et al., Prog. Energy 4 (2022) 032004, doi:10.1088/2516-1083/ac692c.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.cell.relations import scaled
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

RANGE = "two orders of magnitude either way: how far published values lie apart; the spread says how likely that is"
SPREAD = Spread(
    tight=0.43,
    loose=1.0,
    source="the LG M50 parametrised twice (doi:10.1149/1945-7111/ab9050, 10.1016/j.electacta.2022.140700): 0.61 apart, "
    "over the root of two; loose: scatter of published values",
)
PARAMETERS = {
    name: Parameter(
        0.5,
        "dimensionless",
        (0.01, 100.0),
        RANGE,
        log=True,
        neutral=1.0,
        spread=SPREAD,
        description=f"factor, {name[:8]} electrode",
    )
    for name in ("negative_factor", "positive_factor")
}


def scale_diffusivities(model: EspmModel, *, negative_factor: float, positive_factor: float) -> EspmModel:
    """The model with both solid diffusivities scaled."""
    cell = model.cell
    cell = cell.with_negative(diffusivity=scaled(cell.negative.diffusivity, negative_factor))
    cell = cell.with_positive(diffusivity=scaled(cell.positive.diffusivity, positive_factor))
    return model.of(cell)


EFFECT = Effect(
    "solid_diffusivity",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_diffusivities,
    of_design=True,
    experiment="GITT: long pulses and long rests over the range of state of charge",
    told_apart={
        "particle_size_distribution": (
            "GITT: a distribution relaxes over a spread of times, one radius with one time after each pulse"
        ),
        "concentration_dependent_diffusivity": "GITT over the whole range of state of charge",
    },
)
