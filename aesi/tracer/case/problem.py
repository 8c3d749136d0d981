"""The inverse problem of one case: a declared cell, its records, and what hypotheses may move."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from aesi.advice import listed
from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import AesiError, first_line
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array, BoolArray
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.initial_state import REST_C_RATE
from aesi.physics.rest.open_circuit import OpenCircuit
from aesi.physics.rest.voltage import freed_of_instruments, freed_of_series
from aesi.physics.simulation import ModelName, model_with
from aesi.records import Hold, Measurement, Run
from aesi.tracer.case.energies import ACTIVATION_ENERGIES, energies_of, far_from_file
from aesi.tracer.case.fit_simulation import fit_simulation
from aesi.tracer.case.free_parameter import (
    CAPACITY_SHARE,
    SHARED_SUFFIX,
    STATE_OF_CHARGE,
    FreeParameter,
    acting_on,
    capacity_share,
    effect_parameters,
    own_parameter,
    shared_owner,
    state_of_charge,
)
from aesi.tracer.case.records import PreparedRecord
from aesi.tracer.case.trust import AGEING, MEASURED_CELL, Trust, own_sd, start_sd

SHARE_SD = 0.027
"""Standard deviation of ln(capacity of a record / capacity in the file): RMS over the twelve records, taken within
weeks of each other, of two files that were calibrated over temperatures (`Cell.capacity_shares`), when the number was
chosen. The present files give 0.030, since a record with a load now has the silicon of its day."""
INDEPENDENT_S, INDEPENDENT_CHARGE = 200.0, 0.05
"""Time (s) and charge (share of the capacity) over which the error of a model of a measured cell stays correlated. Its
integral correlation time is 45 to 670 s on eight development records of `aesi bench real` (geometric mean 140 s about
the mean, 260 s about zero); in charge it is 1 to 18 %.

The part within seconds lasts 4 to 6 s. It is a wrong response to the current and comes back whenever the current does
the same, so it adds no independent samples: taken as independent after 8 s, effects that are not there gain up to 290
nats on development controls. As counted here, the fitted sizes of such effects scatter by 1.06 of their standard
deviations; with twice as many samples by 1.14, with four times as many by 1.38, and by 0.95 where the part within
seconds is left out (`python -m aesi.bench.fast_error`)."""
BESIDE_TIMES = 2.0
"""Factor on the number of independent samples of the model error where good records show its size in this cell. With
it the sizes of effects that 24 pairs of records do not have scatter by 1.07 of their standard deviations, and four
pairs have one beyond 2.58 of them (`python -m aesi.bench.real.repeatability`); with the cell files that the number was
chosen with, by 0.97, and one. One of these records was fitted and one is of a test case alone (`ALIKE` there): without
the eight pairs that hold one of the two, by 1.15, and three of 16."""
OHMIC_SHARE = 0.03
"""Relative error of a cell file in the resistance that a cell shows from one row to the next: 0.7 to 4.0 % on five
development records, 2.7 % in the median. A published file is off by 20 %, too much for any contact (`python -m
aesi.bench.fast_error`)."""
STEP = 4e-3
"""Step of finite differences, in standard deviations of a parameter's prior: short against the posterior standard
deviation. Rows at 10 Hz determine a lag to a thousandth of its spread."""
NO_CELLS_V = 100.0
"""A simulated voltage beyond this, V, either way, is no cell's: a run that goes on beyond empty ends at some -5 V, and
one whose exponents end at their limits at up to 1e152 V. A convention."""
CACHED_VOLTAGES = 64
"""Number of simulated voltages of good records in the cache: enough for a dozen hypotheses that grow in parallel."""

ARITHMETIC = (FloatingPointError, ZeroDivisionError, OverflowError)
"""Errors of a simulation whose numbers left their range."""

ValuesByOwner = Mapping[str, Mapping[str, float]]
"""owner -> name -> value."""


def record_capacity_share(values: ValuesByOwner, record: int) -> float:
    """Capacity of the cell during a record (its number), as a share of the file's; 1 where it is not fitted."""
    return values.get(CAPACITY_SHARE, {}).get(str(record), 1.0)


def _is_of_a_cell(voltage_v: Array) -> bool:
    """Whether each of these voltages (n,) V, may be a cell's; NaN is not."""
    return bool((np.abs(voltage_v) < NO_CELLS_V).all())


