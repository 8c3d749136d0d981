"""What a cell is declared to be: by a BPX file, by a saved model, or by an object at hand."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from aesi.physics import Cell
from aesi.pipeline.product.hybrid import HybridModel

Declared = str | PathLike[str] | Cell | HybridModel
"""A BPX file, the folder of a saved model, a Cell, or a model itself."""


def declared_model(source: Declared) -> HybridModel:
    """The model that is declared: of a BPX file or a cell, the physics alone.

    Raises CellError or InputError, one sentence, for what cannot be read.
    """
    if isinstance(source, HybridModel):
        return source
    if isinstance(source, Cell):
        return HybridModel(source)
    path = Path(source)
    return HybridModel.load(path) if path.is_dir() else HybridModel(Cell.from_bpx(path))
