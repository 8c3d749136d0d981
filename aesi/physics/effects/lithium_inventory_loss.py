"""Cyclable lithium is lost: the stoichiometry windows of the electrodes are shifted against each other.

    q_n x_n + q_p x_p = Q_Li - loss Q,   U_p(x_p) - U_n(x_n) = V_full, V_empty       q capacity of an electrode, Ah

Q is the capacity of the cell after the effects named before this one: the declared capacity minus that lost with active
material. The stoichiometry windows follow from the declared rest voltages of the full and the empty cell. A simulation
starts from the rest voltage that the declared cell has at soc0.

Leaves out the film that consumed the lithium (film_growth). Holds for a cell that still reaches both voltages.

Source: Birkl et al., J. Power Sources 341 (2017) 373, doi:10.1016/j.jpowsour.2016.12.011.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.balance import without_lithium
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    "loss": Parameter(
        0.05,
        "dimensionless",
        bounds=(-0.1, 0.4),
        neutral=0.0,
        source="a cell more than new (declared too low) to its end of life",
        description="share of the declared capacity",
        counted="share",
        spread=Spread(None, 0.03, "first-cycle losses of cells of one make differ by a few per cent"),
    )
}


def lose_lithium(model: EspmModel, *, loss: float) -> EspmModel:
    """The model with less cyclable lithium."""
    return model.of(without_lithium(model.cell, loss))


EFFECT = Effect(
    "lithium_inventory_loss",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=lose_lithium,
    of_age=True,
    experiment="a full C/20 discharge between the voltage limits and the coulombs that go back in",
)