@dataclass(frozen=True, eq=False)
class InverseProblem:
    """One case.

    cell : as declared.  records : prepared, the good ones last.
    effects : id -> Effect, all that may be tried or moved. A parameter of an effect that has a spread is an own
    parameter of the declared model, and moves in every hypothesis.  trust : how far the declared values are believed.
    fixed : effects in every simulation.  model : model of the cell, the same in every hypothesis.
    approximated_v : RMS change of the voltage by the approximations kept in that model, V; no effect is named for less.
    reduced_v : RMS difference to the cell's other model, V, where that may be searched too: a residual may be this
    difference.
    ages : whether the records appear to be of several ages.  energies : whether to fit those activation energies of a
    measured cell that the calibration of its file could not determine.
    """

    cell: Cell
    records: tuple[PreparedRecord, ...]
    effects: Mapping[str, Effect]
    fixed: tuple[ActiveEffect, ...] = ()
    trust: Trust = "tight"
    model: ModelName = "espm"
    approximated_v: float = 0.0
    reduced_v: float = 0.0
    ages: bool = False
    energies: bool = True

    @property
    def coarse(self) -> bool:
        """True where the model error is that of a measured cell, so that the likelihood is coarsened."""
        return self.trust == "loose" or self.trust in MEASURED_CELL

    @property
    def has_good(self) -> bool:
        """True where some records are known to be good, so that effects act on the others only."""
        return any(record.good for record in self.records)

    @property
    def two_scales(self) -> bool:
        """True where the model error has two parts: one that lasts, and one within seconds."""
        return self.trust == "measured"

    @property
    def several_ages(self) -> bool:
        """True where each record has its own capacity of the cell. It takes several records: in a single one, the
        capacity lost since the file was made is for an effect to explain."""
        return self.ages and self.trust in AGEING and len(self.records) > 1

    def competing(self) -> tuple[str, ...]:
        """Ids of the effects that a hypothesis may name: all but those that undo an approximation of the model."""
        return tuple(name for name, effect in self.effects.items() if effect.refines is None)

    def free(self, hypothesis: Sequence[str]) -> tuple[FreeParameter, ...]:
        """The parameters that a hypothesis may move: states of charge, own parameters, then those of its effects."""
        out = [
            state_of_charge(i, r.soc0, start_sd(self.trust, r.soc0_sd)) for i, r in enumerate(self.records)
        ]
        if self.several_ages:
            out += [capacity_share(i, SHARE_SD) for i in range(len(self.records))]
        for effect in self.effects.values():
            if effect.refines is not None or (effect.id in hypothesis and not self.has_good):
                continue
            owner = shared_owner(effect.id) if self.has_good else effect.id
            for name, p in effect.parameters.items():
                sd = own_sd(self.trust, effect, p, self.cell.nominal_capacity_ah)
                if sd is not None:
                    out.append(own_parameter(owner, name, p, sd))
        out += self._open_energies(hypothesis)
        for effect_id in hypothesis:
            out += self.parameters_of(effect_id)
        return tuple(out)

    def _open_energies(self, hypothesis: Sequence[str]) -> list[FreeParameter]:
        """The activation energies of a measured cell that its file could not determine. Empty unless a record is, or
        may be under the hypothesis, far enough from the temperature at which the file was fitted, see
        `far_from_file`."""
        if not self.energies or self.trust not in MEASURED_CELL:
            return []
        acting = (*(self.effects[name] for name in hypothesis), *(active.effect for active in self.fixed))
        supposed = any(effect.infers == "temperature" for effect in acting)
        if not any(far_from_file(self.cell, record.data, supposed) for record in self.records):
            return []
        owner = shared_owner(ACTIVATION_ENERGIES) if self.has_good else ACTIVATION_ENERGIES
        return [
            own_parameter(owner, name, p, p.spread.tight)
            for name, p in self._movable[ACTIVATION_ENERGIES].parameters.items()
            if p.spread is not None and p.spread.tight is not None
        ]

    @cached_property
    def _movable(self) -> Mapping[str, Effect]:
        """id -> Effect, of all that a hypothesis may move."""
        return {**self.effects, ACTIVATION_ENERGIES: energies_of(self.cell)}

    def parameters_of(self, effect: str) -> list[FreeParameter]:
        """The parameters of an effect under test, by its id, in order."""
        return effect_parameters(effect, self.effects[effect].parameters, self.cell.nominal_capacity_ah)

    def jumps(self, free: Sequence[FreeParameter]) -> list[int]:
        """Numbers of the parameters below whose zero, the record as written, the voltage may jump: those of effects on
        the record. A row at a step of the current was read before the step or, by a clock a millisecond earlier, after
        it."""
        owners = [self.effects.get(one.owner.removesuffix(SHARED_SUFFIX)) for one in free]
        return [j for j, owner in enumerate(owners) if owner is not None and owner.on_record is not None]

    def active(self, values: ValuesByOwner, good: bool = False) -> tuple[ActiveEffect, ...]:
        """The effects to simulate with. An effect under test is included even at its neutral point: some rewrite the
        cell even there (its windows by voltages), and a residual must be continuous in the parameters of a fit.

        good : whether the record is known to be good, so that no effect under test acts on it.
        """
        acting = acting_on(self._movable, values, good)
        return (*self.fixed, *(self._movable[name].activate_only(**given) for name, given in acting.items()))

    def predict(self, values: ValuesByOwner, only: int | None = None) -> Array | None:
        """(n,) V, voltage of the model over the fit parts of all records, or of record `only`; None where it cannot be
        simulated or is no cell's."""
        out = []
        indices = range(len(self.records)) if only is None else (only,)
        try:
            acting = {good: self.active(values, good) for good in {self.records[i].good for i in indices}}
            for i in indices:
                good = self.records[i].good
                voltage_v = self._cached_voltage_v if good else self._voltage_v
                soc0 = self.initial_soc(i, values, acting[good])
                out.append(voltage_v(i, soc0, acting[good], record_capacity_share(values, i)))
        except (AesiError, *ARITHMETIC):
            return None
        joined = np.concatenate(out)
        return joined if _is_of_a_cell(joined) else None

    def initial_soc(self, i: int, values: ValuesByOwner, effects: tuple[ActiveEffect, ...]) -> float:
        """State of charge at the first row of record `i`, in the declared windows.

        The fitted value is what the declared cell reads from the voltage, and the error of that reading. Where it was
        read and not given, the same voltage is read under the hypothesis: by its potentials, without what its effects
        add (a sensor's offset, a hysteresis).

        effects : all that act on the record, as `active` has them.
        """
        as_declared, record = values[STATE_OF_CHARGE][str(i)], self.records[i]
        if record.start.basis not in ("rest", "load"):
            return as_declared
        model, declared = model_with(self.cell, effects), self._open_circuits[i]
        supposed_effects = [active for active in effects if active not in self.fixed]
        seen_v, current_a = float(record.data.voltage_v[0]), float(record.data.current_a[0])
        supposed = declared.with_potentials(model.cell)
        terminal_v = freed_of_instruments(supposed, model, supposed_effects, seen_v, current_a)
        cell_v = freed_of_series(supposed, model, supposed_effects, terminal_v, current_a)
        if supposed is declared and cell_v == seen_v:
            return as_declared
        return declared.reread(supposed, as_declared, record.soc0_sd, cell_v - seen_v)

    @cached_property
    def _open_circuits(self) -> tuple[OpenCircuit, ...]:
        """That of the declared cell, by the potentials of the declared model, at the start of each record."""
        cell = model_with(self.cell, self.fixed).cell
        return tuple(OpenCircuit.at_start(self.cell, r.data).with_potentials(cell) for r in self.records)

    def _voltage_v(self, i: int, soc0: float, effects: tuple[ActiveEffect, ...], share: float = 1.0) -> Array:
        return self.run(self.fit_parts[i], soc0, effects, self.records[i].thin_hold, share=share).voltage_v

    @cached_property
    def _cached_voltage_v(self) -> Callable[[int, float, tuple[ActiveEffect, ...], float], Array]:
        """`_voltage_v` with a cache, for good records: effects under test do not act on them, so that their voltage
        repeats."""
        return lru_cache(maxsize=CACHED_VOLTAGES)(self._voltage_v)

    def run(
        self,
        data: Measurement,
        soc0: float | None,
        effects: tuple[ActiveEffect, ...],
        hold: Hold,
        rest_voltage_v: float | None = None,
        share: float = 1.0,
    ) -> Run:
        """One simulation, see `fit_simulation`.  share : capacity of the cell then, as a share of the file's."""
        cell = self.cell if share == 1.0 else self.cell.with_material(share)
        return fit_simulation(cell, data, soc0, effects, hold, self.model, rest_voltage_v)

    def failure_reason(self, hypothesis: Sequence[str]) -> str:
        """Why a hypothesis cannot be simulated at its typical values: one sentence, with the names of the records where
        others, or another reason, are beside them."""
        records: dict[str, list[str]] = {}
        for i, record in enumerate(self.records):
            if reason := self._failure_on(i, hypothesis):
                records.setdefault(reason, []).append(record.name)
        if not records:
            return "no start of the fit could be simulated."
        reason, names = next(iter(records.items()))
        return reason if len(names) == len(self.records) else f"on {listed(names)}: {reason}"

    def _failure_on(self, i: int, hypothesis: Sequence[str]) -> str:
        """Why a hypothesis cannot be simulated at its typical values on one record, a sentence; '' where it can be."""
        record = self.records[i]
        tested = () if record.good else hypothesis
        try:
            effects = (*self.fixed, *(self.effects[name].activate() for name in tested))
            voltage_v = self._voltage_v(i, record.soc0, effects)
        except AesiError as error:
            return str(error)
        except ARITHMETIC as error:
            return f"the simulation fails ({first_line(error)})."
        return "" if _is_of_a_cell(voltage_v) else "the simulated voltage is no cell's."

    @cached_property
    def fit_parts(self) -> tuple[Measurement, ...]:
        """The fit part of each record, thinned."""
        return tuple(r.thin.take(slice(0, r.n_fit)) for r in self.records)

    @cached_property
    def measured(self) -> Array:
        """(n,) V, measured voltage of the fitted rows, thinned."""
        return np.concatenate([m.voltage_v for m in self.fit_parts])

    @cached_property
    def time_s(self) -> Array:
        """(n,) s."""
        return np.concatenate([m.time_s for m in self.fit_parts])

    @cached_property
    def white_v(self) -> Array:
        """(n,) V, standard deviation of the sensors' noise in each row."""
        return np.concatenate([r.white_v[: r.n_fit] for r in self.records])

    @cached_property
    def equivalent_white_v(self) -> Array:
        """(n,) V, see `PreparedRecord.equivalent_white_v`."""
        return np.concatenate([r.equivalent_white_v[: r.n_fit] for r in self.records])

    @cached_property
    def noise_v(self) -> float:
        """Root mean square of the white noise of the fitted rows, V."""
        return rms(self.white_v)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Rows of each record."""
        ends = np.cumsum([r.n_fit for r in self.records])
        return tuple(slice(int(e - r.n_fit), int(e)) for e, r in zip(ends, self.records, strict=True))

    @cached_property
    def _declared(self) -> tuple[Run, ...]:
        return tuple(
            self.run(data, record.soc0, self.fixed, record.thin_hold)
            for record, data in zip(self.records, self.fit_parts, strict=True)
        )

    @cached_property
    def start_slope_v(self) -> Array:
        """(n,) V, change of the declared model's voltage by one standard deviation of each record's initial state of
        charge; zero for a record that cannot be simulated there."""
        out = []
        for record, data in zip(self.records, self.fit_parts, strict=True):
            try:
                out.append(self.start_slope_of_v(record, data, self.fixed, record.thin_hold))
            except AesiError:
                out.append(np.zeros(len(data)))
        return np.concatenate(out)

    def start_slope_of_v(
        self, record: PreparedRecord, data: Measurement, effects: tuple[ActiveEffect, ...], hold: Hold
    ) -> Array:
        """(n,) V, change of the voltage on these rows of a record by one standard deviation of its initial state of
        charge, for the cell with these effects.  Raises AesiError where it cannot be simulated there."""
        here, there = (
            self.run(data, soc0, effects, hold).voltage_v for soc0 in (record.soc0, record.other_soc0)
        )
        return np.asarray(there - here)

    @cached_property
    def declared_soc(self) -> Array:
        """(n,) state of charge in the declared model, by coulomb counting."""
        return np.concatenate([run.series["soc"] for run in self._declared])

    @cached_property
    def independent(self) -> Array:
        """(n,) number of independent samples of the model error that each row stands for, at most 1.

        A record has as many as its time or its charge allows, whichever is less, shared out over its rows by time. The
        error does not change while no charge moves, so that a rest or a pause of the logger, however long, counts as
        the time of one sample."""
        out = []
        for data, rows in zip(self.fit_parts, self.slices, strict=True):
            duration_s = self.row_duration_s[rows]
            moved_ah = float(np.abs(data.current_a) @ duration_s) / SECONDS_PER_HOUR
            by_charge = moved_ah / self.cell.nominal_capacity_ah / INDEPENDENT_CHARGE
            duration_s = self._without_long_rests(data, duration_s)
            number = min(float(duration_s.sum()) / INDEPENDENT_S, by_charge)
            if self.trust == "beside":
                number *= BESIDE_TIMES
            out.append(np.minimum(duration_s / duration_s.sum() * max(number, 1.0), 1.0))
        joined = np.concatenate(out)
        return joined * self.compared if self.trust == "beside" else joined

    def _without_long_rests(self, data: Measurement, row_duration_s: Array) -> Array:
        """(n,) s, duration that each row stands for, with each rest shortened to the time of as many independent
        samples as its charge makes up, at least one."""
        capacity_ah = self.cell.nominal_capacity_ah
        rests = np.abs(data.current_a) <= REST_C_RATE * capacity_ah
        number = np.cumsum(np.diff(rests, prepend=False))
        together_s = np.bincount(number, row_duration_s)[number]
        moved_ah = np.bincount(number, np.abs(data.current_a) * row_duration_s)[number] / SECONDS_PER_HOUR
        most_s = INDEPENDENT_S * np.maximum(moved_ah / capacity_ah / INDEPENDENT_CHARGE, 1.0)
        return np.where(rests, row_duration_s * np.minimum(most_s / together_s, 1.0), row_duration_s)

    @cached_property
    def row_duration_s(self) -> Array:
        """(n,) s, duration that each row stands for."""
        return np.concatenate([np.gradient(data.time_s) for data in self.fit_parts])

    def file_errors_v(self, hypothesis: Sequence[str]) -> Array:
        """(n, k) V, change of the declared model's voltage by one standard deviation of each parameter in which the
        file may be wrong about the response within seconds. Parameters that the hypothesis itself moves are left out; k
        is 0 where the model error has one part. Lasting changes are included: `model_error.fast_file_errors_v`
        subtracts them."""
        errors = self._file_errors_v if self.two_scales else ()
        kept = [column for restating, column in errors if restating.isdisjoint(hypothesis)]
        return np.column_stack([np.zeros((len(self.time_s), 0)), *kept])

    @cached_property
    def _file_errors_v(self) -> tuple[tuple[frozenset[str], Array], ...]:
        """(effects that restate the parameter, (n,) V for one standard deviation) of each parameter; the first is
        the resistance of the contacts."""
        current = np.concatenate([data.current_a for data in self.fit_parts])
        declared_v = np.concatenate([run.voltage_v for run in self._declared])
        current_steps = np.concatenate([np.diff(data.current_a) for data in self.fit_parts])
        voltage_steps = np.concatenate([np.diff(run.voltage_v) for run in self._declared])
        resistance = max(
            -float(current_steps @ voltage_steps) / max(float(current_steps @ current_steps), 1e-12), 0.0
        )
        ohmic = frozenset(name for name, effect in self.effects.items() if effect.ohmic)
        out = [(ohmic, -OHMIC_SHARE * resistance * current)]
        for effect in self.effects.values():
            if effect.kind != "parameter" or effect.refines is not None:
                continue
            for name, p in effect.parameters.items():
                if p.spread is None or p.spread.tight is None:
                    continue
                one = own_parameter(effect.id, name, p, p.spread.tight)
                moved = self._declared_with(effect, name, one.value(STEP))
                if moved is not None:
                    out.append((frozenset({effect.id}), (moved - declared_v) / STEP))
        return tuple(out)

    def _declared_with(self, effect: Effect, name: str, value: float) -> Array | None:
        """(n,) V of the declared cell with one parameter changed to `value`; None where it cannot be simulated."""
        effects = (*self.fixed, effect.activate_only(**{name: value}))
        try:
            return np.concatenate(
                [self._voltage_v(i, record.soc0, effects) for i, record in enumerate(self.records)]
            )
        except AesiError:
            return None

    @cached_property
    def compared(self) -> BoolArray:
        """(n,) True for all rows of records not known to be good, and for those rows of good records whose state of
        charge lies in the range of the former: the size of a model error depends on the state of charge."""
        z, good = self.declared_soc, self.good_rows
        other = z[~good]
        near = (z > other.min() - INDEPENDENT_CHARGE) & (z < other.max() + INDEPENDENT_CHARGE)
        return np.asarray(~good | near)

    @cached_property
    def good_rows(self) -> BoolArray:
        """(n,) True for the rows of records that are known to be good."""
        return np.concatenate([np.full(r.n_fit, r.good) for r in self.records])

    @cached_property
    def ocv_slope_v(self) -> Array:
        """(n,) V, |dU/dz|, U the declared open-circuit voltage and z the state of charge (share)."""
        z = self.declared_soc
        step = 5e-3
        low, high = np.clip(z - step, -0.01, 1.01), np.clip(z + step, -0.01, 1.01)
        rise = self.cell.rest_voltage_v(high) - self.cell.rest_voltage_v(low)
        return np.asarray(np.abs(rise) / np.maximum(high - low, 1e-6))
