"""`aesi candidate`: any candidate of any tracked run, made again from the tracking store alone.

A run carries what its candidates were made from (the error series by role, the declared cell, the settings), and
every candidate its genome. An evaluation is a pure function of these, so the model and all its figures come back
to the last digit where the libraries are those of the run.

    from flows.results.candidate import rebuild
    rebuilt = rebuild("RUN_ID")
    rebuilt.candidate.bagging.free_run(rebuilt.problem.split.valid[0])
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from aesi.advice import listed
from aesi.errors import AesiError, FitError, InputError
from aesi.logins import without_login
from aesi.numerics.files.whole import write_whole
from aesi.pipeline.experiment.candidate import weights
from aesi.pipeline.experiment.config import ExperimentConfig, parse_experiment
from aesi.pipeline.experiment.fit import build_problem, final_models
from aesi.pipeline.experiment.intervals.conformalise import conformalise
from aesi.pipeline.experiment.judging.reductions import AGAINST, valid_shares
from aesi.pipeline.experiment.load import Loaded
from aesi.pipeline.product.hybrid import HybridModel
from aesi.pipeline.written import CANDIDATE, EXPERIMENT, MODEL
from aesi.records import Failed, LeftOutDrives
from aesi.sparse import Candidate, Genome, Problem, evaluate
from flows.base import codec
from flows.tracking.experiment_log import (
    DECLARED,
    INPUTS,
    LEFT_OUT,
    MEMBERS,
    RECORDS,
    candidate_metrics,
    coefficients,
    reduced,
)
from flows.tracking.provenance import COMMIT
from flows.tracking.store import KIND, PARENT, Store, is_of_experiment
from flows.tracking.tracker import FAILED

COMMIT_SHOWN = 10
GENES = ("lambda1", "lambda2", "tau", "p_c", "d", "feedback")


@dataclass(frozen=True, eq=False)
class Rebuilt:
    """A candidate made again.

    left_out : the training drives under physics that has not seen them.  tracked, metrics : its figures then and now,
    by MLflow's names.
    members : numbers of the candidates that the models of its run are the mean of, of one that they are; none where
    the run has not ended.
    """

    run_id: str
    number: int
    config: ExperimentConfig
    declared: HybridModel
    problem: Problem
    candidate: Candidate
    left_out: LeftOutDrives
    tracked: Mapping[str, float]
    metrics: Mapping[str, float]
    members: tuple[int, ...] = ()

    @property
    def differing(self) -> dict[str, tuple[float, float]]:
        """Figure -> (then, now) of those that are not equal to the last digit."""
        return {
            name: (self.tracked[name], value)
            for name, value in self.metrics.items()
            if name in self.tracked and self.tracked[name] != value
        }


def rebuild(run_id: str, uri: str | None = None) -> Rebuilt:
    """The candidate of a tracked run; for the run of an experiment, the fittest of those that were chosen.

    Raises InputError where the run is no candidate, had failed, or lacks what it was made from, where another version
    wrote that, or where it is not on this machine.
    """
    store = Store.to_read(uri)
    run = _candidate(store, run_id)
    parent = store.run(run.data.tags[PARENT])
    if away := store.files_away(parent):
        raise InputError(f"run {parent.info.run_id} cannot be read: {away}.")
    with _as_written(parent):
        read = partial(store.read, parent)
        config = parse_experiment(json.loads(read(EXPERIMENT).read_text(encoding="utf-8")))
        split, left_out = (codec.loads(read(f"{INPUTS}/{name}").read_bytes()) for name in (RECORDS, LEFT_OUT))
        declared = HybridModel.load(read(f"{INPUTS}/{DECLARED}"))
        genome, number = _genome(run), int(run.data.params["number"])
    loaded = Loaded(declared.cell, declared.cell.name, declared.effects, split, left_out, {}, {}, (), config)
    problem = build_problem(loaded, config)
    candidate = evaluate(problem, genome, weights(config))
    if isinstance(candidate, Failed):
        raise FitError(
            f"candidate {run_id} comes to nothing here ({candidate.reason}); it was made by an earlier version."
        )
    judged = candidate_metrics(candidate, valid_shares(problem, left_out))
    metrics = {name: float(value) for name, value in judged.items()}
    return Rebuilt(
        run.info.run_id,
        number,
        config,
        declared,
        problem,
        candidate,
        left_out,
        run.data.metrics,
        metrics,
        tuple(json.loads(parent.data.tags.get(MEMBERS, "[]"))),
    )


def save(rebuilt: Rebuilt, out: Path) -> Path:
    """Write candidate.json and the hybrid model of its better ensemble below `out`; the model's folder."""
    one = rebuilt.candidate.better
    only = rebuilt.config.model_copy(update={"models": (one.name,)})
    (fitted,) = conformalise(
        final_models(rebuilt.problem, rebuilt.candidate, only).fitted,
        rebuilt.problem,
        rebuilt.candidate,
        only,
        rebuilt.left_out,
    )
    model = replace(
        rebuilt.declared,
        correction=fitted.model,  # with the leverage that its fade and its bands ask for
        intervals=fitted.intervals,
        bands=fitted.bands,
        dt_s=rebuilt.config.data.dt_s,
        hold=rebuilt.config.data.hold,
    )
    model.save(out / MODEL)
    content = {
        "run_id": rebuilt.run_id,
        "number": rebuilt.number,
        "genome": rebuilt.candidate.genome.to_dict(),
        "model": one.name,
        "metrics": dict(rebuilt.metrics),
        "tracked": dict(rebuilt.tracked),
        "coefficients": coefficients(rebuilt.candidate),
    }
    write_whole(out / CANDIDATE, json.dumps(content, indent=1))
    return out / MODEL


