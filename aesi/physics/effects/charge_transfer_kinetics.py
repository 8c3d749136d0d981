"""The declared reaction rate constants are off by a factor.

    j0_i = f_i F K_i,declared sqrt(c_e/c_e0 x (1 - x))        i negative or positive

Leaves out a different rate law (asymmetric_kinetics) and its dependence on temperature. Holds at any rate; at small
currents it cannot be distinguished from a resistance.

Source: scatter of published values, Wang et al., Prog. Energy 4 (2022) 032004, doi:10.1088/2516-1083/ac692c.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

RANGE = "an order of magnitude either way, the scatter of published values"
SPREAD = Spread(
    tight=0.22,
    loose=1.0,
    source="the LG M50 parametrised twice (doi:10.1149/1945-7111/ab9050, 10.1016/j.electacta.2022.140700): 0.31 apart, "
    "over the root of two; loose: scatter of published values",
)
PARAMETERS = {
    name: Parameter(
        0.5,
        "dimensionless",
        (0.1, 10.0),
        RANGE,
        log=True,
        neutral=1.0,
        spread=SPREAD,
        description=f"factor, {name[:8]} electrode",
    )
    for name in ("negative_factor", "positive_factor")
}


def scale_rates(model: EspmModel, *, negative_factor: float, positive_factor: float) -> EspmModel:
    """The model with both rate constants scaled."""
    cell = model.cell
    cell = cell.with_negative(rate_constant=cell.negative.rate_constant * negative_factor)
    cell = cell.with_positive(rate_constant=cell.positive.rate_constant * positive_factor)
    return model.of(cell)


EFFECT = Effect(
    "charge_transfer_kinetics",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_rates,
    of_design=True,
    experiment="pulses from C/10 to 5C: the kinetic drop bends with current",
)
