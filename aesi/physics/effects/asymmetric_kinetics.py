"""Charge transfer with a transfer coefficient other than one half.

    j = j0 (exp(a F eta / R T) - exp(-(1 - a) F eta / R T))      eta = phi_s - phi_e - U, j > 0 delithiates

Leaves out the change of j0's dependence on concentrations, which keeps its square roots. Holds for large
overpotentials; below R T / F the kinetics are linear, and only the rate constant has an effect.

Source: Newman & Thomas-Alyea, Electrochemical Systems, 3rd ed., Wiley 2004, ch. 8.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

RANGE = "published fits between 0.25 and 0.75"
PARAMETERS = {
    f"{side}_alpha": Parameter(
        0.35,
        "dimensionless",
        (0.2, 0.8),
        RANGE,
        neutral=0.5,
        description=f"coefficient of delithiation, {side}",
    )
    for side in ("negative", "positive")
}


def make_asymmetric(model: EspmModel, *, negative_alpha: float, positive_alpha: float) -> EspmModel:
    """The model with the given transfer coefficients."""
    return replace(
        model,
        negative=replace(model.negative, transfer_coefficient=negative_alpha),
        positive=replace(model.positive, transfer_coefficient=positive_alpha),
    )


EFFECT = Effect(
    "asymmetric_kinetics",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=make_asymmetric,
    of_every_record=True,
    experiment="charge and discharge pulses of the same size, from C/10 to 5C",
)
