"""What a path declares: the cell of a BPX file, or all of a saved model."""

from __future__ import annotations

from pathlib import Path

from aesi.physics import Cell
from aesi.pipeline.product.hybrid import HybridModel


def declared_model(path: Path) -> HybridModel:
    """A saved model from its folder, or the bare model of the cell in a BPX file.

    Raises CellError or InputError, one sentence, for what cannot be read.
    """
    return HybridModel.load(path) if path.is_dir() else HybridModel(Cell.from_bpx(path))
