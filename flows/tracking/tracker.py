"""What is tracked of a run: the parent, a nested run per candidate, the models, the data, the machine.

Everything goes through the outbox, so tracking neither slows nor stops the work, and nothing is lost with it.
"""

from __future__ import annotations

import json
import math
import posixpath
import re
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, Protocol

from aesi.errors import AesiError
from aesi.logins import without_login
from aesi.pipeline.experiment.sections import TrackingConfig
from flows.base import environment
from flows.tracking.delivery import deliver
from flows.tracking.outbox import FLUSH_S, Outbox
from flows.tracking.provenance import source_tags
from flows.tracking.store import EXPERIMENT, JOB, KIND, Store, now_ms
from flows.tracking.view import TRAINING
from flows.tracking.whole_run import NestedRun

PARAMETER_LIMIT = 6000  # MLflow cuts longer ones off
CUT = "… sha256 "
"""What stands between the beginning of a longer parameter and the hash of all of it."""
NAME_LIMIT = 250
"""Letters that MLflow's tables have for the name of a run and for that of a parameter. PostgreSQL refuses a longer name
of a run, and with it the run: a discovery is called by all of its records."""
NAME = re.compile(r"[\w.\- /]+")
"""What the name of a parameter may be made of on every system."""
FAILED = "aesi.failed"
"""Tag of a nested run: why it failed."""
SAMPLE_S = 10.0
"""Time between two readings of memory and processor, s."""
LOCAL_UI = "http://127.0.0.1:5000"


class BegunOtherwise(AesiError):
    """A run that is gone on with was begun with something else, which would be tracked as the same."""


class Trackable(Protocol):
    """What a tracker has to know of a job; an experiment is one."""

    @property
    def name(self) -> str: ...

    @property
    def seed(self) -> int: ...

    @property
    def digest(self) -> str: ...

    @property
    def tracking(self) -> TrackingConfig: ...


@dataclass(frozen=True)
class Subject:
    """A `Trackable` that is no experiment file.

    job : what it is. Jobs are tracked under names that experiment files may have too, such as `batch`.
    """

    name: str
    seed: int
    digest: str
    job: Literal["discovery", "batch", "benchmark"]
    tracking: TrackingConfig = field(default_factory=TrackingConfig)


