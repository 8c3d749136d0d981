"""A finished nested run into a local store in one transaction.

MLflow's client opens a run, adds to it and closes it: a dozen sessions, thirty statements and six commits, each of
which waits for the disk, 17 ms of processor for a candidate. Here its rows go through MLflow's own tables at once:
2 ms. What is written is what the client would have written, which `tests/flows/tracking/test_whole_run.py` holds it to.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from uuid import uuid4

from flows.tracking.outbox import Item

RUN_NAME = "mlflow.runName"
USER = "unknown"
"""What the client writes where no tag names a user."""


def insert_run(tracking: Any, item: Item, artifact_uri: str, tags: Mapping[str, str]) -> None:
    """Write the run of an item with its parameters, metrics and tags, or nothing of it.

    tracking : MLflow's SQLAlchemy store.  artifact_uri : where the run's files are; its id is the folder above.
    """
    from mlflow.store.tracking.dbmodels.models import SqlLatestMetric, SqlMetric, SqlParam, SqlRun, SqlTag

    run_id = artifact_uri.split("/")[-2]
    metrics = [
        {"run_uuid": run_id, "key": k, "value": v, "timestamp": item["end_ms"], "step": 0, "is_nan": False}
        for k, v in item["metrics"].items()
    ]
    rows: dict[Any, list[dict[str, Any]]] = {
        SqlRun: [_run(item, run_id, artifact_uri)],
        SqlTag: _pairs(run_id, {**tags, RUN_NAME: item["name"]}),
        SqlParam: _pairs(run_id, item["params"]),
        SqlMetric: metrics,
        SqlLatestMetric: metrics,
    }
    with tracking.engine.begin() as connection:
        for table, content in rows.items():
            if content:
                connection.execute(table.__table__.insert(), content)


def new_artifact_uri(experiment_uri: str) -> str:
    """The folder of a new run's files, as MLflow lays them out."""
    return f"{experiment_uri.rstrip('/')}/{uuid4().hex}/artifacts"


def _run(item: Item, run_id: str, artifact_uri: str) -> dict[str, Any]:
    return {
        "run_uuid": run_id,
        "name": item["name"],
        "artifact_uri": artifact_uri,
        "experiment_id": int(item["experiment_id"]),
        "source_type": "UNKNOWN",
        "source_name": "",
        "entry_point_name": "",
        "source_version": "",
        "user_id": USER,
        "status": item["status"],
        "start_time": item["start_ms"],
        "end_time": item["end_ms"],
        "lifecycle_stage": "active",
    }


def _pairs(run_id: str, values: Mapping[str, str]) -> list[dict[str, str]]:
    return [{"run_uuid": run_id, "key": key, "value": value} for key, value in values.items()]
