"""Cases for the tracer: from files named on the command line, or from an experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from aesi.advice import with_keys
from aesi.data.read import Reading, read
from aesi.data.reading import record_names
from aesi.errors import ConfigError, DataError
from aesi.physics import ModelName
from aesi.physics.cell import Soh
from aesi.pipeline.discovery.discover import Case
from aesi.pipeline.discovery.searchable import searchable
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.sections import DiscoverConfig
from aesi.pipeline.experiment.sources import cell_path, discovery_records
from aesi.records import Hold


def case_of_files(
    cell: Path,
    data: Sequence[Path],
    tests: Sequence[Path] = (),
    *,
    good: Sequence[Path] = (),
    reading: Reading | None = None,
    hold: Hold | None = None,
    soc0: float | None = None,
    known_soc0: Mapping[str, float] = MappingProxyType({}),
    holdout: float | None = None,
    max_effects: int = 3,
    seed: int = 0,
    effect_files: Sequence[Path] = (),
    only: Sequence[str] = (),
    without: Sequence[str] = (),
    model: ModelName | None = None,
    soh: Soh | None = None,
) -> Case:
    """A case of measurement files, as `searchable` has it.

    data, tests, good : files of the records that are looked at, that choose nothing, and that are known to be good.
    reading, hold : how the files are read, and how the current runs between their rows; None tells by the rows.
    known_soc0 : name of a record -> state of charge at its first row.
    All else as `Case` has it.
    Raises DataError where a file cannot be of the cell, at any temperature that is looked for.
    """
    paths = (*data, *tests, *good)
    named = zip(paths, record_names(paths), strict=True)
    records = [
        read(path, reading or Reading(), None, name).held(hold).begun_at(known_soc0.get(name))
        for path, name in named
    ]
    case = Case(
        cell,
        measurements=tuple(records[: len(data)]),
        tests=tuple(records[len(data) : len(data) + len(tests)]),
        good=tuple(records[len(data) + len(tests) :]),
        soc0=soc0,
        holdout=holdout,
        max_effects=max_effects,
        seed=seed,
        effect_files=tuple(effect_files),
        only=tuple(only),
        without=tuple(without),
        model=model,
        soh=soh,
    )
    return searchable(case)


def case_of_experiment(config: ExperimentConfig) -> Case:
    """The case that an experiment with a `discover` section describes.

    Raises ConfigError where it names no record to look at, or effects that the cell is declared to have, DataError for
    a record that cannot be of the cell, at any temperature that is looked for.
    """
    wanted = config.discover or DiscoverConfig()
    if config.cell.effects:
        raise ConfigError(
            f"{config.name}: cell.effects: a discovery starts from what the cell's file declares, so that "
            f"{', '.join(config.cell.effects)} would not be in it; leave it out, or name as `cell` the folder of a "
            "saved model that has it."
        )
    cell = cell_path(config)
    fit, test, good = discovery_records(config, wanted, cell)
    if not fit:
        raise ConfigError(f"{config.name}: discover.fit names no record; give at least one to look at.")
    case = Case(
        cell,
        fit,
        test,
        soc0=config.cell.soc0,
        holdout=wanted.holdout,
        max_effects=wanted.max_effects,
        seed=config.seed,
        effect_files=tuple(config.path(name) for name in config.cell.effect_files),
        model=config.cell.model,
        soh=config.cell.soh,
        good=good,
        reader="experiment",
    )
    try:
        return searchable(case)
    except DataError as error:
        raise DataError(with_keys(str(error))) from None
