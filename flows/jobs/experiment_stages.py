"""What each stage of an experiment runs, and what is said and tracked of it. All that they need loads with this module.

A stage's work goes through `run`; what stands beside it (sentences, metrics, artifacts) is done once, after it.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from aesi.pipeline.experiment.comparison import comparison
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.fit import FinalModels, Fitted, build_problem, final_models
from aesi.pipeline.experiment.intervals.conformalise import conformalise
from aesi.pipeline.experiment.judging.evaluate import EvaluatedModels, evaluate_models
from aesi.pipeline.experiment.judging.validation import validation_mser
from aesi.pipeline.experiment.load import Loaded, load
from aesi.pipeline.experiment.outputs import Result, write_outputs
from aesi.pipeline.written import COMPARISON, REPORT, TABLES
from aesi.records.failed import candidates_failed
from aesi.sparse import Problem
from flows.base import environment
from flows.base.console import Console
from flows.base.stage_cache import Cache
from flows.jobs.run_request import RunRequest
from flows.jobs.stages import Stages
from flows.search.study import StudyResult, run_study
from flows.tracking.experiment_log import (
    UNFITTED,
    CandidateTracker,
    result_line,
    track_result,
    track_settings,
    track_start,
)
from flows.tracking.tracker import Tracker


@dataclass(frozen=True, eq=False)
class ExperimentJob:
    """One run of an experiment: what was asked, where it is tracked, who runs its stages and says what comes of them.

    anew : whether it takes nothing that another run has stored.  started : `time.monotonic()` then.
    """

    request: RunRequest
    tracker: Tracker
    anew: bool
    run: Stages
    console: Console
    started: float

    @property
    def config(self) -> ExperimentConfig:
        """What was asked, before a fallback."""
        return self.request.config

    def results(self) -> Path:
        """Every stage in its order; the folder of the results."""
        track_settings(self.tracker, self.config)
        loaded = self._load()
        config = loaded.config  # that of the fallback where it fell back to one
        folder = environment.run_folder(config.name, self.tracker.run_id)
        problem = self._begin(loaded, folder)
        found = self._search(loaded, problem)
        models = self._fit(found, config, problem)
        fitted = self._band(models, found, problem, loaded)
        evaluation = self._evaluate(fitted, found, problem, loaded)
        result = self._result(loaded, problem, found, models, fitted, evaluation)
        summary = self._report(folder, result, found)
        self._publish(folder, summary, config)
        return folder

    def _begins(self, stage: str) -> Callable[[str], None]:
        """Says each long part of a stage as it begins."""
        return partial(self.console.begins, stage)

    def _load(self) -> Loaded:
        stage = "data and physics"
        loaded = self.run(
            stage, lambda: load(self.config, self.request.sources, self._begins(stage)), retries=2
        )
        for note in loaded.notes:
            self.console.say(f"  {note}")
        return loaded

    def _begin(self, loaded: Loaded, folder: Path) -> Problem:
        track_start(self.tracker, loaded, folder)
        problem = self.run("library and resamples", lambda: build_problem(loaded, loaded.config))
        # Bad input has been refused by now, and a run that it refuses is taken back.
        self.console.say(f"run {self.tracker.run_id} {'resumed' if self.tracker.resumed else 'started'}")
        return problem

    def _search(self, loaded: Loaded, problem: Problem) -> StudyResult:
        config, follow = loaded.config, CandidateTracker(self.tracker, loaded, problem)
        name = f"{config.name}, seed {config.seed} ({self.tracker.run_id[:8]})"
        found = self.run(
            "search",
            lambda: run_study(
                problem,
                config,
                self.console,
                self.tracker.run_id if self.anew else None,
                follow,
                publish_as=name,
                on_generation=lambda done, total: self.run.progress("search", done, total),
                lost_again=not self.tracker.resumed,
            ),
        )
        for sentence in candidates_failed(found.result.failed, len(found.result.trials)):
            self.console.say(f"  {sentence}")
        importances = found.result.importances()
        self.tracker.metrics({f"importance/{gene}": share for gene, share in importances.items()})
        return found

    def _fit(self, found: StudyResult, config: ExperimentConfig, problem: Problem) -> FinalModels:
        cache = Cache(self.console.say, not self.anew)
        key = (config.digest, found.key)
        stage = "final models"
        models = self.run(
            stage,
            lambda: final_models(
                problem,
                found.chosen,
                config,
                lambda name, fit: cache.get(f"model {name}", key, fit),
                self._begins(stage),
            ),
        )
        for note in models.unfitted:
            self.console.say(f"  {note}")
        if models.unfitted:
            self.tracker.parameters({}, {UNFITTED: " ".join(models.unfitted)})
        return models

    def _band(
        self, models: FinalModels, found: StudyResult, problem: Problem, loaded: Loaded
    ) -> tuple[Fitted, ...]:
        config, left_out = loaded.config, loaded.left_out
        stage = "intervals"
        begins = self._begins(stage)
        return self.run(
            stage, lambda: conformalise(models.fitted, problem, found.chosen, config, left_out, begins)
        )

    def _evaluate(
        self, fitted: Sequence[Fitted], found: StudyResult, problem: Problem, loaded: Loaded
    ) -> EvaluatedModels:
        validation = self.run("validation", lambda: validation_mser(loaded, problem, found.candidates()))
        return self.run("evaluation", lambda: evaluate_models(fitted, loaded.split, validation))

    def _result(
        self,
        loaded: Loaded,
        problem: Problem,
        found: StudyResult,
        models: FinalModels,
        fitted: Sequence[Fitted],
        evaluation: EvaluatedModels,
    ) -> Result:
        seconds = time.monotonic() - self.started
        return Result(
            loaded.config,
            loaded,
            problem,
            found.chosen,
            found.rows(),
            fitted,
            evaluation,
            self.tracker.run_id,
            seconds,
            failed=found.result.failed,
            unfitted=models.unfitted,
        )

    def _report(self, folder: Path, result: Result, found: StudyResult) -> Mapping[str, Any]:
        summary = self.run("report", lambda: write_outputs(folder, result))
        self.console.say(summary["finding"])
        self.tracker.json(COMPARISON, self.run("comparison", lambda: comparison(result)))
        track_result(self.tracker, folder, summary, found.numbers, result.fitted, result.config.note)
        return summary

    def _publish(self, folder: Path, summary: Mapping[str, Any], config: ExperimentConfig) -> None:
        slug = re.sub("[^a-z0-9]+", "-", config.name.lower()).strip("-")
        tables = (folder / TABLES["md"]).read_text(encoding="utf-8")
        self.run.publish(f"{slug}-report", self._page(folder, summary), f"What came of {config.name}")
        self.run.publish(f"{slug}-tables", tables, f"Tables of {config.name}")

    def _page(self, folder: Path, summary: Mapping[str, Any]) -> str:
        """The headline of the report as Prefect shows it, and where the rest is."""
        row = next(row for row in summary["models"] if row["name"] == summary["chosen"])
        lines = [f"# {row['name']}, {row['terms']} terms", "", result_line(row), ""]
        if summary["fallback"]:
            lines += [f"**{summary['fallback']}**", ""]
        tracked = f"[{self.tracker.run_id}]({self.tracker.address})"
        return "\n".join([*lines, f"- report: `{folder / REPORT}`", f"- tracked: {tracked}"])
