"""One run of PyBaMM's SPMe or DFN on a BPX cell, with changes, under a current profile.

To avoid silent errors, the solver is stopped at every edge of the current and its steps are limited, so that no
pulse is skipped. The charge of the model is compared with the integral of the current, and a run that ends
early is an error. Radial points are dense at the surface of the particles; the default's 20 even ones change
the voltage by millivolts.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq

from aesi.constants import SECONDS_PER_HOUR
from aesi.data.laboratory.cache import cached, key_of
from aesi.data.laboratory.change import Change
from aesi.data.laboratory.changes import CONTACT_RESISTANCE, find_change
from aesi.data.laboratory.mixing import porous_electrode
from aesi.data.laboratory.sizes import gauss_sizes
from aesi.data.profiles.profile import Profile
from aesi.errors import DataError, SimulationError, first_line
from aesi.numerics.typing import Array

LaboratoryModel = Literal["SPMe", "DFN"]
VERSION = 5
"""Increased with every change of this package that changes a voltage, so that old cache entries are not used."""

EDGE_SHARE = 0.15
"""A change of the current between two rows by this share of its range is an edge."""
MOST_EDGES = 400
"""Largest number of edges at which the solver is stopped, the largest ones: each costs a restart."""
MOST_STEPS = 40_000
"""Largest number of steps that the limit on the step may require: longer records have a longer limit."""
CHARGE_TOLERANCE = 6e-4
"""Largest error of the charge, as a share of the nominal capacity. The solver's own error was 3.8e-4 over 8,820 s at 10
Hz; a skipped pulse of 2 s at 2C makes 1.1e-3."""
MESH: dict[LaboratoryModel, dict[str, int]] = {
    "SPMe": {"x_n": 40, "x_s": 20, "x_p": 40, "r_n": 80, "r_p": 80, "R_n": 7, "R_p": 7},
    "DFN": {"x_n": 60, "x_s": 20, "x_p": 60, "r_n": 80, "r_p": 80},
}
"""Numbers of Chebyshev points across the cell and of graded ones along a radius. The error of even points across is in
proportion to their width and acts like a resistance: 27 microohm with 80 on the LG M50, visible at 10 rows a second. On
its pulses of up to 1.2C over half an hour, against 160 points across and 200 along a radius, the error of 80 even and
60 points is 0.072 mV RMS and 0.66 at most, that of these 0.011 to 0.013 and 0.10 to 0.12 in the same time."""
SIZES_MESH = {"x_n": 12, "x_s": 6, "x_p": 12, "r_n": 20, "r_p": 20, "R_n": 5, "R_p": 5}
"""Points for a DFN with particles of several sizes, which has a particle of each size at each point across. On the NMC
cell with a standard deviation of radii of 61 %, under a drive at 0.8C, against 24 points across, 30 along a radius and
7 sizes, its error is 0.06 mV RMS; that of 8 even points across and 15 along a radius is 0.13 in 0.6 times the time."""
ELECTRODES = ("negative", "positive")
STRETCH = 3.3
"""Least grading of a radial mesh towards the surface: logarithm of its widest over its narrowest volume. On pulses of
the LG M50 at up to 2C it differs from this package's single particle by 0.05 mV RMS and 0.15 at most; 60 points with
2.3 did by 0.08 and 0.50."""
RESOLVED_1_S = 1e-4
"""D / R**2 down to which STRETCH is enough; below, see `stretch`. The LG M50 has 1.5e-4, the LFP cell 1.2e-4. At a
tenth of the LG M50's diffusivities, `stretch`'s mesh differs from this package's single particle by 0.03 mV RMS."""
TOLERANCE: dict[LaboratoryModel, float] = {"SPMe": 1e-6, "DFN": 1e-5}
COARSE_TOLERANCE = 1e-5
"""Tolerance of runs with a given number of radial points, of which only differences are used."""


@dataclass(frozen=True)
class Applied:
    """A change by id, with its values."""

    change: str
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class TrueRun:
    """A simulated run without noise. voltage_v, temperature_degc : (n,)."""

    time_s: Array
    current_a: Array
    voltage_v: Array
    temperature_degc: Array


@dataclass(frozen=True)
class Setup:
    """A cell file, a model, and changes of both."""

    bpx: Path
    model: LaboratoryModel
    applied: tuple[Applied, ...] = ()
    radial_points: int | None = None

    def changes(self) -> list[tuple[Change, dict[str, float]]]:
        """The changes with their values checked and completed."""
        return [(find_change(a.change), find_change(a.change).complete(a.values)) for a in self.applied]


