"""The log of data, candidates and models, under names that suit the compare view and the tables."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from math import isfinite, log10
from pathlib import Path
from typing import Any

from aesi.advice import listed
from aesi.constants import MV_PER_V
from aesi.logins import without_login
from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.files.whole import write_whole
from aesi.pipeline.experiment.candidate import ScoredCandidate
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.fit import Fitted
from aesi.pipeline.experiment.judging.reductions import valid_reductions, valid_shares
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.written import COEFFICIENTS, EXPERIMENT, FIGURES, MODEL, REPORT, SUMMARY, TABLES
from aesi.records import ROLES, Failed
from aesi.sparse import Candidate, Genome, Problem
from flows.base import codec
from flows.tracking.provenance import versions
from flows.tracking.tracker import Tracker, flat
from flows.tracking.view import HOW_TO_READ, NOTE, RUN_COLUMNS, experiment_tags

CHOSEN, MEMBERS, UNFITTED, FALLBACK = "aesi.chosen", "aesi.members", "aesi.unfitted", "aesi.fallback"
SETTING, CODE = "aesi.setting", "aesi.code"
"""What runs share that differ by seed alone: what was run on which data, and the program that ran it."""
INPUTS, RECORDS, LEFT_OUT, DECLARED = "inputs", "records.bin", "left_out.bin", "declared"
"""What a candidate is made from: the error series by role, those of training drives under physics that has not seen
them, and the declared cell with its effects."""
NO_PARAMETERS = ("note", "name", "fallback", "discover")
"""Keys of an experiment that are no settings of the run."""
OF_DATA = ("data", "cell")
"""Keys of an experiment that its fallback replaces."""
ADDRESSES = (("tracking", "uri"), ("runner", "storage"), ("runner", "address"))
"""Sections and keys of an experiment that hold the address of a server or a database."""
HEADLINES = ("free_run", "one_step", "intervals")
"""What MLflow's charts show first: it draws a section a prefix, in the order of the alphabet."""
NO_METRICS = ("test_records",)
"""Sections by record: what a file is called may be no name of a metric. They are in summary.json."""
WITH_UNIT = {
    "k_step": "test_rmse_mv_by_horizon_s",
    "k_step_persistence": "persistence_rmse_mv_by_horizon_s",
    "bands_by_horizon": "bands_by_horizon_s",
}
"""Names for sections whose entries are horizons."""
OF_A_MODEL = {"seconds": "fit_and_evaluation_s"}
"""Names for figures of the chosen model that would be taken for the run's own: a search takes longer."""


def track_settings(tracker: Tracker, config: ExperimentConfig) -> None:
    """Settings and versions of a run before its data are there, which takes minutes; those that a fallback may replace
    are left to `track_start`."""
    left = () if config.fallback is None else OF_DATA
    settings = {key: value for key, value in _settings(config).items() if key not in left}
    tracker.parameters(flat(settings) | {"versions": versions()}, {CODE: source_digest()})


def track_start(tracker: Tracker, loaded: Loaded, folder: Path) -> None:
    """Data of a run, and its settings of them, as it is run: those of the fallback where it fell back to one.

    folder : of the run, where what its candidates are made from is kept.
    Raises BegunOtherwise where a run that is gone on with was begun on other data or of another cell.
    """
    config = loaded.config
    held = {"cell_digest": loaded.files, "data_digest": ", ".join(loaded.digests.values())}
    tracker.as_begun(held)
    of_data = {key: value for key, value in _settings(config).items() if key in OF_DATA}
    tracker.about(experiment_tags(f"{config.note}\n\n{HOW_TO_READ}".strip(), RUN_COLUMNS))
    tags = {NOTE: config.note, SETTING: loaded.setting}
    if loaded.fallback:
        tags[FALLBACK] = loaded.fallback
    tracker.parameters(flat(of_data) | {"cell": loaded.cell_name, **held}, tags)
    tracker.json(EXPERIMENT, _without_logins(config))
    write_whole(folder / INPUTS / RECORDS, codec.dumps(loaded.split))
    write_whole(folder / INPUTS / LEFT_OUT, codec.dumps(loaded.left_out))
    soc0 = next(iter(loaded.soc0.values()), None)
    HybridModel(
        loaded.cell,
        loaded.effects,
        soc0=soc0,
        model=loaded.model,
        held=() if config.cell.start == "recalibrated" else loaded.held,
        beside=loaded.beside,
        soh=loaded.soh,
        fitted_to=loaded.fitted_to,
    ).save(folder / INPUTS / DECLARED)
    tracker.files(folder / INPUTS, INPUTS)
    tracker.datasets(
        [
            {
                "name": series.name,
                "digest": series.digest,
                "source": json.dumps({"cell": loaded.cell_name, "measured": loaded.digests}),
                "role": role,
                "profile": json.dumps({"rows": len(series), "dt_s": series.dt_s}),
            }
            for role in ROLES
            for series in getattr(loaded.split, role)
        ]
    )


