"""Data of an experiment: read the records, simulate them with the physics, and cut the voltage errors by role.

The physics model is simulated over each whole record from its first row. A piece that is cut out of the middle
therefore has the states that its history gives it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from aesi.advice import with_keys
from aesi.calibration.records.sizes import sizes_sentence
from aesi.data.resample import DENSE, is_sparse, off_rows, to_even
from aesi.data.virtual import DEFAULT_MIX
from aesi.errors import ConfigError, DataAway, DataError, InputError, SimulationError
from aesi.physics import ActiveEffect, Cell, InitialState, ModelName
from aesi.physics.depletion import RUN_ON
from aesi.physics.effects import activated
from aesi.physics.record_checks import check_measured
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.drives import by_role, cut_short, training_drives
from aesi.pipeline.experiment.left_out import TrainingDrives, series_under
from aesi.pipeline.experiment.physics_models import (
    FREE,
    RECALIBRATED,
    PhysicsModels,
    no_rows,
    physics_models,
)
from aesi.pipeline.experiment.recalibrate import FitRecord, StateSource
from aesi.pipeline.experiment.sources import (
    Sources,
    cell_path,
    check_had,
    check_roles,
    sources_of,
)
from aesi.pipeline.notes import (
    aged_sentences,
    contradiction_sentences,
    seen_names,
    seen_sentences,
    soh_sentences,
    temperature_range_sentences,
    temperature_sentence,
    together,
)
from aesi.pipeline.product.contents import contents
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.product.one_step import LEAST_ROWS
from aesi.records import ErrorSeries, Hold, LeftOutDrives, Measurement, Role, Split, hold_sentence
from aesi.records.steps import after_gap

DFN_NOTE = "The physics is the porous electrode: DFN in tables and figures, where others have ESPM."

TOLD_OFF = 0.05
"""Mean distance of the rows from the even time grid, in steps, above which a note says so. A convention."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """The loaded data of an experiment.

    cell : of the physics that is corrected (`cell.start`).  cell_name : its name in reports.  effects : added to it.
    cells : name of each physics model -> its cell.
    split : error series by role.
    left_out : the training drives under physics that was fitted without a part of one (`cuts`), or without a whole one,
    in turn.
    soc0 : record -> state of charge at its first row, 0 to 1, of the same physics.
    digests : record -> hash of the measured columns.  notes : sentences for the reader of the report on the data, such
    as resampling, dropped rows, a fallback.
    config : the experiment as it is run; with the data and cell of the fallback if `fallback` is not empty.
    fallback : why the fallback is used, one sentence.  model : kind of the physics.  files : hash of the files that
    declare the cell.  held, beside, soh : of the declared model, see `HybridModel`.
    fitted_to : (name, digest) of the records that train or validate, and of those that the declared model was fitted
    to.  seen : names of the test records that the declared model was fitted to.
    """

    cell: Cell
    cell_name: str
    effects: tuple[ActiveEffect, ...]
    split: Split
    left_out: LeftOutDrives
    soc0: dict[str, float]
    digests: dict[str, str]
    notes: tuple[str, ...]
    config: ExperimentConfig
    fallback: str = ""
    model: ModelName = "espm"
    files: str = ""
    cells: Mapping[str, Cell] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    soh: float = 1.0
    fitted_to: tuple[tuple[str, str], ...] = ()
    seen: tuple[str, ...] = ()

    @property
    def setting(self) -> str:
        """Hash of the settings without the seed, of the cell and of the data. Runs that share it differ by chance
        alone."""
        data = "".join(f"|{name} {digest}" for name, digest in sorted(self.digests.items()))
        return hashlib.sha256(f"{self.config.setting}{data}|{self.files}".encode()).hexdigest()[:16]


def load(
    config: ExperimentConfig,
    sources: Sources | None = None,
    begins: Callable[[str], None] = lambda part: None,
) -> Loaded:
    """The data of an experiment: measured minus simulated voltage of each record, by role.

    sources : its records, where they are read already.  begins : called with what is begun, in words: a part of the
    work takes minutes where records are long.

    If the data are not available and the experiment has a `fallback` section, this is used instead; a note says so, and
    the experiment's own note, which is about the named data, is left out. Faults of available data are raised.
    Raises ConfigError or DataError with the file and the remedy.
    """
    check_roles(config)
    try:
        check_had(config)
    except DataError as error:
        if config.fallback is None:
            raise
        fallback = config.on_fallback()
        why = (
            "no copy on this machine and no network"
            if isinstance(error, DataAway)
            else str(error).rstrip(".")
        )
        reason = (
            f"The data set {config.data.set} cannot be had ({why}), so this is the same job on "
            f"{_data_words(fallback)}; it says nothing about the measured cell."
        )
        loaded = _load(fallback, None, begins)
        return replace(loaded, notes=(reason, *loaded.notes), fallback=reason)
    return _load(config, sources, begins)


def check_declared(config: ExperimentConfig) -> None:
    """Raises ConfigError or CellError, before anything is started, for a cell file of the user, or effects of its, that
    cannot be used. A missing file is for `check_there`, or for the fallback."""
    path = config.path(config.cell.bpx)
    if config.cell.bpx != "catalogue" and path.exists():
        _given(config, declared_model(path))


def _given(config: ExperimentConfig, declared: HybridModel) -> HybridModel:
    """The declared model with what the experiment adds to it: effects, state of health, kind of physics."""
    file = declared.with_soh(config.cell.soh)
    return replace(file, effects=(*file.effects, *_effects(config)), model=config.cell.model or file.model)


def _data_words(config: ExperimentConfig) -> str:
    """The data of an experiment in words, for the note on a fallback."""
    if config.data.kind != "virtual":
        return str(config.data.set or config.cell.bpx)
    virtual = config.data.virtual
    effects = DEFAULT_MIX if virtual.effects is None else virtual.effects
    mix = ", ".join(effects) or "nothing added"
    return f"a virtual cell ({virtual.model} of {Path(config.cell.bpx).name} with {mix})"


def _load(config: ExperimentConfig, sources: Sources | None, begins: Callable[[str], None]) -> Loaded:
    path = cell_path(config)
    declared = declared_model(path)
    given = _given(config, declared)
    if sources is None:
        begins("records")
        sources = sources_of(config, path)
    begins("initial states of the records")
    records, starts, grid_notes = _on_grid(config, given, sources)
    training = _training(config, given, records, sources.roles)
    physics, left_out = _physics(given, training, begins)
    begins("errors of the physics and their slopes")
    series, depletion_notes = _series(physics, training)
    split = by_role(config.data, series, sources.roles)
    notes = [
        *given.cell.unread,
        *soh_sentences(declared, config.cell.soh),
        *_declared_sentences(declared, sources),
        *_start_sentences(physics, records, starts, config.data.hold),
        *grid_notes,
        *_repeat_sentences(config, records),
        *_single_drive_sentences(training),
        *_kept_sentences(physics, config),
        *([DFN_NOTE] if given.model == "dfn" else []),
        *depletion_notes,
    ]
    chosen = physics.chosen
    return Loaded(
        cell=chosen.cell,
        cell_name=given.cell.name or path.stem,
        effects=given.effects,
        split=split,
        left_out=left_out or training.as_they_are(split.train),
        soc0={
            name: physics.initial_soc(physics.corrected, record, config.data.hold)[0]
            for name, record in records.items()
        },
        digests={name: measurement.digest for name, measurement in sources.records.items()},
        notes=together(notes, [measurement.name for measurement in sources.records.values()]),
        config=config,
        model=given.model,
        files=_cell_files_digest(path, config),
        cells={name: variant.cell for name, variant in physics.by_name.items()},
        held=given.held,
        beside=given.beside,
        soh=given.soh,
        fitted_to=given.with_fitted(_fitted(sources)).fitted_to,
        seen=seen_names(declared, _judging(sources)),
    )


def _training(
    config: ExperimentConfig,
    given: HybridModel,
    records: Mapping[str, FitRecord],
    roles: Mapping[Role, Sequence[str]],
) -> TrainingDrives:
    """The training drives. In the records, their rows are marked as those that fits may see."""
    drives = training_drives(config.data, records, roles)
    opened = {
        name: records[name].with_resampling_change(given.physics, config.data.hold) for name, _ in drives
    }
    for name, rows in drives:
        opened[name].rows[rows] = True
    return TrainingDrives(config, {**records, **opened}, drives, roles)


def _declared_sentences(declared: HybridModel, sources: Sources) -> list[str]:
    """Sentences on a correction of the saved model that is declared, and on test records that it, or the cell's file,
    was fitted to."""
    said = []
    if declared.correction is not None:
        said.append(
            "the saved model's learnt correction is left out: what is declared is its cell with its effects."
        )
    return [*said, *seen_sentences(declared, _judging(sources))]


def _judging(sources: Sources) -> list[Measurement]:
    """The records with test rows; `data.record` has training rows as well."""
    return [sources.records[name] for name in sources.roles["test"] or sources.records]


def _fitted(sources: Sources) -> list[Measurement]:
    """The records with rows that a model is fitted to, or chosen by."""
    named = {*sources.roles["train"], *sources.roles["valid"]} or sources.records
    return [record for name, record in sources.records.items() if name in named]


def _start_sentences(
    physics: PhysicsModels, records: Mapping[str, FitRecord], starts: Mapping[str, InitialState], hold: Hold
) -> list[str]:
    """A sentence on the initial state of charge of each record under the physics.

    starts : the initial states that the declared cell reads.
    """
    own = {name: physics.own_reading(physics.corrected, record, hold) for name, record in records.items()}
    return [with_keys((own[name] or start).sentence) for name, start in starts.items()]


def _repeat_sentences(config: ExperimentConfig, records: Mapping[str, FitRecord]) -> list[str]:
    """Sentences on the repeats that are incomplete because the record ends in them (`cut_short`)."""
    if config.data.repeats is None:
        return []
    (cut,) = records.values()
    return cut_short(cut.measurement.time_s, config.data.repeats)


def _single_drive_sentences(training: TrainingDrives) -> list[str]:
    """A sentence on the calibration of fitted physics if there is a single training drive; else empty."""
    config = training.config
    fitted = config.cell.start == "recalibrated" or set(config.models) & set(FREE)
    if len(training.drives) > 1 or not fitted:
        return []
    return [
        "One drive trains, so that the physics fitted to it has seen the rows on which its intervals and bands are "
        "calibrated: they may come out too narrow, also around a correction of it; a second drive, or a second repeat, "
        "has them calibrated on what was left out."
    ]


def _kept_sentences(physics: PhysicsModels, config: ExperimentConfig) -> list[str]:
    """A sentence on the share of the recalibration that is kept (left_out.py) if it is not all of it; empty if no model
    of the experiment is recalibrated."""
    share = physics.recalibration_share
    if share == 1.0 or (config.cell.start != "recalibrated" and RECALIBRATED not in config.models):
        return []
    if share == 0.0:
        return [
            "None of the recalibration is kept, so that the recalibrated model is the declared one: a recalibration "
            "without a part of the training drives does not make the error on that part smaller (in the median of the "
            "parts, each left out in turn)."
        ]
    return [
        f"Of each change of the recalibration {100.0 * share:.2g} % is kept: so much carries over to a part of the "
        "training drives that it was fitted without (in the median of the parts, each left out in turn)."
    ]


def _physics(
    given: HybridModel, training: TrainingDrives, begins: Callable[[str], None]
) -> tuple[PhysicsModels, LeftOutDrives | None]:
    """(the physics models; the training drives under physics that has not seen them). The second is None for a single
    training drive, since no other is left to fit to.

    Fits are also made if the declared cell is corrected, because the fitted models stand in the tables beside it.
    """
    config = training.config
    begins("physics fitted to the training records")
    physics = physics_models(
        given.cell,
        given.effects,
        training.records,
        config.data.hold,
        config.cell.start,
        given.model,
        own_charges=training.of_several_records,
    )
    if len(training.drives) > 1:
        return training.left_out(physics, begins)
    return physics, None


def _series(physics: PhysicsModels, training: TrainingDrives) -> tuple[dict[str, ErrorSeries], list[str]]:
    """(record -> its error series under the physics, with slopes; a sentence on each test record on which the model
    runs out of lithium or salt).

    Raises SimulationError if the model runs out on a record that trains or validates.
    """
    records, hold = training.records, training.config.data.hold
    series, depleted = series_under(physics, records, training.config)
    for name, record in records.items():
        series[name] = physics.with_slopes(series[name], record, hold)
    for name in depleted:
        if name not in training.roles["test"]:
            _raise_depletion(physics, name, records[name], hold)
    return series, [
        f"{name} runs empty in the model; its kinetics were held at the edge from there on."
        for name in depleted
    ]


def _cell_files_digest(cell: Path, config: ExperimentConfig) -> str:
    """Hash of the contents of the cell file, or saved model, and of the user's own effect files, since a file that is
    edited keeps its name."""
    sha = hashlib.sha256()
    for held in contents([cell, *(config.path(name) for name in config.cell.effect_files)]):
        sha.update(hashlib.sha256(held).digest())
    return sha.hexdigest()[:16]


def _on_grid(
    config: ExperimentConfig, given: HybridModel, sources: Sources
) -> tuple[dict[str, FitRecord], dict[str, InitialState], list[str]]:
    """(records on an even time grid, with no row open to fits yet; their initial states by the declared cell; sentences
    on what was assumed about them and done to them).

    Raises DataError if a record cannot be of the cell.
    """
    cell, data = given.cell, config.data
    judging = set(sources.roles["test"]) - {*sources.roles["train"], *sources.roles["valid"]}
    records: dict[str, FitRecord] = {}
    starts: dict[str, InitialState] = {}
    notes: list[str] = []
    for name, measurement in sources.records.items():
        try:
            check_measured(cell, [measurement])
        except DataError as error:
            raise DataError(with_keys(str(error))) from None
        own_soc0 = sources.soc0.get(name) if config.cell.soc0 is None else None
        given_soc0 = config.cell.soc0 if own_soc0 is None else own_soc0
        state_source = StateSource(measurement, given_soc0, own_soc0 is None and len(sources.records) > 1)
        start = starts[name] = state_source.initial_state(cell, given.effects, data.hold, given.model)
        held = hold_sentence(measurement.name, data.hold, data.declared_hold is not None, "data.hold: {}")
        # Resampling comes first, since it refuses a time step that would make too many rows, or none.
        even = to_even(measurement, data.dt_s, data.hold)
        if name in judging and len(even) < LEAST_ROWS:
            raise DataError(
                f"{measurement.name} has {len(even)} steps of {data.dt_s:g} s (data.dt_s), and a test record needs "
                f"{LEAST_ROWS}: give a longer one under data.test."
            )
        sampled = _sampling_sentences(measurement, even, data.dt_s, judges=name in judging)
        notes += [
            held,
            *sampled,
            with_keys(temperature_sentence(cell, measurement, given.effects)),
            *map(with_keys, aged_sentences(cell, measurement, start, config.cell.soh)),
            *map(with_keys, contradiction_sentences(given, measurement, start.soc, data.hold)),
            *map(with_keys, even.notes),
        ]
        records[name] = no_rows(even, start.soc, start.read_sd, state_source)
    measured = list(sources.records.values())
    notes += filter(None, [sizes_sentence(cell, measured, cell.capacity_ah)])
    notes += temperature_range_sentences(cell, (m.temperature_degc for m in measured), given.effects)
    return records, starts, notes


def _sampling_sentences(
    measurement: Measurement, even: Measurement, dt_s: float, *, judges: bool
) -> list[str]:
    """A sentence on a record whose rows had to be resampled to the even time grid; else empty.

    dt_s : s, step of the grid.  judges : whether it is a test record, whose free run needs no dense voltage.
    Raises DataError for any other record whose rows are so far apart that most voltages would be interpolated.
    """
    time_s = measurement.time_s
    apart_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else dt_s
    if is_sparse(time_s, measurement.current_a, dt_s) and not judges:
        raise DataError(
            f"{measurement.name}: its rows are {apart_s:g} s apart and data.dt_s is {dt_s:g} s, so that most of what "
            f"is fitted and judged would be filled in between rows; give data.dt_s: {apart_s:g}, or a record of "
            "denser rows."
        )
    if apart_s < DENSE * dt_s:
        of_what = "averages over a step, about which single rows scatter more"
    elif off_rows(time_s, even.time_s) > TOLD_OFF:
        of_what = "voltages filled in between rows, which scatter less than rows do"
    else:
        return []
    ahead = int(np.count_nonzero(~after_gap(time_s, dt_s)[1:]))
    one_step = "one step ahead they are of rows as measured"
    if ahead < LEAST_ROWS:
        one_step = (
            f"one step ahead, {ahead} rows lie a step after another one, and figures need {LEAST_ROWS} such rows of "
            "all test records"
        )
    return [
        f"{measurement.name}: the rows do not lie every {dt_s:g} s. In free run, errors and bands are of {of_what}; "
        f"{one_step}."
    ]


def _raise_depletion(physics: PhysicsModels, name: str, record: FitRecord, hold: Hold) -> None:
    """Raises the SimulationError of a record on which the model runs out of lithium or salt, with the name of the
    record and the remedies that an experiment has."""
    chosen = physics.chosen
    try:
        for data in (record.logged, record.measurement):
            chosen.run(data, physics.initial_soc(physics.corrected, record, hold)[0], hold, "raise")
    except SimulationError as error:
        raise SimulationError(
            f"{Path(name).name}: {str(error).removesuffix(RUN_ON)}, or end the file before that, or give it as a test, "
            "where kinetics are held at the edge from there on."
        ) from error


def _effects(config: ExperimentConfig) -> tuple[ActiveEffect, ...]:
    """The effects of `cell.effects`, from the catalogue and the user's files.  Raises ConfigError for an unknown
    one."""
    files = [config.path(name) for name in config.cell.effect_files]
    try:
        return activated(config.cell.effects.items(), files)
    except InputError as error:
        raise ConfigError(f"{config.name}: cell: {error}") from None
