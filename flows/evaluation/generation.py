"""Evaluate a generation: look up what is known, claim what is not, take from others what they finish."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from aesi.records import Failed
from flows.base import codec, fingerprint
from flows.evaluation.outcome_store import Outcomes
from flows.evaluation.pool import Pool

T = TypeVar("T")
POLL_S = 0.2
"""Interval between looks for candidates that another process has claimed, s."""


@dataclass
class Tally:
    """How many outcomes were evaluated here, and how many were found in the store."""

    evaluated: int = 0
    found: int = 0


class Evaluation:
    """The candidates of one study. Called with a generation, yields (position, outcome) as they come.

    study : content key of the problem, so that the same genome on other data is another candidate.
    only_of : id of the run whose outcomes alone are taken of those that are stored: it marks what it puts there, and
    finds it when it is gone on with. None takes those of all. What a run stores is shared in any case.
    lost_again : whether candidates that an earlier run lost to its machine (time, memory, a killed process) are
    evaluated again, instead of failing every run from then on.
    """

    def __init__(
        self,
        pool: Pool,
        outcomes: Outcomes,
        study: str,
        say: Callable[[str], None],
        tally: Tally,
        only_of: str | None = None,
        lost_again: bool = False,
    ) -> None:
        self._pool = pool
        self._outcomes = outcomes
        self._study = study
        self._say = say
        self._only_of = only_of
        self._lost_again = lost_again
        self._fresh: set[str] = set()
        self._store_lost = False
        self.tally = tally

    def key(self, genome: Any) -> str:
        """Content key of a candidate of this study."""
        return fingerprint.key(self._study, codec.dumps(genome))

    def __call__(self, genomes: Sequence[Any]) -> Iterator[tuple[int, Any]]:
        waiting: dict[str, list[int]] = {}
        for position, genome in enumerate(genomes):
            waiting.setdefault(self.key(genome), []).append(position)  # twins are evaluated once
        working: set[str] = set()
        while waiting:
            for key in [k for k in waiting if k not in working]:
                outcome = self._stored_or_begun(key, genomes[waiting[key][0]], working)
                if outcome is not None:
                    self.tally.found += 1
                    yield from ((position, outcome) for position in waiting.pop(key))
            for key, outcome in self._pool.collect(POLL_S):
                self._store(key, outcome)
                working.discard(key)
                self.tally.evaluated += 1
                yield from ((position, outcome) for position in waiting.pop(key))
            if waiting and not working:
                time.sleep(POLL_S)

    def _stored_or_begun(self, key: str, genome: Any, working: set[str]) -> Any:
        """The stored outcome; None where there is none.  Then an idle pool begins the candidate, and its key is added
        to `working`, unless another process has claimed it."""
        outcome = self._stored(key)
        if (
            outcome is not None
            or not self._pool.idle
            or not self._from_store(self._outcomes.claim, key, True)
        ):
            return outcome
        outcome = self._stored(key)  # finished between the look and the claim
        if outcome is None:
            self._pool.start(key, genome)
            working.add(key)
        else:
            self._from_store(self._outcomes.release, key, None)
        return outcome

    def _stored(self, key: str) -> Any:
        if self._only_of is not None and not self._is_own(key, self._only_of):
            return None
        data = self._from_store(self._outcomes.get, key, None)
        if data is None:
            return None
        try:
            outcome = codec.loads(data)
        except codec.Damaged as error:
            self._say(f"cache: the stored candidate {key[:8]} is damaged ({error}); it is evaluated again.")
            self._from_store(self._outcomes.discard, key, None)
            return None
        lost = isinstance(outcome, Failed) and outcome.of_machine
        return None if lost and self._lost_again and key not in self._fresh else outcome

    def _is_own(self, key: str, run: str) -> bool:
        """Whether the run has put the outcome there, in this process or in one before that worked on it."""
        return key in self._fresh or self._from_store(self._outcomes.get, _mark(key, run), None) is not None

    def _store(self, key: str, outcome: Any) -> None:
        try:
            self._outcomes.put(key, codec.dumps(outcome))
            self._fresh.add(key)
            if self._only_of is not None:
                self._outcomes.put(_mark(key, self._only_of), b"")
        except OSError as error:
            self._say_store_lost(error)
        self._from_store(self._outcomes.release, key, None)

    def _from_store(self, step: Callable[[str], T], key: str, otherwise: T) -> T:
        """The answer of a step of the store (`get`, `claim`, `release`, `discard`) for a key; `otherwise` where the
        store is lost."""
        try:
            return step(key)
        except OSError as error:
            self._say_store_lost(error)
            return otherwise

    def _say_store_lost(self, error: OSError) -> None:
        """Say once that the store is lost: the run itself needs none."""
        if not self._store_lost:
            self._store_lost = True
            self._say(
                f"cache: candidates cannot be stored or looked up ({error.strerror or error}); the search goes on "
                "without, and a resumed or another one evaluates them again."
            )


def _mark(key: str, run: str) -> str:
    """The key under which a run that takes its own outcomes alone notes that it has stored one."""
    return fingerprint.key(run, key)
