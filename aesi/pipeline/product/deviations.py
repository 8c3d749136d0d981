"""Parameters that a cell's file declares and a drive can tell of, and a physics model some deviations away in them.

One deviation is what a parametrisation leaves open that is to serve other drives as well; how each was measured is told
in `aesi.pipeline.experiment.recalibrate`, which fits them. `slopes_v` says how many volts one deviation of each is
worth along a record. Times what the fitted rows leave open of the parameters, that gives what they leave open of the
voltage.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.numerics.typing import Array
from aesi.physics import ActiveEffect, Cell, ModelName, simulate
from aesi.physics.balance import same_rest
from aesi.physics.cell.energies import FILM_ENERGY_SD, RATE_ENERGY_SD, SALT_EA, SOLID_EA
from aesi.physics.cell.relations import scaled
from aesi.physics.effects import CATALOGUE
from aesi.physics.simulation import OnDepletion, model_with
from aesi.records import Hold, Measurement, Run

STEP = 0.05
"""Step of a difference quotient, in deviations."""

SOC0, CONTACT, FILM = "soc0", "contact", "film"


@dataclass(frozen=True)
class FileParameter:
    """owner : an effect of the catalogue, or SOC0, CONTACT or FILM.
    name : of its parameter; the side of an electrode, of a film.
    prior_sd : of the value, of ln(value) where `log`; of the contact resistance in V at a current of 1C.
    energy_j_mol : standard deviation of the activation energy of a rate or a film, 0 where there is none.
    """

    owner: str
    name: str
    prior_sd: float
    log: bool = False
    energy_j_mol: float = 0.0


def _waves() -> Iterator[FileParameter]:
    """The potentials' coefficients, without the constant one: a voltmeter is not off by millivolts."""
    for name, parameter in CATALOGUE[POTENTIALS].parameters.items():
        if parameter.spread is not None and name != "a0_v":
            assert parameter.spread.loose is not None
            yield FileParameter(POTENTIALS, name, POTENTIAL_SHARE * parameter.spread.loose)


RATES = {"solid_diffusivity": SOLID_EA, "charge_transfer_kinetics": RATE_ENERGY_SD}
"""Effect -> deviation of its activation energies, as a calibration starts from; a file of one temperature keeps it."""
POTENTIALS = "ocp_shape"
POTENTIAL_SHARE = 0.6
"""Share of the spread that the catalogue gives for half cells of other makes."""
BALANCE = ("active_material_loss_negative", "active_material_loss_positive", "lithium_inventory_loss")
PRIORS = (
    FileParameter(SOC0, "shift", 0.001),
    FileParameter(CONTACT, "resistance_ohm", 0.03),
    *(
        FileParameter(owner, f"{side}_factor", 0.15, True, energy)
        for owner, energy in RATES.items()
        for side in ("negative", "positive")
    ),
    FileParameter("electrolyte_transport", "conductivity_factor", 0.1, True, SALT_EA),
    FileParameter("electrolyte_transport", "diffusivity_factor", 0.6, True, SALT_EA),
    *(FileParameter(owner, "loss", 0.0003) for owner in BALANCE),
    *_waves(),
)
FILM_UNIT = 0.05
"""What counts as a deviation of the logarithm of a film. A unit and no prior, since no fit moves films: the voltage
that an energy is worth is a slope in these units times ENERGIES_J_MOL, which is divided by it."""
FILMS = tuple(FileParameter(FILM, side, FILM_UNIT, True, FILM_ENERGY_SD) for side in ("negative", "positive"))
"""Films of the electrodes. No fit moves them, since at one temperature they are like contacts; with temperature they
change as rates do."""
ENERGIES_J_MOL = np.array([prior.energy_j_mol / prior.prior_sd for prior in (*PRIORS, *FILMS)])
"""(n_slopes,) deviation of each activation energy over that of the logarithm of its rate; 0 where there is none."""
ALL = tuple(range(len(PRIORS)))
INITIAL_STATE = (0,)
RESISTOR = (1,)
"""Places in PRIORS of what a fit moves: everything, the state of charge at the start alone, the contact alone."""


