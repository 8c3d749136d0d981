"""Training drives under physics that has not seen a part of them: what a correction is learnt and judged on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.drives import cuts, parts, training_part
from aesi.pipeline.experiment.physics_models import DECLARED, PhysicsModels, physics_models, without
from aesi.pipeline.experiment.recalibrate import FitRecord
from aesi.records import ErrorSeries, HeldOutDrive, LeftOutDrives, Role
from aesi.sparse import with_inputs

TrainingDrive = tuple[str, slice]
"""Record and rows of a training drive."""


Piece = tuple[int, slice]
"""Place of a training drive, and rows of it."""


@dataclass(frozen=True)
class Pieces:
    """parts : what the search leaves out in turn (`cuts`).  drives : whole drives, where the parts are not these."""

    parts: tuple[Piece, ...]
    drives: tuple[Piece, ...]


@dataclass(frozen=True, eq=False)
class TrainingDrives:
    """The records of an experiment, and which rows of them train."""

    config: ExperimentConfig
    records: Mapping[str, FitRecord]
    drives: Sequence[TrainingDrive]
    roles: Mapping[Role, Sequence[str]]

    def under(self, physics: PhysicsModels) -> tuple[ErrorSeries, ...]:
        """`Split.train` under that physics."""
        records = self.records
        if not self.config.data.repeats:
            records = {name: self.records[name] for name in self.roles["train"]}
        return training_part(self.config.data, series_under(physics, records, self.config)[0], self.roles)

    def left_out(self, fitted: PhysicsModels) -> LeftOutDrives:
        """The training drives under physics that was fitted without each piece in turn.

        fitted : to all training rows."""
        pieces = self.pieces()
        parts, whole = (
            tuple(HeldOutDrive(self.under(self._refitted(fitted, piece)), *piece) for piece in each)
            for each in (pieces.parts, pieces.drives)
        )
        return LeftOutDrives(parts, whole)

    def pieces(self) -> Pieces:
        """What is left out in turn."""
        count = cuts(self.config.data)
        lengths = [rows.stop - rows.start for _, rows in self.drives]
        return Pieces(
            tuple((place, rows) for place, n in enumerate(lengths) for rows in parts(n, count)),
            tuple((place, slice(0, n)) for place, n in enumerate(lengths)) if count > 1 else (),
        )

    def as_they_are(self, train: tuple[ErrorSeries, ...]) -> LeftOutDrives:
        """Under physics that is the same for all: as declared, or of a single drive."""
        pieces = self.pieces()
        made = [
            tuple(HeldOutDrive(train, place, rows) for place, rows in each)
            for each in (pieces.parts, pieces.drives)
        ]
        return LeftOutDrives(made[0], made[1] if len(train) > 1 else ())

    def _refitted(self, fitted: PhysicsModels, piece: Piece) -> PhysicsModels:
        others = without(self.records, *self._rows(piece))
        declared, cell = fitted.by_name[DECLARED], self.config.cell
        return physics_models(
            declared.cell,
            declared.effects,
            others,
            self.config.data.hold,
            cell.start,
            fitted,
            declared.model,
            self.config.data.repeats is not None,
        )

    def _rows(self, piece: Piece) -> TrainingDrive:
        """The record that a piece is of, and its rows there."""
        place, part = piece
        name, rows = self.drives[place]
        return name, slice(rows.start + part.start, rows.start + part.stop)


def series_under(
    physics: PhysicsModels, records: Mapping[str, FitRecord], config: ExperimentConfig
) -> tuple[dict[str, ErrorSeries], list[str]]:
    """Whole records under the physics, and the names of those that run empty there."""
    series: dict[str, ErrorSeries] = {}
    empty = []
    for name, record in records.items():
        whole, ran_empty = physics.series(record.measurement, record.soc0, config.data.dt_s, config.data.hold)
        # Before the record is cut: a filtered current has to know what came before a piece.
        series[name] = with_inputs(whole, config.library.inputs or whole.input_names)
        if ran_empty:
            empty.append(name)
    return series, empty
