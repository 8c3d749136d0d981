"""The porous electrode on the records that its parameters were published with, beside the figures printed there."""

from __future__ import annotations

from collections.abc import Iterator

from aesi.bench import CaseRow
from aesi.constants import MV_PER_V
from aesi.data.catalogue import locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError
from aesi.numerics.metrics import rms
from aesi.physics import Cell, simulate

SET = "about_energy_nmc"
PUBLISHED_MV = {
    (SET, "drive_cycle"): 18.842,
    (SET, "C20"): 15.866,
    (SET, "C2"): 12.337,
    (SET, "1C"): 13.412,
    (f"{SET}_2c", "2C"): 24.688,
}
"""Root mean square error by record, as printed in NMC/validation-plots.ipynb of the set's source: PyBaMM's DFN, 16
volumes a layer and in a particle, the current straight between rows."""
FULL = 1.0
"""State of charge at the start, as taken there."""


def published() -> Iterator[CaseRow]:
    """A row a record: ours, theirs and what is between (mV); a record that is not on this machine says so."""
    for (data_set, name), theirs in PUBLISHED_MV.items():
        row: CaseRow = {"record": name, "cell": SET, "published_mv": theirs}
        try:
            cell = Cell.from_bpx(locate(SET, "cell.bpx.json"))
            data = read_measurement(locate(data_set, name))
            run = simulate(cell, data.time_s, data.current_a, FULL, hold="linear", model="dfn")
        except AesiError as error:
            yield row | {"error": str(error)}
            continue
        ours = MV_PER_V * rms(run.voltage_v - data.voltage_v)
        yield row | {"rmse_mv": ours, "apart_mv": abs(ours - theirs)}