def simulate_truth(setup: Setup, profile: Profile, between: int = 1) -> TrueRun:
    """The trace of a set-up under a profile, from the cache where it exists.

    between : rows of the trace per row of the profile, for instruments that read between its rows.
    Raises SimulationError where the model stops early or loses charge; DataError for a cell file that cannot
    be read.
    """
    import pybamm

    try:
        content = setup.bpx.read_bytes()
    except OSError as error:
        raise DataError(f"The cell file {setup.bpx} cannot be opened: {error.strerror}.") from None
    values = parameter_values(setup.bpx, profile.soc0)
    for change, chosen in setup.changes():
        change.alter(values, chosen)
    stretches = {electrode: stretch(values, electrode) for electrode in ELECTRODES}
    more = {electrode: value for electrode, value in stretches.items() if value > STRETCH}
    mesh = {"sizes": _mesh(setup)} if setup.model == "DFN" or _many_sizes(setup) else {}
    key = key_of(
        {
            **mesh,
            **({"stretch": more} if more else {}),
            **({"between": between} if between > 1 else {}),
            "version": VERSION,
            "pybamm": pybamm.__version__,
            "bpx": content,
            "model": setup.model,
            "points": setup.radial_points,
            "applied": [[a.change, dict(a.values)] for a in setup.applied],
            "time": profile.time_s,
            "current": profile.current_a,
            "soc0": profile.soc0,
        }
    )
    time = finer(profile.time_s, between)
    kept = cached("laboratory", key, lambda: _simulate(setup, profile, time, values))
    current = np.interp(time, profile.time_s, profile.current_a)
    return TrueRun(time, current, kept["voltage_v"], kept["temperature_degc"])


def finer(time_s: Array, between: int) -> Array:
    """(n,) s with `between` times for each given one; every `between`-th is a given time."""
    rows = np.arange(between * (len(time_s) - 1) + 1) / between
    return np.asarray(np.interp(rows, np.arange(len(time_s)), time_s), dtype=float)


def edges(profile: Profile) -> Array:
    """Times at which the solver has to stop: the ends, and both sides of every step of the current."""
    step = np.abs(np.diff(profile.current_a))
    limit = EDGE_SHARE * max(float(np.ptp(profile.current_a)), 1e-12)
    rows = np.flatnonzero(step > limit)
    if len(rows) > MOST_EDGES:
        rows = np.sort(rows[np.argsort(-step[rows])[:MOST_EDGES]])
    stops = np.concatenate([[0, len(profile) - 1], rows, rows + 1])
    return np.asarray(profile.time_s[np.unique(stops)], dtype=float)


def parameter_values(bpx: Path, soc0: float) -> Any:
    """PyBaMM's parameters of a BPX cell at a state of charge, cut-offs out of the way.

    Raises DataError for a file that is no BPX.
    """
    import pybamm

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # bpx warns of everything that is optional
            values = pybamm.ParameterValues.create_from_bpx(str(bpx), target_soc=soc0)
    except Exception as error:
        # pydantic, json and bpx raise each their own
        raise DataError(f"{bpx.name} is no usable BPX file: {first_line(error)}") from None
    values.update(
        {"Upper voltage cut-off [V]": 6.0, "Lower voltage cut-off [V]": 0.5}, check_already_exists=False
    )
    return values


def evaluated_at(values: Any, name: str, *inputs: float) -> float:
    """A parameter of PyBaMM's at these inputs, in its order (stoichiometry or concentrations, then kelvin); a number as
    it is."""
    import pybamm

    parameter = values[name]
    if callable(parameter):
        parameter = values.evaluate(parameter(*(pybamm.Scalar(one) for one in inputs)))
    return float(np.asarray(parameter).item())


def stretch(values: Any, electrode: str) -> float:
    """Grading (see STRETCH) of the radial mesh of an electrode, as its initial diffusivity requires.

    A current makes a profile of width sqrt(D) and height 1 / sqrt(D) below the surface, for which volumes of width h
    have an error of (h / sqrt(D))**2 / sqrt(D): the narrowest is in proportion to D**(3/4).  values : PyBaMM's
    parameters.
    """
    name = electrode.capitalize()
    initial, full = (
        float(values[f"{which} concentration in {electrode} electrode [mol.m-3]"])
        for which in ("Initial", "Maximum")
    )
    kelvin = float(values["Initial temperature [K]"])
    diffusivity = evaluated_at(values, f"{name} particle diffusivity [m2.s-1]", initial / full, kelvin)
    rate = diffusivity / float(values[f"{name} particle radius [m]"]) ** 2
    if rate >= RESOLVED_1_S:
        return STRETCH
    narrowest = STRETCH / np.expm1(STRETCH) * (rate / RESOLVED_1_S) ** 0.75
    enough = 2.0 * (STRETCH - np.log(narrowest))
    return float(brentq(lambda s: s / np.expm1(s) - narrowest, STRETCH, enough))


