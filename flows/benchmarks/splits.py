"""`aesi bench splits`: does the hybrid survive another drive? One line a split, and a last one that sums up.

The splits are those of `aesi.bench.hybrid.splits`; each runs the stages of `aesi run` and is a nested run of the
experiment `splits`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import PositiveFloat, PositiveInt

from aesi.bench import CaseRow
from aesi.bench.hybrid.split_figures import IN_TABLE, summary, table
from aesi.bench.hybrid.splits import EXPERIMENTS, SplitCase, chosen_splits, judged
from aesi.bench.limit import LOST, NO_TIME, NOT_RUN, Stopwatch
from aesi.errors import AesiError, DataError, FitError, InputError
from aesi.pipeline.experiment.config import ExperimentConfig, overridden_key, read_experiment
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.sources import catalogue_files, check_had, named_files
from flows.base.console import Console
from flows.benchmarks.cases import Cases, judged_once, kept_rows, tracked
from flows.benchmarks.page import write_between

QUICK = {"a_cell": 5, "seeds": 1, "candidates": 24, "resamples": 40, "dt_s": 1.0}
"""Settings of a run of some hours: splits of a cell, seeds, candidates, resamples, and step of the rows, s. With
`whole` all splits run with the settings of their experiment files."""
BLOCK_S = 100.0
"""Length of a block of the bootstrap, s."""
QUICK_INTERVALS = ("conformal.method=split", "conformal.compare=[]", "conformal.horizons_s=[60.0]")
"""Intervals one step ahead are not judged here."""
QUICK_MODELS = ("ESPM", "ESPM, one resistor", "ESPM recalibrated", "AESI I", "AESI II")
"""Rows of Table 1 that are worked out unless others are asked for."""
PARAMETERS = ("split", "cell", "seed", "development", "verdict", "error")
"""Keys of a row that are parameters of its run (`Cases`)."""
TRACKED = ("mser_pct", "coverage_pct", "winkler_mv")
"""Figures of each model that are metrics of its run."""
BEGIN, END = "<!-- table of aesi bench splits -->", "<!-- end of splits -->"
"""Marks on a page between which the table stands."""


@dataclass(frozen=True)
class SplitRun:
    """One split with one seed.

    folder : of the experiment files.  overrides : KEY=VALUE that replace keys of the experiment's file.
    """

    split: SplitCase
    seed: int
    folder: str
    overrides: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the case: split and seed."""
        return f"{self.split.name}, seed {self.seed}"

    @property
    def settings(self) -> list[str]:
        """The overrides that all splits share: without the seed and those of this split."""
        own = ("seed", *map(overridden_key, self.split.overrides))
        return [override for override in self.overrides if overridden_key(override) not in own]

    @property
    def config(self) -> ExperimentConfig:
        """The experiment file with its overrides."""
        return read_experiment(Path(self.folder) / self.split.experiment, self.overrides)


def run(
    experiments: str = "experiments",
    of_cells: Sequence[str] = tuple(EXPERIMENTS),
    whole: bool = False,
    a_cell: PositiveInt | None = None,
    only: str | None = None,
    development: bool | None = None,
    seeds: PositiveInt | None = None,
    candidates: PositiveInt | None = None,
    resamples: PositiveInt | None = None,
    dt_s: PositiveFloat | None = None,
    models: Sequence[str] = QUICK_MODELS,
    overrides: Sequence[str] = (),
    workers: PositiveInt = 1,
    address: str | None = None,
    write: str | None = None,
    keep: str | None = None,
) -> Iterator[dict[str, Any]]:
    """One dict a split and seed, and a last one with `summary`: true.

    experiments : folder of the experiment files.  whole : every split, three seeds, candidates, resamples and step as
    the files have them; otherwise five splits of a cell, one seed, few candidates and rows of 1 s.
    of_cells, a_cell, only, development : which splits.  models : which rows of Table 1.  overrides : KEY=VALUE that
    replace keys of all experiment files.
    workers, address : processes here, or a Dask scheduler.  write : a page whose part between the two marks becomes
    the table.  keep : a folder for what each split gave; one that is in it is not run again by the same program, as it
    was asked, so that an interrupted run goes on, and the table is of all that the program has kept there with these
    settings, of whatever cells and seeds.
    Raises InputError for a table without one of the models that its columns are of.
    """
    asked = {"a_cell": a_cell, "seeds": seeds, "candidates": candidates, "resamples": resamples, "dt_s": dt_s}
    standing = {"seeds": 3} if whole else QUICK
    settings: dict[str, Any] = {**standing, **{k: v for k, v in asked.items() if v is not None}}
    runs = [
        SplitRun(
            split,
            seed,
            experiments,
            merged_overrides(_split_overrides(split, seed, settings, models), overrides),
        )
        for split in chosen_splits(of_cells, settings.get("a_cell"), only, development)
        for seed in range(int(settings["seeds"]))
    ]
    if write is not None:
        lacking = [name for name in IN_TABLE if name not in runs[0].config.models]
        if lacking:
            raise InputError(
                f"--set write={write}: its table has columns of {', '.join(lacking)}, not run here; add them to models."
            )
    rows = []
    judge = partial(judged_once, judge=_row, keep=keep, files=_files)
    for row in tracked(Cases("splits", 0, runs, judge, summary, _lost, PARAMETERS), workers, address):
        rows.append(row)
        yield row
    if write is not None:
        write_between(write, BEGIN, END, table(_kept_with(keep, runs[0].settings) if keep else rows[:-1]))


