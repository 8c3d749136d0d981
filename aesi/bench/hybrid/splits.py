"""Splits of measured drives into training and test data, and the figures of a hybrid model on one split.

In every split a hybrid model is trained on some drives of a cell and predicts drives that it has not seen, in free run:

    nmc        trains on three, or on two, of the five parts of the NMC pouch cell's drive; the other parts test
    lfp        the same with the LFP cell's drive, on which no rule or default was chosen
    hg2        one drive of the LG HG2 at 25 degC tests, the others train; each drive in turn, with a cell file that was
               fitted to one of the others
    panasonic  the same with the Panasonic NCR18650PF
    m50t       trains on the odd repeats of the LG M50T's UDDS and tests on the even ones, and the reverse

Every second split of a cell other than lfp is a development split, whose figures may choose rules and defaults. The
other splits, and all of lfp, are test splits: they choose nothing. Of the hg2 and the panasonic the test splits alone
are tested at other temperatures as well (`abroad`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from aesi.bench import some_chosen
from aesi.conformal import FreeRunBands
from aesi.conformal.scores import interval_score
from aesi.constants import MV_PER_V
from aesi.errors import InputError
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.intervals.bands import reach
from aesi.pipeline.experiment.physics_models import DECLARED
from aesi.pipeline.experiment.sections import RepeatsConfig
from aesi.records import ErrorModel, ErrorSeries, FreeRun


@dataclass(frozen=True)
class SplitCase:
    """One split.

    cell : key of EXPERIMENTS.  name : of the split.  experiment : name of the experiment file with the settings.
    overrides : `key=value` that replace settings of that file.  abroad : names of test records at other temperatures.
    development : whether the figures of this split may choose rules and defaults.
    """

    cell: str
    name: str
    experiment: str
    overrides: tuple[str, ...]
    abroad: tuple[str, ...]
    development: bool


DRIVES = {
    "hg2": ("25degC_us06", "25degC_la92", "25degC_mixed1", "25degC_mixed2", "25degC_mixed3"),
    "panasonic": (
        "25degC_us06",
        "25degC_la92",
        "25degC_hwfet",
        "25degC_cycle_1",
        "25degC_cycle_2",
        "25degC_cycle_3",
    ),
}
"""Cell -> its drives at 25 degC, each of which is the test of one split."""
ABROAD = {
    "hg2": ("10degC_us06", "40degC_la92"),
    "panasonic": ("10degC_cycle_1", "0degC_cycle_1"),
}
"""Cell -> drives at other temperatures, on which test splits are tested as well."""
EXPERIMENTS = {
    "nmc": "measured_nmc_drive.yaml",
    "lfp": "measured_lfp_drive.yaml",
    "hg2": "lg_18650hg2.yaml",
    "panasonic": "panasonic_ncr18650pf.yaml",
    "m50t": "lg_m50t_udds.yaml",
}
"""Cell -> file name of the experiment with its settings."""
OTHER_FILES = {"25degC_mixed1": "cells/lg_18650hg2_mixed2.bpx.json"}
"""Drive -> the cell file with which it is the test, where that of the experiment was fitted to it."""
DRIVE_PARTS = (1, 2, 3, 4, 5)
"""Numbers of the parts of the published drives of the NMC and the LFP cell, DRIVE_PART_S long each."""
DRIVE_PART_S = 1800.0
"""Duration of a part, s, as published."""
M50T_HALVES = ((1, 3, 5, 7), (2, 4, 6))
"""Odd and even repeats of the M50T's UDDS, M50T_PERIOD_S long each."""
M50T_PERIOD_S = 2600.0
"""Period of the schedule, s, as in the record."""


def all_splits() -> tuple[SplitCase, ...]:
    """All splits, ordered by cell."""
    halves = (M50T_HALVES, M50T_HALVES[::-1])
    return (
        *_by_repeats("nmc", DRIVE_PART_S, _drive_parts()),
        *_by_drive("hg2"),
        *_by_drive("panasonic"),
        *_by_repeats("m50t", M50T_PERIOD_S, halves),
        *_by_repeats("lfp", DRIVE_PART_S, _drive_parts(), development=False),
    )


def chosen_splits(
    cells: Sequence[str] = tuple(EXPERIMENTS),
    a_cell: int | None = None,
    only: str | None = None,
    development: bool | None = None,
) -> tuple[SplitCase, ...]:
    """The selected splits.

    cells : keys of EXPERIMENTS.  a_cell : most splits of a cell, spread evenly over its list; None for all.
    only : substring of the split's name.  development : True selects the development splits, False the test splits.
    Raises InputError for an unknown cell, and if no split is selected.
    """
    unknown = [name for name in cells if name not in EXPERIMENTS]
    if unknown:
        raise InputError(
            f"there is no cell {unknown[0]!r} in this benchmark; there are: {', '.join(EXPERIMENTS)}."
        )
    kept: list[SplitCase] = []
    for cell in cells:
        of_cell = [s for s in all_splits() if s.cell == cell and (only is None or only in s.name)]
        of_cell = [s for s in of_cell if development is None or s.development == development]
        if a_cell is not None and a_cell < len(of_cell):
            of_cell = [of_cell[i] for i in np.linspace(0, len(of_cell) - 1, a_cell).round().astype(int)]
        kept += of_cell
    return tuple(some_chosen("splits", kept, (s.name for s in all_splits() if s.cell in cells)))


