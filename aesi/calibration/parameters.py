"""The free parameters of a calibration, with priors from the literature, and their application to a cell.

Every parameter moves in the coordinate z = (value - start)/sd, of the logarithm where it is a factor, so that its prior
is a standard normal deviate.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from aesi.calibration.records.conditions import Prior
from aesi.errors import InputError, did_you_mean
from aesi.physics.cell import Cell, Electrode
from aesi.physics.cell.energies import FILM_ENERGY, SPAN_K, energy_priors
from aesi.physics.cell.parts import NO_FILM
from aesi.physics.cell.relations import Constant, LookupTable, Product, Relation, scaled

LIMIT_SD = 4.0
"""Bound of every parameter and of every other working coordinate without a bound of its own, in standard deviations of
its prior."""
OF_LOGARITHM = " of its natural logarithm"
PLACES = tuple(0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, 7)))
"""Knots of a course (a diffusivity or a rate over stoichiometry), as shares of an electrode's window: dense at both
ends, where both decrease. Pulse tests have ten states of charge or more."""
COURSE_POINTS = 65
"""Points of the table of a course, one every 1.6 % of the window."""


@dataclass(frozen=True)
class FitParameter:
    """One parameter that a fit moves.

    start : value at the start, which is the middle of the prior, in `unit`; of a factor on the start file's value 1, or
    what the user's prior says.  sd : standard deviation of the prior about it.  source : of the prior.  factor : True
    where `sd` is that of the natural logarithm.  low, high : bounds of the value where it is not; elsewhere LIMIT_SD is
    the only one.  given : True for a user's prior.
    """

    name: str
    start: float
    sd: float
    unit: str
    source: str
    factor: bool = False
    low: float = -np.inf
    high: float = np.inf
    given: bool = False

    def value(self, z: float) -> float:
        """The value at a working coordinate, clipped to `low` and `high` where no logarithm is taken."""
        if self.factor:
            return self.start * float(np.exp(self.sd * z))
        return min(max(self.start + self.sd * z, self.low), self.high)

    @property
    def bounds(self) -> tuple[float, float]:
        """(lower, upper) of the working coordinate."""
        low = -LIMIT_SD if self.factor else max(-LIMIT_SD, (self.low - self.start) / self.sd)
        high = LIMIT_SD if self.factor else min(LIMIT_SD, (self.high - self.start) / self.sd)
        # The start may be on a bound (a resistance of zero), but `least_squares` needs it strictly inside.
        return min(low, -1e-9), max(high, 1e-9)


RATE_SD, SALT_SD = 0.8, 0.35
"""Deviations of logarithms. Wider ones let a drive at one temperature trade kinetics for a slow electrolyte, and an LG
18650HG2 then runs out of salt under its US06."""
CONTACT_V = 0.03
"""Voltage drop of the contacts (tabs, collectors, can) at 1C, V, as prior mean and standard deviation: a convention. It
was chosen after the 12 mohm that pulses at four temperatures gave for a Panasonic NCR18650PF (35 mV at its 2.9 Ah); the
file that they calibrate has 15.4 mohm now, where 0.03 V are 10.7. From a start at zero, which no cell has, a fit at one
temperature attributes contacts to films, which grow in the cold: on that cell's pulses at 0 and -10 degC a file
of its C/20, 1C discharge and a drive at 25 degC then errs by 70 and 137 mV, from here by 55 and 112, both with films of
60 kJ/mol.
In `aesi bench calibrate --set evaluations=8`, whose truth has contacts of 8 mohm, it finds 5.6 [0.5, 10.7] mohm, with
half of it 3.7 [0, 8.4], with twice 8.1 [4.2, 12.0], at 11.1, 11.3 and 9.0 mV on the unseen drive. With 0.06 V, and
kinetics and electrolyte left as much wider, the calibration of an LG 18650HG2 ended at kinetics a hundred times quicker
and an electrolyte a third slower, 80 mV off at 0 degC."""
CONTACTS = "convention: 0.03 V at 1C; of a cell of 2.8 Ah pulses at four temperatures tell 15.4 mohm"
FULLEST = 0.95
"""Largest stoichiometry of an electrode in a charged cell: beyond it, the kinetics stop."""
RATES = "convention: rates of cells of one chemistry scatter by a factor of three either way; no source"
TORTUOSITY = "convention: tortuosities scatter by a third; no source"
FILM_OHM_M2, FILM_SD = 3e-3, 1.2
"""A convention: three times the source, whose area is that of smooth spheres under a thin film. The 10 mohm m2 that are
attributed to Ramadass et al. 2004 were not found; PyBaMM's notes on that paper mention faults in its units and
values."""
FILMS = (
    "1 mohm m2 (5 nm of 2e5 ohm m) in PyBaMM's parameter sets, after Ramadass et al. 2004 as corrected by Safari et "
    "al. 2009"
)
FILM_COURSES = "convention: a factor of seven either way; no source"
COURSES = "factors of 59 and 11 over the windows of graphite and NCO, Ecker et al. 2015, as PyBaMM has them"
RATE_COURSES = "convention: exchange currents leave the square root by factors; no source"
COURSE_SD = 1.2
"""Standard deviation of the logarithm of a course at a knot: a decade over the window is two of them. With 0.8 the
rates of a Panasonic NCR18650PF, fitted to its pulses, ended at three deviations."""
FILM_COURSE_SD = 2.0
"""The same of a film. With 1.2 the negative film of the Panasonic NCR18650PF, fitted without its pulses at -10 degC,
ended at four deviations at the empty end, a hundred times its value over the window."""
DOUBLE_LAYER_F_M2, LAYER_SD = 1.0, 1.2
"""A convention. With 0.2 and 0.7 the same pulses ended at four deviations, 3.2 F/m2."""
LAYERS = "0.2 F/m2 in PyBaMM's parameter sets; convention: five times that, of a rough surface"
CONDUCTIVITY_W_M_K, CONDUCTIVITY_SD = 0.2, 0.5
"""From the winding to the thermocouple on its case, and the deviation of its logarithm: a convention, as what is glued
to a case reads less than the case has. The source is of LFP cells."""
CONDUCTIVITIES = (
    "0.20 and 0.15 W/(m K) across the windings of an 18650 and a 26650, Drake et al. 2014, "
    "doi:10.1016/j.jpowsour.2013.11.107"
)
FULL_SD = {"negative": 0.015, "positive": 0.03}
"""Standard deviations of the stoichiometries of full charge, where the file may be of a cell that was made a little
differently."""
AGED_FULL_SD = {"negative": 0.15, "positive": 0.15}
"""The same in a check-up of the file's own cell: a tenth of its lithium lost moves the negative electrode's by 0.09.
Measured on three made check-ups of an LG M50 with up to that loss: with FULL_SD a tenth of the material counts as
lost instead."""
HALF_CELLS = "convention: cells of one chemistry are balanced alike within a tenth; no source"


def free_parameters(
    cell: Cell, span_k: float, same_cell: bool = False, on_case: bool = False
) -> tuple[FitParameter, ...]:
    """The parameters that a fit moves, for records whose temperatures span `span_k` (K).

    Activation energies are free where the records tell them. Records at one temperature do not, see
    `aesi.calibration.start.with_unmoved_energies`.
    same_cell : the records are of the cell of the file, which may have lost lithium.  on_case : see `with_interfaces`.
    """
    ohm = CONTACT_V / cell.nominal_capacity_ah
    most_ohm = (cell.upper_voltage_v - cell.lower_voltage_v) / cell.nominal_capacity_ah
    full = AGED_FULL_SD if same_cell else FULL_SD
    n_full, p_full = cell.negative.theta_max, cell.positive.theta_min
    most, least = max(FULLEST, n_full), min(1.0 - FULLEST, p_full)  # what a file has is what a cell may have
    out = [
        FitParameter("negative.capacity", 1.0, 0.10, "factor", HALF_CELLS, True),
        FitParameter("positive.capacity", 1.0, 0.10, "factor", HALF_CELLS, True),
        FitParameter("negative.full_stoichiometry", n_full, full["negative"], "1", HALF_CELLS, low=0.0, high=most),
        FitParameter("positive.full_stoichiometry", p_full, full["positive"], "1", HALF_CELLS, low=least, high=1.0),
        FitParameter("negative.diffusivity", 1.0, 1.2, "factor", RATES, True),
        FitParameter("positive.diffusivity", 1.0, 1.2, "factor", RATES, True),
        FitParameter("negative.rate", 1.0, RATE_SD, "factor", RATES, True),
        FitParameter("positive.rate", 1.0, RATE_SD, "factor", RATES, True),
        FitParameter("electrolyte.conductivity", 1.0, SALT_SD, "factor", TORTUOSITY, True),
        FitParameter("electrolyte.diffusivity", 1.0, SALT_SD, "factor", TORTUOSITY, True),
        FitParameter("contact.resistance", cell.contact_resistance_ohm, ohm, "ohm", CONTACTS, low=0.0, high=most_ohm),
        *_courses(),
        *_interfaces(cell),
    ]  # fmt: skip
    k = cell.thermal_conductivity_w_m_k
    if on_case and k is not None and cell.winding_resistance_k_w:
        out.append(FitParameter("thermal.conductivity", k, CONDUCTIVITY_SD, "W/(m K)", CONDUCTIVITIES, True))
    if span_k > SPAN_K:
        out += [
            FitParameter(f"{part}.{rate}_energy", one.mean_j_mol, one.sd_j_mol, "J/mol", one.source, low=0.0)
            for (part, rate), one in energy_priors(cell).items()
        ]
    return tuple(out)


def _courses() -> Iterator[FitParameter]:
    """Factors at the knots over the stoichiometry of each electrode: of diffusivity, rate and film."""
    for side in ("negative", "positive"):
        for what, sd, source in (
            ("diffusivity", COURSE_SD, COURSES),
            ("rate", COURSE_SD, RATE_COURSES),
            ("film", FILM_COURSE_SD, FILM_COURSES),
        ):
            for place in range(len(PLACES)):
                yield FitParameter(knot_name(side, what, place), 1.0, sd, "factor", source, True)


def _interfaces(cell: Cell) -> Iterator[FitParameter]:
    """Double layer and film of each electrode."""
    for side, electrode in cell.electrodes.items():
        typical = electrode.double_layer_f_m2 or DOUBLE_LAYER_F_M2
        yield FitParameter(f"{side}.double_layer", typical, LAYER_SD, "F/m2", LAYERS, True)
        yield FitParameter(f"{side}.film", 1.0, FILM_SD, "factor", FILMS, True)


def with_priors(
    free: Sequence[FitParameter], priors: Mapping[str, tuple[float, float]]
) -> tuple[FitParameter, ...]:
    """The parameters with what is known of some from elsewhere in place of their own priors.

    Raises InputError for a name that is none of them, and for a value that none of them has.
    """
    by_name = {one.name: one for one in free}
    for name, prior in priors.items():
        _check_name(name, by_name)
        by_name[name] = _with_prior(by_name[name], Prior(*prior))
    return tuple(by_name.values())


def check_names(cell: Cell, priors: Iterable[str]) -> None:
    """Raises InputError for a prior of what no fit of `cell` has, whatever its records."""
    known = [one.name for one in free_parameters(with_interfaces(cell, True), np.inf, on_case=True)]
    for name in priors:
        _check_name(name, known)


def _check_name(name: str, known: Collection[str]) -> None:
    if name in known:
        return
    places = [round(100 * place) for place in PLACES]
    listed = dict.fromkeys(re.sub(r"_at_\d+_percent", "_at_N_percent", one) for one in known)
    raise InputError(
        f"the prior of {name}: there is no such parameter in this fit{did_you_mean(name, known)} There are "
        f"{', '.join(listed)} (activation energies where records span more than {SPAN_K:g} K; N is one of "
        f"{', '.join(map(str, places))})."
    )


def _with_prior(one: FitParameter, prior: Prior) -> FitParameter:
    inside = prior.value > 0.0 if one.factor else one.low <= prior.value <= one.high
    if not (inside and np.isfinite(prior.value)) or not 0.0 < prior.sd < np.inf:
        most = "" if np.isinf(one.high) else f" to {one.high:.4g}"
        between = "above 0" if one.factor else f"from {one.low:.4g}{most}"
        raise InputError(
            f"the prior of {one.name}: {prior.value:g} with a standard deviation of {prior.sd:g} is not possible; the "
            f"value, in {one.unit}, is {between}, the deviation{OF_LOGARITHM if one.factor else ''} above 0."
        )
    source = f"given: {prior.value:g}, standard deviation{OF_LOGARITHM if one.factor else ''} {prior.sd:g}"
    return replace(one, start=prior.value, sd=prior.sd, source=source, given=True)


def with_parameters(cell: Cell, values: Mapping[str, float], ages: bool = False) -> Cell:
    """The cell with global parameters replaced; the stoichiometry windows follow from its capacity in the new
    electrodes.

    ages : True where its records are a course of ageing. The capacity then scales with the size of both electrodes, so
    that a larger file with smaller shares of its records is the same model.
    """
    n1 = values.get("negative.full_stoichiometry", cell.negative.theta_max)
    p1 = values.get("positive.full_stoichiometry", cell.positive.theta_min)
    n_ah, p_ah = (
        cell.electrode_capacity_ah(x) * values.get(f"{side}.capacity", 1.0)
        for side, x in cell.electrodes.items()
    )
    size = (
        np.sqrt(values.get("negative.capacity", 1.0) * values.get("positive.capacity", 1.0)) if ages else 1.0
    )
    capacity_ah = cell.capacity_ah * float(size)
    n = replace(cell.negative, theta_min=n1 - capacity_ah / n_ah, theta_max=n1)
    p = replace(cell.positive, theta_min=p1, theta_max=p1 + capacity_ah / p_ah)
    e = cell.electrolyte
    electrolyte = replace(
        e,
        conductivity=scaled(e.conductivity, values.get("electrolyte.conductivity", 1.0)),
        diffusivity=scaled(e.diffusivity, values.get("electrolyte.diffusivity", 1.0)),
        conductivity_ea_j_mol=values.get("electrolyte.conductivity_energy", e.conductivity_ea_j_mol),
        diffusivity_ea_j_mol=values.get("electrolyte.diffusivity_energy", e.diffusivity_ea_j_mol),
    )
    return replace(
        cell,
        negative=_electrode(n, "negative", values),
        positive=_electrode(p, "positive", values),
        electrolyte=electrolyte,
        contact_resistance_ohm=values.get("contact.resistance", cell.contact_resistance_ohm),
        thermal_conductivity_w_m_k=values.get("thermal.conductivity", cell.thermal_conductivity_w_m_k),
    )


def knot_name(side: str, what: str, place: int) -> str:
    """Name of the parameter of a knot.  place : index in `PLACES`, 0 at the lowest stoichiometry of the window."""
    return f"{side}.{what}_at_{round(100 * PLACES[place])}_percent"


def with_interfaces(cell: Cell, on_case: bool = False) -> Cell:
    """The cell with typical contacts and films where its file has none: a calibration moves them from there.

    on_case : a temperature was measured on the case (`aesi.records.measured_on_case`), to which heat is conducted from
    within.
    """
    if on_case and cell.thermal_conductivity_w_m_k is None:
        conducting = replace(cell, thermal_conductivity_w_m_k=CONDUCTIVITY_W_M_K)
        # Without a body and a heat capacity no winding is simulated, and what is assumed of one would only be written.
        cell = conducting if conducting.winding_resistance_k_w else cell
    if not cell.contact_resistance_ohm:
        cell = replace(cell, contact_resistance_ohm=CONTACT_V / cell.nominal_capacity_ah)
    film = Constant(FILM_OHM_M2)
    for with_side, electrode in ((Cell.with_negative, cell.negative), (Cell.with_positive, cell.positive)):
        if electrode.film_ohm_m2 == NO_FILM:
            cell = with_side(cell, film_ohm_m2=film, film_ea_j_mol=FILM_ENERGY)
    return cell


def _electrode(electrode: Electrode, side: str, values: Mapping[str, float]) -> Electrode:
    diffusivity = _times(_course(electrode, side, "diffusivity", values), electrode.diffusivity)
    return replace(
        electrode,
        area_per_volume_1_m=electrode.area_per_volume_1_m * values.get(f"{side}.capacity", 1.0),
        diffusivity=scaled(diffusivity, values.get(f"{side}.diffusivity", 1.0)),
        rate_constant=electrode.rate_constant * values.get(f"{side}.rate", 1.0),
        double_layer_f_m2=values.get(f"{side}.double_layer", electrode.double_layer_f_m2),
        film_ohm_m2=_times(
            _course(electrode, side, "film", values),
            scaled(electrode.film_ohm_m2, values.get(f"{side}.film", 1.0)),
        ),
        rate_factor=_times(_course(electrode, side, "rate", values), electrode.rate_factor),
        diffusivity_ea_j_mol=values.get(f"{side}.diffusivity_energy", electrode.diffusivity_ea_j_mol),
        rate_ea_j_mol=values.get(f"{side}.rate_energy", electrode.rate_ea_j_mol),
        film_ea_j_mol=values.get(f"{side}.film_energy", electrode.film_ea_j_mol),
    )


def _course(electrode: Electrode, side: str, what: str, values: Mapping[str, float]) -> LookupTable | None:
    """Factor over stoichiometry, its logarithm a cubic spline through the knots; constant beyond the window."""
    factors = tuple(values.get(knot_name(side, what, k), 1.0) for k in range(len(PLACES)))
    return _splined(electrode.theta_min, electrode.theta_max, factors)


@lru_cache(maxsize=64)
def _splined(theta_min: float, theta_max: float, factors: tuple[float, ...]) -> LookupTable | None:
    """`_course` of the factors at the knots of a window. Cached: a finite difference changes one course of six."""
    logs = np.log(factors)
    if not logs.any():
        return None
    places = theta_min + (theta_max - theta_min) * np.array(PLACES)
    x = np.linspace(theta_min, theta_max, COURSE_POINTS)
    y = np.exp(CubicSpline(places, logs, bc_type="natural")(x))
    return LookupTable(tuple(map(float, x)), tuple(map(float, y)))


def _times(factor: LookupTable | None, base: Relation) -> Relation:
    """A relation times the factor of `_course`; the product with a constant is a table too."""
    if factor is None:
        return base
    if isinstance(base, Constant):
        return LookupTable(factor.x, tuple(base.value * v for v in factor.y))
    return Product(base, factor)
