"""Cell and surroundings are at a temperature other than the declared one.

    T = T_declared + dT;   D, K, kappa scale with exp(E_a/R (1/T_ref - 1/T)),   U = U_ref + dU/dT (T - T_ref)

Leaves out gradients within the cell. Holds where the cell file declares activation energies, and is refused where it
declares none. A measured temperature is used unchanged.

Source: Arrhenius' law as BPX defines it, bpxstandard.com.
"""

from aesi.errors import CellError
from aesi.parameters import Parameter
from aesi.physics.cell import Cell
from aesi.physics.effect import Effect
from aesi.physics.model import EspmModel, activation_energies

PARAMETERS = {
    "shift_k": Parameter(
        -10.0,
        "K",
        bounds=(-65.0, 60.0),
        neutral=0.0,
        source="-40 to 85 degC, what ISO 16750-4 asks of parts in a vehicle, against 25 degC",
        description="true minus declared temperature",
        shift_of="declared_degc",
    )
}


def shift_cell(model: EspmModel, *, shift_k: float) -> EspmModel:
    """The model at the shifted temperature.  Raises CellError where nothing in the cell depends on it."""
    cell = model.cell
    if shift_k and not depends_on_temperature(cell):
        raise CellError(
            f"{cell.name} declares no activation energy, so that no rate depends on temperature; add them."
        )
    return model.with_cell(
        initial_temperature_k=cell.initial_temperature_k + shift_k,
        ambient_temperature_k=cell.ambient_temperature_k + shift_k,
    )


def depends_on_temperature(cell: Cell) -> bool:
    """True where at least one activation energy is declared."""
    return bool(activation_energies(cell).any())


EFFECT = Effect(
    "ambient_temperature",
    "parameter",
    __doc__,
    PARAMETERS,
    on_model=shift_cell,
    infers="temperature",
    experiment="the same profile in a climate chamber at two temperatures",
)
