"""The definition of an effect: its description, and the pure functions by which it acts.

An effect acts at one or more of four places, each a function of plain values that returns changed copies:

    on_model     (EspmModel, **parameters) -> EspmModel       the cell and the model's constitutive choices
    on_record    (Record, **parameters) -> Record             time, current, temperature that the cell really saw
    on_voltage   (Trace, **parameters) -> Contribution        a voltage in series with the cell, with own states
    on_reading   (Trace, **parameters) -> (n,) V              the voltage as the instrument wrote it

The arrays of a Record or a Trace are read-only: they belong to the caller, and other effects read them too. No part of
the core refers to an effect by name. A new effect is a file, a line of registration and a test, or a user's own file
that `load_effect` reads.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar

import numpy as np

from aesi.constants import COLDEST_DEGC, WARMEST_DEGC, ZERO_CELSIUS_K
from aesi.errors import AesiError, InputError, NoNumberError, OwnEffectError, ParameterError
from aesi.numerics.typing import Array, BoolArray, IntArray
from aesi.over_time import stamp
from aesi.parameters import Parameter, checked
from aesi.physics.model import EspmModel
from aesi.records import Run

Acted = TypeVar("Acted")
Kind = Literal["physics", "parameter", "instrument"]
Measurable = Literal["temperature"]
"""Quantities that a record may hold in addition to current and voltage."""
Refinement = Literal["discretisation", "reduction"]
"""Approximations between the declared porous electrode and the equations that are solved."""
PLACES = ("on_model", "on_record", "on_voltage", "on_reading")
"""Where an effect may act: names of the functions of an `Effect`."""
SAME_INSTANT_S = 1e-6
"""A reading this close to a row, s, belongs to that row: t - lag has round-off, and a current that jumps at the row has
two values there."""
SAME_LENGTH = 0.01
"""Relative difference in the lengths of two rows up to which they count as equally long, since time stamps jitter."""


@dataclass(frozen=True, eq=False)
class Record:
    """The load that the cell saw: time (n,) s, current (n,) A, discharge positive, temperature (n,) K or None where the
    model computes it.

    read_s : (n,) s, true time at which the voltage of each row was at the terminals; None: that of the current. Before
    the first row the current is that of the first row, after the last that of the last.
    unresolved_heat_w : (n,) W, heat beyond that of the rows' current, see `simulate`; None for none. No effect acts on
    it.
    """

    time_s: Array
    current_a: Array
    temperature_k: Array | None = None
    read_s: Array | None = None
    unresolved_heat_w: Array | None = None

    def __post_init__(self) -> None:
        """The arrays become read-only views."""
        _lock(self, "time_s", "current_a", "temperature_k", "read_s", "unresolved_heat_w")

    def current_at(self, time_s: Array, backward: bool) -> Array:
        """(m,) A, current at times (m,) s.  backward : True where a row's current holds since the row before, else
        straight lines."""
        if not backward:
            return np.asarray(np.interp(time_s, self.time_s, self.current_a))
        return np.asarray(self.current_a[self._row_of(time_s)])

    def with_readings(self, backward: bool) -> tuple[Record, IntArray]:
        """(record with an additional row at each reading of the voltage, numbers (n,) of these rows).

        Rows between readings are left out where the current does not change.
        """
        read = self._snapped()
        steps = np.diff(self.current_a) != 0.0
        turns = np.append(steps, True)
        if not backward:
            turns[1:] |= steps
        turns[0] = True
        time = np.union1d(self.time_s[turns & (self.time_s < read.max())], read)
        kelvin = None if self.temperature_k is None else np.interp(time, self.time_s, self.temperature_k)
        heat_w = None
        if self.unresolved_heat_w is not None:
            held = np.append(0.0, self.unresolved_heat_w[1:])  # the first row ends no step
            heat_w = np.append(0.0, np.diff(self._integral(held, time)) / np.diff(time))
        record = Record(time, self.current_at(time, backward), kelvin, unresolved_heat_w=heat_w)
        return record, np.searchsorted(time, read)

    def beside_voltage(self, backward: bool, mean: bool = False) -> Record:
        """The record with one row per reading of the voltage, and the current that flowed there.

        Where a held current changes within a row (a pulse begins after a long row), the row has the mean current that
        moves its charge; with `mean` all rows have, for readings that are averaged over rows. The current at the
        instants of the readings does not change with a lag until that exceeds a row, so that no slope would tell of it.
        """
        if self.read_s is None:
            return self
        read = self._snapped()
        current = self.current_at(read, backward)
        if backward and len(read) > 1:
            means = np.diff(self._integral(self.current_a, read)) / np.diff(read)
            current[1:] = means if mean else np.where(self._whole_rows(read), current[1:], means)
        kelvin = self.temperature_k
        return Record(read, current, None if kelvin is None else np.interp(read, self.time_s, kelvin))

    def _whole_rows(self, read_s: Array) -> BoolArray:
        """(n - 1,) True where the readings read_s (n,) s are as far apart as the rows of the current there."""
        within = self._row_of(read_s)[1:]
        long_s = np.diff(self.time_s, prepend=-np.inf, append=np.inf)
        long_s = np.where(read_s[1:] > self.time_s[-1], np.inf, long_s[within])
        return np.asarray(np.abs(long_s - np.diff(read_s)) <= SAME_LENGTH * np.diff(read_s))

    def _snapped(self) -> Array:
        """(n,) s, times of the readings, snapped to a row within `SAME_INSTANT_S`."""
        assert self.read_s is not None
        after = np.clip(np.searchsorted(self.time_s, self.read_s), 1, max(len(self.time_s) - 1, 1))
        near = np.minimum(after, len(self.time_s) - 1)
        before = after - 1
        nearer = np.abs(self.time_s[before] - self.read_s) < np.abs(self.time_s[near] - self.read_s)
        row = self.time_s[np.where(nearer, before, near)]
        return np.where(np.abs(row - self.read_s) < SAME_INSTANT_S, row, self.read_s)

    def _row_of(self, time_s: Array) -> IntArray:
        """(m,) number of the row that ends at a time or next after it."""
        return np.minimum(np.searchsorted(self.time_s, time_s), len(self.time_s) - 1)

    def _integral(self, held: Array, time_s: Array) -> Array:
        """(m,) A s or J, integral from the first row to times (m,) s of a current or heat (n,) held since the row
        before."""
        since = self.time_s
        moved = np.concatenate([[0.0], np.cumsum(held[1:] * np.diff(since))])
        outside = held[0] * np.minimum(time_s - since[0], 0.0) + held[-1] * np.maximum(
            time_s - since[-1], 0.0
        )
        return np.asarray(np.interp(time_s, since, moved) + outside)


@dataclass(frozen=True, eq=False)
class Trace:
    """A finished simulation, the input of voltage effects.

    time_s, current_a : (n,) s, A, as the cell saw them.  voltage_v : (n,) V, with the effects applied before.
    series : states by name, see `Run`.
    backward : True where a row's current holds since the row before.
    """

    model: EspmModel
    time_s: Array
    current_a: Array
    voltage_v: Array
    series: Mapping[str, Array]
    backward: bool = False

    def __post_init__(self) -> None:
        """The arrays become read-only views."""
        _lock(self, "time_s", "current_a", "voltage_v")
        object.__setattr__(self, "series", {name: _read_only(state) for name, state in self.series.items()})


@dataclass(frozen=True, eq=False)
class Contribution:
    """Voltage to add (n,) V, and states by name, (n,) each, to report."""

    voltage_v: Array
    series: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect, inactive: its description and functions, without parameter values.

    doc : docstring of its file: summary, equation, range of validity, source.  file, code : path and text of a user's
    own effect; empty otherwise.
    infers : quantity that the effect supplies where it was not measured; where it was, the effect does not compete.
    refines : approximation of the model that the effect undoes; this is decided before a search for other effects.
    of_design : True for the design of a cell (potentials, geometry, transport, kinetics); a file that was fitted to
    this very cell has it right, within the accuracy of the model.
    of_every_record : True for physics with constants of the cell: if one record shows it, every record does.
    of_material : True for a function of an electrode's stoichiometry that belongs to the material (U(x), D(x)). It acts
    on the windows that the file declares, before effects that move these.
    of_age : True for a change by ageing; all records of the same days have it.
    ohmic : True for a voltage drop proportional to the current, like the declared contact resistance. With such an
    effect in the hypothesis, no separate error of the file's resistance is assumed.
    experiment : one that shows the effect.  told_apart : id of another effect -> experiment that tells the two apart.
    """

    id: str
    kind: Kind
    doc: str
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    on_model: Callable[..., EspmModel] | None = None
    on_record: Callable[..., Record] | None = None
    on_voltage: Callable[..., Contribution] | None = None
    on_reading: Callable[..., Array] | None = None
    file: str | None = None
    code: bytes | None = None
    infers: Measurable | None = None
    refines: Refinement | None = None
    of_design: bool = False
    of_every_record: bool = False
    of_material: bool = False
    of_age: bool = False
    ohmic: bool = False
    experiment: str = ""
    told_apart: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Effect({self.id!r}, {self.kind}, parameters {', '.join(self.parameters) or 'none'})"

    @property
    def where(self) -> str:
        """How a sentence calls it: by the path of its file, or by its id."""
        return self.file or f"the effect {self.id!r}"

    @property
    def acting(self) -> dict[str, Callable[..., Any]]:
        """Place -> the function that it has there, in the order of `PLACES`."""
        functions = {place: getattr(self, place) for place in PLACES}
        return {place: function for place, function in functions.items() if function is not None}

    @property
    def restates_declared(self) -> bool:
        """Whether it moves parameters that cell files declare, with a tolerance."""
        return any(p.spread is not None for p in self.parameters.values())

    @property
    def kind_told(self) -> str:
        """The kind as reported to a user: an effect that refines the discretisation is "numerics", no instrument."""
        return "numerics" if self.refines == "discretisation" else self.kind

    def activate(self, **values: float) -> ActiveEffect:
        """The active effect with the given parameter values, defaults for the others.

        Raises ParameterError for an unknown name or a value out of bounds; InputError for an effect that acts nowhere.
        """
        if not self.acting:
            raise InputError(f"{self.where} acts nowhere; give it one of {', '.join(PLACES)}.")
        try:
            return ActiveEffect(self, tuple(checked(self.parameters, values, self._wider).items()))
        except ParameterError as error:
            raise ParameterError(f"{self.id}: {error}") from None

    def activate_only(self, **values: float) -> ActiveEffect:
        """The active effect with the given parameter values; the others at neutral or, without one, at default."""
        still = {name: p.neutral for name, p in self.parameters.items() if p.neutral is not None}
        return self.activate(**{**still, **values})

    @property
    def _wider(self) -> str:
        """Advice for a value out of bounds; a user cannot change the bounds of the catalogue."""
        if self.file is not None:
            return f"If the cell warrants it, widen the bounds in {self.file}"
        return (
            "If the cell warrants it, an effect of your own can have wider bounds: a file with the same equation and "
            "another id (--effect-file, in Python load_effect)"
        )

    @property
    def summary(self) -> str:
        """First sentence of the file."""
        return self._paragraphs[0].replace("\n", " ").rstrip(".")

    @property
    def equation(self) -> str:
        """The indented block: equation and sign convention."""
        return "\n".join(p for p in self._paragraphs if p.startswith("    "))

    @property
    def validity(self) -> str:
        """What the effect leaves out, and its range of validity."""
        return " ".join(
            p.replace("\n", " ") for p in self._paragraphs if p.startswith(("Leaves out", "Holds"))
        )

    @property
    def source(self) -> str:
        """The literature source."""
        found = [p for p in self._paragraphs if p.startswith("Source:")]
        return found[0].removeprefix("Source:").replace("\n", " ").strip() if found else ""

    @property
    def _paragraphs(self) -> list[str]:
        return [p.rstrip() for p in inspect.cleandoc(self.doc).split("\n\n") if p.strip()]


