"""Lithium metal plates on the negative electrode and strips again.

    j = F k (c_Li exp((1 - a) F phi / R T) - c_e exp(-a F phi / R T)),   dc_Li/dt = -area j / F
    phi = phi_s - phi_e against Li/Li+, j > 0 strips, a = 0.65, c_Li per volume of electrode

Plating shares the electrode's current with intercalation: on charge near phi = 0 some lithium plates. It strips on the
next discharge or at rest, which shows as a voltage plateau.

Leaves out lithium that becomes inactive and the film that it leaves (film_growth, lithium_inventory_loss). Holds for
amounts of lithium that do not cover the particles.

Source: O'Kane et al., J. Electrochem. Soc. 167 (2020) 090540, doi:10.1149/1945-7111/ab90ac.
"""

from dataclasses import replace

from aesi.parameters import Parameter
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel, Plating

TRANSFER_COEFFICIENT = 0.65
"""a of plating, from the source; that of stripping is 1 - a."""
PARAMETERS = {
    "rate_m_s": Parameter(
        1e-9,
        "m/s",
        bounds=(1e-12, 1e-7),
        log=True,
        source="1e-11 to 1e-9 m/s in O'Kane et al. 2022, doi:10.1039/D2CP00417H, two orders wider",
        description="rate constant of plating and stripping, k",
    )
}


def plate(model: EspmModel, *, rate_m_s: float) -> EspmModel:
    """The model with plating on its negative electrode."""
    return replace(model, negative=replace(model.negative, plating=Plating(rate_m_s, TRANSFER_COEFFICIENT)))


EFFECT = Effect(
    "lithium_plating",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=plate,
    of_every_record=True,
    experiment="a charge pulse at low temperature and the voltage plateau of the rest after it",
)
