"""Active material of the negative electrode is lost: less capacity, and more current on what is left.

    a = (1 - loss) a_declared        a reactive area per volume, at the declared particle radius

The material is lost with the lithium that it holds at one state of charge; the stoichiometries at that state do not
change. Those of the full and the empty cell follow from their declared rest voltages and the remaining lithium. A
simulation starts from the rest voltage that the declared cell has at soc0.

Leaves out the change of porosity and conductivity. Holds for isolated or cracked-off particles.

Source: Birkl et al., J. Power Sources 341 (2017) 373, doi:10.1016/j.jpowsour.2016.12.011.
"""

from aesi.parameters import Parameter, Spread
from aesi.physics.balance import with_active_material
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    "loss": Parameter(
        0.1,
        "dimensionless",
        bounds=(-0.3, 0.5),
        neutral=0.0,
        source="an electrode declared too small by 30 % to half of it gone",
        description="share of the declared active material",
        counted="share",
        spread=Spread(None, 0.05, "coating weights and cell-to-cell capacity, a few per cent"),
    ),
    "lost_at_soc": Parameter(
        1.0,
        "dimensionless",
        bounds=(0.0, 1.0),
        source="lost while empty of lithium or while full of it, both are seen",
        description="state of charge at which the material was lost",
    ),
}


def lose_material(model: EspmModel, *, loss: float, lost_at_soc: float) -> EspmModel:
    """The model with less active material in the negative electrode."""
    return model.of(with_active_material(model.cell, 1.0 - loss, 1.0, lost_at_soc))


EFFECT = Effect(
    "active_material_loss_negative",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=lose_material,
    of_age=True,
    experiment="a full C/20 discharge between the voltage limits and the coulombs that go back in, read as dV/dQ",
)
