"""`aesi bench splits`: does the hybrid survive another drive? One line a split, and a last one that sums up.

The splits are those of `aesi.bench.hybrid.splits`; each runs the stages of `aesi run` in this process, untracked.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from aesi.bench.hybrid.splits import EXPERIMENTS, SplitCase, against, chosen_splits, judged
from aesi.errors import AesiError
from aesi.pipeline.experiment.config import ExperimentConfig, read_experiment
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import RECALIBRATED

QUICK = {"a_cell": 5, "seeds": 1, "candidates": 24, "resamples": 40, "dt_s": 1.0}
"""A look at every split in hours; `whole` runs them at the settings of an experiment."""
BLOCK_S = 100.0
"""Of the bootstrap."""
CHEAP = ("conformal.method=split", "conformal.compare=[]", "conformal.horizons_s=[60.0]")
"""Intervals one step ahead are not judged here."""
QUICK_MODELS = ("ESPM", "ESPM, one resistor", "ESPM recalibrated", "AESI I", "AESI II")


def run(
    experiments: str = "experiments",
    cells: Sequence[str] = tuple(EXPERIMENTS),
    whole: bool = False,
    a_cell: int | None = None,
    only: str | None = None,
    development: bool | None = None,
    seeds: int | None = None,
    candidates: int | None = None,
    resamples: int | None = None,
    dt_s: float | None = None,
    models: Sequence[str] = QUICK_MODELS,
    overrides: Sequence[str] = (),
) -> Iterator[dict[str, Any]]:
    """One dict a split and seed, and a last one with `summary`: true.

    experiments : folder of the experiment files.  whole : every split, three seeds, candidates, resamples and step as
    the files have them; otherwise five splits of a cell, one seed, few candidates and rows of 1 s.
    cells, a_cell, only, development : which splits.  models : which rows of Table 1.  overrides : laid over all files.
    """
    asked = {"a_cell": a_cell, "seeds": seeds, "candidates": candidates, "resamples": resamples, "dt_s": dt_s}
    standing = {"seeds": 3} if whole else QUICK
    settings: dict[str, Any] = {**standing, **{k: v for k, v in asked.items() if v is not None}}
    rows = []
    for case in chosen_splits(cells, settings.get("a_cell"), only, development):
        for seed in range(int(settings["seeds"])):
            config = _config(Path(experiments), case, seed, settings, models, overrides)
            row = _row(case, seed, config)
            rows.append(row)
            yield row
    yield summary(rows)


def _config(
    folder: Path,
    case: SplitCase,
    seed: int,
    settings: Mapping[str, Any],
    models: Sequence[str],
    overrides: Sequence[str],
) -> ExperimentConfig:
    laid = [*case.overrides, f"seed={seed}", f"models={json.dumps(list(models))}"]
    laid += [
        f"search.{key}={settings[key]}"
        for key in ("candidates", "resamples")
        if settings.get(key) is not None
    ]
    if settings.get("dt_s") is not None:
        laid += [f"data.dt_s={settings['dt_s']}", f"search.block={round(BLOCK_S / settings['dt_s'])}"]
    laid += CHEAP
    return read_experiment(folder / case.experiment, [*laid, *overrides])


def _row(case: SplitCase, seed: int, config: ExperimentConfig) -> dict[str, Any]:
    """A split that fails says why; it counts as nothing gained over the declared model."""
    started = time.process_time()
    head: dict[str, Any] = {
        "case": case.name,
        "cell": case.cell,
        "seed": seed,
        "development": case.development,
    }
    try:
        figures = _judged(case, config)
    except AesiError as error:
        figures = {"error": str(error)}
    return head | figures | {"cpu_s": round(time.process_time() - started, 1)}


def search_and_fit(config: ExperimentConfig) -> tuple[Loaded, Mapping[str, float], Sequence[Fitted]]:
    """The stages of `aesi run`, untracked: what was loaded, validation MSER (per cent), the models of Table 1."""
    from aesi.pipeline.experiment.candidate import genome_space, weights
    from aesi.pipeline.experiment.fit import build_problem, final_models
    from aesi.pipeline.experiment.intervals.conformalise import conformalise
    from aesi.pipeline.experiment.judging.validation import validation_mser
    from aesi.pipeline.experiment.load import load
    from aesi.sparse import Candidate
    from flows.search.nsga2 import Constraints, search

    loaded = load(config)
    problem = build_problem(loaded, config)
    known = {}
    found = search(
        problem,
        config.search.candidates,
        seed=config.seed,
        on_candidate=lambda number, _, outcome: known.__setitem__(number, outcome),
        space=genome_space(problem, config),
        population=config.search.population,
        constraints=Constraints(config.search.pearson_train, config.search.pearson_valid),
        weights=weights(config),
        warm_start=None if config.search.warm_start else (),
    )
    chosen = known[found.best().trial.number]
    fitted = conformalise(final_models(problem, chosen, config), problem, chosen, config, loaded.left_out)
    validation = validation_mser(loaded, problem, [c for c in known.values() if isinstance(c, Candidate)])
    return loaded, validation, fitted


def _judged(case: SplitCase, config: ExperimentConfig) -> dict[str, Any]:
    loaded, validation, fitted = search_and_fit(config)
    home = [series for series in loaded.split.test if series.name not in case.abroad]
    figures: dict[str, Any] = {
        "validation_mser_pct": validation,
        "models": judged(fitted, home),
    }
    for series in loaded.split.test:
        if series.name in case.abroad:
            figures.setdefault("abroad", {})[series.name] = judged(fitted, [series])
    return figures


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Means and worst cases by cell, of all splits and of those that judge alone.

    best_in_hindsight : of whichever model errs least on each split, the recalibrated one among them: what a choice that
    knew the test could have taken off, and no choice from training drives can count on."""
    return {
        "summary": True,
        "splits": len(rows),
        "failed": sum("error" in row for row in rows),
        "all": {cell: _of(mine) for cell, mine in _by_cell(rows).items()},
        "judging": {
            cell: _of(mine) for cell, mine in _by_cell([r for r in rows if not r["development"]]).items()
        },
    }


