"""Sources of an experiment: its records, from files, the catalogue or the virtual laboratory, and its cell file."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aesi.advice import with_keys
from aesi.data.read import Reading, read
from aesi.data.reading import record_names
from aesi.data.virtual import DEFAULT_MIX
from aesi.errors import ConfigError, DataError, did_you_mean
from aesi.pipeline.distinct import check_distinct
from aesi.pipeline.experiment.config import NO_ROLES, ExperimentConfig
from aesi.pipeline.experiment.sections import DiscoverConfig, FallbackConfig
from aesi.records import ROLES, Measurement, Role

if TYPE_CHECKING:
    from aesi.data.virtual import VirtualExperiment


@dataclass(frozen=True, eq=False)
class Sources:
    """The records of an experiment.

    records : name -> record.  roles : role -> names of records.  soc0 : name -> state of charge at the first row, of
    the records of which it is known: those of a virtual cell.
    """

    records: dict[str, Measurement]
    roles: dict[Role, tuple[str, ...]]
    soc0: dict[str, float] = field(default_factory=dict)


def sources_of(config: ExperimentConfig, cell: Path) -> Sources:
    """The records that the experiment names.

    cell : the BPX file from which virtual records are simulated.
    Raises DataError if two records have rows in common.
    """
    if config.data.kind == "virtual":
        return _virtual(config, cell)
    data = config.data
    where = _locator(config)
    roles: dict[Role, tuple[str, ...]] = {role: getattr(data, role) for role in ROLES}
    records = {
        name: _record(path, data.reading(name), record_name).begun_at(config.cell.soc0_of.get(name))
        for name, (path, record_name) in _files_and_names(where, data.listed).items()
    }
    train, valid, test = ([records[name] for name in roles[role]] for role in ROLES)
    check_distinct([*train, *valid], test)
    return Sources(records, roles)


def check_roles(config: ExperimentConfig) -> None:
    """Raises ConfigError if the experiment has no training or no test records."""
    if not config.data.has_roles:
        raise ConfigError(f"{config.name}: data: {NO_ROLES}; as it is, it is for `aesi discover` alone.")


def named_files(config: ExperimentConfig) -> dict[str, Path]:
    """Key of the experiment file -> file, or folder of a saved model, of the user that it and its fallback name. Files
    of the catalogue are not included."""
    names = _named(config)
    if config.fallback is not None:
        names |= {f"fallback: {key}": name for key, name in _named(config.fallback).items()}
    return {key: config.path(name) for key, name in names.items()}


def _named(sections: ExperimentConfig | FallbackConfig) -> dict[str, str]:
    """`named_files` of one cell and its data, with the paths as written."""
    cell, data = sections.cell, sections.data
    names = {} if cell.bpx == "catalogue" else {"cell": cell.bpx}
    names |= {f"cell: effect_files: {name}": name for name in cell.effect_files}
    if data.kind == "files":
        names |= {f"data: {name}": name for name in data.listed}
    return names


def check_had(config: ExperimentConfig) -> None:
    """Raises DataError if a file of the catalogue that the experiment names is not available."""
    if config.data.kind == "catalogue":
        catalogue_files(config)


def catalogue_files(config: ExperimentConfig) -> list[Path]:
    """The files of the catalogue that an experiment uses: its records, then the cell. Missing ones are fetched.

    Raises ConfigError or DataError if one is not available.
    """
    where = _locator(config)
    records = config.data.listed if config.data.kind == "catalogue" else ()
    cell = [cell_path(config)] if config.cell.bpx == "catalogue" else []
    return [*(where(name) for name in records), *cell]


def check_there(config: ExperimentConfig) -> None:
    """Raises ConfigError, with the nearest name, for a missing file of the user that the experiment names. The check
    runs before anything is started. Files of a fallback are checked when it is used."""
    for what, name in _named(config).items():
        path = config.path(name)
        if not path.exists() and not (what == "cell" and config.fallback):
            beside = [other.name for other in path.parent.iterdir()] if path.parent.is_dir() else []
            raise ConfigError(
                f"{config.name}: {what}: there is no file {path}{did_you_mean(path.name, beside)}"
            )


def discovery_records(
    config: ExperimentConfig, wanted: DiscoverConfig, cell: Path
) -> tuple[tuple[Measurement, ...], tuple[Measurement, ...], tuple[Measurement, ...]]:
    """(records that are searched, test records, known-good records) of a discovery; of a virtual cell its training and
    test records.

    wanted : the section `discover`.  cell : the BPX file from which virtual records are simulated.
    """
    if config.data.kind == "virtual":
        experiment = virtual_experiment(config, cell)
        stop_s = math.inf if wanted.until_s is None else wanted.until_s
        ends = (int(np.searchsorted(test.time_s, stop_s, side="right")) for test in experiment.test)
        cut = (test.take(slice(end)) for test, end in zip(experiment.test, ends, strict=True))
        return experiment.train, tuple(cut), ()
    placed = _files_and_names(_locator(config), (*wanted.fit, *wanted.test, *wanted.good))
    hold = wanted.hold or config.data.declared_hold

    def record(name: str, until_s: float | None) -> Measurement:
        path, record_name = placed[name]
        reading = config.data.reading(name)
        ends_s = [end_s for end_s in (reading.stop_s, until_s) if end_s is not None]
        whole = _record(path, reading.but(stop_s=min(ends_s, default=None)), record_name)
        return whole.held(hold).begun_at(config.cell.soc0_of.get(name))

    return (
        tuple(record(name, wanted.fit_until_s.get(name)) for name in wanted.fit),
        tuple(record(name, wanted.until_s) for name in wanted.test),
        tuple(record(name, None) for name in wanted.good),
    )


def virtual_experiment(config: ExperimentConfig, cell: Path) -> VirtualExperiment:
    """The records of `data.kind: virtual`, simulated by the laboratory from the cell file or taken from its cache."""
    from aesi.data.virtual import Laboratory, paper_experiment

    wanted = config.data.virtual
    effects = DEFAULT_MIX if wanted.effects is None else wanted.effects
    laboratory = Laboratory(
        cell,
        wanted.model,
        effects,
        wanted.magnitude,
        wanted.values,
        thermocouple=wanted.thermocouple,
        seed=wanted.seed,
    )
    return paper_experiment(laboratory, config.data.dt_s, wanted.pulse_c, wanted.other_load)


def _virtual(config: ExperimentConfig, cell: Path) -> Sources:
    experiment = virtual_experiment(config, cell)
    measurements: dict[Role, tuple[Measurement, ...]] = {role: getattr(experiment, role) for role in ROLES}
    return Sources(
        records={m.name: m for role in ROLES for m in measurements[role]},
        roles={role: tuple(m.name for m in measurements[role]) for role in ROLES},
        soc0=experiment.soc0,
    )


def cell_path(config: ExperimentConfig) -> Path:
    """The BPX file, or folder of a saved model, of the experiment's cell.

    Raises ConfigError or DataError if there is none in the data set of the catalogue.
    """
    if config.cell.bpx != "catalogue":
        return config.path(config.cell.bpx)
    from aesi.data.catalogue import locate

    if config.data.set is None:
        raise ConfigError("cell.bpx: catalogue needs data.set; give the path of a BPX file.")
    return locate(config.data.set, "cell.bpx.json")


def _files_and_names(where: Callable[[str], Path], names: Sequence[str]) -> dict[str, tuple[Path, str]]:
    """Name in the experiment -> (file, name of the record). The names of the records are all different, also where
    files of several folders share a name, because results are stored by them."""
    paths = {name: where(name) for name in names}
    of_records = record_names(list(paths.values()))
    return {name: (path, one) for (name, path), one in zip(paths.items(), of_records, strict=True)}


def _record(path: Path, reading: Reading, record_name: str | None = None) -> Measurement:
    """The record in a file, with all its rows: they are averaged once, to the step of the experiment.

    record_name : None takes that of the file.
    Raises DataError that names the keys of an experiment file beside the options of a command.
    """
    try:
        return read(path, reading, None, record_name)
    except DataError as error:
        raise DataError(with_keys(str(error))) from None


def _locator(config: ExperimentConfig) -> Callable[[str], Path]:
    """Function from the name of a record in the experiment to its file."""
    if config.data.kind != "catalogue":
        return config.path
    from aesi.data.catalogue import locate

    assert config.data.set is not None  # the schema of kind: catalogue
    return partial(locate, config.data.set)
