"""Thinned records for fits: fewer rows, which keep charge and the linear part of the response.

Rows of a drive are averages over symmetric windows, of current and voltage alike. Tests at steady currents with pulses
and rests, and records with uneven times, get rows that are dense after each step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aesi.data.thinning import Averaged, Spacing, averaged_over, condensed
from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect
from aesi.records import Hold, Measurement
from aesi.tracer.case.fit_simulation import fit_simulation

THIN_STEP_S = 1.0
"""Fits see at most one sample a second: nothing in the catalogue is faster than that and yet above the noise."""
FIT_SAMPLES = 12_000
"""Most rows of all records together: above it windows are doubled, since the time of a fit grows with its rows."""
DOUBLED_UNTIL_S = 30.0
"""Longer windows are not doubled again: a drive would be averaged away."""
STEADY_SAMPLES = 600
"""Rows that a record of steady currents is spread over."""
STEADY_SPACING = Spacing(first_s=0.5, growth=0.25)


@dataclass(frozen=True, eq=False)
class ThinnedRecord:
    """A record as measured, with its thinned copy.

    whole : as measured.  thin : the thinned rows; the same object where no row was dropped.
    rows : (n_thin,) number of rows of `whole` that each thinned row stands for; None for the even windows of a drive.
    hold : how the current of `whole` runs between its rows.
    """

    whole: Measurement
    thin: Measurement
    rows: Array | None
    hold: Hold

    @property
    def thin_hold(self) -> Hold:
        """How the current of `thin` runs between its rows."""
        return self.hold if self.thin is self.whole or self.rows is not None else "linear"

    def averaged(self, voltage_v: Array) -> Array:
        """(n_thin,) V, a voltage (n,) over the whole record, averaged like the record's own."""
        return self.thin.window.averages(voltage_v) if isinstance(self.thin, Averaged) else voltage_v


def thinned_record(cell: Cell, data: Measurement, step_s: float = THIN_STEP_S) -> ThinnedRecord:
    """One record, thinned; a drive to at most one row in `step_s` (s)."""
    hold = data.hold_taken
    longest_s = float(data.time_s[-1] - data.time_s[0]) / STEADY_SAMPLES
    steady = condensed(data, cell.nominal_capacity_ah, longest_s, STEADY_SPACING, hold)
    thin, rows = (averaged_over(data, step_s), None) if steady is None else steady
    return ThinnedRecord(data, thin, rows, hold)


def thinned_together(cell: Cell, measurements: Sequence[Measurement]) -> list[ThinnedRecord]:
    """Several records, thinned until they have at most `FIT_SAMPLES` rows in all or windows reach `DOUBLED_UNTIL_S`."""
    step_s = THIN_STEP_S
    while True:
        records = [thinned_record(cell, data, step_s) for data in measurements]
        if step_s > DOUBLED_UNTIL_S or sum(len(r.thin) for r in records) <= FIT_SAMPLES:
            return records
        step_s *= 2.0


def thinning_error_v(cell: Cell, record: ThinnedRecord, soc0: float, given: Sequence[ActiveEffect]) -> Array:
    """(n_thin,) V, error of the declared model's voltage by thinning: its voltage on the whole record, averaged over
    the thinned rows, minus its voltage on the thinned record; zero where it cannot be simulated.

    The two differ since kinetics are not linear in the current: the average of a voltage over a step of the current is
    not the voltage at the average current.
    """
    nothing = np.zeros(len(record.thin))
    if len(record.thin) == len(record.whole):
        return nothing
    try:
        whole = fit_simulation(cell, record.whole, soc0, given, record.hold).voltage_v
        reduced = fit_simulation(cell, record.thin, soc0, given, record.thin_hold).voltage_v
    except AesiError:
        return nothing
    lost = record.averaged(whole) - reduced
    return np.asarray(np.where(np.isfinite(lost), lost, 0.0))