def _settings(config: ExperimentConfig) -> dict[str, Any]:
    """What of an experiment is tracked as parameters, by section."""
    return {key: value for key, value in _without_logins(config).items() if key not in NO_PARAMETERS}


def _without_logins(config: ExperimentConfig) -> dict[str, Any]:
    """The content of an experiment with the addresses that may hold a password as they may be written."""
    content = config.model_dump(mode="json")
    for section, key in ADDRESSES:
        given = content[section]
        content[section] = given | {key: given[key] and without_login(given[key])}
    return content


class CandidateTracker:
    """Logs a nested run a candidate."""

    def __init__(self, tracker: Tracker, loaded: Loaded, problem: Problem) -> None:
        self._tracker = tracker
        self._problem = problem
        self._valid_shares = valid_shares(problem, loaded.left_out)
        self._shared = {
            "seed": loaded.config.seed,
            "data_hashes": loaded.digests,
            "versions": versions(),
            "resamples": loaded.config.search.resamples,
        }

    def __call__(self, number: int, genome: Genome, outcome: ScoredCandidate | Failed) -> None:
        """Log candidate `number`; a failed one carries its reason as a tag."""
        params = {
            "number": number,
            "lambda1": genome.lambda1,
            "lambda1_log10": round(log10(genome.lambda1), 4),  # MLflow's own plots have no logarithmic axis
            "lambda2": genome.lambda2,
            "lambda2_log10": round(log10(genome.lambda2), 4),
            "tau": genome.tau,
            "p_c": genome.p_c,
            "d": genome.d,
            "feedback": genome.feedback,
            "terms": genome.terms,  # with the genes above, all that `flows.results.candidate` needs
            "library_terms": int(genome.active(self._problem.library).sum()),
            "library_hash": genome.digest(self._problem.library),
            **self._shared,
        }
        label, name, kind = f"candidate:{number}", f"candidate {number:03d}", "candidate"
        if isinstance(outcome, Failed):
            self._tracker.nested(label, name, kind, params, {}, failed=outcome.reason)
            return
        self._tracker.nested(
            label,
            name,
            kind,
            params,
            _metrics(outcome, self._valid_shares),
            files={COEFFICIENTS: coefficients(outcome.candidate)},
            tags={"aesi.intervals": outcome.note} if outcome.note else {},
            seconds=outcome.seconds,
        )


def track_result(
    tracker: Tracker,
    folder: Path,
    summary: Mapping[str, Any],
    numbers: Sequence[int],
    fitted: Sequence[Fitted],
    note: str,
) -> None:
    """The models, the tables, the report and the chosen model; `numbers` are of the candidates that they are the mean
    of, the fittest first.

    note : what the experiment is about, which the run's description begins with.
    """
    chosen = summary["chosen"]
    for row in summary["models"]:
        figures = _flat_metrics(row)
        tracker.nested(f"model:{row['name']}", row["name"], "model", {"model": row["name"]}, figures)
        if row["name"] == chosen:
            tracker.metrics(figures)
    headline = next(row for row in summary["models"] if row["name"] == chosen)
    tags = {
        NOTE: f"{note}\n\n{result_line(headline)} {candidates_line(numbers)}; the report is an artifact.".strip(),
        MEMBERS: json.dumps(list(numbers)),
    }
    tracker.parameters({"chosen_candidate": numbers[0], "chosen_model": chosen}, tags)
    tracker.mark(f"candidate:{numbers[0]}", {CHOSEN: "true"})
    for name in (SUMMARY, REPORT, *TABLES.values()):
        tracker.files(folder / name)
    for one in fitted:
        if one.trials:
            tracker.json(f"search of {one.model.name}.json", [dict(row) for row in one.trials])
    if (folder / FIGURES).is_dir():
        tracker.files(folder / FIGURES, FIGURES)
    tracker.model(folder / MODEL)


