"""Activation energies of a measured cell whose file was fitted at one temperature only, so that they are unknown.

A calibration on records of one temperature keeps the activation energies of its start file, or takes typical ones. At
another temperature T the logarithm of each rate is then off by

    dE/R (1/T_file - 1/T)        T_file mean temperature of the records that the file was fitted to

The error dE of an energy has the prior of a calibration on records of several temperatures. The error of a rate is zero
at T_file, and a factor of four either way in a solid diffusivity at -20 degC for a file of 25 degC. The energies of a
file whose records span temperatures were fitted, and stay.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from aesi.constants import ZERO_CELSIUS_K
from aesi.parameters import Parameter, Spread
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import SPAN_K, energy_priors
from aesi.physics.cell.relations import scaled
from aesi.physics.effect import Effect
from aesi.physics.espm.plain import rate_factor
from aesi.physics.model import EspmModel
from aesi.records import Measurement
from aesi.tracer.case.free_parameter import FURTHEST_SDS

ACTIVATION_ENERGIES = "activation_energies"
"""Id of the effect that moves the activation energies. No hypothesis can name it: it restates declared parameters."""


def fitted_kelvin(cell: Cell) -> float | None:
    """The temperature at which a cell file was fitted, K; None where its records span more than `SPAN_K`, or where the
    file records no temperature."""
    kelvin = [mean_k for _, mean_k in cell.fitted_at_k]
    return float(np.mean(kelvin)) if kelvin and max(kelvin) - min(kelvin) <= SPAN_K else None


def far_from_file(cell: Cell, data: Measurement, supposed: bool) -> bool:
    """Whether a record's temperature is more than `SPAN_K` from that at which the file was fitted. Records have to lie
    so far apart for a fit to determine activation energies.

    supposed : whether an effect supplies the temperature of the record where none was measured.
    """
    fitted_k = fitted_kelvin(cell)
    if fitted_k is None:
        return False
    if data.temperature_degc is None:
        return supposed or abs(cell.initial_temperature_k - fitted_k) > SPAN_K
    return bool(abs(np.mean(data.temperature_degc) + ZERO_CELSIUS_K - fitted_k) > SPAN_K)


def energies_of(cell: Cell) -> Effect:
    """The effect that changes the activation energies of a file that was fitted at one temperature. The rates at that
    temperature stay. A rate whose energy is zero in the file stays at every temperature.

    The spread of each energy is the RMS deviation of the file's value under the prior of `energy_priors`.
    """
    parameters, declared = {}, {}
    for (part, rate), known in energy_priors(cell).items():
        name, energy = f"{part}_{rate}", float(getattr(getattr(cell, part), f"{rate}_ea_j_mol"))
        declared[name] = energy
        if energy > 0.0:
            off = float(np.hypot(known.sd_j_mol, energy - known.mean_j_mol))
            most = max(energy, known.mean_j_mol + FURTHEST_SDS * known.sd_j_mol)
            spread = Spread(off, off, known.source)
            parameters[name] = Parameter(
                energy, "J/mol", (0.0, most), known.source, neutral=energy, spread=spread
            )
    acting = partial(
        with_energies, declared=declared, held_at_k=fitted_kelvin(cell) or cell.reference_temperature_k
    )
    return Effect(ACTIVATION_ENERGIES, "parameter", __doc__, parameters, on_model=acting)


def with_energies(
    model: EspmModel, *, declared: Mapping[str, float], held_at_k: float, **energies: float
) -> EspmModel:
    """The model with other activation energies, J/mol, its rates at `held_at_k` (K) unchanged.

    declared : activation energy in the file, J/mol, of every rate.
    """
    cell, new_j_mol = model.cell, {**declared, **energies}

    def rate_scale(name: str) -> float:
        """Factor on a rate at the reference temperature that keeps it the same at `held_at_k`."""
        return rate_factor(declared[name] - new_j_mol[name], held_at_k, cell.reference_temperature_k)

    e = cell.electrolyte
    cell = cell.with_electrolyte(
        diffusivity=scaled(e.diffusivity, rate_scale("electrolyte_diffusivity")),
        diffusivity_ea_j_mol=new_j_mol["electrolyte_diffusivity"],
        conductivity=scaled(e.conductivity, rate_scale("electrolyte_conductivity")),
        conductivity_ea_j_mol=new_j_mol["electrolyte_conductivity"],
    )
    for side, electrode, with_side in (
        ("negative", cell.negative, Cell.with_negative),
        ("positive", cell.positive, Cell.with_positive),
    ):
        cell = with_side(
            cell,
            diffusivity=scaled(electrode.diffusivity, rate_scale(f"{side}_diffusivity")),
            diffusivity_ea_j_mol=new_j_mol[f"{side}_diffusivity"],
            rate_constant=electrode.rate_constant * rate_scale(f"{side}_rate"),
            rate_ea_j_mol=new_j_mol[f"{side}_rate"],
            film_ohm_m2=scaled(electrode.film_ohm_m2, 1.0 / rate_scale(f"{side}_film")),
            film_ea_j_mol=new_j_mol[f"{side}_film"],
        )
    return model.of(cell)
