"""Outcomes of candidates by content key, and which process computes which: on disk, or in a database.

Every process on a study walks through the same deterministic search. Before it evaluates a candidate it looks
here, then claims it; a claim ends with its owner, whatever ends the owner.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from flows.evaluation.outcome_files import FileOutcomes


class Outcomes(Protocol):
    """A store of results by key; keys are hexadecimal. All but `close` raise OSError where it is lost."""

    def get(self, key: str) -> bytes | None:
        """The stored outcome of a key, or None."""
        ...

    def put(self, key: str, data: bytes) -> None:
        """Store atomically: a reader sees all of it or nothing."""
        ...

    def discard(self, key: str) -> None:
        """Forget a damaged entry."""
        ...

    def claim(self, key: str) -> bool:
        """True if this process is now the one that computes the key."""
        ...

    def release(self, key: str) -> None:
        """Give the claim back."""
        ...

    def close(self) -> None:
        """Give back everything."""
        ...


def open_outcomes(folder: Path, url: str | None) -> Outcomes:
    """A database where a URL is given, else the folder."""
    if not url:
        return FileOutcomes(folder)
    from flows.evaluation.outcome_database import DatabaseOutcomes

    return DatabaseOutcomes(url)
