"""The declared porosities of the electrodes are off by a factor, at the declared active material.

    eps_i = f_i eps_i,declared,   B_i = f_i^1.5 B_i,declared        i negative or positive, B transport efficiency

Less pore space conducts worse (Bruggeman's exponent) and holds less salt, which depletes sooner.

Leaves out the separator and a wrong tortuosity at the right porosity (electrolyte_transport). Holds at any rate; below
1C it looks like a resistance, and while the salt is nearly uniform like a conductivity.

Source: Bruggeman's relation as used in Chen et al., J. Electrochem. Soc. 167 (2020) 080534,
doi:10.1149/1945-7111/ab9050.
"""

from aesi.errors import CellError
from aesi.parameters import Parameter
from aesi.physics.cell.parts import Electrode
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

BRUGGEMAN = 1.5
"""Bruggeman's exponent, for spheres."""
PARAMETERS = {
    name: Parameter(
        0.8,
        "dimensionless",
        (0.5, 1.6),
        "porosities from densities and from mercury, and films that clog pores: a third either way and more",
        log=True,
        neutral=1.0,
        description=f"factor, {name[:8]} electrode",
    )
    for name in ("negative_factor", "positive_factor")
}


def scale_porosities(model: EspmModel, *, negative_factor: float, positive_factor: float) -> EspmModel:
    """The model with both porosities scaled.  Raises CellError where the pores would fill a whole electrode.

    With the active material they may fill more than that, as they do in files of calibrated cells (1.03 of an
    electrode): there its volume was fitted, as an effective one, beside a porosity that was not.
    """
    cell = model.cell
    cell = cell.with_negative(**_more_porous(cell.negative, negative_factor, cell.name))
    return model.of(cell.with_positive(**_more_porous(cell.positive, positive_factor, cell.name)))


def _more_porous(electrode: Electrode, factor: float, cell: str) -> dict[str, float]:
    porosity = electrode.porosity * factor
    if porosity >= 1.0:
        raise CellError(
            f"{cell}: {factor:g} times the porosity {electrode.porosity:g} leaves no solid; give less."
        )
    return {
        "porosity": porosity,
        "transport_efficiency": electrode.transport_efficiency * factor**BRUGGEMAN,
    }


EFFECT = Effect(
    "porosity",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_porosities,
    of_design=True,
    experiment="a discharge above 3C, where the electrolyte is depleted, and its relaxation",
    told_apart={
        "electrolyte_transport": "the relaxation after a discharge above 3C: less pore space also holds less salt",
        "series_resistance": "pulses and rests above 2C: an ohmic drop goes at once, that of the salt in minutes",
    },
)
