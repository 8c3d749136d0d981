"""The start of a calibration: the cell scaled to the data, and the part of each record that the model can follow."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from aesi.constants import J_PER_KJ, SECONDS_PER_HOUR
from aesi.numerics.typing import Array, BoolArray
from aesi.over_time import stamp
from aesi.physics.cell import Cell
from aesi.physics.cell.energies import RATE_ENERGY
from aesi.physics.cell.parts import NO_FILM
from aesi.physics.rest.open_circuit import OpenCircuit
from aesi.records import Hold, Measurement

TYPICAL_SOLID_EA_J_MOL = 30e3
TYPICAL_ELECTROLYTE_EA_J_MOL = 17.1e3
"""Activation energies for a file that declares none, from which records of several temperatures move them, see
`aesi.calibration.parameters`. Diffusion in graphite and the conductivity as in Ecker et al., J. Electrochem. Soc. 162
(2015) A1836 (30.3, 17.1), as PyBaMM's parameter sets have them."""
UNMOVED_SOLID_EA_J_MOL, UNMOVED_RATE_EA_J_MOL, UNMOVED_FILM_EA_J_MOL = 45e3, 45e3, 40e3
"""Activation energies where all records are of one temperature, so that no fit moves them: see `with_unmoved_energies`.
With 35 and 17.8 kJ/mol for kinetics, 30 for diffusion and 50 for films, files of the Panasonic NCR18650PF and the LG
18650HG2 at 25 degC alone are off by 60 mV with the thermocouple (geometric mean of every other record of both archives,
-20 to 40 degC: 38 records that entered no fit), with these by 42, with 55, 45 and 30 by 45. With 50 for diffusion
drives run out before their end. At 1 Hz spectra of two other cells of the HG2's make have 42 to 44 for films and
kinetics together. Where records move them the priors of `aesi.physics.cell.energies` hold."""
OPEN_SHARE = 1e-3
"""Share of the largest current of a record below which no current flows (the relay is open), whatever the cycler
reads. More would take the end of a charge at constant voltage for a rest: that of an LG M50T ends at 1 % of the
largest current. The noise that hides in the small current of a slow record is another matter, see
`aesi.calibration.records.zero.steadily_flowing`."""
FULL_WINDOW_V = 0.15
"""A full discharge starts within this voltage of the upper limit, V, and ends within twice this of the lower."""
ALL_OF_IT = 0.95
"""Least charge taken out at the lowest voltage, as a share of the most that a record takes out, for this voltage to
count as empty. With less, a pulse reached the limit, which happens at any state of charge in the cold. Likewise the
cell counts as charged again where this share of the charge taken was returned. A convention."""
NEAR_THE_SIZE = 0.5
"""Least ratio of a full discharge to the largest one: a smaller one is of another cell, or in another unit, and does
not determine the size. Likewise of a discharge to empty to the capacity in the file. A convention."""
LONG_CHARGE = 0.3
"""Charge, as a share of the capacity or of the most that was taken out, beyond which a charging phase changes the
branch of a hysteresis."""


def scaled_to_discharge(cell: Cell, measurements: Sequence[Measurement]) -> tuple[Cell, tuple[str, ...]]:
    """(cell with its area scaled to the largest full discharge among the measurements, a sentence on that); the cell as
    it is where there is none."""
    known = max((q for q in _full_discharges_ah(cell, measurements) if q is not None), default=None)
    if known is None:
        return cell, (size_assumed(cell, measurements),)
    factor = known / cell.capacity_ah
    return with_area_factor(cell, factor, known), (
        f"a full discharge took {known:.3f} Ah, and the start file's electrodes give {cell.capacity_ah:.3f} Ah between "
        f"empty and full: the fit starts from an electrode area scaled by {factor:.3f}; the fitted capacity is given "
        "with the state of health.",
    )


def with_area_factor(cell: Cell, factor: float, nominal_ah: float) -> Cell:
    """The cell with its electrode area multiplied by a factor, and its contact resistance divided by it.

    nominal_ah : its new nominal capacity, Ah.
    """
    return replace(
        cell,
        electrode_area_m2=cell.electrode_area_m2 * factor,
        nominal_capacity_ah=nominal_ah,
        contact_resistance_ohm=cell.contact_resistance_ohm / factor,
    )


def full_discharge_numbers(cell: Cell, measurements: Sequence[Measurement]) -> tuple[int, ...]:
    """Numbers of the measurements that hold a full discharge of at least `NEAR_THE_SIZE` times the largest one, by
    which the size of the cell is known."""
    charges = _full_discharges_ah(cell, measurements)
    known = max((q for q in charges if q is not None), default=0.0)
    return tuple(i for i, q in enumerate(charges) if q is not None and q >= NEAR_THE_SIZE * known)


def _full_discharges_ah(cell: Cell, measurements: Sequence[Measurement]) -> list[float | None]:
    """Charge of the largest full discharge of each measurement, Ah; None for one without."""
    return [full_discharge_ah(cell, m) for m in measurements]