def _kept_with(folder: str, settings: Sequence[str]) -> list[CaseRow]:
    """The rows in a folder that are of this program and of these settings (`SplitRun.settings`)."""
    rows = kept_rows(folder)
    other = [row["case"] for row in rows if row["settings"] != settings]
    if other:
        Console().say(f"{folder}: of other settings, and left out of the table: {'; '.join(other)}.")
    return [row for row in rows if row["settings"] == settings]


def merged_overrides(defaults: Sequence[str], overrides: Sequence[str]) -> tuple[str, ...]:
    """The defaults, without the keys that `overrides` have too, then `overrides`: an experiment refuses a key that is
    given twice.  Both : KEY=VALUE of an experiment file."""
    asked = {overridden_key(override) for override in overrides}
    return (*(one for one in defaults if overridden_key(one) not in asked), *overrides)


def _files(run: SplitRun) -> Iterator[Path]:
    """The file of its experiment, those that this names, and the records and the cell of its data set."""
    config = run.config
    yield Path(run.folder) / run.split.experiment
    yield from named_files(config).values()
    with suppress(DataError):
        yield from catalogue_files(config)


def _split_overrides(
    case: SplitCase, seed: int, settings: Mapping[str, Any], models: Sequence[str]
) -> tuple[str, ...]:
    """The overrides of one split and seed with these settings (keys as in `QUICK`)."""
    overrides = [*case.overrides, f"seed={seed}", f"models={json.dumps(list(models))}"]
    overrides += [
        f"search.{key}={settings[key]}"
        for key in ("candidates", "resamples")
        if settings.get(key) is not None
    ]
    if settings.get("dt_s") is not None:
        overrides += [f"data.dt_s={settings['dt_s']}", f"search.block={round(BLOCK_S / settings['dt_s'])}"]
    return (*overrides, *QUICK_INTERVALS)


def _row(run: SplitRun) -> CaseRow:
    """A split that fails says why; `verdict` is 'not run' where its data cannot be had."""
    spent = Stopwatch()
    case, head = run.split, _head(run)
    try:
        check_had(run.config)
    except DataError as error:
        return head | {"verdict": NOT_RUN, "error": str(error), **spent.row}
    try:
        figures = _judged(case, run.config)
    except AesiError as error:
        figures = {"error": str(error)}
    return head | figures | spent.row


def _lost(run: SplitRun) -> CaseRow:
    return _head(run) | {"error": LOST.error} | NO_TIME


def _head(run: SplitRun) -> CaseRow:
    return {
        "case": run.name,
        "split": run.split.name,
        "cell": run.split.cell,
        "seed": run.seed,
        "development": run.split.development,
        "settings": run.settings,
    }


def search_and_fit(config: ExperimentConfig) -> tuple[Loaded, Mapping[str, float], Sequence[Fitted]]:
    """The stages of `aesi run`, untracked: what was loaded, validation MSER (per cent), the models of Table 1.

    Raises DataError where the data cannot be had: what an experiment falls back to is no measurement of its cell.
    """
    from aesi.pipeline.experiment.candidate import top_share
    from aesi.pipeline.experiment.fit import build_problem, final_models
    from aesi.pipeline.experiment.intervals.conformalise import conformalise
    from aesi.pipeline.experiment.judging.validation import validation_mser
    from aesi.pipeline.experiment.load import load
    from aesi.sparse import Candidate
    from aesi.sparse.search.pick.average import averaged
    from flows.search.nsga2 import search
    from flows.search.study import settings_of

    loaded = load(config.model_copy(update={"fallback": None}))
    problem = build_problem(loaded, config)
    known = {}
    found = search(
        problem,
        config.search.candidates,
        config.seed,
        settings_of(problem, config),
        on_candidate=lambda number, _, outcome: known.__setitem__(number, outcome),
    )
    chosen = averaged([known[number] for number in found.fittest(top_share(config))])
    models = final_models(problem, chosen, config)
    if models.unfitted:
        raise FitError(" ".join(models.unfitted))  # figures of cases are compared model by model
    fitted = conformalise(models.fitted, problem, chosen, config, loaded.left_out)
    validation = validation_mser(loaded, problem, [c for c in known.values() if isinstance(c, Candidate)])
    return loaded, validation, fitted


def _judged(case: SplitCase, config: ExperimentConfig) -> dict[str, Any]:
    loaded, validation, fitted = search_and_fit(config)
    home = [series for series in loaded.split.test if series.name not in case.abroad]
    models = judged(fitted, home)
    figures: dict[str, Any] = {"validation_mser_pct": validation, "models": models}
    figures |= {
        f"{name}/{key}": models[name][key] for name in models for key in TRACKED if key in models[name]
    }
    for series in loaded.split.test:
        if series.name in case.abroad:
            figures.setdefault("abroad", {})[series.name] = judged(fitted, [series])
    return figures
