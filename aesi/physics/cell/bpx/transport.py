"""Whether lengths, diffusivities, conductivities and rate constants of a cell's file are in the units of the standard.

What cannot be told: the conductivity of a solid in S/cm where it is good all the same, since those of electrodes span
three decades, and one of two rate constants or diffusivities in an electrode that is slow by nature. Those of graphite
alone are 1e-11 m2/s along its planes and 1e-15 along grain boundaries (Persson et al., J. Phys. Chem. Lett. 1 (2010)
1176, doi:10.1021/jz100188d), so that a slow electrode in cm2/s is a fast one in m2/s.
"""

from __future__ import annotations

import numpy as np

from aesi.constants import FARADAY_C_MOL
from aesi.errors import CellError
from aesi.numerics.typing import Array
from aesi.physics.cell.parts import CellParameters, Electrode

POINTS = 101
"""Number of stoichiometries between empty and full at which relations are evaluated."""
HALF_FULL = 0.5
"""Largest value of sqrt(x (1 - x)), at x = 1/2."""
SEPARATOR_M = (1e-6, 1e-3)
"""Range of the separator's thickness: 12 to 25 um in the shipped files and in twelve published sets (of PyBaMM), 0.7 mm
at most in laboratory cells (glass fibre). In another unit the number would be 0.012 (mm) or 12 (um)."""
ELECTROLYTE_S_M = (0.05, 8.5)
"""Range of the electrolyte's conductivity: 0.88 to 2.05 S/m in the shipped files and the same sets, which is 0.009 to
0.02 S/cm and 9 to 20 mS/cm; a calibration may change it by a factor of four."""
LARGEST_SALT_M2_S = 1e-8
"""Largest diffusivity of the salt: it is 2.5e-11 to 7.5e-10 m2/s there, which is 2.5e-7 to 7.5e-6 cm2/s; the limit is
halfway between on a logarithmic scale."""
SHORTEST_DIFFUSION_S = 1.0
"""Least (radius squared over the median diffusivity in an electrode's window): 2.9 s in one (0.5 um, Kim 2011) and 100
to 25,000 s in the others of the shipped files and the same sets; with a diffusivity in cm2/s, 1e-4 of that."""
LARGEST_SOLID_DROP_V = 0.2
"""Largest mean ohmic drop in an electrode's solid at 1C, I L / (3 A sigma): 0.7 uV to 7 mV in the shipped files and in
twelve published sets (of PyBaMM). The largest is for the 0.18 S/m of Chen et al., J. Electrochem. Soc. 167 (2020)
080534; its 0.0018 S/cm read as S/m would make 0.7 V."""
LEAST_EXCHANGE_1_H = 2e-3
"""Least exchange current of a half-full electrode over nominal capacity: 0.05 to 470 1/h there, and 0.2 or more without
the set of sodium. In the slower electrode it would be at most 0.0009 with a rate constant in mol/(cm2 s), and less with
one in m/s."""


def check_transport(cell: CellParameters, where: str) -> None:
    """Raises CellError, naming `where`, for values that cannot be lengths in m, diffusivities in m2/s, or an
    electrolyte's conductivity in S/m."""
    least, most = SEPARATOR_M
    if not least <= cell.separator.thickness_m <= most:
        raise CellError(
            f"{where}: Separator: thickness = {cell.separator.thickness_m:g} m is outside {least:g} to {most:g} m, "
            "where all separators are; it is in m, so that 12 um is 1.2e-05."
        )
    electrolyte = cell.electrolyte
    at_rest = np.array([electrolyte.c0_mol_m3])
    conductivity = float(electrolyte.conductivity(at_rest)[0])
    least, most = ELECTROLYTE_S_M
    if not least <= conductivity <= most:
        raise CellError(
            f"{where}: Electrolyte: conductivity = {conductivity:g} S/m at {electrolyte.c0_mol_m3:g} mol/m3 is outside "
            f"{least:g} to {most:g} S/m, where all electrolytes are; it is in S/m, so that 10 mS/cm or 0.01 S/cm is 1."
        )
    diffusivity = float(electrolyte.diffusivity(at_rest)[0])
    if diffusivity > LARGEST_SALT_M2_S:
        raise CellError(
            f"{where}: Electrolyte: diffusivity = {diffusivity:g} m2/s at {electrolyte.c0_mol_m3:g} mol/m3 is above "
            f"{LARGEST_SALT_M2_S:g} m2/s, faster than any salt; it is in m2/s, so that 2e-06 cm2/s is 2e-10."
        )
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        median = float(np.median(electrode.diffusivity(inside_window(electrode))))
        seconds = electrode.particle_radius_m**2 / median
        if seconds < SHORTEST_DIFFUSION_S:
            raise CellError(
                f"{where}: {side} electrode: diffusivity = {median:g} m2/s takes lithium across particles of "
                f"{electrode.particle_radius_m:g} m in {seconds:.2g} s, faster than in any electrode; it is in m2/s, "
                "so that 1e-10 cm2/s is 1e-14."
            )
        _check_solid(cell, electrode, f"{where}: {side} electrode")


def _check_solid(cell: CellParameters, electrode: Electrode, what: str) -> None:
    """Raises CellError for a drop above LARGEST_SOLID_DROP_V: the mean one, which the cell's voltage has, of a current
    that decreases linearly to zero across the electrode is a third of the solid's resistance times the current."""
    current_a_m2 = cell.nominal_capacity_ah / cell.total_area_m2
    drop_v = current_a_m2 * electrode.thickness_m / (3.0 * electrode.conductivity_s_m)
    if drop_v > LARGEST_SOLID_DROP_V:
        raise CellError(
            f"{what}: conductivity = {electrode.conductivity_s_m:g} S/m takes {drop_v:.2g} V of the cell's voltage at "
            f"{cell.nominal_capacity_ah:g} A, more than in any electrode; it is in S/m, so that 0.01 S/cm is 1."
        )


def check_kinetics(cell: CellParameters, where: str) -> None:
    """Raises CellError, naming `where`, for rate constants not in mol/(m2 s)."""
    for side, electrode in (("Negative", cell.negative), ("Positive", cell.positive)):
        exchange_a = FARADAY_C_MOL * electrode.rate_constant * HALF_FULL * cell.reactive_area_m2(electrode)
        if exchange_a < LEAST_EXCHANGE_1_H * cell.nominal_capacity_ah:
            raise CellError(
                f"{where}: {side} electrode: reaction rate constant = {electrode.rate_constant:g} makes an exchange "
                f"current of {exchange_a:.2g} A, less than in any electrode of {cell.nominal_capacity_ah:g} A.h; it is "
                "in mol/(m2 s), those of cells are 1e-06 to 1e-03."
            )


def inside_window(electrode: Electrode) -> Array:
    """(n,) stoichiometries within the window, without its ends: potentials may be infinite at 0 or 1."""
    return np.linspace(electrode.theta_min, electrode.theta_max, POINTS)[1:-1]