def rebuilt_line(rebuilt: Rebuilt, out: Path) -> str:
    """What came back, in one line; of one of several candidates that the models of a run are the mean of, that too."""
    candidate = rebuilt.candidate
    declared, recalibrated = (rebuilt.metrics[f"free_run/valid_{name}"] for name in AGAINST)
    return (
        f"candidate {rebuilt.number}: {len(candidate.bagging.terms)} and {len(candidate.stability.terms)} terms, "
        f"{reduced(declared)} squared error on validation in free run, {reduced(recalibrated)} than recalibrated; "
        f"{candidate.better.name} is in {out / MODEL}{_one_of(rebuilt)}"
    )


def _one_of(rebuilt: Rebuilt) -> str:
    if len(rebuilt.members) < 2 or rebuilt.number not in rebuilt.members:
        return ""
    numbers = listed([str(number) for number in rebuilt.members])
    return f". It is one of several: the models of the run are the mean of candidates {numbers}"


class Differs(AesiError):
    """A candidate did not come back to the last digit."""

    def __init__(self, rebuilt: Rebuilt) -> None:
        name, (then, now) = next(iter(rebuilt.differing.items()))
        super().__init__(
            f"{len(rebuilt.differing)} figures differ from those tracked ({name}: {then!r} then, {now!r} now); compare "
            "the run's parameter `versions` with what is installed."
        )


def _candidate(store: Store, run_id: str) -> Any:
    """The tracked run of a candidate that did not fail."""
    run = store.run(run_id)
    if run.data.tags.get(KIND) == "run" and is_of_experiment(run):
        number = run.data.params.get("chosen_candidate")
        if number is None:
            raise InputError(
                f"run {run_id} has chosen no candidate yet; give the id of one of its candidates."
            )
        chosen = store.child(run.info.experiment_id, run.info.run_id, f"candidate:{number}")
        if chosen is None:
            raise InputError(
                f"run {run_id} chose candidate {number}, which is not in {without_login(store.uri)}: it was deleted, "
                "or waits in the workspace of its run, where `aesi tables` delivers it."
            )
        run = chosen
    if run.data.tags.get(KIND) != "candidate":
        raise InputError(f"run {run_id} is no candidate of a search, nor the run of an experiment.")
    if FAILED in run.data.tags:
        raise InputError(f"candidate {run_id} had failed: {run.data.tags[FAILED]}")
    if "terms" not in run.data.params:
        raise InputError(f"candidate {run_id} was tracked without its terms, by an earlier version.")
    return run


@contextmanager
def _as_written(run: Any) -> Iterator[None]:
    """What a run carries was written by the program: where it cannot be read, another version wrote it, or it was
    changed since. Raises InputError for either."""
    try:
        yield
    except (InputError, codec.Damaged, KeyError, ValueError) as error:
        commit = run.data.tags.get(COMMIT, "")
        by = f" (commit {commit[:COMMIT_SHOWN]})" if commit else ""
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error).rstrip(".")
        raise InputError(
            f"run {run.info.run_id} was made by an earlier version{by}, or its files were changed since: {reason}; run "
            "its experiment again with this version, or ask the one that made it."
        ) from None


def _genome(run: Any) -> Genome:
    params = run.data.params
    return Genome(terms=params["terms"], **{name: json.loads(params[name]) for name in GENES})
