"""The catalogue of effects: one file an effect, registered here."""

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
    electrolyte_transport,
    film_growth,
    leakage_current,
    lithium_inventory_loss,
    lithium_plating,
    numerical_error,
    ocp_shape,
    ocv_hysteresis,
    particle_size_distribution,
    reaction_nonuniformity,
    self_heating,
    series_resistance,
    solid_diffusivity,
    voltage_sensor_offset,
)

CATALOGUE: dict[str, Effect] = {
    effect.id: effect
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
}
"""id -> Effect, in the order in which listings show them."""