def _by_cell(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Mapping[str, Any]]]:
    good = [row for row in rows if "error" not in row]
    by_cell = {cell: [row for row in good if row["cell"] == cell] for cell in EXPERIMENTS}
    return {cell: mine for cell, mine in by_cell.items() if mine} | ({"every cell": good} if good else {})


def _of(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    out: dict[str, Any] = {"splits": len(rows)}
    every = [(row["models"], row.get("abroad", {})) for row in rows]
    for name in rows[0]["models"]:
        mine = [models[name] for models, _ in every if name in models]
        out[name] = _spread("mser_pct", [m["mser_pct"] for m in mine])
        recalibrated = [
            against(test[name], test[RECALIBRATED])
            for models, abroad in every
            for test in (models, *abroad.values())
            if RECALIBRATED in test
        ]
        if recalibrated:
            out[name] |= _spread("mser_recalibrated_pct", recalibrated)
        if all("coverage_pct" in m for m in mine):
            counts = np.array([m["rows"] for m in mine], dtype=float)
            out[name] |= {
                "coverage_pct": float(counts @ [m["coverage_pct"] for m in mine] / counts.sum()),
                "worst_drive_coverage_pct": min(m["worst_drive_coverage_pct"] for m in mine),
                "winkler_mv": float(counts @ [m["winkler_mv"] for m in mine] / counts.sum()),
            }
    best = [
        max(against(test[name], test[RECALIBRATED]) for name in test)
        for test, _ in every
        if RECALIBRATED in test
    ]
    if best:
        out["best_in_hindsight"] = _spread("mser_recalibrated_pct", best)
    if "AESI I" in rows[0]["models"]:
        gaps = [abs(r["validation_mser_pct"]["AESI I"] - r["models"]["AESI I"]["mser_pct"]) for r in rows]
        out["validation_minus_test"] = {"median": float(np.median(gaps)), "worst": max(gaps)}
    return out


def _spread(name: str, values: Sequence[float]) -> dict[str, float]:
    return {f"{name}_mean": float(np.mean(values)), f"{name}_worst": min(values)}
