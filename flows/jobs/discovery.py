"""`aesi discover` as a flow: trace the residual, track every hypothesis, write the finding.

cell and data -> hypotheses -> verdict -> discovery.json, report, model
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aesi.constants import MV_PER_V
from aesi.numerics.files.source_digest import source_digest
from aesi.pipeline.experiment.config import ExperimentConfig
from aesi.pipeline.experiment.sections import TrackingConfig
from aesi.pipeline.product.contents import contents
from aesi.pipeline.written import ARCHIVE, FINDING, REPORT
from flows.base import environment
from flows.base.console import Console, duration
from flows.base.folder_lock import alone_in
from flows.base.interrupt import kept_on_interrupt
from flows.jobs.run_session import tracked_job

if TYPE_CHECKING:
    from aesi.pipeline.discovery.discover import Case
    from aesi.tracer import Discovery
    from aesi.tracer.discovery import TriedHypothesis
    from flows.jobs.stages import Stages
    from flows.tracking.tracker import Subject, Tracker

EXPERIMENT = "discover"


@dataclass(frozen=True)
class TrackedUnder:
    """The name that a discovery is tracked under, and the store and what it is sent; an experiment file says both."""

    name: str = EXPERIMENT
    tracking: TrackingConfig = field(default_factory=TrackingConfig)

    @classmethod
    def of(cls, config: ExperimentConfig) -> TrackedUnder:
        """As the experiment has it."""
        return cls(config.name, config.tracking)


def check_case(case: Case) -> None:
    """Raise AesiError, one sentence, for a cell, an effect file or records that cannot be used."""
    from aesi.tracer.discovery import inverse_problem

    given = case.declared()
    inverse_problem(
        given.cell,
        case.measurements,
        case.soc0,
        case.kept_back,
        case.tried(),
        given.effects,
        good=case.good,
    )


def finding_folder(config: ExperimentConfig) -> Path:
    """Where the finding of an experiment goes when no folder is named."""
    return environment.workspace() / "runs" / config.name / "discovery"


def run_discovery(
    case: Case, out: Path, run: Stages, console: Console, under: TrackedUnder
) -> dict[str, Any]:
    """The flow itself; `run` runs a stage.  Raises InputError where another process writes to `out` now."""
    from aesi.pipeline.discovery.discover import run_case, write_discovery
    from aesi.pipeline.notes import together

    started = time.monotonic()
    kept = f"What was fitted is kept in {out}; the same command goes on from there."
    title = ", ".join(m.name for m in case.measurements)
    with alone_in(out):
        if (out / ARCHIVE).exists():
            console.say(_earlier_sentence(out))
        with tracked_job(_subject(case, under), title, console) as tracker, kept_on_interrupt(kept):
            _track_case(tracker, case)
            follow = HypothesisTracker(tracker, console)
            found = run("hypotheses", lambda: run_case(case, out, follow))
            run_id = tracker.run_id if tracker is not None else ""
            content: dict[str, Any] = run("report", lambda: write_discovery(out, case, found, run_id))
            _track_result(tracker, found, content, out)
        run.publish("discovery", _page(content, out, tracker), "What the model lacks")
        notes = together((*case.restrictions, *case.assumed, *found.notes), [m.name for m in case.records])
        _say_result(console, content, notes, out, started)
    return content


def _earlier_sentence(out: Path) -> str:
    """A sentence on a folder in which an earlier search left its fits and, unless it was stopped, its finding."""
    replaced = ", and its finding is replaced when this search ends" if (out / FINDING).exists() else ""
    fits = "fits of the same cell and records by this version are taken up again"
    return f"{out} holds an earlier search: {fits}{replaced}."


def _page(content: dict[str, Any], out: Path, tracker: Tracker | None) -> str:
    """The finding as Prefect shows it: verdict, errors, and where the rest is."""
    from aesi.pipeline.report.words.discoveries import reason_finding, states_of

    lines = [f"# {content['verdict']}: {', '.join(content['effects']) or 'nothing to add'}", ""]
    lines += [reason_finding(content), "", "| model | fit, mV | test, mV |", "|---|---:|---:|"]
    for state, words in states_of(content).items():
        figures = [content[state].get(part, {}).get("rmse_mv") for part in ("fit", "test")]
        shown = " | ".join("" if value is None else f"{value:.2f}" for value in figures)
        lines.append(f"| {words} | {shown} |")
    lines += ["", f"Report: `{out / REPORT}`", ""]
    if tracker is not None:
        lines.append(f"Tracked: [{tracker.run_id}]({tracker.address})")
    return "\n".join(lines)


class HypothesisTracker:
    """Shows and tracks each hypothesis as it is judged."""

    def __init__(self, tracker: Tracker | None, console: Console) -> None:
        self._tracker, self._console = tracker, console
        self._started, self._done = time.monotonic(), 0
        self._fits: Counter[str] = Counter()

    def __call__(self, tried: TriedHypothesis) -> None:
        """One hypothesis: what it says of unseen data, its error and its parameters."""
        self._done += 1
        name = "+".join(tried.effects)
        # How many there will be is not known: each is judged by what the ones before it left.
        self._console.count("hypotheses", self._done, self._started, name)
        if self._tracker is None:
            return
        parameters = {
            f"{owner}.{key}": v for owner, given in tried.values.items() for key, v in given.items()
        }
        metrics = {
            "gain_nats": tried.gain_nats,
            "fit/rmse_mv": MV_PER_V * tried.rmse_v,
            "model_error_mv": MV_PER_V * tried.delta_v,
            "simulations": float(tried.simulations),
        }
        title = f"{name or 'nothing'}, {tried.trust}"
        self._fits[title] += 1
        self._tracker.nested(
            f"{name}#{self._done}",
            title if self._fits[title] == 1 else f"{title}, fit {self._fits[title]}",
            "hypothesis",
            {"hypothesis": name, "trust": tried.trust, **parameters},
            metrics,
        )


def _subject(case: Case, under: TrackedUnder) -> Subject:
    from flows.tracking.tracker import Subject

    key = sha256(repr(_asked(case)).encode()).hexdigest()[:16]
    return Subject(under.name, case.seed, key, "discovery", under.tracking)


def _asked(case: Case) -> dict[str, Any]:
    """What was asked, by name: cell, records and options."""
    given = case.declared()
    cell = json.dumps(given.cell.to_bpx(), sort_keys=True) + repr(given.effects)
    asked = {
        "cell": given.cell.name,
        "cell_digest": sha256(cell.encode()).hexdigest()[:16],
        "data": ", ".join(m.name for m in case.measurements),
        "data_digest": ", ".join(m.digest for m in case.measurements),
        "test": ", ".join(m.name for m in case.tests),
        "test_digest": ", ".join(m.digest for m in case.tests),
        "good": ", ".join(m.name for m in case.good),
        "good_digest": ", ".join(m.digest for m in case.good),
        "hold_asked": ", ".join(dict.fromkeys(m.hold for m in case.records if m.hold is not None)),
        "model_asked": case.model or "",
        "effect_files": ", ".join(file.name for file in case.effect_files),
        "effect_files_digest": "".join(sha256(held).hexdigest()[:16] for held in contents(case.effect_files)),
        "only": ", ".join(case.only),
        "without": ", ".join(case.without),
    }
    options = {
        "soc0": case.soc0,
        "soh": case.soh,
        "holdout": case.kept_back,
        "max_effects": case.max_effects,
        "seed": case.seed,
    }
    return {name: value for name, value in asked.items() if value} | options


def _track_case(tracker: Tracker | None, case: Case) -> None:
    """What was asked, from the start on: a search that fails or is stopped can be told from others too."""
    if tracker is None:
        return
    from flows.tracking.experiment_log import CODE
    from flows.tracking.provenance import versions
    from flows.tracking.view import DISCOVERY_COLUMNS, HOW_TO_READ_DISCOVERIES, experiment_tags

    tracker.about(experiment_tags(HOW_TO_READ_DISCOVERIES, DISCOVERY_COLUMNS))
    tracker.parameters(_asked(case) | {"versions": versions()}, {CODE: source_digest()})


def _track_result(tracker: Tracker | None, found: Discovery, content: dict[str, Any], out: Path) -> None:
    """What came of it."""
    if tracker is None:
        return
    from aesi.pipeline.report.words.discoveries import reason_finding, short_finding
    from aesi.pipeline.report.words.moved import moved_summary
    from aesi.tracer.report.outcome import STATES
    from flows.tracking.view import NOTE

    tracker.parameters(
        {"model": found.choice.model, "hold": ", ".join(dict.fromkeys(f.hold for f in found.files))},
        {
            "verdict": content["verdict"],
            "effects": ", ".join(content["effects"]),
            "finding": short_finding(content),
            NOTE: f"{short_finding(content)}\n\n{reason_finding(content)}",
            **{
                f"moved_{state}": moved_summary(rows)
                for state, rows in content["own_parameters"].items()
                if moved_summary(rows)
            },
        },
    )
    errors = {
        f"{state}/{part}_rmse_mv": content[state][part]["rmse_mv"]
        for state in STATES
        for part in ("fit", "test")
        if content[state].get(part)
    }
    names = ("confidence", "noise_floor_mv", "explainable_mv", "structured_mv")
    figures = {name: content[name] for name in names if content[name] is not None}
    tracker.metrics(errors | figures | {"seconds": content["seconds"]})
    for name in (FINDING, REPORT):
        tracker.files(out / name)


def _say_result(
    console: Console, content: dict[str, Any], notes: Sequence[str], out: Path, started: float
) -> None:
    from aesi.pipeline.report.words.discoveries import (
        look_alike_finding,
        next_finding,
        reason_finding,
        short_finding,
        written_finding,
    )
    from aesi.pipeline.report.words.moved import moved_findings

    console.say(short_finding(content, with_confidence=True))
    for warning in content["warnings"]:
        console.say(f"  WARNING: {warning}")
    said = (
        written_finding(content),
        reason_finding(content),
        next_finding(content),
        look_alike_finding(content),
        *moved_findings(content),
    )
    for sentence in filter(None, said):
        console.say(f"  {sentence}")
    for part in ("fit", "test"):
        if content["before"].get(part):
            console.say(f"  {part}: {_errors_of(content, part)}")
    for note in notes:
        console.say(f"  {note}")
    console.say(f"Finished in {duration(time.monotonic() - started)}. Report: {out / REPORT}")


def _errors_of(content: dict[str, Any], part: str) -> str:
    """The errors of one part; that of `after` only where it is more than a refit, and none of a model that cannot be
    simulated there."""
    from aesi.pipeline.report.words.discoveries import states_of

    told = ((content[state].get(part), words) for state, words in states_of(content).items())
    return ", ".join(f"{row['rmse_mv']:.2f} mV {words}" for row, words in told if row)
