"""The model in each state that a report compares: as declared, recalibrated, and with what was found."""

from __future__ import annotations

from dataclasses import dataclass

from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.physics.balance import same_rest
from aesi.physics.effect import ActiveEffect
from aesi.physics.folded import Folded, folded
from aesi.records import Run
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE
from aesi.tracer.case.problem import InverseProblem, ValuesByOwner, share_of
from aesi.tracer.case.records import PreparedRecord
from aesi.tracer.likelihood.growth import Explanation


@dataclass(frozen=True, eq=False)
class ModelState:
    """A model that can be simulated: a problem and the values of what moved in it (none: as declared).

    hypothesis : the effects on top of the declared model.
    """

    problem: InverseProblem
    values: ValuesByOwner | None = None
    hypothesis: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: InverseProblem, one: Explanation) -> ModelState:
        """Where a fit ended."""
        return cls(problem, one.values, one.hypothesis)

    def effects(self, good: bool = False) -> tuple[ActiveEffect, ...]:
        """What is simulated on top of the declared cell.  good : of a record that is known to be good."""
        if self.values is None:
            return self.problem.fixed
        return self.problem.active(self.values, good)

    def simulated(self, record: PreparedRecord, index: int | None, thin: bool) -> Run:
        """One record.

        index : place among the fitted records, None for one that was not. That goes on from a fitted one where it
        continues it; else its cell has the file's capacity, and it begins at the state of charge that was given, of a
        full charge where the fitted full charges begin, or where this model rests at its first voltage.
        """
        index = record.continues if index is None else index
        data, hold = (record.thin, record.thin_hold) if thin else (record.data, record.hold)
        effects, run = self.effects(record.good), self.problem.run
        if self.values is not None and index is not None:
            share = share_of(self.values, index)
            return run(data, self.values[STATE_OF_CHARGE][str(index)], effects, hold, share=share)
        if self.values is not None and record.start.basis == "full charge":
            return run(data, self._full(record.soc0), effects, hold)
        rest_v = record.start.rest_voltage_v  # None where the state of charge was given
        if self.values is None or rest_v is None:
            return run(data, record.soc0, effects, hold)
        try:
            return run(data, None, effects, hold, rest_v)
        except AesiError:
            return run(data, record.soc0, effects, hold)

    def start_slope_v(self, record: PreparedRecord) -> Array:
        """(n,) V of a whole record that was not fitted: what one standard deviation of its initial state of charge is
        worth.  Raises AesiError where it cannot be simulated there."""
        return self.problem.start_slope_of_v(record, record.data, self.effects(record.good), record.hold)

    def _full(self, otherwise: float) -> float:
        """State of charge that counts as full: the mean fitted start of the records that begin fully charged."""
        assert self.values is not None
        known = self.values[STATE_OF_CHARGE]
        full = [known[str(i)] for i, r in enumerate(self.problem.records) if r.start.basis == "full charge"]
        return sum(full) / len(full) if full else otherwise

    def settled(self) -> tuple[Folded, float]:
        """The cell with all in it that a cell file can hold, but for what infers a measurement that may come, and the
        state of charge at the first sample in the windows of that cell."""
        declared, fixed = self.problem.cell, self.problem.fixed
        inside = folded(
            declared, self.effects(), lambda active: active in fixed or active.effect.infers is not None
        )
        soc0 = self.problem.records[0].soc0 if self.values is None else self.values[STATE_OF_CHARGE]["0"]
        return inside, same_rest(declared, inside.cell, soc0)
