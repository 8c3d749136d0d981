"""The same cell in PyBaMM: compare the physics model with an independent one in one call.

PyBaMM reads the cell as BPX, so that the file written by `Cell.to_bpx` is checked too. Its solver is stopped wherever
the slope of the current changes, since it could step over a pulse, and the charge that it passed is compared with the
integral of the current. The contact resistance, for which BPX has no field, is passed separately. Other parameters of a
calibrated cell that PyBaMM does not read are left out of both models, and named.
"""

from __future__ import annotations

import copy
import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from aesi.constants import MV_PER_V, SECONDS_PER_HOUR
from aesi.errors import DataError, SimulationError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, IntArray, Numbers
from aesi.over_time import extent, over_time
from aesi.physics import Cell, ModelName, simulate
from aesi.physics.arguments import check_cell, check_choice
from aesi.pipeline.export import own_fields_of, pybamm_contacts, without_own_fields
from aesi.records.checked import numbers, of_columns

if TYPE_CHECKING:
    import pandas as pd
    from plotly.graph_objects import Figure

PybammModel = Literal["SPMe", "DFN"]
OURS: Mapping[PybammModel, ModelName] = {"SPMe": "espm", "DFN": "dfn"}
DEFAULT_MESH = {"x_n": 20, "x_s": 20, "x_p": 20, "r_n": 20, "r_p": 20}
FINE_MESH = {"x_n": 30, "x_s": 20, "x_p": 30, "r_n": 60, "r_p": 60}
"""Points of PyBaMM's mesh: its default of 20 radial points moves the voltage of a drive by millivolts."""
STRETCH = 2.0
"""Stretch of a graded mesh: the points of a particle are e^2 times closer at its surface than at its centre."""
TOLERANCE = 1e-6
CHARGE_SHARE = 1e-5
"""Largest difference of PyBaMM's charge from the integral of the current, as a share of the nominal capacity."""
BEND = 1e-9
"""Largest distance of a row from the line through its neighbours, as a share of the largest current, for the current to
count as straight there."""


@dataclass(frozen=True, eq=False)
class PybammRun:
    """A PyBaMM simulation.  voltage_v : (n,) V at the requested times.  seconds : processor time of the solver.
    solution : PyBaMM's own object."""

    voltage_v: Array
    seconds: float
    solution: Any


@dataclass(frozen=True, eq=False)
class CrossCheck:
    """The comparison of two models of one cell.

    time_s : (n,) s.  ours_v, pybamm_v : (n,) V.  rmse_mv, max_mv : RMS and largest absolute difference of the two, mV.
    solution : PyBaMM's own object.  left_out : names of parameters that were left out of both models, since PyBaMM does
    not read them.
    """

    time_s: Array
    ours_v: Array
    pybamm_v: Array
    solution: Any
    left_out: tuple[str, ...] = ()

    def __repr__(self) -> str:
        without = f", without {', '.join(self.left_out)}" if self.left_out else ""
        return f"CrossCheck({extent(self.time_s)}, {self.rmse_mv:.3g} mV RMS, {self.max_mv:.3g} mV at most{without})"

    def to_frame(self) -> pd.DataFrame:
        """Both voltages as a table, one row per sample."""
        import pandas as pd

        return pd.DataFrame({"time_s": self.time_s, "ours_v": self.ours_v, "pybamm_v": self.pybamm_v})

    def plot(self) -> Figure:
        """Both voltages and their difference over time: a plotly figure."""
        difference = {"ours minus PyBaMM": MV_PER_V * (self.ours_v - self.pybamm_v)}
        voltages = {"ours": self.ours_v, "PyBaMM": self.pybamm_v}
        return over_time(self.time_s, {"voltage, V": voltages, "difference, mV": difference})

    @property
    def rmse_mv(self) -> float:
        return MV_PER_V * rms(self.ours_v - self.pybamm_v)

    @property
    def max_mv(self) -> float:
        return MV_PER_V * float(np.abs(self.ours_v - self.pybamm_v).max())


@of_columns
def cross_check(
    cell: Cell, time_s: Numbers, current_a: Numbers, soc0: float, model: PybammModel = "SPMe"
) -> CrossCheck:
    """Simulate the cell with this package and with PyBaMM.

    time_s : (n,) s, strictly increasing, n at least 2.  current_a : (n,) A, discharge positive, linear between rows.
    soc0 : state of charge at the first row, 0 to 1.  model : "SPMe" is compared with "espm", "DFN" with "dfn".
    Parameters of a calibrated cell that PyBaMM does not read (films, rates over stoichiometry, double layers) are left
    out of both models, and named in the result.
    Raises SimulationError where PyBaMM ends early or loses charge; DataError and InputError as `simulate`; DataError
    for a single row, InputError for an unknown model.
    """
    check_cell(cell)
    check_choice("model", model, PybammModel)
    time, current = numbers(time_s, "time_s"), numbers(current_a, "current_a")
    compared = without_own_fields(cell)
    ours = simulate(compared, time, current, soc0=soc0, model=OURS[model]).voltage_v
    if len(time) < 2:
        raise DataError("two models are compared over time; give at least two rows.")
    bends = _bends(time, current)
    content = compared.to_bpx()
    # Even points miss the thin layer below a surface after a step of the current: of the LG M50 under its drive of
    # up to 4C, 60 of them are 6.7 mV off at most, as many graded ones 1.2, in the same time.
    run = pybamm_run(
        content, compared, time[bends], current[bends], time, soc0, FINE_MESH, model, graded=True
    )
    return CrossCheck(time, ours, run.voltage_v, run.solution, own_fields_of(cell))


