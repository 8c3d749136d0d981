"""PyBaMM as a second opinion, solved so that it can be believed.

The break points of the current are given as points to stop at, so that no pulse is stepped over, and the charge
that passed is checked against the integral of the current.
"""

import copy
import json
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from aesi.bench.physics.espm import random_load
from aesi.physics import Cell

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"
SOC0 = 0.9
SECONDS = 500


@dataclass(frozen=True, eq=False)
class Peer:
    """A cell and a load, in our terms, and how PyBaMM answers to them."""

    content: dict
    cell: Cell
    time: np.ndarray
    current: np.ndarray
    soc0: float = SOC0

    def solve(
        self,
        model="SPMe",
        options=None,
        update=None,
        radial=60,
        through=20,
        tolerance=1e-7,
        graded=False,
        stretch=2.0,
    ):
        """PyBaMM's solution on a fine mesh; graded : finer towards the surfaces of the particles, by exp(stretch)."""
        import pybamm

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            values = pybamm.ParameterValues.create_from_bpx_obj(copy.deepcopy(self.content))
            theta_n, theta_p = self.cell.stoichiometries(self.soc0)
            n, p = self.cell.negative, self.cell.positive
            values.update(
                {
                    "Current function [A]": pybamm.Interpolant(self.time, self.current, pybamm.t),
                    "Lower voltage cut-off [V]": 0.5,  # a cut-off would end the run without an error
                    "Upper voltage cut-off [V]": 6.0,
                    "Initial concentration in negative electrode [mol.m-3]": theta_n * n.c_max_mol_m3,
                    "Initial concentration in positive electrode [mol.m-3]": theta_p * p.c_max_mol_m3,
                }
            )
            values.update(update or {}, check_already_exists=False)
            mesh = {
                "x_n": through,
                "x_s": 10,
                "x_p": through,
                "r_n": radial,
                "r_p": radial,
                "R_n": 15,
                "R_p": 15,
            }
            built = getattr(pybamm.lithium_ion, model)(options or {})
            grids = dict(built.default_submesh_types)
            if graded:
                towards_surface = {"side": "right", "stretch": stretch}
                for side in ("negative particle", "positive particle"):
                    grids[side] = pybamm.MeshGenerator(
                        pybamm.Exponential1DSubMesh, submesh_params=towards_surface
                    )
            simulation = pybamm.Simulation(
                built,
                submesh_types=grids,
                parameter_values=values,
                var_pts=mesh,
                solver=pybamm.IDAKLUSolver(rtol=tolerance, atol=tolerance),
            )
            solution = simulation.solve(t_eval=self.time, t_interp=self.time)
        charge = float(solution["Discharge capacity [A.h]"](self.time[-1:])[0])
        assert solution.t[-1] == pytest.approx(self.time[-1])
        assert charge == pytest.approx(np.trapezoid(self.current, self.time) / 3600.0, abs=1e-4)
        return solution

    def voltage(self, **options):
        """(n,) V."""
        return np.asarray(self.solve(**options)["Voltage [V]"](self.time))


def read(name):
    return json.loads((CELLS / f"{name}.bpx.json").read_text())


@pytest.fixture(scope="session")
def peer():
    """The 30 Ah cell under a random drive load up to 3C."""
    content = read("nmc_30ah")
    cell = Cell.from_bpx(content)
    time, current = random_load(10 * SECONDS, cell.nominal_capacity_ah, np.random.default_rng(3))
    return Peer(content, cell, time, current)


@pytest.fixture(scope="session")
def plain_v(peer):
    """PyBaMM's SPMe of that cell, (n,) V."""
    return peer.voltage()


@pytest.fixture(scope="session")
def reversible_plating():
    """Rate constant (m/s), and PyBaMM's options and parameters of plating and stripping at it."""
    import pybamm

    rate, faraday = 1e-9, pybamm.constants.F
    return rate, {
        "options": {"lithium plating": "reversible", "surface form": "algebraic"},
        "update": {
            "Exchange-current density for plating [A.m-2]": lambda c_e, c_li, T: faraday * rate * c_e,
            "Exchange-current density for stripping [A.m-2]": lambda c_e, c_li, T: faraday * rate * c_li,
            "Initial plated lithium concentration [mol.m-3]": 0.0,
            "Typical plated lithium concentration [mol.m-3]": 1000.0,
            "Lithium plating transfer coefficient": 0.65,
            "Lithium metal partial molar volume [m3.mol-1]": 1.3e-5,
            "Initial SEI thickness [m]": 5e-9,
            "SEI partial molar volume [m3.mol-1]": 9.585e-5,
        },
    }
