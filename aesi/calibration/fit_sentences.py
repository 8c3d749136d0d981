"""Sentences on where a calibration ended: priors, single records, starts and simulations that a user has to know of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from aesi.calibration.model import FitState, Model
from aesi.calibration.silicon import SILICON_V
from aesi.calibration.start import flowing
from aesi.constants import MILLI, MV_PER_V
from aesi.errors import DataError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.cell import Cell
from aesi.physics.depletion import ran_out
from aesi.physics.initial_state import initial_state
from aesi.physics.simulation import simulate
from aesi.records import Measurement

NOTED_ZERO = 0.02
"""Share of a record's typical current above which a note reports the offset of its cycler's current."""
NOTED_AGE = 0.01
"""Relative difference of a record's active material from the file's above which a note reports it."""
NOTED_SILICON = 0.05
"""The same for the silicon, which holds a sixth of such a cell's charge."""
MOVED_SOC = 1e-3
"""Least change of a given state of charge between the windows of the start file and of the written cell that a note
tells. A convention."""
NOTED_DEVIATIONS = 2.0
"""A fit that ends more than this many standard deviations from a prior that the user gave contradicts it. A
convention."""
STATE_WORDS: dict[FitState, str] = {
    "declared": "the declared cell",
    "fitted": "the fitted cell",
    "simulated": "the file as simulated",
}
"""State of the cell -> what notes call it."""


def contradicted_prior_sentences(model: Model, x: Array) -> tuple[str, ...]:
    """A sentence for each prior that was given and that the records contradict."""
    out = []
    for free, z in zip(model.free, x, strict=False):
        if free.given and abs(z) > NOTED_DEVIATIONS:
            out.append(
                f"{free.name} ends at {free.value(float(z)):.4g} {free.unit}, {abs(z):.1f} standard deviations "
                f"{'above' if z > 0.0 else 'below'} what was given ({free.start:g}): the records contradict it."
            )
    return tuple(out)


def own_parameter_sentences(model: Model, x: Array) -> tuple[str, ...]:
    """Sentences on the parameters of single records: offset of the current, active material and silicon."""
    out = []
    zero_a = model.zero.at(float(x[model.layout.zero]))
    for i, record in enumerate(model.records):
        typical = float(np.median(np.abs(record.rows.current_a[record.flows > 0.0])))
        if record.slow and abs(zero_a) > NOTED_ZERO * typical:
            out.append(
                f"{record.name}: by the fit its current reads {MILLI * abs(zero_a):.2g} mA too "
                f"{'high' if zero_a > 0 else 'low'} ({100 * abs(zero_a) / typical:.1f} % of it); the fit corrects that."
            )
        material, silicon = model.material(i, x) - 1.0, model.silicon(i, x)
        if abs(material) > NOTED_AGE:
            out.append(
                f"{record.name}: in the fit the cell has {100 * abs(material):.1f} % "
                f"{'more' if material > 0.0 else 'less'} active material in this record than in the file; the record "
                "may be of another age."
            )
        if abs(silicon - 1.0) > NOTED_SILICON:
            how = "fits with" if record.slow else "has, by the slow records before and after it,"
            out.append(
                f"{record.name}: {how} {100 * silicon:.0f} % of the capacity of the negative electrode above "
                f"{SILICON_V:g} V (silicon, if it has any)."
            )
    return tuple(out)


def ran_out_sentences(
    model: Model, runs: Mapping[FitState, Sequence[tuple[Array, int | None]]]
) -> tuple[str, ...]:
    """A sentence for each record on which the cell runs out of lithium or salt in one of the states.

    runs : state of the cell -> `Model.errors_and_ends`.
    """
    out = []
    for i, record in enumerate(model.records):
        rows = {words: runs[name][i][1] for name, words in STATE_WORDS.items()}
        at_s = {words: float(record.rows.time_s[row]) for words, row in rows.items() if row is not None}
        if at_s:
            out.append(ran_out(record.name, at_s))
    return tuple(out)


def moved_start_sentences(model: Model, begun: Mapping[str, float]) -> tuple[str, ...]:
    """A sentence for each record whose given state of charge is another one in the windows of the written cell.

    begun : `Calibration.starts`.
    """
    given = ((r.name, r.start.soc) for r in model.records if r.start.basis == "given")
    return tuple(
        f"{name} starts at a state of charge of {begun[name]:.4f} of the written cell, in which empty is the rest at "
        f"its lower cut-off: by the start file it is the {soc:.4g} that was given."
        for name, soc in given
        if abs(begun[name] - soc) >= MOVED_SOC
    )


def unfitted_rows_sentences(
    found: Cell, model: Model, records: Sequence[Measurement], begun: Mapping[str, float]
) -> tuple[str, ...]:
    """A sentence with the error of the written file over the rows of each record that were not fitted, under current.

    found : written cell.  records : whole, in the order of the model's.  begun : `Calibration.starts`.
    Where the file runs out only the rows before count.
    """
    out = []
    for whole, record in zip(records, model.records, strict=True):
        fitted = record.data
        left_out = (whole.time_s < fitted.time_s[0]) | (whole.time_s > fitted.time_s[-1])
        left_out &= flowing(whole.current_a)
        if not left_out.any():
            continue
        degc = whole.temperature_degc
        if degc is None and fitted.temperature_degc is not None:
            degc = np.full(len(whole), fitted.temperature_degc[0])  # stated, the same in every row
        given = begun[record.name] if record.start.basis == "given" else None
        try:
            soc = initial_state(found, whole, given, whole.hold_taken, model=model.model_name).soc
        except DataError:  # a simulation has to be given the start
            continue
        run = simulate(
            found,
            whole.time_s,
            whole.current_a,
            soc,
            temperature_degc=degc,
            hold=whole.hold_taken,
            on_depletion="clip",
            model=model.model_name,
        )
        depleted = run.series["depleted"] > 0.0
        rows = left_out & (np.cumsum(depleted) == 0)
        if rows.any():
            error_v = (whole.voltage_v - run.voltage_v)[rows]
            out.append(
                f"{record.name}: over its rows under current that are not fitted the file errs by "
                f"{MV_PER_V * rms(error_v):.2f} mV, {MV_PER_V * error_v.mean():+.2f} mV in the mean (measured minus "
                "model); aesi discover on the whole record tells which effect explains that, a hysteresis or another."
            )
    return tuple(out)
