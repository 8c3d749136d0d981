"""How each kind of item reaches the tracking store; sent a second time, none of them doubles anything."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from flows.tracking.outbox import Item
from flows.tracking.store import NUMBER, PARENT

if TYPE_CHECKING:
    from mlflow.entities import RunInfo

    from flows.tracking.store import Store


def _send_run(store: Store, item: Item, again: bool) -> None:
    """A finished nested run: parameters, metrics, files."""
    from mlflow.entities import Metric, Param, RunTag

    info = _sent_before(store, item) if again else None
    tags = {PARENT: item["parent"], NUMBER: item["label"], **item["tags"]}
    if info is None:
        info = store.client.create_run(
            item["experiment_id"], start_time=item["start_ms"], run_name=item["name"], tags=tags
        ).info
    store.client.log_batch(
        info.run_id,
        metrics=[Metric(k, v, item["end_ms"], 0) for k, v in item["metrics"].items()],
        params=[Param(k, v) for k, v in item["params"].items()],
        tags=[RunTag(k, v) for k, v in tags.items()] if again else [],
    )
    _write_files(store, info.artifact_uri, item["files"])
    store.client.set_terminated(info.run_id, item["status"], item["end_ms"])


def _write_files(store: Store, artifact_uri: str, files: Mapping[str, str]) -> None:
    """Text artifacts, to where the run is known to keep them: the client would ask the store once a file."""
    from mlflow.store.artifact.artifact_repository_registry import get_artifact_repository

    if not files:
        return
    with TemporaryDirectory(prefix="aesi-") as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text, encoding="utf-8")
        get_artifact_repository(artifact_uri, store.uri).log_artifacts(folder)


def _send_batch(store: Store, item: Item, again: bool) -> None:
    """Parameters, metrics and tags of a run that exists."""
    from mlflow.entities import Metric, Param, RunTag

    store.client.log_batch(
        item["run_id"],
        metrics=[Metric(k, v, item["at_ms"], item.get("step", 0)) for k, v in item["metrics"].items()],
        params=[Param(k, v) for k, v in item["params"].items()],
        tags=[RunTag(k, v) for k, v in item["tags"].items()],
    )


def _send_datasets(store: Store, item: Item, again: bool) -> None:
    from mlflow.entities import Dataset, DatasetInput, InputTag

    inputs = [
        DatasetInput(
            Dataset(d["name"], d["digest"], "local", d["source"], profile=d["profile"]),
            [InputTag("mlflow.data.context", d["role"])],
        )
        for d in item["datasets"]
    ]
    store.client.log_inputs(item["run_id"], inputs)


def _send_files(store: Store, item: Item, again: bool) -> None:
    """A file or a folder as artifacts."""
    source = Path(item["path"])
    if source.is_dir():
        store.client.log_artifacts(item["run_id"], str(source), item["to"])
    elif source.is_file():
        store.client.log_artifact(item["run_id"], str(source), item["to"])
    else:
        raise ValueError(f"{source} is gone")


def _send_json(store: Store, item: Item, again: bool) -> None:
    store.client.log_dict(item["run_id"], item["content"], item["name"])


def _send_model(store: Store, item: Item, again: bool) -> None:
    from flows.tracking.logged_model import log_hybrid

    log_hybrid(store.uri, item["run_id"], Path(item["path"]), item["registered_as"])


def _send_end(store: Store, item: Item, again: bool) -> None:
    store.client.set_terminated(item["run_id"], item["status"], item["at_ms"])


def _sent_before(store: Store, item: Item) -> RunInfo | None:
    found = store.children(item["experiment_id"], item["parent"]).get(item["label"])
    return None if found is None else found.info


SENDERS: dict[str, Callable[[Store, Item, bool], None]] = {
    "run": _send_run,
    "batch": _send_batch,
    "datasets": _send_datasets,
    "files": _send_files,
    "json": _send_json,
    "model": _send_model,
    "end": _send_end,
}
"""Kind of item -> what sends it: to a store, an item, and whether it may have been sent before."""


def deliver(store: Store, item: Item, again: bool) -> None:
    """Send an item; `again` says that it may have been sent before."""
    SENDERS[item["kind"]](store, item, again)
