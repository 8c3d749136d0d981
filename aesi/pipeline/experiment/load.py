"""From an experiment's data section to error series by role: measure, simulate, subtract, cut.

The physics model runs over each whole record from its own start, so that a piece cut out of the middle keeps
the states that its history gave it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aesi.data.read import read
from aesi.data.resample import to_even
from aesi.data.virtual import DEFAULT_MIX
from aesi.errors import ConfigError, DataAway, DataError, InputError
from aesi.physics import ActiveEffect, Cell, ModelName, initial_state, simulate
from aesi.physics.effects import activated
from aesi.pipeline.belonging import check_belongs
from aesi.pipeline.experiment.config import NO_ROLES, ExperimentConfig
from aesi.pipeline.experiment.physics_models import DECLARED, PhysicsModels, no_rows, physics_models, without
from aesi.pipeline.experiment.recalibrate import FitRecord
from aesi.pipeline.experiment.sections import DataConfig, RepeatsConfig
from aesi.pipeline.product.declared import declared_model
from aesi.records import ROLES, ErrorSeries, HeldOutDrive, Hold, Measurement, Role, Split
from aesi.sparse import with_inputs

if TYPE_CHECKING:
    from aesi.data.virtual import VirtualExperiment


DFN_NOTE = "The physics is the porous electrode: DFN in tables and figures, where others have ESPM."


@dataclass(frozen=True, eq=False)
class Loaded:
    """What an experiment works on.

    config : the experiment as it is run, with data and cell of the fallback where `fallback` says why.
    digests : record name -> content hash of what was measured.  notes : what a reader of the report should know
    about the data: resampling, dropped rows, a fallback.  soc0 : state of charge at the first row, by record.
    cell, soc0 : of the physics that is corrected (`cell.start`).  left_out : for each part of the training drives that
    is left out in turn (`cuts`), its drive under physics that was fitted to all the others.
    """

    cell: Cell
    cell_name: str
    effects: tuple[ActiveEffect, ...]
    split: Split
    left_out: tuple[HeldOutDrive, ...]
    soc0: dict[str, float]
    digests: dict[str, str]
    notes: tuple[str, ...]
    config: ExperimentConfig
    fallback: str = ""
    model: ModelName = "espm"

    @property
    def setting(self) -> str:
        """Hash of what was run and on which data, without the seed: runs that share it differ by chance alone."""
        data = "".join(f"|{name} {digest}" for name, digest in sorted(self.digests.items()))
        return hashlib.sha256(f"{self.config.setting}{data}".encode()).hexdigest()[:16]


def load(config: ExperimentConfig) -> Loaded:
    """Measurements, simulated and subtracted, by role.

    Raises ConfigError or DataError naming the file and what to do; with a `fallback` section, data that cannot be
    had are replaced by it and a note says so.
    """
    if not config.data.has_roles:
        raise ConfigError(f"{config.name}: data: {NO_ROLES}; as it is, it is for `aesi discover` alone.")
    try:
        return _load(config)
    except DataError as error:
        if config.fallback is None or config.data.kind != "catalogue":
            raise
        fallback = config.model_copy(
            update={"data": config.fallback.data, "cell": config.fallback.cell, "fallback": None}
        )
        why = (
            "no copy on this machine and no network"
            if isinstance(error, DataAway)
            else str(error).rstrip(".")
        )
        reason = (
            f"The data set {config.data.set} cannot be had ({why}), so this is the same job on {_called(fallback)}; "
            "it says nothing about the measured cell."
        )
        loaded = _load(fallback)
        return replace(loaded, notes=(reason, *loaded.notes), fallback=reason)


def _called(config: ExperimentConfig) -> str:
    """What the data of an experiment are, as a person says it."""
    if config.data.kind != "virtual":
        return str(config.data.set or config.cell.bpx)
    virtual = config.data.virtual
    effects = DEFAULT_MIX if virtual.effects is None else virtual.effects
    mix = ", ".join(effects) or "nothing added"
    return f"a virtual cell ({virtual.model} of {Path(config.cell.bpx).name} with {mix})"


def cut_repeats(series: ErrorSeries, repeats: RepeatsConfig) -> Split:
    """Pieces of a record that repeats a schedule; each training repeat gives its last share to validation."""
    train, valid = [], []
    for number in repeats.train:
        piece = _repeat(series, repeats.period_s, number)
        cut = round(len(piece) * (1 - repeats.valid_share))
        train.append(piece.take(slice(0, cut)))
        if cut < len(piece):
            valid.append(piece.take(slice(cut, len(piece)), f"{piece.name}, end"))
    test = [_repeat(series, repeats.period_s, number) for number in repeats.test]
    return Split(tuple(train), tuple(valid), tuple(test))


def _repeat(series: ErrorSeries, period_s: float, number: int) -> ErrorSeries:
    start = series.time_s[0] + (number - 1) * period_s
    low, high = np.searchsorted(series.time_s, [start, start + period_s])
    if high - low < 2:
        raise DataError(
            f"{series.name} lasts {series.time_s[-1] - series.time_s[0]:.0f} s and has no repeat {number} of "
            f"{period_s:g} s; take it out of `repeats`."
        )
    return series.take(slice(int(low), int(high)), f"repeat {number}")


def _load(config: ExperimentConfig) -> Loaded:
    path = cell_path(config)
    given = declared_model(path)
    cell, effects = given.cell, (*given.effects, *_effects(config))
    model = config.cell.model or given.model
    sources = _virtual(config, path) if config.data.kind == "virtual" else _sources(config)
    soc0: dict[str, float] = {}
    notes: list[str] = []
    records: dict[str, FitRecord] = {}
    for name, (measurement, known_soc0) in sources.records.items():
        check_belongs(cell, [measurement])
        declared = known_soc0 if config.cell.soc0 is None else config.cell.soc0
        start = initial_state(cell, measurement, declared, config.data.hold, effects, model=model)
        soc0[name] = start.soc
        notes.append(start.sentence)
        even = to_even(measurement, config.data.dt_s)
        notes.extend(even.notes)
        records[name] = no_rows(even, start.soc)
    drives = _training_drives(config.data, records, sources.roles)
    for name, rows in drives:
        records[name].rows[rows] = True
    hold = config.data.hold
    physics = physics_models(cell, effects, records, hold, config.cell.start, model=model)
    if model == "dfn":
        notes.append(DFN_NOTE)
    series, empty = _series(physics, records, config)
    for name in empty:
        if name not in sources.roles["test"]:
            _refuse(physics, records[name], hold)
        notes.append(
            f"{name} runs empty in the model; its stoichiometries were held at the edge from there on."
        )
    split = _split(config.data, series, sources.roles)
    refitted = config.cell.start == "recalibrated" and len(drives) > 1
    left_out = tuple(
        HeldOutDrive(_without(config, physics, records, drive, rows, piece.name) if refitted else piece, rows)
        for drive, piece in zip(drives, split.train, strict=True)
        for rows in _parts(len(piece), cuts(config.data))
    )
    chosen = physics.chosen
    return Loaded(
        cell=chosen.cell,
        cell_name=cell.name or path.stem,
        effects=effects,
        split=split,
        left_out=left_out,
        soc0={name: chosen.soc0(each) for name, each in soc0.items()},
        digests={name: measurement.digest for name, (measurement, _) in sources.records.items()},
        notes=tuple(notes),
        config=config,
        model=model,
    )


def _series(
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


def _refuse(physics: PhysicsModels, record: FitRecord, hold: Hold) -> None:
    """Raise what a simulation that may not run empty says."""
    chosen, data = physics.chosen, record.measurement
    simulate(
        chosen.cell,
        data.time_s,
        data.current_a,
        chosen.soc0(record.soc0),
        chosen.effects,
        data.temperature_degc,
        hold,
        model=chosen.model,
    )


def _training_drives(
    data: DataConfig, records: Mapping[str, FitRecord], roles: Mapping[Role, Sequence[str]]
) -> list[tuple[str, slice]]:
    """Record and rows of each training drive, in the order of `Split.train`."""
    if data.repeats is None:
        return [(name, slice(0, len(records[name].rows))) for name in roles["train"]]
    (name, record), repeats = next(iter(records.items())), data.repeats
    time = record.measurement.time_s
    drives = []
    for number in repeats.train:
        begin = time[0] + (number - 1) * repeats.period_s
        low, high = np.searchsorted(time, [begin, begin + repeats.period_s])
        drives.append((name, slice(int(low), int(low + round((high - low) * (1 - repeats.valid_share))))))
    return drives


def cuts(data: DataConfig) -> int:
    """Into how many parts a training drive is cut to be left out in turn.

    Repeats of one record lie side by side in the state of charge. A test repeat lies between two of training, half a
    repeat from either at most, and so does half a repeat from its other half; without a whole one, three repeats are
    missing in a row, which asks for more than the test.
    """
    return 2 if data.repeats is not None else 1


def _parts(n: int, count: int) -> list[slice]:
    edges = np.linspace(0, n, count + 1).round().astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _without(
    config: ExperimentConfig,
    fitted: PhysicsModels,
    records: Mapping[str, FitRecord],
    drive: tuple[str, slice],
    part: slice,
    called: str,
) -> ErrorSeries:
    """A training drive under physics that was fitted to all but a part of it; `fitted` was fitted to that as well."""
    name, rows = drive
    unseen = slice(rows.start + part.start, rows.start + part.stop)
    others = without(records, name, unseen)
    declared = fitted.by_name[DECLARED]
    physics = physics_models(
        declared.cell, declared.effects, others, config.data.hold, config.cell.start, fitted, declared.model
    )
    series, _ = _series(physics, {name: records[name]}, config)
    return series[name].take(rows, called)


@dataclass(frozen=True, eq=False)
class _Sources:
    """Every record once, with its state of charge at the start where that is known; and names by role."""

    records: dict[str, tuple[Measurement, float | None]]
    roles: dict[Role, tuple[str, ...]]


def _sources(config: ExperimentConfig) -> _Sources:
    data = config.data
    where = locator(config)
    roles: dict[Role, tuple[str, ...]] = {role: getattr(data, role) for role in ROLES}
    names = (data.record,) if data.record else tuple(name for role in ROLES for name in roles[role])
    records: dict[str, tuple[Measurement, float | None]] = {
        name: (read(where(name), data.reading), None) for name in dict.fromkeys(names)
    }
    return _Sources(records, roles)


def virtual_experiment(config: ExperimentConfig, cell: Path) -> VirtualExperiment:
    """The records of kind: virtual, made by the laboratory from the cell file, or found in its cache."""
    from aesi.data.virtual import Laboratory, paper_experiment

    wanted = config.data.virtual
    effects = DEFAULT_MIX if wanted.effects is None else wanted.effects
    laboratory = Laboratory(cell, wanted.model, effects, wanted.magnitude, seed=wanted.seed)
    return paper_experiment(laboratory, config.data.dt_s, wanted.pulse_c, wanted.other_load)


def _virtual(config: ExperimentConfig, cell: Path) -> _Sources:
    experiment = virtual_experiment(config, cell)
    measurements: dict[Role, tuple[Measurement, ...]] = {role: getattr(experiment, role) for role in ROLES}
    return _Sources(
        records={m.name: (m, experiment.soc0[m.name]) for role in ROLES for m in measurements[role]},
        roles={role: tuple(m.name for m in measurements[role]) for role in ROLES},
    )


def _split(data: DataConfig, series: dict[str, ErrorSeries], roles: dict[Role, tuple[str, ...]]) -> Split:
    if data.repeats:
        return cut_repeats(next(iter(series.values())), data.repeats)
    train, valid, test = (tuple(series[name] for name in roles[role]) for role in ROLES)
    return Split(train, valid, test)


def _effects(config: ExperimentConfig) -> tuple[ActiveEffect, ...]:
    files = [config.path(name) for name in config.cell.effect_files]
    try:
        return activated(config.cell.effects.items(), files)
    except InputError as error:
        raise ConfigError(f"{config.name}: cell: {error}") from None


def cell_path(config: ExperimentConfig) -> Path:
    """The BPX file of the experiment's cell. Raises ConfigError or DataError where there is none."""
    if config.cell.bpx != "catalogue":
        return config.path(config.cell.bpx)
    from aesi.data.catalogue import locate

    if config.data.set is None:
        raise ConfigError("cell.bpx: catalogue needs data.set; give the path of a BPX file.")
    return locate(config.data.set, "cell.bpx.json")


def locator(config: ExperimentConfig) -> Callable[[str], Path]:
    """Finds the file of a record by its name in the experiment."""
    if config.data.kind == "files":
        return config.path
    from aesi.data.catalogue import locate

    assert config.data.set is not None  # the schema of kind: catalogue
    return partial(locate, config.data.set)
