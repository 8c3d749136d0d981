"""`simulate`: current in, voltage and internal states out.

The extended single-particle model: solid diffusion in one particle an electrode, electrolyte diffusion
through the three layers, Butler-Volmer kinetics averaged over each electrode with the surface and local
electrolyte concentrations, electrolyte potential with the conductivity at the mean concentration, ohmic drop
of the solid. It is the SPMe of Marquis et al., J. Electrochem. Soc. 166 (2019) A3693,
doi:10.1149/2.0341915jes.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from aesi.errors import DataError, SimulationError
from aesi.numerics.galerkin import sphere_modes, stack_modes
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell, Electrode, initial_soc
from aesi.physics.constants import FARADAY_C_MOL, GAS_CONSTANT_J_MOL_K
from aesi.physics.model import EspmModel
from aesi.physics.tables import conductivity_table, electrolyte_diffusion, ocp_table
from aesi.records import Hold, Run

OnDepletion = Literal["raise", "clip"]
LAYERS = {1: "negative electrode", 2: "positive electrode"}


def simulate(
    cell: Cell,
    time_s: Array,
    current_a: Array,
    soc0: float | None = None,
    effects: Iterable[Any] = (),
    temperature_degc: Array | float | None = None,
    hold: Hold = "linear",
    *,
    rest_voltage_v: float | None = None,
    on_depletion: OnDepletion = "raise",
) -> Run:
    """Terminal voltage and states of `cell` under a current.

    time_s : (n,) s, strictly increasing, any sampling.  current_a : (n,) A, positive on discharge.
    soc0 : state of charge at rest before the first sample; None takes it from `rest_voltage_v`.
    hold : "linear" joins the samples by straight lines; "backward" holds each row's value since the row
    before.
    on_depletion : what happens where a surface stoichiometry leaves [0, 1] or the electrolyte runs dry.
    "raise" is for users; "clip" is for searches: kinetics are held at the edge, open-circuit potentials go on
    at 10 V per unit of stoichiometry, every value stays finite, and `series["depleted"]` is 1 from the first
    such sample on.

    Returns a Run with series c_sp, c_sn (mol/m3), c_e0, c_eL (mol/m3), soc, temperature_k.
    Raises SimulationError naming time and electrode; DataError for arrays that cannot be simulated.
    """
    time, current = _checked_record(time_s, current_a)
    if soc0 is None:
        soc0 = _soc_from_rest(cell, rest_voltage_v)
    model = EspmModel(cell)
    rows, fault_at, fault = _run(model, time, current, soc0, hold)
    series = _series(cell, rows, np.full(len(time), cell.initial_temperature_k))
    if fault_at >= 0:
        if on_depletion == "raise":
            raise SimulationError(_depletion(cell, time, fault_at, fault))
        series["depleted"] = (np.arange(len(time)) >= fault_at).astype(float)
    elif on_depletion == "clip":
        series["depleted"] = np.zeros(len(time))
    return Run(time, current, rows[0], series)


def _checked_record(time_s: Array, current_a: Array) -> tuple[Array, Array]:
    time = np.ascontiguousarray(time_s, dtype=float)
    current = np.ascontiguousarray(current_a, dtype=float)
    if time.ndim != 1 or time.shape != current.shape or len(time) == 0:
        raise DataError(
            f"time_s and current_a have shapes {time.shape} and {current.shape}; give two equal rows."
        )
    if not (np.isfinite(time).all() and np.isfinite(current).all()):
        raise DataError("time_s or current_a holds a value that is not finite; drop or fill it first.")
    if len(time) > 1 and not (np.diff(time) > 0).all():
        row = int(np.flatnonzero(np.diff(time) <= 0)[0]) + 1
        raise DataError(
            f"time_s does not increase at row {row} ({time[row]:g} s); sort or drop duplicate stamps."
        )
    return time, current


def _soc_from_rest(cell: Cell, rest_voltage_v: float | None) -> float:
    if rest_voltage_v is None:
        raise DataError("give soc0, or rest_voltage_v measured at rest before the record.")
    return initial_soc(cell, rest_voltage_v)


def _depletion(cell: Cell, time: Array, at: int, fault: int) -> str:
    if fault in LAYERS:
        what = f"the surface of the {LAYERS[fault]} left the stoichiometry range [0, 1]"
    else:
        what = "the electrolyte ran out of salt"
    return (
        f"{cell.name}: {what} at {time[at]:.6g} s (row {at}); the record asks for more charge than the cell "
        'has: check soc0, capacity and the sign of the current, or use on_depletion="clip".'
    )


def _series(cell: Cell, rows: Array, temperature_k: Array) -> dict[str, Array]:
    n, p = cell.negative, cell.positive
    return {
        "c_sp": rows[2] * p.c_max_mol_m3,
        "c_sn": rows[1] * n.c_max_mol_m3,
        "c_e0": rows[3],
        "c_eL": rows[4],
        "soc": (rows[5] - n.theta_min) / (n.theta_max - n.theta_min),
        "temperature_k": temperature_k,
    }


def _run(model: EspmModel, time: Array, current: Array, soc0: float, hold: Hold) -> tuple[Array, int, int]:
    from aesi.physics.kernels import run_linear

    out = np.empty((7, len(time)))
    theta0 = np.array(model.cell.stoichiometries(soc0))
    arguments = _linear_arguments(model)
    fault_at, fault = run_linear(time, current, hold == "backward", theta0, *arguments, out)  # type: ignore[call-arg]
    return out, fault_at, fault


def _solid_scales(cell: Cell, electrode: Electrode) -> float:
    """Stoichiometry a coulomb and unit of surface gain: j / (F R c_max) for one ampere."""
    area = cell.total_area_m2 * electrode.thickness_m * electrode.area_per_volume_1_m
    return 1.0 / (area * FARADAY_C_MOL * electrode.particle_radius_m * electrode.c_max_mol_m3)


@lru_cache(maxsize=64)
def _linear_arguments(model: EspmModel) -> tuple[Any, ...]:
    cell = model.cell
    n, s, p, e = cell.negative, cell.separator, cell.positive, cell.electrolyte
    sphere = sphere_modes(model.solid_order)
    d_n, d_p = (float(x.diffusivity(np.array([0.5]))[0]) for x in (n, p))
    rates = np.array(
        [
            sphere.lam[1:] * d_n / n.particle_radius_m**2,
            sphere.lam[1:] * d_p / p.particle_radius_m**2,
        ]
    )
    scale = np.array([_solid_scales(cell, n), _solid_scales(cell, p)])
    gains = scale[:, None] * sphere.gain[None, 1:]
    stack = stack_modes(
        (n.thickness_m, s.thickness_m, p.thickness_m),
        (n.porosity, s.porosity, p.porosity),
        (n.transport_efficiency, s.transport_efficiency, p.transport_efficiency),
        model.electrolyte_order,
    )
    diffusion = electrolyte_diffusion(e.diffusivity, e.c0_mol_m3)
    thermal_v = GAS_CONSTANT_J_MOL_K * cell.initial_temperature_k / FARADAY_C_MOL
    scalars = np.array(
        [
            cell.total_area_m2,
            e.c0_mol_m3,
            diffusion.top,
            n.area_per_volume_1_m * n.thickness_m,
            p.area_per_volume_1_m * p.thickness_m,
            FARADAY_C_MOL * n.rate_constant,
            FARADAY_C_MOL * p.rate_constant,
            thermal_v,
            2.0 * (1.0 - e.transference) * thermal_v,
            n.thickness_m / (3.0 * n.transport_efficiency)
            + s.thickness_m / s.transport_efficiency
            + p.thickness_m / (3.0 * p.transport_efficiency),
            (n.thickness_m / n.conductivity_s_m + p.thickness_m / p.conductivity_s_m) / 3.0,
            cell.contact_resistance_ohm,
        ]
    )
    return (
        rates, gains, 3.0 * scale,
        stack.lam * diffusion.d0,
        stack.gain * (1.0 - e.transference) / (FARADAY_C_MOL * cell.total_area_m2),
        stack.to_nodes, np.ascontiguousarray(stack.project.T), stack.gauss, stack.mean,
        diffusion.psi, 1.0 / diffusion.d0, not diffusion.linear, model.substep_s,
        ocp_table(n.ocp, "negative"), ocp_table(p.ocp, "positive"),
        conductivity_table(e.conductivity, e.c0_mol_m3),
        scalars,
    )  # fmt: skip
