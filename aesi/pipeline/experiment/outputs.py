"""The output files of `aesi run`: report.html, figures/, tables.md, tables.tex, model/ and summary.json."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from aesi.numerics.blocks import coverage
from aesi.numerics.files.whole import write_whole
from aesi.physics import ModelName
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.judging.evaluate import EvaluatedModels
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.experiment.physics_models import DECLARED, PHYSICS_NAMES, RECALIBRATED
from aesi.pipeline.notes import together
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.report import tables
from aesi.pipeline.report.figures import paper_figures
from aesi.pipeline.report.page import write_page
from aesi.pipeline.report.views import BootstrapView, RecordTrace, RunView
from aesi.pipeline.report.words.runs import run_finding
from aesi.pipeline.report.write import write_run_report
from aesi.pipeline.written import FIGURES, MODEL, PAPER_FIGURES, REPORT, SUMMARY, TABLES
from aesi.records.failed import candidates_failed
from aesi.sparse import ENSEMBLES, Candidate, Problem, SparseModel
from aesi.sparse.ranking import svd_ranking

SCHEMA = "aesi.summary/1"
VERSIONS = ("aesi", "numpy", "scipy", "scikit-learn", "optuna", "mlflow", "prefect")
SHORT: Mapping[ModelName, str] = {"espm": DECLARED, "dfn": "DFN"}
"""Kind of the physics -> its name in tables and figures."""


@dataclass(frozen=True, eq=False)
class Result:
    """The result of an experiment.

    candidates : one row per evaluated candidate, with number, oob (out-of-bag loss), valid (validation loss), terms,
    fitness, feasible, front, chosen.  chosen : the candidate that the ensembles come from; several are merged to one.
    fitted : the models.  evaluation : their figures.  run_id : of the tracked run.  seconds : wall time so far, s.
    failed : reason -> number of candidates that failed for it.  unfitted : a sentence on each baseline that could not
    be fitted.
    """

    config: ExperimentConfig
    loaded: Loaded
    problem: Problem
    chosen: Candidate
    candidates: Sequence[Mapping[str, Any]]
    fitted: Sequence[Fitted]
    evaluation: EvaluatedModels
    run_id: str
    seconds: float
    failed: Mapping[str, int] = field(default_factory=dict)
    unfitted: tuple[str, ...] = ()

    @property
    def evaluated(self) -> int:
        """Number of candidates of the search, including those that failed."""
        return len(self.candidates) + sum(self.failed.values())

    @property
    def best(self) -> str:
        """Name of the chosen model: the ensemble with the lower validation loss. If the experiment names one ensemble,
        it is that one; if it names none, the last model.

        Without validation records the loss is that on the left-out pieces. The test records choose nothing.
        """
        names = [str(row["name"]) for row in self.evaluation.rows]
        judged = [name for name in ENSEMBLES if name in names]
        if len(judged) < len(ENSEMBLES):
            return judged[0] if judged else names[-1]
        return self.chosen.better.name

    @property
    def ensemble(self) -> SparseModel | None:
        """The ensemble that `best` names; None if it is another model."""
        return self.chosen.named(self.best)

    @property
    def corrected(self) -> str:
        """Name of the physics that corrections are learnt on and that a saved model contains."""
        return RECALIBRATED if self.loaded.config.cell.start == "recalibrated" else DECLARED

    @property
    def saved_physics(self) -> str:
        """Name of the physics in the saved model: the chosen model if that is one, else the one that is corrected."""
        return self.best if self.best in self.loaded.cells else self.corrected

    @property
    def kept(self) -> Fitted | None:
        """The chosen model if a model folder can hold it (a sparse model, or the corrected physics alone); else None.
        Its bands are saved with it."""
        one = next(fitted for fitted in self.fitted if fitted.model.name == self.best)
        return one if isinstance(one.model, SparseModel) or self.best == self.corrected else None


def write_outputs(folder: Path, result: Result) -> dict[str, Any]:
    """Write all outputs of an experiment to `folder` and return the content of summary.json."""
    folder.mkdir(parents=True, exist_ok=True)
    shown = published_by(result.loaded.model)
    rows = [finite({**row, "name": shown(row["name"])}) for row in result.evaluation.rows]
    view = run_view(result, rows)
    finding = run_finding(view)
    summary = {
        "schema": SCHEMA,
        "experiment": result.config.name,
        "mlflow_run_id": result.run_id,
        "candidates": result.evaluated,
        "chosen": shown(result.best),
        "finding": finding,
        "seed": result.config.seed,
        "cell": result.loaded.cell_name,
        "data": result.loaded.config.data.kind,
        "fallback": result.loaded.fallback or None,
        "notes": list(view.notes),
        "models": rows,
    }
    # Predictions repeat the finding of the saved model; it is left out if it is about another model than the saved one.
    about_saved = result.kept is not None or result.saved_physics == result.best
    replace(hybrid(result), finding=finding if about_saved else "").save(folder / MODEL)
    for format, name in TABLES.items():
        write_whole(folder / name, tables.render(rows, format))
    write_run_report(folder / REPORT, view)
    figures, title = paper_figures(view), f"{view.experiment}: figures"
    write_page(folder / FIGURES / PAPER_FIGURES, "figures.html", figures, title=title)
    write_whole(folder / SUMMARY, json.dumps(summary, indent=1, allow_nan=False))
    return summary


def notes(result: Result) -> tuple[str, ...]:
    """The notes of the report: sentences on the data, on terms and models that were left out, on failed candidates, and
    on intervals that could not be calibrated."""
    without_intervals = (note for one in result.fitted for note in one.notes)
    because = (
        f"bands of physics are kept for the {result.corrected} alone (cell.start)"
        if result.saved_physics == result.best
        else f"{result.best} cannot be kept with it"
    )
    alone = f"The saved model is the {result.saved_physics} alone, without bands: {because}."
    told = () if result.kept else (alone,)
    failed = candidates_failed(result.failed, result.evaluated)
    return together(
        (*result.loaded.notes, *result.problem.notes, *result.unfitted, *without_intervals, *failed, *told)
    )


def published_by(model: ModelName) -> Callable[[str], str]:
    """Function of a model's internal name that returns its name in tables and figures: `PHYSICS + NAME` for a model of
    the error, and the name of the physics for the physics alone."""
    short = SHORT[model]

    def published(name: str) -> str:
        return name.replace(DECLARED, short, 1) if name in PHYSICS_NAMES else f"{short} + {name}"

    return published


def _published_trace(trace: RecordTrace, shown: Callable[[str], str]) -> RecordTrace:
    return replace(trace, predictions={shown(name): each for name, each in trace.predictions.items()})


def hybrid(result: Result) -> HybridModel:
    """The hybrid model that is saved: physics, effects, the chosen ensemble with its intervals and bands; the physics
    alone, without bands, if the chosen model cannot be saved."""
    one, physics = result.kept, result.saved_physics
    return HybridModel(
        cell=result.loaded.cells.get(physics, result.loaded.cell),
        effects=result.loaded.effects,
        correction=one.model if one and isinstance(one.model, SparseModel) else None,
        intervals=one.intervals if one else None,
        bands=one.bands if one else None,
        dt_s=result.loaded.config.data.dt_s,
        hold=result.loaded.config.data.hold,
        soc0=next(iter(result.loaded.soc0.values()), None) if physics == result.corrected else None,
        model=result.loaded.model,
        held=result.loaded.held if physics == DECLARED else (),  # a refit moves the values
        beside=result.loaded.beside,
        soh=result.loaded.soh,
        fitted_to=result.loaded.fitted_to,
    )


def run_view(result: Result, rows: Sequence[Mapping[str, Any]]) -> RunView:
    """The content of the report.  rows : of the models, with their names in tables."""
    genome = result.chosen.genome
    shown = published_by(result.loaded.model)
    return RunView(
        experiment=result.config.name,
        note=result.config.note,
        cell=result.loaded.cell_name,
        chosen=shown(result.best),
        models=tuple(rows),
        traces=tuple(_published_trace(trace, shown) for trace in result.evaluation.traces),
        candidates=tuple(result.candidates),
        terms=tuple(_terms(result)),
        bootstrap=BootstrapView(
            lengths=tuple(b - a for a, b in result.problem.spans),
            block=result.problem.block,
            unique_fraction=coverage(result.problem.counts),
        ),
        settings={
            "lambda1": f"{genome.lambda1:.3g}",
            "lambda2": f"{genome.lambda2:.3g}",
            "tau": f"{genome.tau:.2f}",
            "p_c": str(genome.p_c),
            "d": str(genome.d),
            "feedback of the error": "yes" if genome.feedback else "no",
            "candidates averaged": str(len(result.chosen.genomes)),
        },
        notes=notes(result),
        versions={"python": platform.python_version()} | {name: version(name) for name in VERSIONS},
        mlflow_run_id=result.run_id,
        seconds=result.seconds,
        physics=shown(DECLARED),
        corrected=shown(result.corrected),
        fallback=result.loaded.fallback,
        seen=result.loaded.seen,
        hold=result.loaded.config.data.hold,
    )


def finite(value: Any) -> Any:
    """A value that JSON can hold: numbers that are not finite become None, tuples lists, numpy scalars Python
    numbers."""
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float) and value - value != 0:
        return None
    return value


def _terms(result: Result) -> list[dict[str, Any]]:
    """One row per term of the two ensembles: coefficients, inclusion probability, and importance in the chosen ensemble
    (in AESI I if another model is chosen)."""
    chosen = result.chosen
    bagging, stability = chosen.bagging.coefficient_table(), chosen.stability.coefficient_table()
    importance = dict(svd_ranking(result.ensemble or chosen.bagging, result.problem.split.train))
    inclusion = chosen.stability.inclusion_table() | chosen.bagging.inclusion_table()
    names = dict.fromkeys([*bagging, *stability])
    return [
        {
            "term": name,
            "importance": importance.get(name),
            "bagging": bagging.get(name),
            "stability": stability.get(name),
            "inclusion": inclusion.get(name),
        }
        for name in names
    ]
