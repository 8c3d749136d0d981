"""Physics fitted without parts of the training drives, and the share of a recalibration that carries over to them.

    a = median_d <e_d, c_d> / |c_d|**2     limited to [0, 1]                                              (1)

e_d is the error of the declared physics on a left-out part d, and c_d the change of the voltage by a recalibration that
was fitted without d. The slope <e_d, c_d> / |c_d|**2 is 1 if the recalibration is right on d, and 0 if it does not
help there. Each deviation of the recalibrated parameters is multiplied by a; for the physics without a part, a is the
median over the other parts. The prior of `recalibrate` allows for noise within drives, and (1) for differences between
drives: on the LG HG2, two drives have errors of opposite signs over a whole discharge, so that a fit to some drives
does not reduce the error of the others. The median is used because physics can fail by volts on a part that it has not
seen, which would dominate a mean.

Effect of a, over the development splits of `aesi bench splits` (16 candidates): reduction of the declared model's
squared error by AESI I, per cent, mean and worst split, with a as in (1) | with a = 1:

    NMC        64.1, 32.4 | 65.3, 32.4
    Panasonic  54.0, 44.9 | 50.9, 41.5
    LG HG2     19.1, 18.3 | 23.9, 22.3

On the HG2 a recalibration makes the left-out drives worse by 14 and 12 %, but these two tests better by 13 and 6 %. The
least-squares slope minus its standard error, as used for a correction (fade.py), gives 0 on two splits of the NMC
drive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from aesi.numerics.typing import Array
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.drives import cuts, training_part
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
from aesi.sparse.search.rows import cut_evenly, spans_of

TrainingDrive = tuple[str, slice]
"""(record, its rows) of a training drive."""


class Piece(NamedTuple):
    """A part of a training drive that is left out.

    drive : index of the training drive.  rows : counted from the first row of that drive.
    """

    drive: int
    rows: slice


@dataclass(frozen=True)
class Pieces:
    """All parts that are left out in turn.

    folds : those of the search (`cuts`).  drives : the whole drives, if the folds are parts of drives; else empty.
    """

    folds: tuple[Piece, ...]
    drives: tuple[Piece, ...]


@dataclass(frozen=True, eq=False)
class TrainingDrives:
    """The records of an experiment, and the rows of them that train.

    drives : in the order of `Split.train`.  roles : role -> records.
    """

    config: ExperimentConfig
    records: Mapping[str, FitRecord]
    drives: Sequence[TrainingDrive]
    roles: Mapping[Role, Sequence[str]]

    @property
    def of_several_records(self) -> bool:
        """Whether the drives are from several records. Each record may then have an initial state of charge of its own,
        also in fits without one of them."""
        return len({name for name, _ in self.drives}) > 1

    def under(self, physics: PhysicsModels, piece: Piece) -> tuple[ErrorSeries, ...]:
        """The error series of `Split.train` under physics that was fitted without the piece."""
        records = self._without(piece)
        if not self.config.data.repeats:
            records = {name: records[name] for name in self.roles["train"]}
        return training_part(self.config.data, series_under(physics, records, self.config)[0], self.roles)

    def left_out(
        self, fitted: PhysicsModels, begins: Callable[[str], None]
    ) -> tuple[PhysicsModels, LeftOutDrives]:
        """(the physics with its recalibration multiplied by the share (1); the training drives under physics without
        each piece in turn).

        fitted : the physics fitted to all training rows.  begins : called with what is begun, in words.
        """
        pieces = self.pieces()
        refits = len(pieces.folds) + len(pieces.drives)
        begins(f"physics refitted {refits} times without a part of the training drives")
        refitted = [self._refitted(fitted, piece) for piece in pieces.folds]
        slopes = np.array([self._slope(*each) for each in zip(refitted, pieces.folds, strict=True)])
        drives = np.array([piece.drive for piece in pieces.folds])
        folds = [
            self._left_out(physics.with_recalibration_share(carried_over(np.delete(slopes, number))), piece)
            for number, (physics, piece) in enumerate(zip(refitted, pieces.folds, strict=True))
        ]
        wholes = [
            self._left_out(
                self._refitted(fitted, whole).with_recalibration_share(
                    carried_over(slopes[drives != whole.drive])
                ),
                whole,
            )
            for whole in pieces.drives
        ]
        return fitted.with_recalibration_share(carried_over(slopes)), LeftOutDrives(
            tuple(folds), tuple(wholes)
        )

    def _left_out(self, physics: PhysicsModels, piece: Piece) -> HeldOutDrive:
        return HeldOutDrive.of(self.under(physics, piece), piece.drive, piece.rows)

    def pieces(self) -> Pieces:
        """The pieces of the training drives that are left out in turn: the samples that the rows of a fold predict. The
        first sample of a drive, which no row predicts, is in its first piece."""
        count = cuts(self.config.data)
        lengths = [rows.stop - rows.start for _, rows in self.drives]
        spans = spans_of([n - 1 for n in lengths])
        return Pieces(
            tuple(
                Piece(drive, slice(0 if a == first else a - first + 1, b - first + 1))
                for drive, (first, last) in enumerate(spans)
                for a, b in cut_evenly(first, last, count)
            ),
            tuple(Piece(drive, slice(0, n)) for drive, n in enumerate(lengths)) if count > 1 else (),
        )

    def as_they_are(self, train: tuple[ErrorSeries, ...]) -> LeftOutDrives:
        """The left-out pieces under the physics that was fitted to all training rows, for a single training drive:
        there is no other drive to fit the physics to without it."""
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
            declared.model,
            fitted,
            own_charges=self.of_several_records,
        )

    def _slope(self, physics: PhysicsModels, piece: Piece) -> float:
        """The slope of (1) on the piece. Only its record is simulated, with the declared and the recalibrated physics.

        Both start from the state of charge that the declared cell reads, so that the slope measures the parameters and
        not a better initial state.
        """
        name, rows = self._rows(piece)
        record, hold = self.records[name], self.config.data.hold
        declared_v, recalibrated_v = (
            physics.by_name[model].run_as_declared(record.measurement, record.soc0, hold).voltage_v[rows]
            for model in (DECLARED, RECALIBRATED)
        )
        return slope_on(record.voltage_v[rows] - declared_v, recalibrated_v - declared_v)

    def _without(self, piece: Piece) -> dict[str, FitRecord]:
        """The records with the rows of the piece closed to fits."""
        return without(self.records, *self._rows(piece))

    def _rows(self, piece: Piece) -> TrainingDrive:
        """The record of a piece, and the rows of the piece in that record."""
        name, rows = self.drives[piece.drive]
        return name, slice(rows.start + piece.rows.start, rows.start + piece.rows.stop)


def series_under(
    physics: PhysicsModels, records: Mapping[str, FitRecord], config: ExperimentConfig
) -> tuple[dict[str, ErrorSeries], list[str]]:
    """(record -> error series of the whole record under the physics; names of the records on which the model runs out
    of lithium or salt)."""
    series: dict[str, ErrorSeries] = {}
    empty = []
    for name, record in records.items():
        whole, ran_empty = physics.series(record, config.data.dt_s, config.data.hold)
        # Inputs are added before the record is cut, since a filtered current depends on the rows before a piece.
        series[name] = with_inputs(whole, config.library.inputs or whole.input_names)
        if ran_empty:
            empty.append(name)
    return series, empty


def slope_on(error: Array, taken_off: Array) -> float:
    """The slope <e, c> / |c|**2 of (1); NaN if the recalibration changes nothing.

    error : e, (n,) V, measured minus declared model.  taken_off : c, (n,) V, recalibrated minus declared model.
    """
    square = float(taken_off @ taken_off)
    return float(error @ taken_off) / square if square > 0.0 else float("nan")


def carried_over(slopes: Array) -> float:
    """The share a of (1); 1 if no part has a slope.  slopes : (n,), NaN where there is none."""
    known = slopes[np.isfinite(slopes)]
    return float(np.clip(np.median(known), 0.0, 1.0)) if len(known) else 1.0
