"""One case on a measured record: load, put in or withhold, look, and hold the answer against what is known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench.detectable import seen_on_measured
from aesi.bench.limit import LOST, NO_TIME, NOT_RUN, NoAnswer, Stopwatch, answer_of
from aesi.bench.real.answers import initial_state_row, scored
from aesi.bench.real.beside import capacity_row, course_row, witness_row
from aesi.bench.real.case import RealCase, Take
from aesi.bench.real.faults import declared_with_fault, soc0_with_fault, with_fault
from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.data import read_measurement
from aesi.data.catalogue import locate
from aesi.data.spectra import read_spectra
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.physics import Cell
from aesi.pipeline.discovery.discover import discovery_content
from aesi.records import Measurement, Spectrum
from aesi.tracer import Discovery, discover

LIMIT_S = 600.0
HELD_OUT = 0.3
"""Last share of a record that chooses nothing, as `aesi discover` has it."""
MOST_ROWS = 20_000
"""Rows that a case is read with; more are averaged, as `aesi discover` does."""
DRAWN = 160
"""Points of a residual that the report draws."""


def judged(case: RealCase, cells: str, limit_s: float | None = LIMIT_S) -> dict[str, Any]:
    """The row of one case; `verdict` is 'not run' where its data cannot be had.

    cells : folder of the cell files.  limit_s : processor seconds; a case that takes longer is a miss.
    """
    spent = Stopwatch()
    row = _asked(case)
    try:
        data = record(case.take)
        declared = declared_cell(case.cell, cells)
        known = _known(case, data, declared)
        good = [record(take) for take in case.good]
    except DataError as error:
        return row | {"verdict": NOT_RUN, "error": str(error), **spent.row}
    soc0 = case.soc0
    if case.fault:
        data = with_fault(data, case.fault.kind, case.fault.size)
        declared = declared_with_fault(declared, case.fault.kind, case.fault.size)
        soc0 = soc0_with_fault(soc0, case.fault.kind, case.fault.size)
    held = 0.0 if good else HELD_OUT  # what a record has beside good ones is asked of all of it
    found = answer_of(lambda: discover(declared, [data], soc0=soc0, holdout=held, good=good), limit_s)
    if isinstance(found, NoAnswer):
        answer = found.row | MISSED
    else:
        answer = _held_against(case, known, found, discovery_content(found), data, declared, soc0)
    row |= answer | spent.row
    return row | {"seen_nats": seen_on_measured(declared, data, soc0, case.answers, good, held)}


def lost(case: RealCase) -> dict[str, Any]:
    """The row of a case whose process the system ended: a miss. What there was to be seen is not known."""
    return _asked(case) | LOST.row | MISSED | NO_TIME


MISSED: dict[str, Any] = {"effects": [], "named": False}
"""What a case scores that gave no answer."""


def _asked(case: RealCase) -> dict[str, Any]:
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
    """By the name that a case gives.  cells : folder of the cell files.  Raises DataError where a data set lacks it."""
    place, colon, file = name.partition(":")
    return Cell.from_bpx(locate(place, file) if colon else Path(cells) / name)


@dataclass(frozen=True, eq=False)
class Known:
    """What was measured beside a record: parameter of an effect -> true value, the thermocouple's course (n,) degC that
    the finder was not given, the share of capacity lost, and spectra."""

    parameters: Mapping[str, float]
    temperature_degc: Array | None = None
    lost: float | None = None
    spectra: tuple[Spectrum, ...] = ()


def _known(case: RealCase, data: Measurement, declared: Cell) -> Known:
    truth = dict(case.parameters)
    course, lost = None, None
    if case.group == "withheld":
        full = record(replace(case.take, temperature=True))
        if full.temperature_degc is None:
            raise DataError(f"{full.name} has no column of temperature.")
        course = full.temperature_degc
    if case.measured == "temperature" and course is not None:
        reference_degc = declared.initial_temperature_k - ZERO_CELSIUS_K
        truth["ambient_temperature.shift_k"] = float(np.mean(course)) - reference_degc
    if case.against is not None:
        other_ah = record(case.against).charge_ah
        by_file = case.measured == "declared capacity"
        lost = 1 - (other_ah / declared.capacity_ah if by_file else data.charge_ah / other_ah)
    spectra = () if case.spectra is None else read_spectra(locate(case.take.set, case.spectra))
    return Known(truth, course, lost, spectra)


def _held_against(
    case: RealCase,
    known: Known,
    found: Discovery,
    content: Mapping[str, Any],
    data: Measurement,
    declared: Cell,
    told: float | None,
) -> dict[str, Any]:
    row = scored(case.answers, known.parameters, content) | {"residual": _residual(found)}
    if known.temperature_degc is not None:
        row |= course_row(found, data, known.temperature_degc)
    if known.lost is not None:
        row |= capacity_row(found, declared, known.lost)
    if known.spectra:
        row |= witness_row(found, declared, known.spectra)
    if case.fault and case.fault.kind == "wrong_soc0" and told is not None and case.soc0 is not None:
        row |= initial_state_row(told, case.soc0, content)
    return row


def record(take: Take) -> Measurement:
    """As the finder is given it.  Raises DataError where it cannot be had."""
    columns: dict[str, str | None] | None = None if take.temperature else {"temperature_degc": None}
    path = locate(take.set, take.file)
    if take.set in ("about_energy_nmc", "lg_m50t_w8"):
        columns = None  # these have no such column
    return read_measurement(path, columns, max_rows=MOST_ROWS, stop_s=take.stop_s)


def _residual(found: Discovery) -> dict[str, list[float]]:
    """Time in s and residual in mV of each state over the record, thinned for drawing."""
    time_s = np.concatenate([f.time_s for f in found.files])
    kept = np.unique(np.linspace(0, len(time_s) - 1, DRAWN).astype(int))
    out = {"time_s": time_s[kept].round(1).tolist()}
    for state in ("before", "recalibrated", "after"):
        residual = MV_PER_V * np.concatenate([f.residual_v(state) for f in found.files])
        out[f"{state}_mv"] = residual[kept].round(2).tolist()
    return out
