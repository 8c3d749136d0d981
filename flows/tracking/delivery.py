"""How each kind of item reaches the tracking store; sent a second time, none of them doubles anything."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from flows.base import environment
from flows.tracking.outbox import Item, OfAnotherVersion
from flows.tracking.store import NUMBER, PARENT
from flows.tracking.view import of_both_kinds
from flows.tracking.whole_run import NestedRun, insert_run, new_artifact_uri

if TYPE_CHECKING:
    from mlflow.entities import RunInfo

    from flows.tracking.store import Store


def _send_run(store: Store, item: Item, again: bool) -> None:
    """A finished nested run: parameters, metrics, files.  again : whether it may be there already, in whole or in
    part."""
    run = NestedRun.of(item)  # whole, before a part of it is anywhere
    found = store.child(run.experiment_id, run.parent, run.label) if again else None
    tags = {PARENT: run.parent, NUMBER: run.label, **run.tags}
    if found is None and store.local:
        artifacts = new_artifact_uri(store.artifact_place(run.experiment_id))
        _write_files(store, artifacts, run.files)
        insert_run(store.database, run, artifacts, tags)
    else:
        _send_run_by_client(store, run, tags, found and found.info)


def _send_run_by_client(store: Store, run: NestedRun, tags: Mapping[str, str], info: RunInfo | None) -> None:
    """To a server, or the rest of what has arrived in part; info : of the run that is there already.

    A run of which the store refuses a part is FAILED there until it is whole, not RUNNING for ever.
    """
    from mlflow.entities import Metric, Param, RunTag

    metrics = [Metric(k, v, run.end_ms, 0) for k, v in run.metrics.items()]
    params = [Param(k, v) for k, v in run.params.items()]
    late = [RunTag(k, v) for k, v in tags.items()] if info is not None else []
    if info is None:
        info = store.client.create_run(
            run.experiment_id, start_time=run.start_ms, run_name=run.name, tags=dict(tags)
        ).info
    try:
        store.client.log_batch(info.run_id, metrics=metrics, params=params, tags=late)
        _write_files(store, info.artifact_uri, run.files)
    except Exception as error:
        if not store.away(error):
            store.client.set_terminated(info.run_id, "FAILED", run.end_ms)
        raise
    store.client.set_terminated(info.run_id, run.status, run.end_ms)


def _write_files(store: Store, artifact_uri: str, files: Mapping[str, str]) -> None:
    """Text artifacts, to where the run is known to keep them: the client would ask the store once a file."""
    from mlflow.store.artifact.artifact_repository_registry import get_artifact_repository
    from mlflow.utils.file_utils import local_file_uri_to_path

    if not files:
        return
    if artifact_uri.startswith("file:"):
        _write_texts(Path(local_file_uri_to_path(artifact_uri)), files)
        return
    with TemporaryDirectory(prefix="aesi-") as folder:
        _write_texts(Path(folder), files)
        get_artifact_repository(artifact_uri, store.uri).log_artifacts(folder)


def _write_texts(folder: Path, files: Mapping[str, str]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _send_batch(store: Store, item: Item) -> None:
    """Parameters, metrics and tags of a run that exists."""
    from mlflow.entities import Metric, Param, RunTag

    store.client.log_batch(
        item["run_id"],
        metrics=[Metric(k, v, item["at_ms"], item.get("step", 0)) for k, v in item["metrics"].items()],
        params=[Param(k, v) for k, v in item["params"].items()],
        tags=[RunTag(k, v) for k, v in item["tags"].items()],
    )


def _send_datasets(store: Store, item: Item) -> None:
    from mlflow.entities import Dataset, DatasetInput, InputTag

    inputs = [
        DatasetInput(
            Dataset(d["name"], d["digest"], "local", d["source"], profile=d["profile"]),
            [InputTag("mlflow.data.context", d["role"])],
        )
        for d in item["datasets"]
    ]
    store.client.log_inputs(item["run_id"], inputs)


def _send_files(store: Store, item: Item) -> None:
    """A file or a folder as artifacts."""
    source = environment.workspace() / item["path"]
    if source.is_dir():
        store.client.log_artifacts(item["run_id"], str(source), item["to"])
    elif source.is_file():
        store.client.log_artifact(item["run_id"], str(source), item["to"])
    else:
        raise ValueError(f"{source} is gone")


def _send_json(store: Store, item: Item) -> None:
    store.client.log_dict(item["run_id"], item["content"], item["name"])


def _send_model(store: Store, item: Item) -> None:
    from flows.tracking.serving.logged_model import log_hybrid

    folder = environment.workspace() / item["path"]
    log_hybrid(store.uri, item["run_id"], folder, item["registered_as"])


def _send_end(store: Store, item: Item) -> None:
    store.client.set_terminated(item["run_id"], item["status"], item["at_ms"])


def _send_mark(store: Store, item: Item) -> None:
    """Tags of a nested run that was sent before."""
    run = store.child(item["experiment_id"], item["parent"], item["label"])
    if run is not None:
        for key, value in item["tags"].items():
            store.client.set_tag(run.info.run_id, key, value)


def _send_experiment(store: Store, item: Item) -> None:
    """Tags of the experiment that are not there yet: what a person has written stays."""
    there = store.client.get_experiment(item["experiment_id"]).tags
    new = {key: value for key, value in item["tags"].items() if key not in there}
    for key, value in (new | of_both_kinds(item["tags"], there)).items():
        store.client.set_experiment_tag(item["experiment_id"], key, value)


SENDERS: dict[str, Callable[[Store, Item], None]] = {
    "mark": _send_mark,
    "experiment": _send_experiment,
    "batch": _send_batch,
    "datasets": _send_datasets,
    "files": _send_files,
    "json": _send_json,
    "model": _send_model,
    "end": _send_end,
}
"""Kind of item -> what sends it to a store, for the kinds that MLflow itself does not double. A nested run is the other
one (`_send_run`): each request would make a new one."""


def deliver(store: Store, item: Item, again: bool) -> None:
    """Send an item.  again : whether it may have been sent before.

    Raises OfAnotherVersion for one that lacks what is sent of its kind, or is of an unknown kind.
    """
    kind = item.get("kind")
    if kind == "run":
        _send_run(store, item, again)
    elif kind in SENDERS:
        SENDERS[kind](store, item)
    else:
        raise OfAnotherVersion(f"its kind {kind!r} is not known here")