class Tracker:
    """Tracks one flow run, new or resumed.

    run_id : MLflow's id of the parent run, which also names the folder below runs/.  resumed : whether it is old.
    experiment_id : MLflow's id of the experiment.  title : what a new run is called; None names the experiment and the
    seed.  tags : what a new run carries beside its own.
    """

    def __init__(
        self,
        store: Store,
        config: Trackable,
        say: Callable[[str], None],
        run_id: str | None = None,
        title: str | None = None,
        tags: Mapping[str, str] | None = None,
    ) -> None:
        self.store = store
        self._config = config
        self._say = say
        self.experiment_id = store.experiment(config.name)
        self._tracked: set[str] = set()
        self._began: dict[str, str] = {}
        self.resumed = run_id is not None
        if run_id is None:
            job = config.job if isinstance(config, Subject) else EXPERIMENT
            own = {KIND: "run", JOB: job, "aesi.config_digest": config.digest, **source_tags()}
            name = title or f"{config.name}, seed {config.seed}"
            self.run_id = store.create_run(self.experiment_id, _short(name), {**own, **(tags or {})})
        else:
            self.run_id = run_id
            store.client.update_run(run_id, status="RUNNING")
            self._tracked = set(store.children(self.experiment_id, run_id))
            self._began = dict(store.run(run_id).data.params)
        self._outbox = Outbox(
            environment.state() / "outbox" / self.run_id, partial(deliver, store), store.away, say
        )
        for item in self._outbox.left:
            if item.get("kind") == "run":
                self._tracked.add(item.get("label", ""))
            elif item.get("kind") == "batch":
                self._began |= item.get("params", {})
        self._stop = threading.Event()
        if config.tracking.system_metrics:
            threading.Thread(target=self._sample, name="aesi-system", daemon=True).start()

    @property
    def address(self) -> str:
        """Where MLflow's UI shows the run: on the server, or on the one that `aesi ui` starts."""
        server = without_login(self.store.uri) if self.store.uri.startswith("http") else LOCAL_UI
        return f"{server.rstrip('/')}/#/experiments/{self.experiment_id}/runs/{self.run_id}?{TRAINING}"

    def parameters(self, values: Mapping[str, Any], tags: Mapping[str, str] | None = None) -> None:
        """Parameters of the parent run.

        Those that a resumed run began with stay, since MLflow changes none and would refuse the others with them; where
        one is another now, that is said.
        """
        texts = _texts(values)
        changed = {name for name, text in texts.items() if self._began.get(name, text) != text}
        if changed:
            told = ", ".join(f"{name} = {self._began[name]} (now {texts[name]})" for name in sorted(changed))
            self._say(f"tracking: the run stays tracked as it was begun, with {told}.")
        self._batch(params={k: v for k, v in texts.items() if k not in changed}, tags=dict(tags or {}))

    def as_begun(self, digests: Mapping[str, str]) -> None:
        """Raises BegunOtherwise where the run is gone on with and began on other records or another cell, by digest."""
        if any(self._began.get(name, text) != text for name, text in _texts(digests).items()):
            raise BegunOtherwise(
                f"run {self.run_id} was begun with records or a cell file that are others now, and its candidates "
                "would stand beside new ones of these; leave out --resume to start a new run."
            )

    def metrics(self, values: Mapping[str, float], step: int = 0) -> None:
        """Metrics of the parent run."""
        self._batch(metrics=_finite(values), step=step)

    def datasets(self, rows: Sequence[Mapping[str, str]]) -> None:
        """Records with name, digest, source, role and profile (a JSON text)."""
        self._outbox.put({"kind": "datasets", "run_id": self.run_id, "datasets": [dict(row) for row in rows]})

    def nested(
        self,
        label: str,
        name: str,
        kind: str,
        params: Mapping[str, Any],
        metrics: Mapping[str, float],
        files: Mapping[str, Any] | None = None,
        failed: str | None = None,
        seconds: float = 0.0,
        tags: Mapping[str, str] | None = None,
    ) -> None:
        """A nested run with JSON files; one that is tracked already (in a resumed run) is not tracked again."""
        if label in self._tracked:
            return
        self._tracked.add(label)
        end = now_ms()
        noted = {KIND: kind, **(tags or {})} | ({FAILED: failed[:5000]} if failed else {})
        run = NestedRun(
            experiment_id=self.experiment_id,
            parent=self.run_id,
            label=label,
            name=_short(name),
            tags=noted,
            params=_texts(params),
            metrics=_finite(metrics),
            files={name: json.dumps(content) for name, content in (files or {}).items()},
            status="FAILED" if failed else "FINISHED",
            start_ms=end - int(1000 * seconds),
            end_ms=end,
        )
        self._outbox.put({"kind": "run", **vars(run)})

    def mark(self, label: str, tags: Mapping[str, str]) -> None:
        """Tags of a nested run that is tracked already."""
        self._outbox.put(
            {
                "kind": "mark",
                "experiment_id": self.experiment_id,
                "parent": self.run_id,
                "label": label,
                "tags": dict(tags),
            }
        )

    def about(self, tags: Mapping[str, str]) -> None:
        """Tags of the experiment, where it has none of that name yet."""
        self._outbox.put({"kind": "experiment", "experiment_id": self.experiment_id, "tags": dict(tags)})

    def files(self, path: Path, to: str | None = None) -> None:
        """A file or a folder as artifacts of the parent run; they may be delivered from another folder later."""
        self._outbox.put({"kind": "files", "run_id": self.run_id, "path": _lasting(path), "to": to})

    def json(self, name: str, content: Any) -> None:
        """A JSON artifact of the parent run."""
        self._outbox.put({"kind": "json", "run_id": self.run_id, "name": name, "content": content})

    def model(self, folder: Path) -> None:
        """The chosen model, as a pyfunc that MLflow can serve."""
        if not self._config.tracking.log_model:
            return
        name = self._config.name if self._config.tracking.register_model else None
        self._outbox.put(
            {
                "kind": "model",
                "run_id": self.run_id,
                "path": _lasting(folder),
                "registered_as": name,
            }
        )

    def flush(self, wait_s: float = FLUSH_S) -> int:
        """Wait until the store has all; returns how many items it has not taken."""
        return self._outbox.flush(wait_s)

    def end(self, status: str, wait_s: float = FLUSH_S) -> int:
        """Close the parent run; returns how many items the store has not taken yet."""
        self.conclude(status)
        return self.close(wait_s)

    def conclude(self, status: str) -> None:
        """Keep on disk, for the store, that the parent run ends."""
        self._stop.set()
        self._outbox.put({"kind": "end", "run_id": self.run_id, "status": status, "at_ms": now_ms()})

    def close(self, wait_s: float) -> int:
        """Stop tracking; returns how many items the store has not taken yet."""
        left = self.flush(wait_s)
        self._outbox.close()
        return left

    @property
    def empty(self) -> bool:
        """Whether nothing has been tracked below the parent run."""
        return not self._tracked

    def withdraw(self, wait_s: float) -> None:
        """Take the run back, as if it had never begun: MLflow keeps it among its deleted runs.

        Raises OSError or MlflowException where the store does not; the run can be ended then.
        """
        self._stop.set()
        self.flush(wait_s)
        self.store.client.delete_run(self.run_id)
        self._outbox.close()

    def _batch(
        self,
        params: dict[str, str] | None = None,
        metrics: dict[str, float] | None = None,
        tags: dict[str, str] | None = None,
        step: int = 0,
    ) -> None:
        self._outbox.put(
            {
                "kind": "batch",
                "run_id": self.run_id,
                "params": params or {},
                "metrics": metrics or {},
                "tags": tags or {},
                "at_ms": now_ms(),
                "step": step,
            }
        )

    def _sample(self) -> None:
        """The machine's load under MLflow's own names, so that its system metrics page shows them."""
        import psutil

        step = 0
        psutil.cpu_percent()
        while not self._stop.wait(SAMPLE_S):
            memory = psutil.virtual_memory()
            reading = {
                "system/cpu_utilization_percentage": psutil.cpu_percent(),
                "system/system_memory_usage_megabytes": memory.used / 1e6,
                "system/system_memory_usage_percentage": memory.percent,
                "system/disk_usage_percentage": psutil.disk_usage("/").percent,
            }
            # A full disk is told by the run itself, and may have room for the next reading.
            with suppress(OSError):
                self.metrics(reading, step)
            step += 1


