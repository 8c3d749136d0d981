"""The models that a report compares: declared, recalibrated, and with the effects that were found."""

from __future__ import annotations

from dataclasses import dataclass, replace

from aesi.errors import AesiError
from aesi.numerics.typing import Array
from aesi.physics.balance import same_rest
from aesi.physics.effect import ActiveEffect
from aesi.physics.folded import Folded, folded
from aesi.records import Run
from aesi.tracer.case.free_parameter import CAPACITY_SHARE, STATE_OF_CHARGE
from aesi.tracer.case.problem import InverseProblem, ValuesByOwner, record_capacity_share
from aesi.tracer.case.records import PreparedRecord
from aesi.tracer.likelihood.growth import Explanation


@dataclass(frozen=True, eq=False)
class ModelState:
    """A model that can be simulated.

    values : owner -> name -> value of the fitted parameters; None for the declared model.
    hypothesis : ids of the effects added to the declared model.
    """

    problem: InverseProblem
    values: ValuesByOwner | None = None
    hypothesis: tuple[str, ...] = ()

    @classmethod
    def of(cls, problem: InverseProblem, one: Explanation) -> ModelState:
        """The model where a fit ended."""
        return cls(problem, one.values, one.hypothesis)

    def with_file_capacity(self) -> ModelState:
        """The model as it is written: with the file's capacity in every record, in place of the fitted shares."""
        if self.values is None or CAPACITY_SHARE not in self.values:
            return self
        return replace(self, values={o: v for o, v in self.values.items() if o != CAPACITY_SHARE})

    def effects(self, good: bool = False) -> tuple[ActiveEffect, ...]:
        """The effects that are simulated on top of the declared cell.  good : of a record that is known to be good."""
        if self.values is None:
            return self.problem.fixed
        return self.problem.active(self.values, good)

    def simulated(self, record: PreparedRecord, index: int | None, thin: bool) -> Run:
        """Simulation of one record.

        index : number among the fitted records; None for one that was not fitted. Such a record takes capacity and
        initial state from the fitted record that it continues. Otherwise it has the file's capacity, and its initial
        state of charge is the first that applies: the one given; for a full charge, the mean fitted start of the full
        charges; that at which this model rests at the first voltage; that of the declared cell.
        """
        index = record.continues if index is None else index
        data, hold = (record.thin, record.thin_hold) if thin else (record.data, record.hold)
        effects = self.effects(record.good)
        share = 1.0 if self.values is None or index is None else record_capacity_share(self.values, index)
        soc0 = self._initial_soc(record, index)
        if soc0 is not None:
            return self.problem.run(data, soc0, effects, hold, share=share)
        try:
            return self.problem.run(data, None, effects, hold, record.start.rest_voltage_v)
        except AesiError:
            return self.problem.run(data, record.soc0, effects, hold)

    def _initial_soc(self, record: PreparedRecord, index: int | None) -> float | None:
        """State of charge at a record's first row; None where the model's rest at the first voltage determines it.

        index : number of the fitted record that it is or continues; None where there is none.
        """
        if self.values is None:
            return record.soc0
        if index is not None:
            return self.fitted_soc(index, self.values)
        if record.start.basis == "full charge":
            return self._full_charge_soc(record.soc0)
        return record.soc0 if record.start.rest_voltage_v is None else None  # it was given

    def fitted_soc(self, index: int, values: ValuesByOwner) -> float:
        """State of charge at the first row of a fitted record by these values, with the effects of this model."""
        return self.problem.initial_soc(index, values, self.effects(self.problem.records[index].good))

    def start_slope_v(self, record: PreparedRecord) -> Array:
        """(n,) V, change of the voltage on a whole record that was not fitted, by one standard deviation of its initial
        state of charge.  Raises AesiError where it cannot be simulated there."""
        return self.problem.start_slope_of_v(record, record.data, self.effects(record.good), record.hold)

    def _full_charge_soc(self, otherwise: float) -> float:
        """State of charge that counts as full: the mean fitted start of the records that begin fully charged."""
        assert self.values is not None
        known = self.values[STATE_OF_CHARGE]
        full = [known[str(i)] for i, r in enumerate(self.problem.records) if r.start.basis == "full charge"]
        return sum(full) / len(full) if full else otherwise

    def folded_cell(self) -> tuple[Folded, float]:
        """(the cell with all fitted values and effects that a cell file can hold, except effects that infer a quantity
        which a later record may have measured; state of charge at the first row of the first record, in the
        stoichiometry windows of that cell)."""
        declared, fixed = self.problem.cell, self.problem.fixed
        inside = folded(
            declared, self.effects(), lambda active: active in fixed or active.effect.infers is not None
        )
        first = self.problem.records[0]
        soc0 = first.soc0 if self.values is None else self.fitted_soc(0, self.values)
        return inside, same_rest(declared, inside.cell, soc0)
