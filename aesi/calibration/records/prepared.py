"""Records prepared for a calibration: thinned, with an initial state and a temperature."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from aesi.calibration.records.thinning import Thinned
from aesi.calibration.records.zero import is_slow, steadily_flowing
from aesi.calibration.start import flowing
from aesi.constants import ZERO_CELSIUS_K
from aesi.data.thinning import Averaged, Runs
from aesi.errors import DataError
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.cell import Cell
from aesi.physics.initial_state import InitialState, initial_state
from aesi.physics.rest.open_circuit import GOOD_READING_V
from aesi.physics.simulation import ModelName
from aesi.records import Hold, Measurement, at_its_temperature, hold_sentence

SOC_SD = 0.005
"""Least standard deviation of an initial state of charge that was read from a voltage, since the fit moves the
potentials of that reading; one that the user gave keeps its own."""
OTHER_CELL_SD = 0.01
"""The same where the file is of another cell. The start file of the shipped ones, an LG M50, reads eight full
charges of an LG 18650HG2 and a Panasonic NCR18650PF as 0.984 to 1.000, off by 0.010 root mean square. With 0.005 the
starts of the Panasonic's pulses at 10 and 0 degC, read as 0.976 and 0.977, end 3.9 deviations away, at 0.996."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """One record for a calibration.

    data : as measured.  rows, hold : thinned rows for the simulation, and how their current runs.  kelvin : (rows,) K,
    or None for the cell's own temperature.  unresolved_heat_w : (rows,) W, see `Averaged.unresolved_heat_w`; None for
    rows as measured.  start : state of charge at the first row.  soc_sd : its standard deviation in the fit.
    slow : see `is_slow`.  flows : (rows,) 1 where a current flows, else 0.  trusted : (rows,) see `Thinned`.
    """

    data: Measurement
    rows: Measurement
    hold: Hold
    kelvin: Array | None
    unresolved_heat_w: Array | None
    start: InitialState
    soc_sd: float
    slow: bool
    flows: Array
    trusted: BoolArray

    @property
    def name(self) -> str:
        """The measurement's name."""
        return self.data.name


def prepared(
    cell: Cell,
    records: Sequence[Measurement],
    rows: Sequence[Thinned],
    soc0: float | None,
    model: ModelName = "espm",
    same_cell: bool = False,
    cut: Collection[str] = (),
) -> tuple[Prepared, ...]:
    """The records with their rows and initial states.

    cell : that a fit starts from; under load a voltage is read of it.  rows : of each record, see `thinned`.
    soc0 : state of charge of all records whose voltage does not contradict it.  same_cell : True where the potentials
    are of this very cell.  cut : names of records whose first rows were cut off, so that `soc0` does not apply and the
    voltage is read.
    """
    least = SOC_SD if same_cell else OTHER_CELL_SD
    return tuple(
        _prepared(cell, data, thin, None if data.name in cut else soc0, len(records) > 1, model, least)
        for data, thin in zip(records, rows, strict=True)
    )


def _prepared(
    cell: Cell,
    data: Measurement,
    thin: Thinned,
    soc0: float | None,
    shared: bool,
    model: ModelName,
    least: float,
) -> Prepared:
    start = initial_state(
        cell, data, soc0, data.hold_taken, shared=shared, model=model, potentials_v=GOOD_READING_V
    )
    slow = is_slow(thin.data, cell.nominal_capacity_ah)
    if start.basis == "given":
        sd = start.sd
    elif start.basis == "full charge":
        sd = max(start.sd, SOC_SD) if slow else 0.0
    else:
        sd = max(start.sd, least)
    rows, temperature = thin.data, thin.data.temperature_degc
    return Prepared(
        data=data,
        rows=rows,
        hold=data.hold_taken if rows is data else thin.hold,
        kelvin=None if temperature is None else np.ascontiguousarray(temperature + ZERO_CELSIUS_K),
        unresolved_heat_w=rows.unresolved_heat_w(thin.hold) if isinstance(rows, Averaged) else None,
        start=start,
        soc_sd=sd,
        slow=slow,
        trusted=thin.trusted,
        flows=(steadily_flowing(thin.data) if slow else flowing(thin.data.current_a)).astype(float),
    )


def check_flows(record: Measurement) -> None:
    """Raises DataError for a record in which no current flows."""
    if not record.current_a.any():
        raise DataError(
            f"{record.name}: the current is 0 A in all {len(record):,} rows, so that no parameter shows; leave the "
            "record out, or check the column of the current."
        )


def fitted_rows_sentence(record: Prepared) -> str:
    """A sentence on the rows that are fitted and how the current runs between them."""
    declared = record.data.hold
    if record.rows is record.data:
        return hold_sentence(record.name, record.hold, declared is not None)
    step_s = float(np.median(np.diff(record.rows.time_s)))
    by_steps = isinstance(record.rows, Averaged) and isinstance(record.rows.window, Runs)
    averages = (
        "averages over intervals that grow with the time since the last current step"
        if by_steps
        else f"averages over {step_s:.3g} s"
    )
    between = {"linear": "linear between them", "backward": "constant since the row before"}
    taken = f"{averages}, with the current {between[record.hold]}"
    against = (
        "" if declared in (None, record.hold) else f"; --hold {declared} holds for rows that are not thinned"
    )
    return f"{record.name}: {len(record.data):,} rows are thinned to {len(record.rows):,} to fit: {taken}{against}."


def with_temperatures(
    cell: Cell, records: Sequence[Measurement], degc: Mapping[str, float]
) -> tuple[tuple[Measurement, ...], tuple[str, ...]]:
    """(records with the given temperatures, by name, where they have no column; sentences on the temperatures used).

    cell : its initial temperature is that of the remaining records.
    Raises DataError for a temperature of an unknown record, or of one that has a column of its own.
    """
    known = {r.name for r in records}
    for name in degc:
        if name not in known:
            raise DataError(
                f"the temperature of {name}: there is no such record among {', '.join(sorted(known))}."
            )
    out, notes = [], []
    for record in records:
        given = degc.get(record.name)
        if given is not None and record.temperature_degc is not None:
            raise DataError(
                f"the temperature of {record.name}, {given:g} degC: this record has a measured temperature of its own; "
                "leave out what is given, or the column (--column temperature_degc=)."
            )
        if given is not None:
            record = replace(record, temperature_degc=np.full(len(record), float(given)))
            notes.append(f"{record.name}: at {given:g} degC, as given.")
        elif record.temperature_degc is not None:
            notes.append(f"{record.name}: {at_its_temperature(record.temperature_degc)}.")
        else:
            declared = cell.initial_temperature_k - ZERO_CELSIUS_K
            notes.append(
                f"{record.name}: no temperature column; taken at {declared:.4g} degC, as the cell's file declares; "
                "its own can be given (--temperature FILE=DEGC)."
            )
        out.append(record)
    return tuple(out), tuple(notes)


def kelvin_taken(cell: Cell, rows: Measurement) -> float:
    """Mean temperature of the rows of a record, K; the file's where the record tells none."""
    degc = rows.temperature_degc
    return cell.initial_temperature_k if degc is None else float(degc.mean()) + ZERO_CELSIUS_K
