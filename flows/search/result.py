"""The result of a search: its trials, the Pareto front, and the pick under given weights."""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import dataclass
from typing import Any

from optuna.importance import get_param_importances
from optuna.study import Study
from optuna.trial import FrozenTrial, TrialState

from aesi.errors import FitError
from aesi.records.failed import counted
from aesi.sparse import FitnessWeights, Genome, fitness
from flows.search.term_sampler import INDEX, genome_of, violation

LEAST_TOLD = 20
"""Candidates from which the importance of a gene can be told at all."""
NO_REASON, LOW = "no reason given", "a correlation below its constraint"
"""Words for a trial that failed without a reason, and for one that was evaluated and is not feasible."""
FINISHED = (TrialState.COMPLETE, TrialState.PRUNED)
RECORD = "record"
RECORDED = (
    "fitness",
    "pearson_train",
    "pearson_valid",
    "free_run_valid_mser_pct",
    "one_step_valid_rmse_v",
)


@dataclass(frozen=True)
class Trial:
    """One finished trial. `losses` is None where it failed, and `reason` says why.

    number : its index in the search.
    numbers : fitness, correlations and validation figures by name, as in `Candidate`.
    """

    number: int
    genome: Genome
    losses: tuple[float, float, float] | None
    feasible: bool
    numbers: dict[str, float]
    reason: str | None


@dataclass(frozen=True, eq=False)
class SearchResult:
    """All finished trials of a study, and what to choose from them."""

    study: Study
    trials: tuple[Trial, ...]
    library_size: int
    weights: FitnessWeights

    @classmethod
    def of(cls, study: Study, library_size: int, weights: FitnessWeights) -> SearchResult:
        """The candidates of the study so far, in the order of the index."""
        stored = study.get_trials(deepcopy=False, states=FINISHED)
        trials = sorted((_read(trial) for trial in stored), key=lambda trial: trial.number)
        return cls(study, tuple(trials), library_size, weights)

    @property
    def feasible(self) -> tuple[Trial, ...]:
        """Those that were evaluated and meet the constraints."""
        return tuple(trial for trial in self.trials if trial.feasible)

    def front(self) -> tuple[Trial, ...]:
        """Feasible trials that no other feasible one dominates: is as good as in all losses, and better than in one."""
        best = {trial.user_attrs[INDEX] for trial in self.study.best_trials}
        return tuple(trial for trial in self.feasible if trial.number in best)

    def importances(self) -> dict[str, float]:
        """Gene -> its share of the variance of the fitness, by Optuna; empty where too few candidates tell."""
        told = [trial for trial in self.trials if trial.losses is not None]
        if len(told) < LEAST_TOLD:
            return {}
        with warnings.catch_warnings():
            # Optuna warns of every target that low values of it are taken as good: of this one they are.
            warnings.filterwarnings("ignore", "PedAnovaImportanceEvaluator computes the importances")
            return dict(
                get_param_importances(self.study, target=lambda trial: -trial.user_attrs[RECORD]["fitness"])
            )

    def best(self) -> Trial:
        """The trial of the front of highest fitness; the earlier one on a tie.

        Raises FitError, with the reasons counted, where no trial is feasible.
        """
        front = self.front()
        if not front:
            raise FitError(self._nothing_feasible())
        return max(front, key=lambda trial: (self._fitness(trial), -trial.number))

    def fittest(self, share: float) -> tuple[int, ...]:
        """Numbers of the feasible trials of highest fitness, a share of all trials and at least one; the best first.

        Raises FitError as `best` does.
        """
        first = self.best().number
        ranked = sorted(self.feasible, key=lambda trial: (-self._fitness(trial), trial.number))
        others = [trial.number for trial in ranked if trial.number != first]
        return (first, *others[: max(1, round(share * len(self.trials))) - 1])

    def _fitness(self, trial: Trial) -> float:
        assert trial.losses is not None
        return fitness(trial.losses, self.library_size, self.weights)

    @property
    def failed(self) -> dict[str, int]:
        """Why trials came to nothing -> how many."""
        return Counter(trial.reason or NO_REASON for trial in self.trials if trial.losses is None)

    def _nothing_feasible(self) -> str:
        reasons = Counter(self.failed)
        low = len(self.trials) - reasons.total()
        if low:
            reasons[LOW] = low
        advice = (
            "lower the correlation constraints, widen the ranges, or evaluate more candidates"
            if low
            else "see to what they failed of (each may take search.timeout_s and search.memory_mb), or widen the ranges"
        )
        return (
            f"none of {len(self.trials)} candidates is feasible ({counted(reasons) or 'none was evaluated'}); "
            f"{advice}."
        )


def _read(trial: FrozenTrial) -> Trial:
    done = trial.state == TrialState.COMPLETE
    numbers: dict[str, Any] = trial.user_attrs.get(RECORD, {})
    losses = (trial.values[0], trial.values[1], trial.values[2]) if done else None
    return Trial(
        trial.user_attrs[INDEX],
        genome_of(trial),
        losses,
        done and violation(trial) == 0,
        numbers,
        trial.user_attrs.get("reason"),
    )
