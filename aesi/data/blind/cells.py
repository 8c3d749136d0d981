"""The cells of the blind set: four, of four chemistries, each a BPX file in `experiments/cells`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from aesi.errors import DataError


@dataclass(frozen=True)
class BlindCell:
    """A cell of the blind set.

    rate : factor on the drive's currents, for the power of this cell.  soc0 : range of the initial state of charge, in
    which charge pulses stay near the voltage window.
    """

    file: str
    rate: float
    soc0: tuple[float, float]


CELLS: Mapping[str, BlindCell] = {
    "nmc": BlindCell("nmc_30ah.bpx.json", 1.0, (0.8, 0.95)),
    "lg_m50": BlindCell("lg_m50_chen2020.bpx.json", 0.7, (0.6, 0.75)),
    "lfp": BlindCell("lfp_prada2013.bpx.json", 1.2, (0.75, 0.9)),
    "nca": BlindCell("nca_kim2011.bpx.json", 1.2, (0.7, 0.85)),
}


def cells_in(folder: Path) -> dict[str, Path]:
    """Name -> declared file. Raises DataError where the folder lacks one."""
    found = {name: folder / cell.file for name, cell in CELLS.items()}
    for path in found.values():
        if not path.exists():
            raise DataError(f"{folder} has no {path.name}, a cell of the blind set; give its folder.")
    return found