def _simulate(setup: Setup, profile: Profile, time: Array, values: Any) -> dict[str, Array]:
    """values : PyBaMM's parameters, with the changes."""
    import pybamm

    changes = setup.changes()
    capacity = float(values["Nominal cell capacity [A.h]"])
    declared = {"contact resistance": "true"} if values.get(CONTACT_RESISTANCE, 0.0) else {}
    options = _options([declared, *(change.options for change, _ in changes)])
    if _many_sizes(setup):
        options.pop("heat of mixing", None)  # PyBaMM supports it only for particles of one size
    current = profile.current_a
    for change, chosen in changes:
        current = change.cell_current(profile.time_s, current, chosen)
    values["Current function [A]"] = pybamm.Interpolant(profile.time_s, current, pybamm.t)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solution = _solve(setup, profile, time, values, options)
    voltage = np.asarray(solution["Voltage [V]"](time), dtype=float)
    temperature = np.asarray(solution["Volume-averaged cell temperature [C]"](time), dtype=float)
    moved = float(solution["Discharge capacity [A.h]"](time[-1]))
    asked = float(np.trapezoid(current, profile.time_s)) / SECONDS_PER_HOUR
    if abs(moved - asked) > CHARGE_TOLERANCE * capacity:
        raise SimulationError(
            f"{profile.name}: the model moved {moved:.6g} Ah where the current has {asked:.6g} Ah; "
            "a pulse was stepped over."
        )
    current = np.interp(time, profile.time_s, current)
    for change, chosen in changes:
        voltage = change.terminal_voltage(time, current, voltage, chosen)
    if not np.all(np.isfinite(voltage)):
        raise SimulationError(f"{profile.name}: the model gave no finite voltage.")
    return {"voltage_v": voltage, "temperature_degc": temperature}


def _many_sizes(setup: Setup) -> bool:
    """Whether the electrodes hold particles of many sizes."""
    return any(change.options.get("particle size") == "distribution" for change, _ in setup.changes())


def _mesh(setup: Setup) -> dict[str, int]:
    """Points of each domain."""
    mesh = dict(SIZES_MESH if setup.model == "DFN" and _many_sizes(setup) else MESH[setup.model])
    if setup.radial_points:
        mesh.update(r_n=setup.radial_points, r_p=setup.radial_points)
    return mesh


def _submeshes(setup: Setup, values: Any) -> dict[str, Any]:
    """Meshes across the cell, along a radius and over a distribution of radii."""
    import pybamm

    across = ("negative electrode", "separator", "positive electrode")
    kinds = {domain: pybamm.MeshGenerator(pybamm.Chebyshev1DSubMesh) for domain in across}
    for electrode in ELECTRODES:
        kinds[f"{electrode} particle"] = pybamm.MeshGenerator(
            pybamm.Exponential1DSubMesh, {"side": "right", "stretch": stretch(values, electrode)}
        )
    if _many_sizes(setup):
        for electrode in ELECTRODES:
            mean = float(values[f"{electrode.capitalize()} particle radius [m]"])
            spread = next(
                v[f"{electrode}_spread"] for c, v in setup.changes() if "particle size" in c.options
            )
            kinds[f"{electrode} particle size"] = gauss_sizes(mean, spread * mean)
    return kinds


def _options(asked: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    options: dict[str, Any] = {}
    for wanted in asked:
        for name, value in wanted.items():
            if options.get(name, value) != value:
                raise DataError(f"Two changes ask for different values of the model option {name!r}.")
            options[name] = value
    return options


def _solve(setup: Setup, profile: Profile, time: Array, values: Any, options: dict[str, Any]) -> Any:
    import pybamm

    if setup.model == "DFN" and "heat of mixing" in options:
        model = porous_electrode(options)
    else:
        model = getattr(pybamm.lithium_ion, setup.model)(options)
    length = float(profile.time_s[-1])
    row = float(np.median(np.diff(profile.time_s)))
    tolerance = COARSE_TOLERANCE if setup.radial_points else TOLERANCE[setup.model]
    solver = pybamm.IDAKLUSolver(
        rtol=tolerance,
        atol=1e-2 * tolerance,
        options={"dt_max": max(2 * row, 1.0, length / MOST_STEPS)},
        output_variables=[
            "Voltage [V]",
            "Volume-averaged cell temperature [C]",
            "Discharge capacity [A.h]",
        ],
    )
    kinds = {**model.default_submesh_types, **_submeshes(setup, values)}
    simulation = pybamm.Simulation(
        model, parameter_values=values, solver=solver, var_pts=_mesh(setup), submesh_types=kinds
    )
    try:
        solution = simulation.solve(edges(profile), t_interp=time)
    except (pybamm.SolverError, pybamm.ModelError, ValueError) as error:
        raise SimulationError(f"{profile.name}: {setup.model} cannot be solved: {error}") from None
    if solution.t[-1] < length * (1 - 1e-9):
        raise SimulationError(
            f"{profile.name}: {setup.model} stopped at {solution.t[-1]:.6g} s of {length:.6g} s "
            f"({solution.termination})."
        )
    return solution
