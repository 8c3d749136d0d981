"""Whether every record is given once: what is fitted twice counts twice, and what judges may not be fitted."""

from __future__ import annotations

from collections.abc import Sequence

from aesi.errors import DataError
from aesi.records import Measurement


def check_distinct(fitted: Sequence[Measurement], tests: Sequence[Measurement] = ()) -> None:
    """Raises DataError, one sentence, for two records that hold the same rows.

    fitted : what may be looked at.  tests : what chooses nothing.
    """
    seen: dict[str, str] = {}
    for record in fitted:
        if record.digest in seen:
            raise DataError(f"{_both(seen[record.digest], record.name)} among the data; give it once.")
        seen[record.digest] = record.name
    for record in tests:
        if record.digest in seen:
            raise DataError(
                f"{_both(seen[record.digest], record.name)} among the data and the tests; what is fitted cannot "
                "judge: name another test."
            )


def _both(one: str, other: str) -> str:
    """How a sentence begins about two records of the same rows."""
    if one == other:
        return f"{one} is there twice"
    return f"{one} and {other} hold the same rows and are both"