@dataclass(frozen=True)
class ActiveEffect:
    """An effect with values for all of its parameters, as `simulate` takes it.

    Two are equal if they have the same effect object and the same values. The id alone does not count: an effect that
    was rewritten under its id acts differently, and cached results of the old one must not be reused.
    """

    effect: Effect
    values: tuple[tuple[str, float], ...]

    def __repr__(self) -> str:
        return f"{self.id}({', '.join(f'{name}={value:.4g}' for name, value in self.values)})"

    @property
    def id(self) -> str:
        """The effect's id."""
        return self.effect.id

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name."""
        return dict(self.values)

    @property
    def vanishes(self) -> bool:
        """Whether it changes nothing: it has neutral values, and all parameters that have one are at it."""
        neutral = {name: p.neutral for name, p in self.effect.parameters.items() if p.neutral is not None}
        return bool(neutral) and all(self.parameters[name] == value for name, value in neutral.items())

    def act(self, function: Callable[..., Acted], given: object) -> Acted:
        """The result of one of the effect's functions for the input `given`.

        For a user's own function raises OwnEffectError where it returns something unusable, and NoNumberError where a
        value is not finite. Where one of a file fails, these two name file and line; one that was made in Python fails
        with its own error. An AesiError that it raises itself passes.
        """
        if not _is_own(function):
            return function(given, **self.parameters)
        try:
            acted = function(given, **self.parameters)
        except AesiError:
            raise
        except (Exception, SystemExit) as error:
            if self.effect.file is None:
                raise
            arithmetic = isinstance(error, ArithmeticError)
            raise (NoNumberError if arithmetic else OwnEffectError)(
                _failure(self.effect.file, error)
            ) from error
        _check_acted(self.effect, function, given, acted)
        return acted

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values; `aesi.physics.effects.active_effect` restores the effect."""
        out: dict[str, Any] = {"effect": self.effect.id, "parameters": self.parameters}
        if self.effect.file is not None:
            out["file"] = self.effect.file
        return out


