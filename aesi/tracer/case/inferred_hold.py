"""How the current of a record runs between its rows, where the records tell it and nobody declared it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from aesi.records import Hold, Measurement

AS_FITTED = "as that of the fitted records"


@dataclass(frozen=True)
class InferredHold:
    """hold : course of the current between the rows of a record.  reason : clause, why it is not the assumed one."""

    hold: Hold
    reason: str


def as_inferred(data: Measurement, inferred: InferredHold | None) -> Measurement:
    """The record with its inferred hold; unchanged without one."""
    return data if inferred is None else data.held(inferred.hold)


def hold_of_test(
    test: Measurement, fitted: Iterable[Measurement], inferred: Iterable[InferredHold]
) -> InferredHold | None:
    """The hold of a test record that declares none, as a logger wrote the fitted ones: the one that was inferred of all
    fitted records of which it is known; None where that is not one."""
    holds = {one.hold for one in inferred}
    if test.hold is not None or len(holds) != 1 or holds | {one.hold for one in fitted} - {None} != holds:
        return None
    return InferredHold(holds.pop(), AS_FITTED)
