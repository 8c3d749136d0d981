"""The catalogue of effects: one file per effect, registered here."""

from collections.abc import Iterable

from aesi.errors import EffectError, did_you_mean
from aesi.physics.effect import Effect
from aesi.physics.effects import (
    active_material_loss_negative,
    active_material_loss_positive,
    ambient_temperature,
    asymmetric_kinetics,
    charge_transfer_kinetics,
    clock_skew,
    concentration_dependent_diffusivity,
    current_sensor_gain,
    current_sensor_offset,
    double_layer,
    electrode_thickness,
    electrolyte_transport,
    film_growth,
    leakage_current,
    lithium_inventory_loss,
    lithium_plating,
    numerical_error,
    ocp_shape,
    ocv_hysteresis,
    particle_radius,
    particle_size_distribution,
    porosity,
    reaction_nonuniformity,
    self_heating,
    series_resistance,
    solid_diffusivity,
    voltage_sensor_offset,
)


class Catalogue(dict[str, Effect]):
    """Effects by id.  Raises EffectError, with the nearest match, for an unknown id."""

    def __missing__(self, name: str) -> Effect:
        raise EffectError(no_such_effect(name, self))


def no_such_effect(name: object, known: Iterable[str]) -> str:
    """The message for an unknown id: the most similar known id, else the effects whose text mentions it."""
    meant = did_you_mean(str(name), known)
    word = str(name).replace("_", " ").lower()
    speaking = [id for id, effect in CATALOGUE.items() if word in effect.summary.lower()]
    if meant == "." and speaking:
        meant = f"; of that speaks {' and '.join(speaking)}."
    return f"there is no effect {name!r} in the catalogue{meant} `aesi effects` lists them."


CATALOGUE = Catalogue(
    (effect.id, effect)
    for effect in (
        self_heating.EFFECT,
        ambient_temperature.EFFECT,
        series_resistance.EFFECT,
        film_growth.EFFECT,
        ocv_hysteresis.EFFECT,
        ocp_shape.EFFECT,
        double_layer.EFFECT,
        concentration_dependent_diffusivity.EFFECT,
        solid_diffusivity.EFFECT,
        particle_size_distribution.EFFECT,
        particle_radius.EFFECT,
        electrode_thickness.EFFECT,
        porosity.EFFECT,
        electrolyte_transport.EFFECT,
        charge_transfer_kinetics.EFFECT,
        asymmetric_kinetics.EFFECT,
        reaction_nonuniformity.EFFECT,
        lithium_inventory_loss.EFFECT,
        active_material_loss_negative.EFFECT,
        active_material_loss_positive.EFFECT,
        leakage_current.EFFECT,
        lithium_plating.EFFECT,
        current_sensor_gain.EFFECT,
        current_sensor_offset.EFFECT,
        voltage_sensor_offset.EFFECT,
        clock_skew.EFFECT,
        numerical_error.EFFECT,
    )
)
"""id -> Effect, in the order in which listings show them."""
