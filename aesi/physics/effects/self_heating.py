"""The cell warms itself: one lump, heated by its losses and by entropy, cooled by its surroundings.

    C dT/dt = sum_u i_u (T dU/dT - U)_u - I V - G (T - T_amb)      i_u > 0 delithiates, I > 0 on discharge
    U and dU/dT of particle u at its mean stoichiometry
    D, K, kappa scale with exp(E_a/R (1/T_ref - 1/T)),   U = U_ref + dU/dT (T - T_ref)

Where the temperature of the case was measured that is used, with what the winding is warmer by where the cell file
tells how it conducts (`aesi.physics.model.of_record`), and this balance is not needed.

Energy is kept from one rest to another: what diffusion dissipates is heat, too. It counts when it is taken from the
voltage; that gradients of lithium and salt hold part of it until they have levelled out is left out, as are gradients
of temperature within the cell, the casing's own heat capacity, and the heat of effects in series with the cell
(film_growth, ocv_hysteresis) and of a leakage_current. Holds for cells whose Biot number is small. Needs density,
specific heat and volume in the cell file.

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
"""Heat transfer from a case whose file declares none: what the shipped files of the LG M50, Prada's LFP and Kim's NCA
cell have, after the parameter sets of PyBaMM, air that hardly moves. Fitted to measured temperatures the Panasonic
NCR18650PF and LG 18650HG2 in their chambers have 27 to 122 W/(m2 K)."""
CUBE = 6.0
"""Surface of a cube over its volume to the two thirds: no box has less. Cells of the shipped files have 6.0 to 17."""


def of_file(cell: Cell) -> ActiveEffect:
    """The effect with the thermal data of the cell's file; a conductance that it does not declare is typical of a cell
    of its surface, or of its volume, see `assumed`.

    Raises CellError where the file has no heat capacity.
    """
    active = EFFECT.activate()
    warm(EspmModel(cell), **active.parameters)  # refused before anything is made of its volume
    conductance = _with_typical(cell).conductance_w_k
    assert conductance is not None
    return EFFECT.activate(heat_transfer_w_k=conductance)


def assumed(cell: Cell) -> tuple[str, ...]:
    """A sentence on what `of_file` takes for a cell whose file does not tell how it is cooled."""
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
    """The cell with a heat transfer and a surface where its file has none; it has a volume."""
    if cell.surface_area_m2 is None:
        assert cell.volume_m3 is not None
        # Without a surface the winding has no resistance to its case in a simulation either.
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
