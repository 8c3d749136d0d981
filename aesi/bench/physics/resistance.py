"""`aesi bench resistance`: does a calibrated file know how far off its resistance is where no record was?

A file that was calibrated at 25 degC alone predicts the resistance of a pulse elsewhere, with a 95 % interval
(`aesi.calibration.uncertainty.pulse_resistance`).

Measured: a Panasonic NCR18650PF, calibrated on its C/20 cycle and pulses at 25 degC, against all 1C pulses of its tests
at 25, 10, 0 and -10 degC, which are also of other days, on which the cell had another capacity; and an LG M50T,
calibrated on its C/20 discharge and UDDS, against its 1C pulses.

Virtual: cells drawn from the priors of a calibration, activation energies included, calibrated on a drive and a 1C
discharge at 25 degC, against their own resistance at `TEMPERATURES_DEGC` and `SOCS`.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import NonNegativeInt

from aesi.bench.physics.calibrate import discharge, random_drive, virtual_record
from aesi.bench.physics.cells import START
from aesi.bench.scoring import proportion
from aesi.calibration import calibrate
from aesi.calibration.parameters import free_parameters, with_interfaces, with_parameters
from aesi.calibration.uncertainty.pulse_resistance import (
    TEMPERATURES_DEGC,
    PulseResistance,
    log_resistance,
    measured_pulses,
    pulse_resistance,
)
from aesi.constants import ZERO_CELSIUS_K
from aesi.data.catalogue import M50T, PANASONIC, locate
from aesi.data.read import read_measurement
from aesi.errors import AesiError, DataError
from aesi.numerics.typing import Array
from aesi.physics import Cell, initial_state
from aesi.records import Measurement

MEASURED: tuple[tuple[str, tuple[str, ...], dict[str, float | None]], ...] = (
    (
        PANASONIC,
        ("25degC_c20_ocv", "25degC_hppc"),
        {"25degC_hppc": None, "10degC_hppc": None, "0degC_hppc": None, "n10degC_hppc": 78610.2},
    ),
    (M50T, ("n0_c20_discharge", "n0_udds"), {"n0_hppc": None}),
)
"""Data set, records that a file is calibrated on, and records of pulses with the time of their cut, s, or None;
the one at -10 degC has a gap of nine hours there."""
BALANCE = ("capacity", "full_stoichiometry")
"""Last parts of the names of parameters that are not drawn, since hardly any draw of them is a cell."""


def run(
    cells: str = "experiments/cells", virtual: NonNegativeInt = 10, seed: NonNegativeInt = 0
) -> Iterator[dict[str, Any]]:
    """One row per measured record, or with an `error` one for the cell; one per temperature of the virtual cells; each
    with the share of resistances inside their intervals (`inside_pct`), the median of high over low of the intervals
    (`width`), and that of the larger over the smaller of prediction and truth (`off`). The 95 % interval of the share
    takes pulses for independent. Those of one record or cell err alike, so that it is too narrow.

    cells : folder of the cell files.  virtual : number of virtual cells.  seed : of these.
    """
    start = Cell.from_bpx(Path(cells) / f"{START}.bpx.json")
    yield from _measured(start)
    yield from _virtual(with_interfaces(start), virtual, np.random.default_rng(seed))


def _measured(start: Cell) -> Iterator[dict[str, Any]]:
    for cell, fitted, pulses in MEASURED:
        try:
            records = {
                name: read_measurement(locate(cell, name), stop_s=pulses.get(name))
                for name in dict.fromkeys((*fitted, *pulses))
            }
        except DataError as error:
            yield {"cell": cell, "error": str(error)}
            continue
        found = calibrate(start, [records[name] for name in fitted])
        for name in pulses:
            record = records[name]
            soc, ohm = measured_pulses(found.cell, record, initial_state(found.cell, record).soc)
            degc = _mean_degc(found.cell, record)
            told = pulse_resistance(found, degc, soc)
            row = {"cell": cell, "record": name, "degc": round(degc, 1), "fitted": name in fitted}
            yield row | _figures(told.ohm[0], told.low_ohm[0], told.high_ohm[0], ohm)


def _mean_degc(cell: Cell, record: Measurement) -> float:
    """The mean temperature of a record, degC; that of the cell's file where it has none."""
    if record.temperature_degc is None:
        return cell.initial_temperature_k - ZERO_CELSIUS_K
    return float(np.mean(record.temperature_degc))


def _virtual(start: Cell, cells: int, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """The rows of the virtual cells, by temperature; they are simulated with the model that is calibrated."""
    predicted: list[PulseResistance] = []
    true_ohm: list[Array] = []
    while len(predicted) < cells:
        cell = _drawn(start, rng)
        loads = {0.9: random_drive(rng, start.capacity_ah), 0.95: discharge(start.capacity_ah)}
        try:
            records = [
                virtual_record(cell, f"from {soc0:g}", load, soc0, rng, "espm")
                for soc0, load in loads.items()
            ]
        except AesiError:
            continue  # it runs empty under these loads
        told = pulse_resistance(calibrate(start, records))
        predicted.append(told)
        true_ohm.append(np.exp(log_resistance(cell, told.temperature_degc, told.soc)))
    for a, degc in enumerate(TEMPERATURES_DEGC if cells else ()):
        ohm, low_ohm, high_ohm = (
            np.array([getattr(one, key)[a] for one in predicted]) for key in ("ohm", "low_ohm", "high_ohm")
        )
        row = {"cell": "virtual", "degc": degc, "cells": cells}
        yield row | _figures(ohm, low_ohm, high_ohm, np.array([truth[a] for truth in true_ohm]))


def _drawn(start: Cell, rng: np.random.Generator) -> Cell:
    """A cell with parameters drawn from the priors of a calibration."""
    free = [one for one in free_parameters(start, np.inf) if not one.name.endswith(BALANCE)]
    return with_parameters(start, {one.name: one.value(float(rng.standard_normal())) for one in free})


def _figures(ohm: Array, low_ohm: Array, high_ohm: Array, true_ohm: Array) -> dict[str, Any]:
    """The figures of a row, of arrays of one shape; pulses that a cell or its model cannot give do not count."""
    here = np.isfinite(ohm) & np.isfinite(true_ohm)
    predicted, low, high, truth = (a[here] for a in (ohm, low_ohm, high_ohm, true_ohm))
    if not len(truth):
        return {"pulses": 0}
    inside = (low <= truth) & (truth <= high)
    return {
        "pulses": len(truth),
        **proportion(int(inside.sum()), len(inside)).named("inside"),
        "width": round(float(np.median(high / low)), 2),
        "off": round(float(np.median(np.exp(np.abs(np.log(predicted / truth))))), 3),
    }
