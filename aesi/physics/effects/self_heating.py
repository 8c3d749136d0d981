"""The cell warms itself: one lump, heated by its losses and by entropy, cooled by its surroundings.

    C dT/dt = sum_u i_u (T dU/dT - U)_u - I V - G (T - T_amb)      i_u > 0 delithiates, I > 0 on discharge
    D, K, kappa scale with exp(E_a/R (1/T_ref - 1/T)),   U = U_ref + dU/dT (T - T_ref)

Where the temperature of the case was measured that is used, with what the winding is warmer by where the cell file
tells how it conducts (`aesi.physics.model.of_record`), and this balance is not needed.

Leaves out other gradients within the cell, heat of mixing, the casing's own heat capacity, and the heat of effects in
series with the cell (film_growth, ocv_hysteresis) and of a leakage_current. Holds for cells whose Biot number is small.
Needs density, specific heat and volume in the cell file.

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


def of_file(cell: Cell) -> ActiveEffect:
    """The effect with the thermal data of the cell's file; a conductance that it does not declare is typical.

    Raises CellError where the file has no heat capacity.
    """
    conductance = cell.conductance_w_k
    active = EFFECT.activate(**({} if conductance is None else {"heat_transfer_w_k": conductance}))
    warm(EspmModel(cell), **active.parameters)
    return active


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
