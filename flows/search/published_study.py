"""The study as Optuna's dashboard shows it: in Optuna's storage, under readable names, while the search goes on.

The search itself keeps its study in memory, because it is rebuilt from what is known of its candidates whenever it
starts. This copy outlives the process: a journal file in the workspace, or the database of `runner.storage`. It
is written once a candidate, from what the search has told, and Optuna's dashboard shows it (`aesi ui --optuna`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import optuna
from optuna.distributions import BaseDistribution
from optuna.exceptions import ExperimentalWarning
from optuna.storages import BaseStorage, JournalStorage, RDBStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState, create_trial

from aesi.errors import first_line
from aesi.pipeline.experiment.candidate import ScoredCandidate
from aesi.records import Failed
from aesi.sparse import Genome
from aesi.sparse.search.genome import GENE_WORDS
from aesi.sparse.search.genome_space import GenomeSpace
from flows.base import environment
from flows.base.databases import limits, with_driver
from flows.search.nsga2 import Constraints
from flows.search.term_sampler import distributions

LOSSES = ("loss out of bag", "loss on validation", "terms")
CANDIDATE = "candidate"


def journal() -> Path:
    """The file that holds the studies of the workspace."""
    return environment.state() / "optuna" / "journal.log"


def study_storage(url: str | None = None) -> BaseStorage:
    """Optuna's storage at a database URL, or the journal of the workspace."""
    if url:
        return RDBStorage(with_driver(url), engine_kwargs=limits(url))
    journal().parent.mkdir(parents=True, exist_ok=True)
    return JournalStorage(JournalFileBackend(str(journal())))


class PublishedStudy:
    """The copy of one study. A storage that fails is said once; the search goes on without the copy."""

    def __init__(
        self,
        name: str,
        url: str | None,
        constraints: Constraints,
        space: GenomeSpace,
        say: Callable[[str], None],
    ) -> None:
        self._constraints = constraints
        self._space = space
        self._say = say
        self._study: optuna.Study | None = None
        self._there: set[int] = set()
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        try:
            self._study = optuna.create_study(
                storage=study_storage(url),
                study_name=name,
                directions=["minimize"] * len(LOSSES),
                load_if_exists=True,
            )
            with warnings.catch_warnings(action="ignore", category=ExperimentalWarning):
                self._study.set_metric_names(list(LOSSES))
            self._there = {trial.user_attrs[CANDIDATE] for trial in self._study.get_trials(deepcopy=False)}
        except Exception as error:
            self._give_up(error)

    def add(self, number: int, genome: Genome, outcome: ScoredCandidate | Failed) -> None:
        """One candidate; one that is there already, from before an interruption, stays as it is."""
        if self._study is None or number in self._there:
            return
        self._there.add(number)
        try:
            self._study.add_trial(self._trial(number, genome, outcome))
        except Exception as error:
            self._give_up(error)

    def _trial(
        self, number: int, genome: Genome, outcome: ScoredCandidate | Failed
    ) -> optuna.trial.FrozenTrial:
        genes: dict[str, tuple[Any, BaseDistribution]] = {
            GENE_WORDS[gene]: (getattr(genome, gene), distribution)
            for gene, distribution in distributions(self._space, genome).items()
        }
        noted: dict[str, Any] = {CANDIDATE: number, "terms offered": int(genome.mask(self._space.size).sum())}
        common = {
            "params": {name: value for name, (value, _) in genes.items()},
            "distributions": {name: distribution for name, (_, distribution) in genes.items()},
        }
        if isinstance(outcome, Failed):
            return create_trial(
                state=TrialState.PRUNED, user_attrs={**noted, "failed": outcome.reason}, **common
            )
        one = outcome.candidate
        noted |= {
            "fitness": one.fitness,
            "free run on validation, MSER in % of the corrected physics": one.free_run_valid_mser_pct,
            "coverage on validation, %": outcome.coverage_pct,
        }
        return create_trial(
            values=list(one.losses),
            user_attrs=noted,
            constraints=self._constraints.violations(one),
            **common,
        )

    def _give_up(self, error: Exception) -> None:
        self._say(
            f"optuna: the study cannot be kept for the dashboard ({first_line(error)}); the search goes on without."
        )
        self._study = None
