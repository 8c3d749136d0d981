"""The double layer at the particles carries part of the current until it is charged.

    i = i_reaction + C d(phi_s - phi_e)/dt        C per reactive area, each electrode

Lithium ions charge the layer, so that its current counts in the salt as that of the reaction does.

Leaves out dependence of C on potential, and diffuse layers. Holds where samples are no further apart than a few
C R_ct; with slower sampling the data do not determine it.

Source: Ong & Newman, J. Electrochem. Soc. 146 (1999) 4360, doi:10.1149/1.1392643.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

RANGE = "0.1 to 0.5 F/m2 on the true surface, up to 50 F/m2 on the declared one where that is rough"
PARAMETERS = {
    f"{side}_f_m2": Parameter(2.0, "F/m**2", (0.0, 50.0), RANGE, neutral=0.0, description=f"capacity, {side}")
    for side in ("negative", "positive")
}


def add_capacity(model: EspmModel, *, negative_f_m2: float, positive_f_m2: float) -> EspmModel:
    """The model with these double layers added to those of its cell file."""
    return replace(
        model,
        negative=replace(model.negative, double_layer_f_m2=negative_f_m2),
        positive=replace(model.positive, double_layer_f_m2=positive_f_m2),
    )


EFFECT = Effect(
    "double_layer",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=add_capacity,
    of_every_record=True,
    experiment="impedance from 1 Hz to 10 kHz, or pulses sampled at 1 ms",
)