def pybamm_run(
    content: Mapping[str, Any],
    cell: Cell,
    breaks_s: Array,
    current_a: Array,
    time_s: Array,
    soc0: float,
    mesh: Mapping[str, int],
    model: PybammModel = "SPMe",
    graded: bool = False,
) -> PybammRun:
    """PyBaMM's simulation of a BPX content, with the contact resistance of `cell`, under a piecewise linear current.

    breaks_s, current_a : (k,) s and A, break points from the first to the last of time_s (n,) s.  mesh : number of
    points by dimension.  graded : True for points in a particle that are closer towards its surface.
    """
    os.environ.setdefault("PYBAMM_DISABLE_TELEMETRY", "true")  # of which it asks when it is imported
    import pybamm

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # from PyBaMM's parser and solver; nothing here can avoid them
        values = pybamm.ParameterValues.create_from_bpx_obj(copy.deepcopy(dict(content)))  # bpx fills it in
        values.update(_overrides(pybamm, cell, breaks_s, current_a, soc0))
        options, contacts = pybamm_contacts(cell)
        values.update(contacts, check_already_exists=False)
        theirs = getattr(pybamm.lithium_ion, model)(options=options)
        grids = dict(theirs.default_submesh_types)
        if graded:
            towards_surface = {"side": "right", "stretch": STRETCH}
            for side in ("negative particle", "positive particle"):
                grids[side] = pybamm.MeshGenerator(
                    pybamm.Exponential1DSubMesh, submesh_params=towards_surface
                )
        simulation = pybamm.Simulation(
            theirs,
            parameter_values=values,
            submesh_types=grids,
            var_pts=dict(mesh),
            solver=pybamm.IDAKLUSolver(rtol=TOLERANCE, atol=TOLERANCE),
        )
        simulation.build()
        at = np.unique(np.append(breaks_s[breaks_s <= time_s[-1]], time_s[-1]))
        start = process_time()
        solution = simulation.solve(t_eval=at, t_interp=time_s)
        seconds = process_time() - start
    _require_whole(solution, cell, breaks_s, current_a, time_s)
    return PybammRun(np.asarray(solution["Voltage [V]"](time_s), dtype=float), seconds, solution)


def _overrides(pybamm: Any, cell: Cell, breaks_s: Array, current_a: Array, soc0: float) -> dict[str, Any]:
    theta_n, theta_p = cell.stoichiometries(soc0)
    return {
        "Current function [A]": pybamm.Interpolant(breaks_s, current_a, pybamm.t),
        "Ambient temperature [K]": cell.initial_temperature_k,  # its isothermal model is at the ambient one
        "Lower voltage cut-off [V]": 0.5,  # a cut-off would end the run without an error
        "Upper voltage cut-off [V]": 6.0,
        "Initial concentration in negative electrode [mol.m-3]": theta_n * cell.negative.c_max_mol_m3,
        "Initial concentration in positive electrode [mol.m-3]": theta_p * cell.positive.c_max_mol_m3,
    }


def _require_whole(solution: Any, cell: Cell, breaks_s: Array, current_a: Array, time_s: Array) -> None:
    """Raise SimulationError unless the run reached its end and passed the charge of its current."""
    charge = float(solution["Discharge capacity [A.h]"](time_s[-1:])[0])
    wanted = float(np.trapezoid(np.interp(time_s, breaks_s, current_a), time_s)) / SECONDS_PER_HOUR
    if abs(solution.t[-1] - time_s[-1]) > 1e-6 * time_s[-1] or (
        abs(charge - wanted) > CHARGE_SHARE * cell.nominal_capacity_ah
    ):
        raise SimulationError(
            f"PyBaMM passed {charge:.5f} Ah by {solution.t[-1]:.1f} s, not {wanted:.5f} Ah by {time_s[-1]:.1f} s; "
            "the voltages cannot be compared. Check that the current keeps the cell within its limits."
        )


def _bends(time: Array, current: Array) -> IntArray:
    """Numbers of the rows at which the slope of the current changes, with the first and the last row."""
    slopes = np.diff(current) / np.diff(time)
    step = np.minimum(np.diff(time)[:-1], np.diff(time)[1:])
    bent = np.abs(np.diff(slopes)) * step > BEND * max(float(np.abs(current).max()), 1e-12)
    return np.flatnonzero(np.concatenate([[True], bent, [True]]))