def instruments_first(effects: Iterable[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """The effects, those of instruments first: the record has to be corrected before the cell responds to it."""
    return tuple(sorted(effects, key=lambda e: e.effect.kind != "instrument"))


def materials_first(effects: Iterable[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """The effects, those `of_material` first: properties of a material at a stoichiometry do not depend on the balance
    of the electrodes."""
    return tuple(sorted(effects, key=lambda e: not e.effect.of_material))


def as_cell_saw(record: Record, effects: Iterable[ActiveEffect]) -> Record:
    """The load that the cell really saw, from the `record` as written, by the effects in their order."""
    for active in effects:
        if active.effect.on_record is not None:
            record = active.act(active.effect.on_record, record)
    return record


def _is_own(function: Callable[..., Any] | None) -> bool:
    """Whether a function is a user's own, of a file or made in Python, and none of this package."""
    return not str(getattr(function, "__module__", "")).startswith(f"{__name__.partition('.')[0]}.")


def check_states(effect: Effect, added: Contribution, trace: Trace) -> None:
    """Raises OwnEffectError where a user's own effect returns a state with a name that the run has already."""
    taken = {*trace.series, *(one.name for one in fields(Run))}
    clash = [name for name in added.series if name in taken]
    if clash and _is_own(effect.on_voltage):
        raise OwnEffectError(
            f"{effect.where}: on_voltage gives a state {clash[0]!r}, which the run has; name it otherwise."
        )


def _failure(file: str, error: BaseException) -> str:
    """A sentence on an error that a function of the file raised, with its line."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    where = f"{file}, line {frames[-1].lineno}, in {frames[-1].name}" if frames else file
    said = str(error).rstrip(".")
    if isinstance(error, ValueError) and "read-only" in said:  # numpy's word, of assignments and of out=
        return f"{where}: it writes into its input; make a copy first, as record.current_a.copy() is."
    return f"{where}: {type(error).__name__}{': ' if said else ''}{said}."


def _check_acted(effect: Effect, function: Callable[..., Any], given: Any, acted: Any) -> None:
    """Check the result of a user's own function.  Raises OwnEffectError for a wrong type or shape, NoNumberError for
    values that are not finite."""
    if function is effect.on_reading:
        _check_rows(effect, "on_reading", {"": acted}, given.time_s)
        return
    places: dict[type, tuple[str, type]] = {
        EspmModel: ("on_model", EspmModel),
        Record: ("on_record", Record),
        Trace: ("on_voltage", Contribution),
    }
    place, wanted = places[type(given)]
    if not isinstance(acted, wanted):
        what = f"an object of type {type(acted).__name__}"
        raise OwnEffectError(f"{effect.where}: {place} gives {what}, not {_article(wanted.__name__)}.")
    if isinstance(acted, Record):
        rows = {"time_s": acted.time_s, "current_a": acted.current_a, "temperature_k": acted.temperature_k}
        rows["read_s"] = acted.read_s
        _check_rows(effect, place, {k: row for k, row in rows.items() if row is not None}, given.time_s)
        _check_possible(effect, acted)
    elif isinstance(acted, Contribution):
        states = {f"state {name!r}": state for name, state in acted.series.items()}
        _check_rows(effect, place, {"": acted.voltage_v, **states}, given.time_s)


def _check_possible(effect: Effect, acted: Record) -> None:
    """Raises OwnEffectError for times of a record that do not rise, and for a temperature that no cell has."""
    if np.any(np.diff(acted.time_s) <= 0.0):
        raise OwnEffectError(f"{effect.where}: on_record gives times that do not rise from row to row.")
    kelvin = acted.temperature_k
    if kelvin is None:
        return
    low, high = COLDEST_DEGC + ZERO_CELSIUS_K, WARMEST_DEGC + ZERO_CELSIUS_K
    absurd = (kelvin < low) | (kelvin > high)
    if np.any(absurd):
        raise OwnEffectError(
            f"{effect.where}: on_record gives {kelvin[int(np.argmax(absurd))]:.5g} K, and a cell is at {low:g} to "
            f"{high:g} K; temperature_k is in kelvin."
        )


def _article(name: str) -> str:
    return f"an {name}" if name[0] in "AEIO" else f"a {name}"


def _check_rows(effect: Effect, place: str, rows: Mapping[str, Any], time_s: Array) -> None:
    """Raises OwnEffectError for a row of another shape or not of numbers; NoNumberError where values lack."""
    for name, row in rows.items():
        what = f"{effect.where}: {place}{f', {name},' if name else ''} gives"
        if np.shape(row) != time_s.shape:
            raise OwnEffectError(f"{what} the shape {np.shape(row)}, where the record has {time_s.shape}.")
        if np.asarray(row).dtype.kind not in "biuf":
            raise OwnEffectError(f"{what} values of type {np.asarray(row).dtype}, not numbers.")
        unknown = ~np.isfinite(row)
        if unknown.any():
            raise NoNumberError(f"{what} no number at {stamp(float(time_s[int(np.argmax(unknown))]))} s.")


def _lock(holder: object, *names: str) -> None:
    for name in names:
        values = getattr(holder, name)
        if values is not None:
            object.__setattr__(holder, name, _read_only(values))


def _read_only(values: Array) -> Array:
    view = np.asarray(values).view()
    view.flags.writeable = False
    return view