def flat(content: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested mappings as one level of dotted names.

    One with a key that is no part of a parameter's name, such as what a file may be called, stays whole: MLflow refuses
    all parameters that are sent with one that it does not take.
    """
    result: dict[str, Any] = {}
    for name, value in content.items():
        dotted = f"{prefix}{name}"
        if isinstance(value, Mapping) and value and all(_is_name(f"{dotted}.{key}") for key in value):
            result |= flat(value, f"{dotted}.")
        else:
            result[dotted] = value
    return result


def _is_name(text: str) -> bool:
    """Whether MLflow takes a text for the name of a parameter, which it may make a path of."""
    fits = len(text) <= NAME_LIMIT and NAME.fullmatch(text) is not None
    return fits and posixpath.normpath(text) == text


def _lasting(path: Path) -> str:
    """A path that is found from any folder; within the workspace also where that is moved: from the workspace."""
    path, home = path.resolve(), environment.workspace()
    return str(path.relative_to(home) if path.is_relative_to(home) else path)


def _short(name: str) -> str:
    return name if len(name) <= NAME_LIMIT else f"{name[: NAME_LIMIT - 1]}…"


def _texts(values: Mapping[str, Any]) -> dict[str, str]:
    return {name: _text(value) for name, value in values.items()}


def _text(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    if len(text) <= PARAMETER_LIMIT:
        return text
    mark = f"{CUT}{sha256(text.encode()).hexdigest()[:16]}"  # by which two that begin alike are told apart
    return text[: PARAMETER_LIMIT - len(mark)] + mark


def was_cut(text: str) -> bool:
    """Whether a tracked parameter is the beginning of a longer one alone."""
    return len(text) == PARAMETER_LIMIT and CUT in text


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    """Finite values alone: MLflow turns infinity into 1.8e308, which then draws every plot's scale."""
    return {
        name: float(value) for name, value in values.items() if value is not None and math.isfinite(value)
    }
