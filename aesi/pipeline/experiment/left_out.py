"""Training drives under physics that has not seen a part of them, and how much of a recalibration carries over to it.

    a = median_d <e_d, c_d> / |c_d|**2     within [0, 1]                                                  (1)

e_d is what the declared physics leaves of a left-out part d, c_d what a recalibration without d takes off it. Each
deviation of the recalibrated physics is multiplied by a; for the physics without a part, a comes from the other parts.
The prior of `recalibrate` allows for noise within drives, (1) for what differs between them: on the LG HG2 two drives
err with opposite signs over a whole discharge, and what is fitted to some takes nothing off the others.
A median, since physics that runs a part it has not seen into volts would set a mean for all.

Over the development splits of `aesi bench splits` (16 candidates; per cent taken off the declared model's squared error
by AESI I, mean and worst), with it and with a recalibration kept whole: NMC 64.1, 32.4 and 65.3, 32.4; Panasonic 54.0,
44.9 and 50.9, 41.5; LG HG2 19.1, 18.3 and 23.9, 22.3, where left-out drives are 14 and 12 % worse for a recalibration
and these two tests 13 and 6 % better. The least-squares slope less its standard error, as for a correction (fade.py),
takes all off two splits of the NMC drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aesi.numerics.typing import Array
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.drives import cuts, parts, training_part
from aesi.pipeline.experiment.physics_models import (
    DECLARED,
    RECALIBRATED,
    PhysicsModels,
    physics_models,
    without,
)
from aesi.pipeline.experiment.recalibrate import FitRecord
from aesi.records import ErrorSeries, HeldOutDrive, LeftOutDrives, Role
from aesi.sparse import with_inputs

TrainingDrive = tuple[str, slice]
"""Record and rows of a training drive."""


class Piece(NamedTuple):
    """drive : place of a training drive among them.  rows : of that drive."""

    drive: int
    rows: slice


@dataclass(frozen=True)
class Pieces:
    """folds : what the search leaves out in turn (`cuts`).  drives : whole drives, where the folds are not these."""

    folds: tuple[Piece, ...]
    drives: tuple[Piece, ...]


@dataclass(frozen=True, eq=False)
class TrainingDrives:
    """The records of an experiment, and which rows of them train."""

    config: ExperimentConfig
    records: Mapping[str, FitRecord]
    drives: Sequence[TrainingDrive]
    roles: Mapping[Role, Sequence[str]]

    @property
    def of_several_records(self) -> bool:
        """Whether the drives are of several records. Each record then has a charge of its own, also where one is
        left out."""
        return len({name for name, _ in self.drives}) > 1

    def under(self, physics: PhysicsModels, piece: Piece) -> tuple[ErrorSeries, ...]:
        """`Split.train` under physics that was fitted without the piece."""
        records = self._without(piece)
        if not self.config.data.repeats:
            records = {name: records[name] for name in self.roles["train"]}
        return training_part(self.config.data, series_under(physics, records, self.config)[0], self.roles)

    def left_out(self, fitted: PhysicsModels) -> tuple[PhysicsModels, LeftOutDrives]:
        """The share of the recalibrated physics that carries over, and the training drives under physics without each
        piece in turn.

        fitted : to all training rows.
        """
        pieces = self.pieces()
        refitted = [self._refitted(fitted, piece) for piece in pieces.folds]
        slopes = np.array([self._slope(*each) for each in zip(refitted, pieces.folds, strict=True)])
        drives = np.array([piece.drive for piece in pieces.folds])
        folds = [
            self._left_out(physics.carried(carried_over(np.delete(slopes, number))), piece)
            for number, (physics, piece) in enumerate(zip(refitted, pieces.folds, strict=True))
        ]
        wholes = [
            self._left_out(
                self._refitted(fitted, whole).carried(carried_over(slopes[drives != whole.drive])), whole
            )
            for whole in pieces.drives
        ]
        return fitted.carried(carried_over(slopes)), LeftOutDrives(tuple(folds), tuple(wholes))

    def _left_out(self, physics: PhysicsModels, piece: Piece) -> HeldOutDrive:
        return HeldOutDrive.of(self.under(physics, piece), piece.drive, piece.rows)

    def pieces(self) -> Pieces:
        """The pieces that are left out in turn."""
        count = cuts(self.config.data)
        lengths = [rows.stop - rows.start for _, rows in self.drives]
        return Pieces(
            tuple(Piece(drive, rows) for drive, n in enumerate(lengths) for rows in parts(n, count)),
            tuple(Piece(drive, slice(0, n)) for drive, n in enumerate(lengths)) if count > 1 else (),
        )

    def as_they_are(self, train: tuple[ErrorSeries, ...]) -> LeftOutDrives:
        """The training drives under the physics that was fitted to all of them, which a single one leaves no other."""
        pieces = self.pieces()
        made = [
            tuple(HeldOutDrive.of(train, piece.drive, piece.rows) for piece in each)
            for each in (pieces.folds, pieces.drives)
        ]
        return LeftOutDrives(made[0], made[1] if len(train) > 1 else ())

    def _refitted(self, fitted: PhysicsModels, piece: Piece) -> PhysicsModels:
        others = self._without(piece)
        declared, cell = fitted.by_name[DECLARED], self.config.cell
        return physics_models(
            declared.cell,
            declared.effects,
            others,
            self.config.data.hold,
            cell.start,
            fitted,
            declared.model,
            own_charges=self.of_several_records,
        )

    def _slope(self, physics: PhysicsModels, piece: Piece) -> float:
        """`slope_on` the piece; only the one record, under the two models that it takes, is simulated.

        Both start by the declared cell's reading: what parameters take off is asked, not what a better start does.
        """
        name, rows = self._rows(piece)
        record, hold = self.records[name], self.config.data.hold
        declared_v, recalibrated_v = (
            physics.by_name[model].simulate(record.measurement, record.soc0, hold).voltage_v[rows]
            for model in (DECLARED, RECALIBRATED)
        )
        return slope_on(record.voltage_v[rows] - declared_v, recalibrated_v - declared_v)

    def _without(self, piece: Piece) -> dict[str, FitRecord]:
        """The records as a fit without the piece sees them."""
        return without(self.records, *self._rows(piece))

    def _rows(self, piece: Piece) -> TrainingDrive:
        """The record that a piece is of, and its rows there."""
        name, rows = self.drives[piece.drive]
        return name, slice(rows.start + piece.rows.start, rows.start + piece.rows.stop)


def series_under(
    physics: PhysicsModels, records: Mapping[str, FitRecord], config: ExperimentConfig
) -> tuple[dict[str, ErrorSeries], list[str]]:
    """Whole records under the physics, and the names of those that run empty there."""
    series: dict[str, ErrorSeries] = {}
    empty = []
    for name, record in records.items():
        whole, ran_empty = physics.series(record, config.data.dt_s, config.data.hold)
        # Before the record is cut: a filtered current has to know what came before a piece.
        series[name] = with_inputs(whole, config.library.inputs or whole.input_names)
        if ran_empty:
            empty.append(name)
    return series, empty


def slope_on(error: Array, taken_off: Array) -> float:
    """<e, c> / |c|**2 of (1), both (n,) V; NaN where the recalibration changes nothing."""
    square = float(taken_off @ taken_off)
    return float(error @ taken_off) / square if square > 0.0 else float("nan")


def carried_over(slopes: Array) -> float:
    """a of (1); 1 where no part can tell."""
    known = slopes[np.isfinite(slopes)]
    return float(np.clip(np.median(known), 0.0, 1.0)) if len(known) else 1.0