def size_assumed(cell: Cell, measurements: Sequence[Measurement]) -> str:
    """A sentence that the size of the cell is the file's; '' where a full discharge among the measurements determines
    it. Without one a fit only moves the stoichiometry windows, since the size is no parameter of it."""
    if any(q is not None for q in _full_discharges_ah(cell, measurements)):
        return ""
    return (
        f"no record holds a full discharge (from {cell.upper_voltage_v - FULL_WINDOW_V:.4g} V or more to "
        f"{cell.lower_voltage_v + 2 * FULL_WINDOW_V:.4g} V or less, by the cut-offs of the start file): the size of "
        f"the cell is taken from the start file, {cell.capacity_ah:.3g} Ah, and where that is wrong, capacity, lithium "
        "and active material are wrong by the same factor, which their intervals do not include."
    )


def declared_energies(cell: Cell) -> dict[str, float]:
    """Name of the parameter in a fit -> activation energy of the cell, J/mol; 0 where the cell declares none. Films are
    included where the cell has films that depend on temperature."""
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    films = {"negative.film_energy": n.film_ea_j_mol, "positive.film_energy": p.film_ea_j_mol}
    return {
        "negative.diffusivity_energy": n.diffusivity_ea_j_mol,
        "negative.rate_energy": n.rate_ea_j_mol,
        "positive.diffusivity_energy": p.diffusivity_ea_j_mol,
        "positive.rate_energy": p.rate_ea_j_mol,
        "electrolyte.conductivity_energy": e.conductivity_ea_j_mol,
        "electrolyte.diffusivity_energy": e.diffusivity_ea_j_mol,
        **{name: energy for name, energy in films.items() if energy},
    }


def with_activation(cell: Cell) -> Cell:
    """The cell with typical activation energies where it declares none."""
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    for with_side, electrode in ((Cell.with_negative, n), (Cell.with_positive, p)):
        cell = with_side(
            cell,
            diffusivity_ea_j_mol=electrode.diffusivity_ea_j_mol or TYPICAL_SOLID_EA_J_MOL,
            rate_ea_j_mol=electrode.rate_ea_j_mol or RATE_ENERGY,
        )
    return cell.with_electrolyte(
        conductivity_ea_j_mol=e.conductivity_ea_j_mol or TYPICAL_ELECTROLYTE_EA_J_MOL,
        diffusivity_ea_j_mol=e.diffusivity_ea_j_mol or TYPICAL_ELECTROLYTE_EA_J_MOL,
    )


def with_unmoved_energies(declared: Cell, cell: Cell, same_cell: bool) -> Cell:
    """The cell with the activation energies that serve best where no record moves them.

    An electrode without a film in its file was given one by `aesi.calibration.parameters.with_interfaces`. Its kinetics
    get an energy of their own, since what a file declares for an interface as a whole includes the film's.
    declared : the cell as its file declares it; a diffusivity's energy that it has is kept.
    same_cell : the records are of the file's own cell, of whose kinetics a declared energy is kept, too.
    """
    for with_side, own in ((Cell.with_negative, declared.negative), (Cell.with_positive, declared.positive)):
        film_added = own.film_ohm_m2 == NO_FILM
        rate_j_mol = 0.0 if film_added and not same_cell else own.rate_ea_j_mol
        cell = with_side(
            cell,
            diffusivity_ea_j_mol=own.diffusivity_ea_j_mol or UNMOVED_SOLID_EA_J_MOL,
            rate_ea_j_mol=rate_j_mol or UNMOVED_RATE_EA_J_MOL,
            film_ea_j_mol=UNMOVED_FILM_EA_J_MOL if film_added else own.film_ea_j_mol,
        )
    return cell


def activation_sentences(
    declared: Cell, taken: Cell, fitted: Mapping[str, tuple[float, float]], given: Collection[str]
) -> tuple[str, ...]:
    """Sentences on the activation energies that a fit has, or starts from, and that the cell's file does not declare.

    taken : the cell with typical ones in their place.  fitted : name -> (start, standard deviation), J/mol, of those
    that the records move.  given : names of those whose start is a user's.
    """
    typical = declared_energies(taken)
    missing, replaced = [], []
    for name, own in declared_energies(declared).items():
        if name in given:
            continue
        what = name.removesuffix("_energy").replace(".", " ")
        start, sd = fitted.get(name, (typical[name], 0.0))
        words = f"{what} {start / J_PER_KJ:g}{f' +/- {sd / J_PER_KJ:g}' if sd else ''} kJ/mol"
        if not own:
            missing.append(words)
        elif start != own:
            replaced.append(f"{words} (declared: {own / J_PER_KJ:.4g})")
    begin = "the fit starts from typical ones" if fitted else "typical ones are taken"
    said = []
    if missing:
        said.append(f"no activation energy is declared for these, {begin}: {', '.join(missing)}.")
    if replaced:
        said.append(
            f"declared activation energies often include those of other processes; {begin} for kinetics and films "
            f"alone: {', '.join(replaced)}."
        )
    return tuple(said)


