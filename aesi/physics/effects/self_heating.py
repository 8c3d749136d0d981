"""The cell heats up: a lumped heat balance of its losses, its entropy and the cooling by its surroundings.

    C dT/dt = sum_u i_u (T dU/dT - U)_u - I V - G (T - T_amb)      i_u > 0 delithiates, I > 0 on discharge
    U and dU/dT of particle u at its mean stoichiometry
    D, K, kappa scale with exp(E_a/R (1/T_ref - 1/T)),   U = U_ref + dU/dT (T - T_ref)

Where the temperature of the case was measured, that is used, plus the excess of the winding where the cell file states
its thermal conductivity (`aesi.physics.model.of_record`); of this balance only C counts then.

Energy is conserved from one rest to another: heat includes what diffusion within particles and electrolyte dissipates,
from the moment when it lowers the voltage.

Leaves out the energy that gradients of lithium and salt store until they have relaxed, gradients of temperature within
the cell, the heat capacity of the casing, and the heat of effects in series with the cell (film_growth, ocv_hysteresis)
and of a leakage_current. Holds for cells with a small Biot number. Needs density, specific heat and volume in the cell
file.

Source: Bernardi, Pawlikowski & Newman, J. Electrochem. Soc. 132 (1985) 5, doi:10.1149/1.2113792.
"""

from dataclasses import replace

from aesi.errors import CellError
from aesi.parameters import Parameter
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.model import EspmModel, HeatBalance

PARAMETERS = {
    "heat_transfer_w_k": Parameter(
        0.2,
        "W/K",
        bounds=(1e-3, 100.0),
        log=True,
        source="1 mW/K (a small cell in foam, all but adiabatic) to 100 W/K (a cold plate)",
        low_is_limit=True,
        description="conductance from cell to surroundings, G",
    ),
    "heat_capacity_factor": Parameter(
        1.0,
        "dimensionless",
        bounds=(0.3, 3.0),
        log=True,
        expected=0.2,
        source="estimated specific heats are off by some 20 %, at most by a factor of three",
        description="heat capacity C over what the cell file declares",
    ),
}


def warm(model: EspmModel, *, heat_transfer_w_k: float, heat_capacity_factor: float) -> EspmModel:
    """The model with a heat balance.  Raises CellError where the cell file has no thermal data."""
    declared = model.cell.heat_capacity_j_k
    if declared is None:
        raise CellError(
            f"{model.cell.name}: self_heating needs 'Density [kg.m-3]', 'Specific heat capacity [J.K-1.kg-1]' and "
            "'Volume [m3]' in the cell file."
        )
    return replace(model, heat=HeatBalance(declared * heat_capacity_factor, heat_transfer_w_k))


TYPICAL_W_M2_K = 10.0
"""Heat transfer coefficient of a case whose file declares none, as in nearly still air: that of the shipped files of
the LG M50, Prada's LFP and Kim's NCA cell, after the parameter sets of PyBaMM. Fitted to measured temperatures, the
Panasonic NCR18650PF and LG 18650HG2 in their chambers have 27 to 110 W/(m2 K)."""
CUBE = 6.0
"""Surface of a cube over (its volume)^(2/3), the minimum for a box. Cells of the shipped files have 6.0 to 17."""


def of_file(cell: Cell) -> ActiveEffect:
    """The effect with the thermal data of the cell's file; a conductance that the file does not declare is typical of a
    cell with that surface, or volume, see `assumed`.

    Raises CellError where the file has no heat capacity.
    """
    active = EFFECT.activate()
    warm(EspmModel(cell), **active.parameters)  # raises for missing thermal data before the volume is used
    conductance = _with_typical(cell).conductance_w_k
    assert conductance is not None
    return EFFECT.activate(heat_transfer_w_k=conductance)


def assumed(cell: Cell) -> tuple[str, ...]:
    """A sentence on the cooling that `of_file` assumes for a cell whose file does not state it; else empty."""
    if cell.conductance_w_k is not None:
        return ()
    missing = [
        name
        for name, value in (
            ("'Heat transfer coefficient [W.m-2.K-1]'", cell.heat_transfer_w_m2_k),
            ("'External surface area [m2]'", cell.surface_area_m2),
        )
        if value is None
    ]
    typical = _with_typical(cell)
    air = ", typical of still air," if cell.heat_transfer_w_m2_k is None else ""
    cube = ", those of a cube of its volume" if cell.surface_area_m2 is None else ""
    return (
        f"the cell's file has no {' and no '.join(missing)}: its own heat leaves it by "
        f"{typical.heat_transfer_w_m2_k:.3g} W/(m2 K){air} from {typical.surface_area_m2:.3g} m2{cube}.",
    )


def _with_typical(cell: Cell) -> Cell:
    """The cell, which has a volume, with a typical heat transfer and surface where its file has none."""
    if cell.surface_area_m2 is None:
        assert cell.volume_m3 is not None
        # Without a surface, a simulation too has no thermal resistance between winding and case.
        surface = CUBE * cell.volume_m3 ** (2.0 / 3.0)
        cell = replace(cell, surface_area_m2=surface, thermal_conductivity_w_m_k=None)
    if cell.heat_transfer_w_m2_k is None:
        cell = replace(cell, heat_transfer_w_m2_k=TYPICAL_W_M2_K)
    return cell


EFFECT = Effect(
    "self_heating",
    "physics",
    __doc__,
    PARAMETERS,
    on_model=warm,
    infers="temperature",
    of_every_record=True,
    experiment="a thermocouple on the case",
    told_apart={
        "ambient_temperature": (
            "a thermocouple on the case: one rises with load and the other stands off from the start"
        ),
    },
)
