"""The porous-electrode model on the records that the parameters of the NMC pouch cell were published with, beside the
published errors."""

from __future__ import annotations

from collections.abc import Iterator

from aesi.bench import CaseRow
from aesi.constants import MV_PER_V
from aesi.data.catalogue import NMC, NMC_2C, locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.physics import Cell, simulate

PUBLISHED_MV = {
    (NMC, "drive_cycle"): 18.842,
    (NMC, "C20"): 15.866,
    (NMC, "C2"): 12.337,
    (NMC, "1C"): 13.412,
    (NMC_2C, "2C"): 24.688,
}
"""(data set, record) -> published RMS error, mV, from NMC/validation-plots.ipynb of the data set's source: PyBaMM's DFN
with 16 volumes in each layer and in a particle, the current linear between rows."""
FULL = 1.0
"""State of charge at the first row, as taken in the publication."""


def published() -> Iterator[CaseRow]:
    """One row per record: the RMS error of this package's model, the published one, and their absolute difference, mV.
    If the record is not available or cannot be simulated, the row has the reason in `error`."""
    for (data_set, name), theirs in PUBLISHED_MV.items():
        row: CaseRow = {"record": name, "cell": NMC, "published_mv": theirs}
        try:
            cell = Cell.from_bpx(locate(NMC, "cell.bpx.json"))
            data = read_measurement(locate(data_set, name))
            run = simulate(cell, data.time_s, data.current_a, FULL, hold="linear", model="dfn")
        except AesiError as error:
            yield row | {"error": str(error)}
            continue
        ours = MV_PER_V * rms(run.voltage_v - data.voltage_v)
        yield row | {"rmse_mv": ours, "apart_mv": abs(ours - theirs)}
