"""Initial view of MLflow's pages: a description of the experiment, and the columns of its table of runs.

MLflow keeps a view of an experiment as a tag of it and opens it by name, `?viewStateShareKey=aesi` in the address,
which `aesi ui` prints. Without it the table shows no figure at all. Tags that are there already stay, so what a person
has written or saved is not overwritten.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

VIEW = "aesi"
TRAINING = "workflowType=machine_learning"
"""The end of an address without which MLflow opens on what it has for language models, where runs are hard to find."""
NOTE = "mlflow.note.content"
KIND_OF_EXPERIMENT = {"mlflow.experimentKind": "custom_model_development"}
"""Else MLflow asks everybody who opens the experiment whether it is about language models."""

RUN_COLUMNS = (
    "params.`chosen_model`",
    "metrics.`free_run/test_rmse_mv`",
    "metrics.`free_run/test_mser_pct`",
    "metrics.`intervals/coverage_pct`",
    "metrics.`intervals/average_width_mv`",
    "metrics.`fitness`",
    "metrics.`free_run/valid_mser_pct`",
    "metrics.`intervals/valid_coverage_pct`",
    "metrics.`terms`",
    "tags.`aesi.chosen`",
    "tags.`aesi.fallback`",
)
"""Of a run its chosen model's figures on test; of a candidate those that it was chosen by."""
DISCOVERY_COLUMNS = (
    "tags.`finding`",
    "tags.`verdict`",
    "params.`cell`",
    "params.`data`",
    "metrics.`before/test_rmse_mv`",
    "metrics.`recalibrated/test_rmse_mv`",
    "metrics.`after/test_rmse_mv`",
    "metrics.`gain_nats`",
    "metrics.`confidence`",
)
BATCH_COLUMNS = (
    "params.`finding`",
    "params.`verdict`",
    "params.`reason`",
    "metrics.`before/test_rmse_mv`",
    "metrics.`recalibrated/test_rmse_mv`",
    "metrics.`after/test_rmse_mv`",
    "tags.`batch`",
)
UNFOLDED = "once they are sorted by a figure: in the order of time MLflow folds them into their runs"
HOW_TO_READ = (
    "A run is one `aesi run`, and the table lists those alone: it loads a hundred rows at a time, which one run's "
    "candidates would fill. With the filter ``tags.`aesi.kind` = 'candidate'`` it lists candidates (the one that the "
    f"models come from is tagged `aesi.chosen`), with `'model'` the final models, {UNFOLDED}. `free_run/` is without "
    "any measured voltage after the first sample, `one_step/` and `intervals/` are one step ahead. Sort candidates by "
    "`free_run/valid_mser_pct` (against the declared model; `free_run/valid_mser_recalibrated_pct` against the "
    "recalibrated one): selection never meets the test records."
)
HOW_TO_READ_DISCOVERIES = (
    "A run is one `aesi discover`, and the table lists those alone; with the filter "
    "``tags.`aesi.kind` = 'hypothesis'`` it lists the hypotheses, with what each says of unseen data (`gain_nats`), "
    f"{UNFOLDED}. Each is called by its effects and by how far the cell's file was believed (`trust`), fitted again at "
    "the same trust by the number of the fit, too. `finding` is the verdict in a line; the report is "
    "among the artifacts."
)
HOW_TO_READ_BATCHES = (
    "A run is one `aesi batch`, and the table lists its cells: what the model of each lacks, or why the cell could not "
    "be used (`reason`), and the error on held-out data, RMSE in free run, as declared (`before/`), recalibrated and "
    "with the finding (`after/`). With the filter ``tags.`aesi.kind` = 'run'`` it lists whole batches; the page of all "
    "cells, `index.html`, is among the artifacts of each."
)
WHOLE_RUNS = "tags.`aesi.kind` = 'run'"
CELLS = "tags.`aesi.kind` = 'cell'"


VIEW_TAG = f"mlflow.sharedViewState.{VIEW}"


def experiment_tags(note: str, columns: Sequence[str], rows: str = WHOLE_RUNS) -> dict[str, str]:
    """Tags of an experiment: its description in Markdown, its kind, and the view that shows these columns.

    rows : MLflow's filter for the runs that the table lists.
    """
    return {NOTE: note, VIEW_TAG: _state(columns, rows), **KIND_OF_EXPERIMENT}


def of_both_kinds(tags: Mapping[str, str], there: Mapping[str, str]) -> dict[str, str]:
    """The view of an experiment that has runs and discoveries: with the columns of both, where what is there is ours
    for the other kind alone; else nothing."""
    kinds = {_state(columns) for columns in (RUN_COLUMNS, DISCOVERY_COLUMNS)}
    if {tags.get(VIEW_TAG), there.get(VIEW_TAG)} != kinds:
        return {}
    return {VIEW_TAG: _state((*RUN_COLUMNS, *DISCOVERY_COLUMNS))}


def _state(columns: Sequence[str], rows: str = WHOLE_RUNS) -> str:
    state = {"selectedColumns": list(columns), "searchFilter": rows}
    if rows != WHOLE_RUNS:  # in the order of time MLflow folds nested runs into those above them
        state |= {"orderByKey": "tags.`mlflow.runName`", "orderByAsc": True}
    return json.dumps(state)


def view_of(experiment_id: str) -> str:
    """The part of an address after the server's that opens an experiment with its columns."""
    return f"#/experiments/{experiment_id}/runs?{TRAINING}&viewStateShareKey={VIEW}"
