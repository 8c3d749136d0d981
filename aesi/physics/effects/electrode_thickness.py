"""The declared thickness of an electrode is off by a factor, at the declared composition.

    L_i = f_i L_i,declared        i negative or positive; a, porosity and active fraction as declared

A thicker coating holds more lithium (as active_material_loss with a loss of 1 - f at full charge, which has the same
balance and surface) and has longer paths through solid and electrolyte. The stoichiometries of the full cell do not
change; the empty cell has the declared rest voltage.

Leaves out the swelling of a cell in operation. Holds at any rate; below 1C the drop in the electrolyte is too small to
distinguish it from a change of active material.

Source: definition; teardown thicknesses, Chen et al., J. Electrochem. Soc. 167 (2020) 080534,
doi:10.1149/1945-7111/ab9050.
"""

from aesi.parameters import Parameter
from aesi.physics.balance import with_active_material
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    name: Parameter(
        1.1,
        "dimensionless",
        (0.7, 1.4),
        "drying, calendering and teardown, up to a third either way",
        log=True,
        neutral=1.0,
        description=f"factor, {name[:8]} electrode",
    )
    for name in ("negative_factor", "positive_factor")
}


def scale_thicknesses(model: EspmModel, *, negative_factor: float, positive_factor: float) -> EspmModel:
    """The model with both coatings scaled: the balance follows, the surface per volume is unchanged."""
    n, p = model.cell.negative, model.cell.positive
    cell = with_active_material(model.cell, negative_factor, positive_factor)
    cell = cell.with_negative(
        thickness_m=n.thickness_m * negative_factor, area_per_volume_1_m=n.area_per_volume_1_m
    )
    return model.of(
        cell.with_positive(
            thickness_m=p.thickness_m * positive_factor, area_per_volume_1_m=p.area_per_volume_1_m
        )
    )


ACTIVE_MATERIAL = "a discharge above 3C: only a thickness also changes the way through the electrolyte"
EFFECT = Effect(
    "electrode_thickness",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_thicknesses,
    of_design=True,
    experiment="a full C/20 discharge for the balance, and one above 3C for the way through the electrolyte",
    told_apart={
        "active_material_loss_negative": ACTIVE_MATERIAL,
        "active_material_loss_positive": ACTIVE_MATERIAL,
        "electrolyte_transport": "a full C/20 discharge: only a thickness also changes the capacity",
    },
)
