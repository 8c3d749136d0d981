"""Run of one case on a measured record: read it, add the fault or withhold the column, search, and score the answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench.detectable import seen_on_measured
from aesi.bench.limit import LOST, NO_TIME, NOT_RUN, NoAnswer, Stopwatch, answer_of
from aesi.bench.real.answers import answer_scores, initial_state_row
from aesi.bench.real.case import RealCase, Take
from aesi.bench.real.faults import declared_with_fault, soc0_with_fault, with_fault
from aesi.bench.real.references import (
    Witness,
    capacity_row,
    case_kelvin,
    resistance_row,
    temperature_row,
    witness_of,
)
from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.data import read_measurement
from aesi.data.catalogue import locate
from aesi.data.spectra import read_spectra
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.physics import Cell
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.budget import MOST_ROWS
from aesi.pipeline.discovery.discover import HOLDOUT, discovery_content
from aesi.records import Measurement
from aesi.tracer import Discovery, discover
from aesi.tracer.report.outcome import STATES

LIMIT_S = 600.0
"""Limit of the processor time of one case, s. A case that takes longer counts as not answered. A convention."""
DRAWN = 160
"""Number of points of a residual in the report."""


def judged(case: RealCase, cells: str, limit_s: float | None = LIMIT_S) -> dict[str, Any]:
    """Run one case and return its row; the verdict is NOT_RUN if its data are not available.

    cells : folder of the cell files.  limit_s : limit of the processor time, s; None sets no limit. A case that takes
    longer counts as not named.
    """
    spent = Stopwatch()
    row = _case_row(case)
    try:
        data = taken(case.take)
        declared = declared_cell(case.cell, cells)
        truth = _truth(case, data, declared)
        good = [taken(take) for take in case.good]
    except DataError as error:
        return row | {"verdict": NOT_RUN, "error": str(error), **spent.row}
    soc0 = case.soc0
    if case.fault:
        data = with_fault(data, case.fault.kind, case.fault.size)
        declared = declared_with_fault(declared, case.fault.kind, case.fault.size)
        soc0 = soc0_with_fault(soc0, case.fault.kind, case.fault.size)
    held = 0.0 if good else HOLDOUT  # beside known-good records the whole record is compared with them
    found = answer_of(lambda: discover(declared, [data], soc0=soc0, holdout=held, good=good), limit_s)
    if isinstance(found, NoAnswer):
        answer = found.row | MISSED
    else:
        answer = _scored_row(case, truth, found, discovery_content(found), data, declared, soc0)
    row |= answer | spent.row
    return row | {"seen_nats": seen_on_measured(declared, data, soc0, case.answers, good, held)}


def lost(case: RealCase) -> dict[str, Any]:
    """The row of a case whose process the operating system ended. It counts as not named, and has no detectability."""
    return _case_row(case) | LOST.row | MISSED | NO_TIME


MISSED: dict[str, Any] = {"effects": [], "named": False}
"""Scores of a case that gave no answer."""


def _case_row(case: RealCase) -> dict[str, Any]:
    """The entries of the row that describe the case."""
    return {
        "case": case.name,
        "group": case.group,
        "development": case.development,
        "cell": case.cell,
        "record": f"{case.take.set}/{case.take.file}",
        "seconds_of_record": case.take.stop_s,
        "given": "temperature" if case.take.temperature else "no temperature",
        "good_records": [f"{take.set}/{take.file}" for take in case.good],
        "put_in": f"{case.fault.kind} {case.fault.size:g}" if case.fault else "",
        "answer": list(case.answers),
        "source": case.source,
        "matched": case.matched,
    }


def declared_cell(name: str, cells: str) -> Cell:
    """The declared cell of a case.

    name : of a file in the folder `cells`, or `set:file` of a data set.  Raises DataError if the data set is not
    available or has no such file, and what `Cell.from_bpx` raises.
    """
    place, colon, file = name.partition(":")
    return Cell.from_bpx(locate(place, file) if colon else Path(cells) / name)


@dataclass(frozen=True, eq=False)
class Truth:
    """What is known of the cell and of the record, for the score.

    parameters : `effect.parameter` -> true value, SI.  temperature_degc : (n,) degC, the temperature that was withheld
    from the tracer.  lost : measured loss of capacity as a share.  witness : impedance measured beside the record.
    """

    parameters: Mapping[str, float]
    temperature_degc: Array | None
    lost: float | None
    witness: Witness | None


def _truth(case: RealCase, data: Measurement, declared: Cell) -> Truth:
    """The truth of a case from its description and the records that it names.

    data : the record of the case, without a fault.  Raises DataError if one of the records is not available, and if its
    spectra do not show the resistances.
    """
    parameters = dict(case.parameters)
    measured_degc, lost = None, None
    if case.group == "withheld":
        full = taken(replace(case.take, temperature=True))
        if full.temperature_degc is None:
            raise DataError(f"{full.name} has no column of temperature.")
        measured_degc = full.temperature_degc
    if case.against is not None:
        other_ah = taken(case.against).charge_ah
        by_file = case.measured == "declared capacity"
        lost = 1 - (other_ah / declared.capacity_ah if by_file else data.charge_ah / other_ah)
    witness = None
    if case.spectra is not None:
        witness = witness_of(read_spectra(locate(case.take.set, case.spectra)), declared)
    return Truth(parameters, measured_degc, lost, witness)


def _scored_row(
    case: RealCase,
    truth: Truth,
    found: Discovery,
    content: Mapping[str, Any],
    data: Measurement,
    declared: Cell,
    given_soc0: float | None,
) -> dict[str, Any]:
    """The entries of the row about the answer: its scores, and its differences from what was measured independently.

    data, declared, given_soc0 : record, cell and initial state of charge as the tracer had them, with the fault.
    """
    parameters = dict(truth.parameters)
    if case.measured == "temperature" and truth.temperature_degc is not None:
        parameters["ambient_temperature.shift_k"] = _shift_k(
            found, declared, data, given_soc0, truth.temperature_degc
        )
    row = answer_scores(case.answers, parameters, content) | {"residual": _residual(found)}
    if truth.temperature_degc is not None:
        row |= temperature_row(found, data, truth.temperature_degc)
    if truth.lost is not None:
        row |= capacity_row(found, declared, truth.lost)
    if truth.witness is not None:
        row |= resistance_row(found, declared, truth.witness)
    if case.fault and case.fault.kind == "wrong_soc0" and given_soc0 is not None and case.soc0 is not None:
        row |= initial_state_row(data.name, given_soc0, case.soc0, content)
    return row


def _shift_k(
    found: Discovery, declared: Cell, data: Measurement, soc0: float | None, measured_degc: Array
) -> float:
    """K, true temperature of the surroundings minus the declared one: that of the case in the mean, less what the
    cell's own heat adds to it where the answer has self-heating (simulated for the declared cell at the temperature
    found).

    data, soc0 : record and initial state of charge as the tracer had them.  measured_degc : (n,) degC, of the case.
    """
    shift_k = float(np.mean(measured_degc)) - (declared.initial_temperature_k - ZERO_CELSIUS_K)
    heat = [active for active in found.model_effects if active.id == "self_heating"]
    sizes = [c.parameters["shift_k"].value for c in found.candidates if c.effect == "ambient_temperature"]
    if not heat or not sizes or sizes[0] is None:
        return shift_k
    effects = (*heat, CATALOGUE["ambient_temperature"].activate(shift_k=sizes[0]))
    kelvin = case_kelvin(declared, data, soc0, effects, data.hold_taken)
    return shift_k - float(np.mean(kelvin) - kelvin[0])


def taken(take: Take) -> Measurement:
    """The record as the tracer is given it, with at most as many rows as `aesi discover` takes.

    Raises DataError if it is not available.
    """
    columns: dict[str, str | None] | None = None if take.temperature else {"temperature_degc": None}
    return read_measurement(locate(take.set, take.file), columns, max_rows=MOST_ROWS, stop_s=take.stop_s)


def _residual(found: Discovery) -> dict[str, list[float]]:
    """Time, s, and residual measured minus model, mV, of the declared (`before`), the recalibrated and the written
    model (`after`), at most DRAWN rows each."""
    time_s = np.concatenate([f.time_s for f in found.files])
    kept = np.unique(np.linspace(0, len(time_s) - 1, DRAWN).astype(int))
    out = {"time_s": time_s[kept].round(1).tolist()}
    for state in STATES:
        residual = MV_PER_V * np.concatenate([f.residual_v(state) for f in found.files])
        out[f"{state}_mv"] = residual[kept].round(2).tolist()
    return out
