"""The declared cell: by a BPX file, by a saved model, or by an object at hand."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from aesi.errors import InputError
from aesi.physics import Cell
from aesi.physics.record_checks import check_measured
from aesi.pipeline.product.hybrid import HybridModel
from aesi.records import Measurement

Declared = str | PathLike[str] | Cell | HybridModel
"""A BPX file, the folder of a saved model, a Cell, or a model itself."""


def declared_model(source: Declared) -> HybridModel:
    """The model that is declared: of a BPX file or a cell, the physics alone, by the model that they were fitted with.

    Raises CellError or InputError, one sentence, for what cannot be read.
    """
    if isinstance(source, HybridModel):
        return source
    if isinstance(source, Cell):
        return _alone(source)
    given: object = source
    if not isinstance(given, str | PathLike):
        raise InputError(
            f"an object of type {type(given).__name__} is no cell; give a BPX file, the folder of a saved model, "
            "a Cell or a HybridModel."
        )
    path = Path(source)
    return HybridModel.load(path) if path.is_dir() else _alone(Cell.from_bpx(path))


def check_of_cell(source: Declared, record: Measurement) -> None:
    """Raises DataError, one sentence, where a record cannot be of the cell that is declared."""
    check_measured(declared_model(source).cell, [record])


def _alone(cell: Cell) -> HybridModel:
    return HybridModel(cell, hold=None, model="dfn" if cell.fitted_with == "dfn" else "espm")