def judged(fitted: Sequence[Fitted], tests: Sequence[ErrorSeries]) -> dict[str, Any]:
    """Model -> its figures in free run over all test records together, and over each by itself (`drives`).

    tests : error series of the test records.  The figures are the RMSE (mV), the reduction of the declared model's mean
    squared error (`mser_pct`, per cent), the number of runs that diverged, and of a model with bands their coverage
    (per cent), mean width and Winkler score (mV).
    """
    return {each.model.name: _figures(each, tests) for each in fitted}


def against(mine: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    """Reduction of the mean squared error of `other` by `mine`, per cent; positive if `mine` is better. Both are
    entries of `judged`."""
    return float(100.0 * (1.0 - (mine["rmse_mv"] / other["rmse_mv"]) ** 2))


def _figures(fitted: Fitted, tests: Sequence[ErrorSeries]) -> dict[str, Any]:
    """The entry of `judged` of one model."""
    runs = [fitted.model.free_run(series) for series in tests]
    truth = np.concatenate([series.error_v for series in tests])
    declared = np.concatenate([series.left_by(DECLARED) for series in tests])
    errors_v = truth - np.concatenate([run.error_v for run in runs])
    figures: dict[str, Any] = {
        "rmse_mv": MV_PER_V * rms(errors_v),
        "mser_pct": float(100.0 * (1.0 - np.mean(errors_v**2) / np.mean(declared**2))),
        "diverged": sum(run.diverged_at is not None for run in runs),
    }
    drives = {
        series.name: {"rmse_mv": MV_PER_V * rms(part)}
        for series, part in zip(tests, _by_record(errors_v, tests), strict=True)
    }
    figures["drives"] = drives
    if fitted.bands is None:
        return figures
    low, high = _band(fitted.bands, fitted.model, tests, runs)
    covered = (low <= errors_v) & (errors_v <= high)
    for drive, part in zip(drives.values(), _by_record(covered, tests), strict=True):
        drive["coverage_pct"] = 100.0 * float(part.mean())
    return figures | {
        "rows": len(errors_v),
        "coverage_pct": 100.0 * float(covered.mean()),
        "worst_drive_coverage_pct": min(drive["coverage_pct"] for drive in drives.values()),
        "width_mv": MV_PER_V * float(np.mean(high - low)),
        "winkler_mv": MV_PER_V * interval_score(low, high, errors_v, fitted.bands.alpha),
    }


def _band(
    bands: FreeRunBands, model: ErrorModel, tests: Sequence[ErrorSeries], runs: Sequence[FreeRun]
) -> tuple[Array, Array]:
    """Lower and upper bound of the band over all rows of all records, relative to the free run, (n,) V each."""
    along = [
        bands.intervals(series, run, reach(model, series)) for series, run in zip(tests, runs, strict=True)
    ]
    return np.concatenate([band.lower_v for band in along]), np.concatenate([band.upper_v for band in along])


def _by_record(column: Array | BoolArray, tests: Sequence[ErrorSeries]) -> list[Array]:
    """A column (n,) over all rows of all records, cut into one array per record."""
    return np.split(column, np.cumsum([len(series) for series in tests])[:-1])


def _drive_parts() -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    return [
        (train, tuple(part for part in DRIVE_PARTS if part not in train))
        for count in (3, 2)
        for train in combinations(DRIVE_PARTS, count)
    ]


def _by_repeats(
    cell: str,
    period_s: float,
    parts: Sequence[tuple[tuple[int, ...], tuple[int, ...]]],
    development: bool = True,
) -> Iterator[SplitCase]:
    """Splits of one record whose parts, period_s s long, train and test.

    parts : (numbers of the training parts, of the test parts) of each split.  development : whether every second split
    is for development; otherwise none is.
    """
    for number, (train, test) in enumerate(parts):
        repeats = RepeatsConfig(period_s=period_s, train=train, test=test)
        yield SplitCase(
            cell=cell,
            name=f"{cell} {'+'.join(map(str, train))}",
            experiment=EXPERIMENTS[cell],
            overrides=(f"data.repeats={repeats.model_dump_json()}",),
            abroad=(),
            development=development and number % 2 == 1,
        )


def _by_drive(cell: str) -> Iterator[SplitCase]:
    for number, drive in enumerate(DRIVES[cell]):
        development = number % 2 == 1
        abroad = () if development else ABROAD[cell]
        train = ", ".join(other for other in DRIVES[cell] if other != drive)
        yield SplitCase(
            cell=cell,
            name=f"{cell} without {drive}",
            experiment=EXPERIMENTS[cell],
            overrides=(
                f"data.train=[{train}]",
                "data.valid=[]",
                f"data.test=[{', '.join((drive, *abroad))}]",
                *([f"cell.bpx={OTHER_FILES[drive]}"] if drive in OTHER_FILES else []),
            ),
            abroad=abroad,
            development=development,
        )
