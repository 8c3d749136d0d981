"""The declared particle radii are off by a factor, at the declared volume of active material.

    R_i = f_i R_i,declared,   a_i = a_i,declared / f_i        i negative or positive

Larger particles have longer diffusion times (R^2/D) and less reactive surface: one factor changes what a solid
diffusivity off by 1/f^2 and a rate constant off by 1/f change together.

Leaves out a spread of radii (particle_size_distribution). Holds at any rate; at low rates, and where the cell's
kinetic overpotentials are small, the data cannot distinguish it from either of the two.

Source: definition; mean radii of one powder by number and by volume, Ecker et al., J. Electrochem. Soc. 162 (2015)
A1836, doi:10.1149/2.0551509jes.
"""

from aesi.parameters import Parameter
from aesi.physics.cell.parts import Electrode
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel

PARAMETERS = {
    name: Parameter(
        1.4,
        "dimensionless",
        (0.5, 2.0),
        "means by number and by volume, and by microscope and by diffraction, differ by up to two",
        log=True,
        neutral=1.0,
        description=f"factor, {name[:8]} electrode",
    )
    for name in ("negative_factor", "positive_factor")
}


def scale_radii(model: EspmModel, *, negative_factor: float, positive_factor: float) -> EspmModel:
    """The model with both radii scaled and the active volumes kept."""
    cell = model.cell
    cell = cell.with_negative(**_coarser(cell.negative, negative_factor))
    return model.of(cell.with_positive(**_coarser(cell.positive, positive_factor)))


def _coarser(electrode: Electrode, factor: float) -> dict[str, float]:
    return {
        "particle_radius_m": electrode.particle_radius_m * factor,
        "area_per_volume_1_m": electrode.area_per_volume_1_m / factor,
    }


EFFECT = Effect(
    "particle_radius",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=scale_radii,
    of_design=True,
    experiment="pulses at several rates with long rests: the kinetic drop gives the surface, the relaxation R^2/D",
    told_apart={
        "solid_diffusivity": "pulses from C/10 to 5C: a radius also changes the surface, and so the kinetic drop",
        "charge_transfer_kinetics": "long rests after pulses: a radius also changes the time of relaxation",
        "particle_size_distribution": "GITT: a distribution relaxes over a spread of times, one radius with one time",
    },
)