@dataclass(frozen=True)
class PhysicsVariant:
    """One physics model of an experiment: the declared cell, or that cell with deviations of `PRIORS`.

    shift : added to the state of charge at the start of every record, in the windows of the declared cell.
    deviations : of the parameters that were free, where the fit ended.  missed_v : V, the error of the model that a
    recalibration allowed for; None of physics that is not from one.
    """

    declared: Cell
    cell: Cell
    effects: tuple[ActiveEffect, ...] = ()
    shift: float = 0.0
    deviations: tuple[float, ...] = ()
    model: ModelName = "espm"
    missed_v: float | None = None

    def soc0(self, soc0: float) -> float:
        """The state of charge, by this cell's windows, of a record that was declared to start at soc0."""
        return same_rest(self.declared, self.cell, soc0 + self.shift)

    def run_as_declared(self, record: Measurement, soc0: float, hold: Hold) -> Run:
        """`run` of a record that starts at soc0 in the windows of the declared cell, as `soc0` translates it."""
        return self.run(record, self.soc0(soc0), hold)

    def run(self, record: Measurement, soc0: float, hold: Hold, on_depletion: OnDepletion = "clip") -> Run:
        """The record under this physics.  soc0 : in the windows of this cell.  on_depletion : see `simulate`."""
        return simulate(
            self.cell,
            record.time_s,
            record.current_a,
            soc0,
            self.effects,
            record.temperature_degc,
            hold,
            on_depletion=on_depletion,
            model=self.model,
        )


def deviating(
    declared: Cell, effects: tuple[ActiveEffect, ...], free: Sequence[int] | Array, z: Array, model: ModelName
) -> PhysicsVariant:
    """The declared physics with its free parameters, or films, moved by z (n_free,) deviations."""
    x = np.zeros(len(ENERGIES_J_MOL))
    x[np.array(free)] = z
    values: dict[str, dict[str, float]] = {}
    for prior, deviations in zip((*PRIORS, *FILMS), x, strict=True):
        if deviations != 0.0:
            moved = float(deviations) * prior.prior_sd
            values.setdefault(prior.owner, {})[prior.name] = float(np.exp(moved)) if prior.log else moved
    shift = values.pop(SOC0, {}).get("shift", 0.0)
    volts_at_1c = values.pop(CONTACT, {}).get("resistance_ohm", 0.0)
    films = values.pop(FILM, {})
    added = tuple(CATALOGUE[owner].activate_only(**given) for owner, given in values.items())
    cell = model_with(declared, added).cell
    ohm = declared.contact_resistance_ohm + volts_at_1c / declared.nominal_capacity_ah
    # A fit may take the whole contact away, and rounding leave less than none, which no file may declare.
    cell = _with_films(replace(cell, contact_resistance_ohm=max(ohm, 0.0)), films)
    return PhysicsVariant(declared, cell, effects, shift, tuple(np.asarray(z).tolist()), model)


def _with_films(cell: Cell, factors: Mapping[str, float]) -> Cell:
    """factors : side of an electrode -> times its film."""
    n, p = cell.negative, cell.positive
    return cell.with_negative(film_ohm_m2=scaled(n.film_ohm_m2, factors.get("negative", 1.0))).with_positive(
        film_ohm_m2=scaled(p.film_ohm_m2, factors.get("positive", 1.0))
    )


def slopes_v(
    cell: Cell,
    effects: tuple[ActiveEffect, ...],
    record: Measurement,
    soc0: float,
    hold: Hold,
    model: ModelName,
    voltage_v: Array,
) -> Array:
    """(n, n_slopes) V a deviation, how the voltage_v (n,) of the record under the cell moves with PRIORS and FILMS.

    soc0 : in the windows of the cell.  Where a neighbour runs empty it is clipped (`simulate`).
    """
    one_each = np.eye(len(ENERGIES_J_MOL))
    moved = (deviating(cell, effects, range(len(one_each)), STEP * one, model) for one in one_each)
    return np.column_stack(
        [(each.run_as_declared(record, soc0, hold).voltage_v - voltage_v) / STEP for each in moved]
    )


def start_v(
    physics: PhysicsVariant, record: Measurement, soc0: float, soc0_sd: float, hold: Hold, voltage_v: Array
) -> Array:
    """(n,) V, >= 0, how far the voltage_v (n,) of the record under the physics moves where it starts a deviation
    `soc0_sd` fuller or emptier, whichever is more: a knee lies to one side. No cell starts beyond full or empty.

    soc0 : as of `PhysicsVariant.run`.
    """
    others = {float(np.clip(soc0 + sign * soc0_sd, 0.0, 1.0)) for sign in (-1.0, 1.0)}
    moved = [np.abs(physics.run(record, other, hold).voltage_v - voltage_v) for other in others]
    return np.asarray(np.max(moved, axis=0))
