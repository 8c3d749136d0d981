"""Priors of activation energies, for records that do not determine them."""

from __future__ import annotations

from typing import NamedTuple

from aesi.physics.cell.cell import Cell

SPAN_K = 8.0
"""Least span of the records' temperatures for a fit to move activation energies and entropy, K."""
SOLID_EA, SALT_EA = 20e3, 5e3
"""Standard deviations of the prior, J/mol: a convention; the sources below have 12 to 81, and 12 to 21 kJ/mol."""
ENERGIES = (
    "graphite 30.3, NCO 80.6 kJ/mol, Ecker et al. 2015, doi:10.1149/2.0551509jes; graphite-SiOx 17.4, NMC811 12.0, "
    "O'Regan et al. 2022, doi:10.1016/j.electacta.2022.140700; NMC811 25, O'Kane et al. 2022; all as PyBaMM has them"
)
RATE_ENERGY, RATE_ENERGY_SD = 55e3, 12e3
"""J/mol: desolvation energy of lithium, the mean of the sources. Lower values (40 and 24 in O'Regan et al. 2022, as
PyBaMM has them) are of rates that include contacts and films."""
KINETIC_ENERGIES = (
    "graphite 68, NCA 50 kJ/mol, Jow, Marx & Allen 2011, ECS Trans. 33 (23) 1, abstract; graphite 53.4, NCO 43.6, "
    "Ecker et al. 2015, as PyBaMM has them"
)
SALT_ENERGIES = (
    "conductivity 17.1 kJ/mol, Ecker et al. 2015; 12 to 21 and diffusivity 15 to 21 from 0.5 to 2 mol/l, 0 to 25 degC, "
    "Landesfeind & Gasteiger 2019; both as PyBaMM has them"
)
FILM_ENERGY, FILM_ENERGY_SD = 50e3, 12e3
"""Between the source, of a film by itself in another solvent, and what a cell's pulses want. A Panasonic NCR18650PF's
file of its C/20, 1C discharge and a drive at 25 degC alone misses those at 10, 0 and -10 degC with 60 kJ/mol by 25, 56
and 111 mV, with 50 by 18, 33 and 57, with 40 by 14, 20 and 34; its file over temperatures, fitted to them, is off its
impedance at 10 degC from 0.95 to 0.2 of charge by 11 to 15 % with 50 and by 14 to 17 % with 40."""
OF_FILMS = (
    "0.61 to 0.66 eV (59 to 64 kJ/mol) of the film on graphite, J. Power Sources 153 (2006) 391, "
    "doi:10.1016/j.jpowsour.2005.05.034, abstract; 38 and 57 fitted to a cell's pulses"
)


class EnergyPrior(NamedTuple):
    """Prior of an activation energy: mean and standard deviation, J/mol, and source."""

    mean_j_mol: float
    sd_j_mol: float
    source: str


def energy_priors(cell: Cell) -> dict[tuple[str, str], EnergyPrior]:
    """(part of the cell, its rate) -> prior of that rate's activation energy. It is centred on the file's value for
    diffusion, and on the literature for kinetics and films, since the values of files often include contacts."""
    n, p, e = cell.negative, cell.positive, cell.electrolyte
    return {
        ("negative", "diffusivity"): EnergyPrior(n.diffusivity_ea_j_mol, SOLID_EA, ENERGIES),
        ("positive", "diffusivity"): EnergyPrior(p.diffusivity_ea_j_mol, SOLID_EA, ENERGIES),
        ("negative", "rate"): EnergyPrior(RATE_ENERGY, RATE_ENERGY_SD, KINETIC_ENERGIES),
        ("positive", "rate"): EnergyPrior(RATE_ENERGY, RATE_ENERGY_SD, KINETIC_ENERGIES),
        ("electrolyte", "conductivity"): EnergyPrior(e.conductivity_ea_j_mol, SALT_EA, SALT_ENERGIES),
        ("electrolyte", "diffusivity"): EnergyPrior(e.diffusivity_ea_j_mol, SALT_EA, SALT_ENERGIES),
        ("negative", "film"): EnergyPrior(FILM_ENERGY, FILM_ENERGY_SD, OF_FILMS),
        ("positive", "film"): EnergyPrior(FILM_ENERGY, FILM_ENERGY_SD, OF_FILMS),
    }