def discharge_branch(cell: Cell, data: Measurement) -> tuple[Measurement, tuple[str, ...]]:
    """(piece of the record without long charges before or after its main discharge, a sentence if something was cut).

    A model without hysteresis has one open-circuit potential: that of the discharge, where the data show both.
    """
    step_ah = charge_by_row_ah(data)
    flows = flowing(data.current_a)
    before = np.maximum.accumulate(np.where(flows, np.arange(len(data)), 0))
    charges = (step_ah < 0.0)[before]  # a rest belongs to what came before it
    runs = _run_numbers(charges)
    of_run_ah = np.bincount(runs, weights=step_ah)
    long = of_run_ah < -LONG_CHARGE * cell.capacity_ah
    pieces = _run_numbers(long)
    discharged_ah = np.bincount(pieces, weights=np.where(long, 0.0, of_run_ah))
    best = int(np.argmax(discharged_ah))
    if not long.any() or discharged_ah[best] < LONG_CHARGE * cell.capacity_ah:
        return data, ()
    rows = np.flatnonzero(pieces[runs] == best)
    first = int(before[rows[0] - 1]) + 1 if rows[0] else 0  # the rest before it shows where it starts from
    kept = data.take(slice(min(first, max(int(rows[0]) - 1, 0)), int(rows[-1]) + 1))
    note = (
        f"{data.name}: only {stamp(kept.time_s[0])} to {stamp(kept.time_s[-1])} s are fitted; the long charge in the "
        "rest follows the other branch of the open-circuit voltage, and this model has no hysteresis."
    )
    return kept, (note,)


def charge_by_row_ah(data: Measurement) -> Array:
    """(n,) Ah, charge taken out since the row before, with the current of each row; 0 in the first."""
    return np.diff(data.time_s, prepend=data.time_s[0]) * data.current_a / SECONDS_PER_HOUR


def flowing(current_a: Array) -> BoolArray:
    """(n,) True where a current flows."""
    size = np.abs(current_a)
    return size > OPEN_SHARE * size.max()


def _run_numbers(flags: BoolArray) -> Array:
    """(n,) number, from 0, of the run of equal flags (n,) that each row is in."""
    return np.cumsum(np.diff(flags.astype(int), prepend=int(flags[0])) != 0)


def full_discharge_ah(cell: Cell, data: Measurement) -> float | None:
    """The largest charge from full to empty in a stretch of the record, Ah; None where there is none. A stretch begins
    where the cell is full, and ends where it has been charged to full again."""
    full = data.voltage_v >= cell.upper_voltage_v - FULL_WINDOW_V
    # A full cell of a flat potential falls by more at rest; where it is being charged, any state may be as high.
    charged = data.current_a < -OPEN_SHARE * np.abs(data.current_a).max()
    full |= ~charged & (data.voltage_v >= OpenCircuit(cell).lingers_from_v)
    taken_ah = data.discharged_ah(charge_hold(data))
    most: float | None = None
    position = 0
    while full[position:].any():
        position += int(np.argmax(full[position:]))
        left = np.flatnonzero(~full[position:])
        if not len(left):
            break
        # Of the rows at the top, that to which it was charged; the first, where the record begins up there.
        top = slice(position, position + int(left[0]))
        start = position + int(np.argmin(taken_ah[top]))
        stop = top.stop + _recharged(taken_ah[top.stop :] - taken_ah[start], full[top.stop :])
        most = max(filter(None, (most, emptied_ah(cell, data, taken_ah, start, stop))), default=None)
        position = stop
    return most


def _recharged(taken_ah: Array, full: BoolArray) -> int:
    """Number of the row of a stretch at which the cell has been charged to full again, or the number of rows.

    taken_ah : (n,) Ah taken out since it was full.  full : (n,) True for rows near full. A cell that is near full at
    rest, or after a pulse, has not been charged again.
    """
    if not len(taken_ah):
        return 0
    most_ah = np.maximum.accumulate(taken_ah)
    given_back = most_ah - taken_ah >= ALL_OF_IT * most_ah
    again = np.flatnonzero(full & given_back & (most_ah > LONG_CHARGE * most_ah[-1]))
    return int(again[0]) if len(again) else len(taken_ah)


def emptied_ah(cell: Cell, data: Measurement, taken_ah: Array, start: int, stop: int) -> float | None:
    """Charge from a full row to the lowest voltage before the next full row, Ah; None where that is not empty."""
    end = start + int(np.argmin(data.voltage_v[start:stop]))
    if data.voltage_v[end] > cell.lower_voltage_v + 2 * FULL_WINDOW_V:
        return None
    if taken_ah[end] - taken_ah[start] < ALL_OF_IT * (taken_ah[start:stop].max() - taken_ah[start]):
        return None
    # One sum, not the last of running ones: where a descent ends moves by millivolts with the last digit of this.
    return float(data.steps_as(charge_hold(data))[start:end].sum()) / SECONDS_PER_HOUR


def charge_hold(data: Measurement) -> Hold:
    """The hold for the charge of a record and for its thinned rows: the declared one; else that of a logger, which
    makes no difference for dense rows."""
    return data.hold or "backward"
