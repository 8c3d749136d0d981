"""State of charge at the first row of a record, its standard deviation, and its source.

Every command uses the same rule: the first of these that applies.

    given         by the user
    full charge   the cell rests within `CHARGED_V` below its upper cut-off voltage: a charge that ended there is state
                  of charge 1 by definition, whatever the open-circuit potentials of the cell file say
    rest          the open-circuit voltage that the cell relaxes to, at the temperature of the record; under a slow
                  current, which nothing tells from a rest at first, that of the first rows
    load          the open-circuit voltage after the drop of the model over the first minutes; the current may have
                  begun with the record or long before it, and another before: these minutes tell how likely either is

A rest that a load ends before it has settled is read by these minutes too, if they leave less uncertainty. A full
charge is also recognised before a load whose voltage drop is known well enough, but never while a charge still flows.

Current, time and temperature are those that the cell saw: the effects of its model (a sensor's offset, a leak) are
taken off the record first, as in `simulate`, and decide whether it rests.

A reading is as accurate as the open-circuit potentials: where a potential is flat, the state of charge is uncertain.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from aesi.constants import MV_PER_V, ZERO_CELSIUS_K
from aesi.errors import DataError
from aesi.numerics.typing import Array
from aesi.physics.arguments import check_cell, check_choice, check_measurement, checked_effects, checked_soc
from aesi.physics.balance import same_rest
from aesi.physics.cell import Cell
from aesi.physics.effect import ActiveEffect, Record, as_cell_saw, instruments_first
from aesi.physics.rest.open_circuit import (
    BEYOND_V,
    CHARGED_V,
    GIVEN_BY,
    GIVEN_SD,
    GOOD_READING_V,
    READING_V,
    OpenCircuit,
)
from aesi.physics.rest.voltage import first_rows_v, freed_of_instruments, freed_of_series
from aesi.physics.simulation import ModelName, model_with
from aesi.physics.start.charge import start_bounds, truncated_by_charge
from aesi.physics.start.load import DROP_ERROR, FLOWED_S, LoadedStart
from aesi.physics.start.relaxing import Rest, resting_rows, settled_voltage
from aesi.physics.start.state import Basis, InitialState
from aesi.records import Hold, Measurement
from aesi.records.rows import written_decimals

__all__ = ["Basis", "InitialState", "initial_state"]

REST_C_RATE = 1.0 / 50.0
"""Below this current a cell rests: the drop at C/50 is within what the potentials are uncertain by. With half of it
`aesi bench start --set cuts=16` reads all 48 rows the same. With twice, four loads more pass for rests, and rests are
off by 0.63 points of charge RMS instead of 0.42."""
ONE_STATE = GIVEN_SD
"""Of the capacity, the most charge that the rows of one rest may move: the least that any state of charge is known to.
The rests that measured records begin with move 1.6e-4 at most, and a cycler whose zero is 0.1 %
of 1C off takes half an hour for it. Hours of C/50 and C/55 either way from 0.02, 0.5 and 0.97 of an LG M50 are off by
0.49 points RMS and 1.2 deviations at most; with half, twice and four times of it by 0.28, 0.47 and 0.45 points and 0.6,
1.5 and 1.1 deviations; as one rest, whatever they move, by 17 points and 120 deviations."""
STEP_SD = 12.0**-0.5
"""Standard deviation of a value that is rounded to steps of one."""
GIVE_IT = "; give {} if it is known"
"""Clause at the end of a sentence on an uncertain reading, where no state of charge was given."""
OF_ONE = f"{GIVEN_BY} FILE=SOC"
"""How a user gives the state of charge of one of several records."""
FLOWED_BEFORE = (
    "as if a current had flowed before (the model begins at rest: if so, its first minutes are off)"
)
"""How a sentence calls a record that looks as if a current had flowed before it."""
OTHER_STATE = 0.05
OTHER_STATE_LOADED = 0.15
"""A given state of charge further than this from that of a record's voltage is contradicted by it, at rest and under
load. In `aesi bench start --set cuts=16`, of 48 states given right (within 2 points) and 48 given 20 points wrong, none
of the right ones are contradicted and 67 % of the wrong ones; with half of both numbers none and 92 %, with twice none
and 40 %. On pulses in the cold (Panasonic, -10 degC) 12 % of the right ones are; what is right should not be. At rest
all wrong ones are contradicted; those that pass start under load. Those cells have steep potentials: of an LFP cell at
0.7 of its charge what is 34 points off is contradicted, and less is not."""
DOUBTED_SDS = 2.0
"""A given state of charge further than OTHER_STATE from that of the voltage, and by more than so many of its deviations
beyond the two that this may be off by, is told as doubtful. Of 147 starts under load of 14 measured records, with the
file of their cell, 3.4 % of states given 2 points off are, 54 % of those 20 points off and 22 % of those 10; with 1 it
is 6.8, 69 and 29 %, with 3 2.7, 42 and 15 %."""


def initial_state(
    cell: Cell,
    record: Measurement,
    soc0: float | None = None,
    hold: Hold = "backward",
    effects: Iterable[ActiveEffect] = (),
    *,
    shared: bool = False,
    model: ModelName = "espm",
    potentials_v: float = READING_V,
) -> InitialState:
    """State of charge at the first row of `record`: as given, or read from its voltage.

    The first of these that applies: given; full, where the cell rests at its upper cut-off voltage after a charge; the
    open-circuit voltage of a rest; the open-circuit voltage under load, after the voltage drop of the model.

    record : its temperature is used where it was measured.  soc0 : state of charge given by the user, 0 to 1; None
    takes that of the record (`Measurement.soc0`), where it is known.
    shared : True where there are several records, and `soc0`, if it was given, is for all of them; one whose voltage
    contradicts it is then read instead, unless the charge that the record moves allows `soc0` and not the state of
    charge that is read. What is known of this record alone goes before it.
    hold : how the current runs between rows.  effects : active effects of cell and instruments, as in `simulate`.
    model : for the simulation of a start under load.  potentials_v : standard deviation of the file's open-circuit
    voltage, V; a fit that moves the potentials takes `GOOD_READING_V`.
    Where the voltage is missing from some row on, only the rows before it are used.
    Raises DataError where the voltage belongs to no state of this cell, or where there is neither voltage nor `soc0`;
    InputError for a `soc0` that is no state of charge, for an unknown hold or model, and for what is no Cell, no
    Measurement or no active effect.
    """
    check_cell(cell)
    check_measurement(record)
    check_choice("hold", hold, Hold)
    check_choice("model", model, ModelName)
    soc0 = checked_soc(soc0)
    if record.soc0 is not None and (soc0 is None or shared):
        soc0, shared = record.soc0, False
    if not len(record):
        raise DataError(f"{record.name} has no row to start from.")
    option = OF_ONE if shared else GIVEN_BY
    active = instruments_first(checked_effects(effects))
    unknown = ~np.isfinite(record.voltage_v)
    if unknown[0]:
        if soc0 is None:
            raise DataError(f"{record.name} has no voltage to start from; give {option}.")
        return _given(record, soc0, None)
    seen = _record_as_cell_saw(record, active, hold)
    if unknown.any():
        seen = seen.take(slice(0, int(np.argmax(unknown))))
    advice = GIVE_IT.format(option) if soc0 is None else ""
    first_a = float(record.current_a[0])
    start = _StartReading(cell, seen, hold, active, model, potentials_v, first_a, option, advice)
    if soc0 is None:
        return start.read()
    try:
        read = start.read()
    except DataError:
        return _given(record, soc0, None)
    allowed = OTHER_STATE if read.basis in ("rest", "full charge") else OTHER_STATE_LOADED
    if read.off(soc0) <= allowed:
        return _given_beside_reading(record, soc0, read)
    least, most = start.bounds
    given_admitted, read_admitted = (least <= soc <= most for soc in (soc0, read.soc))
    if shared and (read_admitted or not given_admitted):
        return _read_instead(read, soc0)
    return replace(_given(record, soc0, read, read.flowed), doubt=abs(read.soc - soc0))


def _record_as_cell_saw(record: Measurement, effects: tuple[ActiveEffect, ...], hold: Hold) -> Measurement:
    """The record with the current, time and temperature that the cell saw; itself where no effect acts on it."""
    if all(active.effect.on_record is None for active in effects):
        return record
    degc = record.temperature_degc
    kelvin = None if degc is None else degc + ZERO_CELSIUS_K
    seen = as_cell_saw(Record(record.time_s, record.current_a, kelvin), effects).beside_voltage(
        hold == "backward"
    )
    return replace(
        record,
        time_s=seen.time_s,
        current_a=seen.current_a,
        temperature_degc=None if seen.temperature_k is None else seen.temperature_k - ZERO_CELSIUS_K,
    )


def _given_beside_reading(record: Measurement, soc0: float, read: InitialState) -> InitialState:
    """The given state of charge, which the reading does not contradict; `doubted` where it is notably off."""
    doubt = abs(read.soc - soc0)
    if doubt > OTHER_STATE and read.off(soc0) > DOUBTED_SDS * read.sd:
        told = _given(record, soc0, read, read.flowed)
        return replace(told, contradicted=False, doubt=doubt, doubted=True)
    return replace(_given(record, soc0, None, read.flowed), doubt=doubt)


def _read_instead(read: InitialState, soc0: float) -> InitialState:
    """The reading, with a sentence that says why what was given for several records is not believed for this one."""
    words = f"{read.sentence[:-1]}; not the {soc0:.4g} that was given, which its voltage contradicts."
    return InitialState(read.soc, read.sd, read.basis, words, True, read.rest_voltage_v, flowed=read.flowed)


def _given(
    record: Measurement, soc0: float, other: InitialState | None, flowed: bool = False
) -> InitialState:
    """The given state of charge.  other : what the voltage says instead, where it contradicts it.  flowed : True where
    a current has probably flowed before the record."""
    words = f"{record.name} starts at a state of charge of {soc0:.4g}, as given"
    if other is not None:
        words += f"; its first voltage ({record.voltage_v[0]:.3f} V) rather says {other.soc:.3f} +/- {other.sd:.3f}"
    words += f"; it looks {FLOWED_BEFORE}" if flowed else ""
    return InitialState(soc0, GIVEN_SD, "given", words + ".", other is not None, flowed=flowed)


class _StartReading:
    """Reads the state of charge at the first row of one record, with the model of one cell and its effects.

    record : as the cell saw it.  written_a : the first current as the file has it, A.  option : by which a user gives
    the state of charge instead.  advice : clause at the end of a sentence on an uncertain reading.
    """

    def __init__(
        self,
        cell: Cell,
        record: Measurement,
        hold: Hold,
        effects: tuple[ActiveEffect, ...],
        model_name: ModelName,
        potentials_v: float,
        written_a: float,
        option: str,
        advice: str,
    ) -> None:
        self.declared, self.record, self.effects = cell, record, effects
        self.model = model_with(cell, effects)
        self.cell = self.model.cell
        self.current_a, self.written_a = float(record.current_a[0]), written_a
        self.open_circuit = OpenCircuit.at_start(self.cell, record, potentials_v, option)
        self.model_name, self.hold, self.advice = model_name, hold, advice
        self.load = LoadedStart(self.open_circuit, record, hold, model_name)

    def read(self) -> InitialState:
        """The state read from the voltage and, under load, also from the charge that the record moves."""
        read = self._read_rest() if self._begins_at_rest() else self._read_load()
        # The reading of a rest is its likeliest state, not a mean that what is cut off would move.
        return read if read.basis != "load" else truncated_by_charge(read, self._moved, self.bounds)

    @property
    def _moved(self) -> Array:
        """(n,) discharged since the first row, as a share of the capacity of the cell with its effects."""
        return self.record.discharged_ah(self.hold) / self.cell.capacity_ah

    @property
    def bounds(self) -> Array:
        """(2,) least and largest state of charge at the first row, in the declared windows, by the charge that the
        record moves."""
        own = start_bounds(self._moved)
        inside = np.clip(own, 0.0, 1.0)  # windows have no rest voltage as far beyond them as a record may go
        return np.array([self._in_declared_windows(end) for end in inside.tolist()]) + (own - inside)

    def _begins_at_rest(self) -> bool:
        return abs(self.current_a) <= REST_C_RATE * self.cell.capacity_ah

    def _read_rest(self) -> InitialState:
        """From the voltage that the first rows relax to, or from the load that ends them where that tells more."""
        capacity_ah = self.cell.capacity_ah
        rest = resting_rows(self.record, REST_C_RATE * capacity_ah, ONE_STATE * capacity_ah, self.hold)
        begins_v = first_rows_v(rest.rows.voltage_v)
        terminal_v = self._freed_of_instruments(begins_v)
        if self.open_circuit.charged(terminal_v):
            return self._full_charge(terminal_v, f"rests at {begins_v:.3f} V", begins_v)
        settled_v, settled_sd_v = settled_voltage(self.open_circuit, rest.rows, self.model_name)
        ocv_v = self._freed_of_series(self._freed_of_instruments(settled_v))
        # Before what these rows move, the cell was as much fuller and higher.
        moved = float(rest.rows.discharged_ah(self.hold)[-1]) / capacity_ah
        ocv_rise_before_v = self._rise_v(ocv_v, moved)
        step_v = 10.0 ** -written_decimals(self.record.voltage_v)
        # A finer one adds 4 % to the deviation at most. Of a constant voltage it is not known.
        coarse = step_v > self.open_circuit.potentials_v and np.ptp(self.record.voltage_v) > 0.0
        voltage_sds_v = [self.open_circuit.potentials_v, settled_sd_v, STEP_SD * step_v if coarse else 0.0]
        if rest.flows:
            voltage_sds_v += [self._long_drop_v(rest, ocv_v), ocv_rise_before_v]
        spread_v = float(np.linalg.norm(voltage_sds_v))
        soc, sd = self.open_circuit.reading(ocv_v, spread_v)
        ended_by_load = len(rest.rows) < len(self.record) and not rest.flows
        if ended_by_load and settled_sd_v > self.open_circuit.potentials_v:
            # How far it is from settled is the greater doubt: the load may tell more.
            _, first_v = self._first_voltages()
            by_minutes = self._read_first_minutes(
                first_v, f"rests at {begins_v:.3f} V, too briefly to read the state from that alone"
            )
            if by_minutes.sd < sd:
                return by_minutes
        low, high = self.open_circuit.ends(ocv_v, spread_v)
        begun = self._in_declared_windows(soc + moved)
        return InitialState(
            begun,
            sd,
            "rest",
            self._rest_words(begins_v, settled_v, settled_sd_v, begun, sd, step_v if coarse else None),
            rest_voltage_v=settled_v + ocv_rise_before_v,
            ends=(self._in_declared_windows(low + moved), self._in_declared_windows(high + moved)),
        )

    def _rest_words(
        self,
        begins_v: float,
        settled_v: float,
        settled_sd_v: float,
        soc: float,
        sd: float,
        coarse_step_v: float | None,
    ) -> str:
        """The sentence on a rest: its voltages, V, and the state of charge with its standard deviation.

        coarse_step_v : step that voltages are written in, where that makes the reading less certain."""
        words = f"{self.record.name} rests at {begins_v:.3f} V"
        if coarse_step_v is not None:
            words += f", written in steps of {coarse_step_v:.3g} V"
        if max(abs(settled_v - begins_v), settled_sd_v) > GOOD_READING_V:
            words += f", relaxing to {settled_v:.3f} +/- {settled_sd_v:.3f} V"
        words += f": state of charge {soc:.4f} +/- {sd:.4f}"
        if self.open_circuit.potentials_v < READING_V:  # else it is taken for what a simulation starts from
            words += " by potentials that are fitted with it"
        return f"{words}{self.advice if sd > OTHER_STATE else ''}."

    def _rise_v(self, ocv_v: float, moved: float) -> float:
        """How far the open-circuit voltage was above `ocv_v`, V, before the share `moved` of the charge had flowed."""
        soc = self.open_circuit.soc_at(ocv_v)
        return self.open_circuit.voltage_at(soc + moved) - self.open_circuit.voltage_at(soc)

    def _long_drop_v(self, rest: Rest, ocv_v: float) -> float:
        """V that the model drops by a current below that of a load once it has flowed for long.

        ocv_v : that the rows seem to relax to.
        Not for rows that a load ends sooner, which are of a cell that rested: by what C/58 drops once it has flowed for
        long, three drives of a Panasonic at -20 degC would start within 0.05 instead of 0.0009.
        """
        return self.load.drop(ocv_v, float(rest.rows.current_a.mean()), FLOWED_S[-1])

    def _first_voltages(self) -> tuple[float, float]:
        """(first voltage without instrument faults, the same without effects in series either), V."""
        terminal = self._freed_of_instruments(float(self.record.voltage_v[0]), self.current_a)
        return terminal, self._freed_of_series(terminal, self.current_a)

    def _read_load(self) -> InitialState:
        """From the first voltage where a charge ended before this load, else from the first minutes."""
        terminal, first = self._first_voltages()
        drop_v = self.load.drop(first, self.current_a, 0.0)
        begun = terminal + drop_v
        written = "" if self.written_a == self.current_a else f" ({self.written_a:.3g} A as written)"
        said = f"starts under {self.current_a:.3g} A{written} at {self.record.voltage_v[0]:.3f} V"
        if self._charge_ended_before(begun, drop_v):
            words = f"{said}, and with the {MV_PER_V * drop_v:.0f} mV that the model drops at once at {begun:.3f} V"
            return self._full_charge(begun, words, None, drop_v)
        return self._read_first_minutes(first, said)

    def _read_first_minutes(self, first_v: float, said: str) -> InitialState:
        """From the minutes that the model follows from there, whatever flowed before.

        first_v : V, the first voltage, without what effects add in series and instruments do.
        """
        own_soc, sd, began_there = self.load.state_of_charge(first_v)
        soc = self._in_declared_windows(own_soc)
        likelier = "as if no current had flowed before" if began_there else FLOWED_BEFORE
        words = f"{self.record.name} {said}, {likelier}: state of charge {soc:.3f} +/- {sd:.3f}{self.advice}."
        return InitialState(soc, sd, "load", words, flowed=not began_there)

    def _charge_ended_before(self, begun_v: float, drop_v: float) -> bool:
        """Has a charge ended before this load, also where the model drops by two of its deviations too much?

        One that still flows has not. 1.2 V of drop in the cold made a full charge of 3.06 V and a charge of 0.64.
        """
        least_v = begun_v - DOUBTED_SDS * DROP_ERROR * drop_v
        as_read_v = begun_v - drop_v
        return self.current_a > 0.0 and self.open_circuit.charged(least_v, least_v - as_read_v)

    def _freed_of_instruments(self, reading_v: float, current_a: float = 0.0) -> float:
        return freed_of_instruments(self.open_circuit, self.model, self.effects, reading_v, current_a)

    def _freed_of_series(self, terminal_v: float, current_a: float = 0.0) -> float:
        return freed_of_series(self.open_circuit, self.model, self.effects, terminal_v, current_a)

    def _full_charge(
        self, true_v: float, how: str, rest_v: float | None, drop_v: float = 0.0
    ) -> InitialState:
        """State of charge 1.

        true_v : at the terminals, V.  how : clause on the first row.  rest_v : the rest voltage, V, where it rests.
        drop_v : part of true_v that the model adds to the voltage as it was read, V.
        """
        ocv_v = self._freed_of_series(true_v)
        full, inside = map(self._in_declared_windows, (1.0, self.open_circuit.soc_at(ocv_v)))
        sd = self.open_circuit.full_sd(ocv_v, DROP_ERROR * drop_v)
        above_v = true_v - self.cell.upper_voltage_v
        near, doubt = f"within {MV_PER_V * CHARGED_V:.0f} mV of", ""
        if above_v < -CHARGED_V:
            near = f"far above the plateau of its potential and {-MV_PER_V * above_v:.0f} mV below"
        if above_v > CHARGED_V:
            near = f"{MV_PER_V * above_v:.0f} mV above"
            doubt = "; check the voltage's sensor, and the cell file, which may be another cell's"
            if above_v - drop_v <= CHARGED_V:  # as it was read, the voltage is a full cell's
                doubt = "; by its first row the cell may have dropped by less than the model does"
        doubt = self._limits_doubt(ocv_v - drop_v) or doubt
        words = (
            f"{self.record.name} {how}, {near} the upper cut-off "
            f"({self.cell.upper_voltage_v:g} V): a full charge, state of charge {full:.4g} +/- {sd:.4f} "
            f"(by the open-circuit voltage {inside:.4f}){doubt}."
        )
        return InitialState(full, sd, "full charge", words, rest_voltage_v=rest_v, by_voltage=inside)

    def _limits_doubt(self, ocv_v: float) -> str:
        """A clause where state of charge 1 of the cell's file is no charge to its cut-off; empty elsewhere.

        ocv_v : V, the open-circuit voltage as it was read.
        """
        full_v, cut_off_v = self.open_circuit.voltage_at(1.0), self.cell.upper_voltage_v
        if full_v > cut_off_v + BEYOND_V:
            off = f"{MV_PER_V * (full_v - cut_off_v):.0f} mV above this cut-off"
        elif full_v < min(ocv_v, cut_off_v) - BEYOND_V:
            off = f"{MV_PER_V * (ocv_v - full_v):.0f} mV below this record"
        else:
            return ""
        return (
            f"; but by the potentials and the stoichiometry limits of the cell's file a state of charge of 1 rests at "
            f"{full_v:.3f} V, {off}: correct the cut-off, the potentials or the limits (aesi calibrate fits limits and "
            f"potentials), or give {self.open_circuit.given_by}"
        )

    def _in_declared_windows(self, soc: float) -> float:
        """A state of charge of the cell with its effects, in the windows of the cell file."""
        return same_rest(self.cell, self.declared, soc)
