"""The declared electrolyte conductivity or diffusivity is off by a factor.

    kappa = f_kappa kappa_declared(c),   D_e = f_D D_e,declared(c)

Leaves out a wrong dependence on concentration, transference number and tortuosity of a single layer. A wrong
tortuosity of all layers scales both by the same factor. Holds at any rate; below 1C it looks like a resistance.

Source: scatter of tortuosities, Landesfeind et al., J. Electrochem. Soc. 163 (2016) A1373,
doi:10.1149/2.1141607jes.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.cell.relations import scaled
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

RANGE = "published tortuosities and electrolytes, a factor of five either way"
TWICE = (
    "the LG M50 parametrised twice (doi:10.1149/1945-7111/ab9050, 10.1016/j.electacta.2022.140700): 0.038 and 0.49 "
    "apart, over the root of two; loose: scatter of tortuosities"
)
PARAMETERS = {
    "conductivity_factor": Parameter(
        0.6,
        "dimensionless",
        (0.2, 5.0),
        RANGE,
        log=True,
        neutral=1.0,
        description="factor of kappa",
        spread=Spread(0.027, 0.3, TWICE),
    ),
    "diffusivity_factor": Parameter(
        0.6,
        "dimensionless",
        (0.2, 5.0),
        RANGE,
        log=True,
        neutral=1.0,
        description="factor of D_e",
        spread=Spread(0.35, 0.6, TWICE),
    ),
}


def scale_transport(model: EspmModel, *, conductivity_factor: float, diffusivity_factor: float) -> EspmModel:
    """The model with the electrolyte's transport properties scaled."""
    electrolyte = model.cell.electrolyte
    return model.of(
        model.cell.with_electrolyte(
            conductivity=scaled(electrolyte.conductivity, conductivity_factor),
            diffusivity=scaled(electrolyte.diffusivity, diffusivity_factor),
        )
    )


EFFECT = Effect(
    "electrolyte_transport",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_transport,
    of_design=True,
    experiment="a discharge above 3C, where the electrolyte is depleted, and its relaxation",
)
