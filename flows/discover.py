"""`aesi discover`: close the loop on measured data, every hypothesis a tracked run.

    read -> trace -> write

Fits are kept in the output folder as they are made, so the same command goes on where it was interrupted.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.pipeline.config import DataConfig, ExperimentConfig, TrackingConfig
from flows.console import Console, duration

if TYPE_CHECKING:
    from aesi.pipeline.discover import Case
    from flows.stages import Run

EXPERIMENT = "discover"


def discover(case: Case, out: Path, name: str = EXPERIMENT, uri: str | None = None) -> dict[str, Any]:
    """Trace one case and write its results to `out`; the content of discovery.json."""
    from flows.stages import plainly

    console = Console()
    return _discover(case, out, name, uri, plainly(console.say), console)


def discover_experiment(path: str, overrides: list[str], out: Path | None) -> dict[str, Any]:
    """Trace the case that an experiment file describes."""
    from aesi.pipeline.cases import case_of_experiment
    from aesi.pipeline.config import read_experiment
    from flows import environment

    config = read_experiment(path, overrides)
    folder = out or environment.workspace() / "runs" / config.name / "discovery"
    return discover(case_of_experiment(config), folder, config.name, config.tracking.uri)


def _discover(
    case: Case, out: Path, name: str, uri: str | None, run: Run, console: Console
) -> dict[str, Any]:
    from aesi.pipeline.discover import run_case, write_discovery
    from flows.mlflow_store import Store
    from flows.tracking import Tracker, deliver_leftovers

    started = time.monotonic()
    store = Store(uri)
    deliver_leftovers(store, console.say)
    tracker = Tracker(store, _as_experiment(case, name, uri), console.say)
    _track_case(tracker, case)
    follow = _Follow(console)
    try:
        found = run("trace", lambda: run_case(case, out, follow))
        content: dict[str, Any] = run("report", lambda: write_discovery(out, case, found, tracker.run_id))
        _track_found(tracker, content, out)
    except KeyboardInterrupt:
        tracker.end("KILLED", wait_s=5)
        console.say(f"Stopped. The fits so far are kept in {out}; the same command goes on from there.")
        raise
    except BaseException:
        tracker.end("FAILED", wait_s=10)
        raise
    tracker.end("FINISHED")
    effects = ", ".join(content["effects"]) or "no effect"
    console.say(f"Verdict: {content['verdict']} ({effects}) in {duration(time.monotonic() - started)}.")
    console.say(f"Report: {out / 'report.html'}")
    return content


class _Follow:
    """Says which hypothesis was fitted, at most every few seconds where lines cannot be overwritten."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._count = 0
        self._started = time.monotonic()

    def __call__(self, hypothesis: str, scored: Any, admission: Any) -> None:
        self._count += 1
        rmse = 1e3 * scored.held_out_rmse_v
        self._console.count(
            "hypotheses", self._count, self._started, f"{hypothesis or 'as declared'} {rmse:.2f} mV"
        )


def _track_case(tracker: Any, case: Case) -> None:
    from flows.tracking import versions

    tracker.parameters(
        {
            "cell": case.cell.name,
            "soc0": case.soc0,
            "holdout": case.holdout,
            "max_effects": case.max_effects,
            "seed": case.seed,
            "versions": versions(),
        }
    )
    tracker.datasets(
        [
            {
                "name": measurement.name,
                "digest": measurement.digest,
                "source": measurement.source,
                "role": role,
                "profile": f'{{"rows": {len(measurement)}}}',
            }
            for role, group in (("fit", case.measurements), ("test", case.tests))
            for measurement in group
        ]
    )


def _track_found(tracker: Any, content: dict[str, Any], out: Path) -> None:
    """A nested run a hypothesis; verdict, errors and report with the parent."""
    for candidate in content["candidates"]:
        values = {f"parameter/{k}": p["value"] for k, p in candidate["parameters"].items()}
        tracker.nested(
            label=f"hypothesis:{candidate['effect']}",
            name=candidate["effect"],
            kind="hypothesis",
            params={"effect": candidate["effect"], "kind": candidate["kind"]},
            metrics={"score": candidate["score"], "test_rmse_mv": candidate["test_rmse_mv"], **values},
            files={"hypothesis.json": candidate},
        )
    tracker.parameters({"verdict": content["verdict"], "effects": content["effects"]})
    tracker.metrics(
        {
            f"{state}/{part}_{figure}": value
            for state in ("before", "recalibrated", "after")
            for part, figures in content[state].items()
            for figure, value in figures.items()
        }
        | {key: content[key] for key in ("confidence", "noise_floor_mv", "explainable_mv")}
    )
    for file in ("discovery.json", "report.html"):
        tracker.files(out / file)
    tracker.files(out / "model", "model_folder")


def _as_experiment(case: Case, name: str, uri: str | None) -> ExperimentConfig:
    """The name, seed and data under which a case is tracked."""
    names = tuple(m.source or m.name for m in case.measurements)
    return ExperimentConfig(
        name=name,
        seed=case.seed,
        data=DataConfig(
            kind="files", train=names, test=tuple(m.source or m.name for m in case.tests) or names
        ),
        tracking=TrackingConfig(uri=uri, register_model=False),
    )