def candidates_line(numbers: Sequence[int]) -> str:
    """'Candidate 12 of the search', or of which candidates the models are the mean."""
    which = "Candidate" if len(numbers) == 1 else "The mean of candidates"
    return f"{which} {listed([str(number) for number in numbers])} of the search"


def result_line(row: Mapping[str, Any]) -> str:
    """What came of a run, in one sentence, from the chosen model's row of the summary."""
    free, step = row["free_run"], row.get("intervals") or {}
    line = f"{row['name']}: {reduced(free['test_mser_pct'])} squared error on test in free run"
    line += f" ({free['test_rmse_mv']:.2f} mV)"
    beyond = free.get("test_mser_recalibrated_pct")
    if beyond is not None and isfinite(beyond):
        line += f", {reduced(beyond)} than recalibrated"
    if step.get("coverage_pct") is not None:
        line += f"; {step['coverage_pct']:.1f} % covered one step ahead at {step['nominal_pct']:g} %"
    return f"{line}."


def reduced(percent: float) -> str:
    """'1.7 % less', or more."""
    return f"{abs(percent):.1f} % {'more' if percent < 0.0 else 'less'}"


def coefficients(candidate: Candidate) -> dict[str, dict[str, float]]:
    """term -> coefficient for both ensembles, and term -> inclusion probability."""
    bagging, stability = candidate.bagging, candidate.stability
    return {
        "bagging": bagging.coefficient_table(),
        "stability": stability.coefficient_table(),
        "inclusion": stability.inclusion_table() | bagging.inclusion_table(),
    }


def candidate_metrics(candidate: Candidate, shares: Mapping[str, float]) -> dict[str, float]:
    """What a candidate is judged by, without its intervals; shares : `valid_shares` of its problem."""
    reductions = valid_reductions(candidate, shares)
    return {
        "loss/oob": candidate.loss_oob,
        "loss/valid": candidate.loss_valid,
        "loss/valid_aesi_i": candidate.valid_losses[0],
        "loss/valid_aesi_ii": candidate.valid_losses[1],
        "loss/sparse": candidate.loss_sparse,
        "fitness": candidate.fitness,
        "pearson/train": candidate.pearson_train,
        "pearson/valid": candidate.pearson_valid,
        **{f"free_run/valid_{name}": value for name, value in reductions.items()},
        "one_step/valid_rmse_mv": MV_PER_V * candidate.one_step_valid_rmse_v,
    }


def _metrics(scored: ScoredCandidate, shares: Mapping[str, float]) -> dict[str, Any]:
    return candidate_metrics(scored.candidate, shares) | {
        "intervals/valid_coverage_pct": scored.coverage_pct,
        "intervals/valid_width_v": scored.width_v,
        "intervals/valid_width_mv": None if scored.width_v is None else MV_PER_V * scored.width_v,
        "intervals/valid_coverage_pct_aesi_ii": scored.stable_coverage_pct,
        "intervals/valid_width_v_aesi_ii": scored.stable_width_v,
    }


def _flat_metrics(row: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """The numbers of a table row as metrics: free_run/test_mser_pct and so on, what is no headline below tables/."""
    result: dict[str, float] = {}
    for name, value in row.items():
        if name in NO_METRICS:
            continue
        if isinstance(value, Mapping):
            below = prefix or ("" if name in HEADLINES else "tables/")
            result |= _flat_metrics(value, f"{below}{WITH_UNIT.get(name, name)}/")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            result[f"{prefix}{OF_A_MODEL.get(name, name)}"] = float(value)
            if name.endswith("_width_v"):  # read in millivolts; the summary's own name stays beside it
                result[f"{prefix}{name.removesuffix('v')}mv"] = MV_PER_V * value
    return result
