"""What an effect is: what it says about itself, and the pure functions by which it acts.

An effect acts at one or more of four places, each a function of plain values that returns changed copies:

    on_model     (EspmModel, **parameters) -> EspmModel       the cell and the model's constitutive choices
    on_record    (Record, **parameters) -> Record             time, current, temperature that the cell really saw
    on_voltage   (Trace, **parameters) -> Contribution        a voltage in series with the cell, with own states
    on_reading   (Trace, **parameters) -> (n,) V              the voltage as the instrument wrote it

What a Record or a Trace holds can be read and not written: it is the caller's own, and other effects read it too.
Nothing in the core knows an effect by name: a new one is a file, a line of registration and a test, or a
file of the user's own that `load_effect` reads.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np

from aesi.errors import AesiError, NoNumberError, OwnEffectError, ParameterError
from aesi.numerics.typing import Array, IntArray
from aesi.over_time import stamp
from aesi.parameters import Parameter, checked
from aesi.physics.model import EspmModel

Acted = TypeVar("Acted")
Kind = Literal["physics", "parameter", "instrument"]
Measurable = Literal["temperature"]
"""Quantities that a record may hold beside current and voltage."""
Refinement = Literal["discretisation", "reduction"]
"""Approximations between the declared porous electrode and what is solved."""


SAME_INSTANT_S = 1e-6
"""A reading this close to a row is of that row: t - lag is rounded, and a current that jumps there has two values."""
SAME_LENGTH = 0.01
"""Of a row: another that is as long but for this, as stamps jitter, moves the charge of this one under its current."""


@dataclass(frozen=True, eq=False)
class Record:
    """What the cell saw: (n,) s, (n,) A discharge positive, (n,) K or None where the model finds it.

    read_s : (n,) s, when the voltage of each row was in truth at the terminals; None: with its current. Before the
    first row the current is that of the first, behind the last that of the last.
    """

    time_s: Array
    current_a: Array
    temperature_k: Array | None = None
    read_s: Array | None = None

    def __post_init__(self) -> None:
        """What it holds becomes read-only views of what it is given."""
        _lock(self, "time_s", "current_a", "temperature_k", "read_s")

    def current_at(self, time_s: Array, backward: bool) -> Array:
        """(m,) A at instants (m,) s.  backward : a row's current holds since the row before, else straight lines."""
        if not backward:
            return np.asarray(np.interp(time_s, self.time_s, self.current_a))
        return np.asarray(self.current_a[self._row_of(time_s)])

    def with_readings(self, backward: bool) -> tuple[Record, IntArray]:
        """The same current with a row at each reading of the voltage too, and which rows (n,) these are.

        Rows between readings are left out where the current just goes on.
        """
        read = self._snapped()
        now, steps = self.current_a, np.diff(self.current_a) != 0.0
        turns = np.append(steps, True)
        if not backward:
            turns[1:] |= steps
        turns[0] = True
        time = np.union1d(self.time_s[turns & (self.time_s < read.max())], read)
        kelvin = None if self.temperature_k is None else np.interp(time, self.time_s, self.temperature_k)
        now = self.current_at(time, backward)
        return Record(time, now, kelvin), np.searchsorted(time, read)

    def beside_voltage(self, backward: bool) -> Record:
        """The record with one row a reading of the voltage, and the current that flowed there.

        Of a current that is held, a row that is another than the one it is read in, as where a pulse begins after a
        long row, has what moves its charge.
        """
        if self.read_s is None:
            return self
        read = self._snapped()
        current = self.current_at(read, backward)
        if backward and len(read) > 1:
            within = self._row_of(read)[1:]
            long_s = np.diff(self.time_s, prepend=-np.inf, append=np.inf)
            long_s = np.where(read[1:] > self.time_s[-1], np.inf, long_s[within])
            whole = np.abs(long_s - np.diff(read)) <= SAME_LENGTH * np.diff(read)
            current[1:] = np.where(whole, current[1:], np.diff(self._charge(read)) / np.diff(read))
        kelvin = self.temperature_k
        return Record(read, current, None if kelvin is None else np.interp(read, self.time_s, kelvin))

    def _snapped(self) -> Array:
        """(n,) s, the readings, on a row where they are as good as there."""
        assert self.read_s is not None
        after = np.clip(np.searchsorted(self.time_s, self.read_s), 1, max(len(self.time_s) - 1, 1))
        near = np.minimum(after, len(self.time_s) - 1)
        before = after - 1
        nearer = np.abs(self.time_s[before] - self.read_s) < np.abs(self.time_s[near] - self.read_s)
        row = self.time_s[np.where(nearer, before, near)]
        return np.where(np.abs(row - self.read_s) < SAME_INSTANT_S, row, self.read_s)

    def _row_of(self, time_s: Array) -> IntArray:
        """(m,) the row that is over at an instant or ends next."""
        return np.minimum(np.searchsorted(self.time_s, time_s), len(self.time_s) - 1)

    def _charge(self, time_s: Array) -> Array:
        """(m,) A s that a held current has moved since the first row, up to instants (m,) s."""
        since, now = self.time_s, self.current_a
        moved = np.concatenate([[0.0], np.cumsum(now[1:] * np.diff(since))])
        outside = now[0] * np.minimum(time_s - since[0], 0.0) + now[-1] * np.maximum(time_s - since[-1], 0.0)
        return np.asarray(np.interp(time_s, since, moved) + outside)


@dataclass(frozen=True, eq=False)
class Trace:
    """A finished simulation as voltage effects see it.

    time_s, current_a : what the cell saw.  voltage_v : (n,) V so far.  series : states by name, see `Run`.
    backward : True where a row's current holds since the row before.
    """

    model: EspmModel
    time_s: Array
    current_a: Array
    voltage_v: Array
    series: Mapping[str, Array]
    backward: bool = False

    def __post_init__(self) -> None:
        """What it holds becomes read-only views of what it is given."""
        _lock(self, "time_s", "current_a", "voltage_v")
        object.__setattr__(self, "series", {name: _read_only(state) for name, state in self.series.items()})


@dataclass(frozen=True, eq=False)
class Contribution:
    """Voltage to add (n,) V, and states to report by name."""

    voltage_v: Array
    series: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect; `doc` is the docstring of its file: summary, equation, where it holds, source.

    file, code : of a user's own, where it was read and what stood there.
    infers : the quantity that the effect supplies where it was not measured; with the measurement it has nothing to
    say and does not compete.
    refines : the approximation of the model itself that the effect takes back; it is settled before anything is sought
    in the cell.
    of_design : True for what a cell is made with and keeps (potentials, geometry, transport, kinetics); a file that was
    fitted to this very cell has it right, as far as the model goes.
    of_every_record : True for physics by constants of the cell: what no record is without where another one has it.
    of_material : True for what is laid over the stoichiometry window of an electrode and belongs to its material, as
    U(x) and D(x): it acts on the windows that the file declares, before what moves these.
    of_age : True for what a cell loses or gains as it ages: all records of the same days have it.
    ohmic : True for a drop that follows the current at once, as the declared resistance of contacts does: beside such
    an effect nothing else says that the file is off in it.
    experiment : which one shows it.  told_apart : id of another effect -> which one tells the two apart.
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
    def kind_told(self) -> str:
        """Its kind for a reader: what refines the discretisation alone is no fault of an instrument."""
        return "numerics" if self.refines == "discretisation" else self.kind

    def activate(self, **values: float) -> ActiveEffect:
        """This effect with the given parameters, defaults elsewhere.

        Raises ParameterError for an unknown name or a value out of bounds.
        """
        try:
            return ActiveEffect(self, tuple(checked(self.parameters, values, self._wider).items()))
        except ParameterError as error:
            raise ParameterError(f"{self.id}: {error}") from None

    def activate_only(self, **values: float) -> ActiveEffect:
        """This effect with the given parameters, and the others at their neutral values, where they have one."""
        still = {name: p.neutral for name, p in self.parameters.items() if p.neutral is not None}
        return self.activate(**{**still, **values})

    @property
    def _wider(self) -> str:
        """What to do for a value beyond the bounds: those of the catalogue are no user's to change."""
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
        """What is left out and where it holds."""
        return " ".join(
            p.replace("\n", " ") for p in self._paragraphs if p.startswith(("Leaves out", "Holds"))
        )

    @property
    def source(self) -> str:
        """Where it is from."""
        found = [p for p in self._paragraphs if p.startswith("Source:")]
        return found[0].removeprefix("Source:").replace("\n", " ").strip() if found else ""

    @property
    def _paragraphs(self) -> list[str]:
        return [p.rstrip() for p in inspect.cleandoc(self.doc).split("\n\n") if p.strip()]


@dataclass(frozen=True)
class ActiveEffect:
    """An effect with values for all of its parameters: what `simulate` takes.

    Equal to another of the very same effect with the same values. Effects are not told apart by their ids: one that was
    written anew under its id acts differently, and what was computed with the other has to be computed again.
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

    def act(self, function: Callable[..., Acted], given: object) -> Acted:
        """What one of the effect's functions makes of what it is given.

        Of a user's own, raises OwnEffectError where it fails or gives what cannot be used, NoNumberError where there is
        no number, each with file and line; an AesiError that it raises itself is left as it is.
        """
        if self.effect.file is None:
            return function(given, **self.parameters)
        try:
            acted = function(given, **self.parameters)
        except AesiError:
            raise
        except (Exception, SystemExit) as error:
            arithmetic = isinstance(error, ArithmeticError)
            raise (NoNumberError if arithmetic else OwnEffectError)(
                _failure(self.effect.file, error)
            ) from error
        _check_acted(self.effect, function, given, acted)
        return acted

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; `aesi.physics.effects.active_effect` gives it back."""
        out: dict[str, Any] = {"effect": self.effect.id, "parameters": self.parameters}
        if self.effect.file is not None:
            out["file"] = self.effect.file
        return out


def instruments_first(effects: Iterable[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """What was recorded has to be set right before the cell can answer to it."""
    return tuple(sorted(effects, key=lambda e: e.effect.kind != "instrument"))


def materials_first(effects: Iterable[ActiveEffect]) -> tuple[ActiveEffect, ...]:
    """What a material answers at a stoichiometry does not depend on how electrodes of it are balanced."""
    return tuple(sorted(effects, key=lambda e: not e.effect.of_material))


def as_cell_saw(record: Record, effects: Iterable[ActiveEffect]) -> Record:
    """What the cell really saw where `record` was written, by the effects in their order."""
    for active in effects:
        if active.effect.on_record is not None:
            record = active.act(active.effect.on_record, record)
    return record


def check_states(effect: Effect, added: Contribution, trace: Trace) -> None:
    """Raises OwnEffectError where an effect of a user's own gives a state that the run has already."""
    clash = [name for name in added.series if name in trace.series]
    if clash and effect.file is not None:
        raise OwnEffectError(
            f"{effect.file}: on_voltage gives a state {clash[0]!r}, which the run has; name it otherwise."
        )


def _failure(file: str, error: BaseException) -> str:
    """What a function of the file raised: in which of its lines, and what."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    where = f"{file}, line {frames[-1].lineno}, in {frames[-1].name}" if frames else file
    said = str(error).rstrip(".")
    if isinstance(error, ValueError) and "read-only" in said:  # numpy's word, of assignments and of out=
        return f"{where}: it writes into its input; make a copy first, as record.current_a.copy() is."
    return f"{where}: {type(error).__name__}{': ' if said else ''}{said}."


def _check_acted(effect: Effect, function: Callable[..., Any], given: Any, acted: Any) -> None:
    """Raises OwnEffectError for what no function of a user's own may give, NoNumberError for a row without numbers."""
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
        raise OwnEffectError(f"{effect.file}: {place} gives {what}, not {_article(wanted.__name__)}.")
    if isinstance(acted, Record):
        rows = {"time_s": acted.time_s, "current_a": acted.current_a, "temperature_k": acted.temperature_k}
        rows["read_s"] = acted.read_s
        _check_rows(effect, place, {k: row for k, row in rows.items() if row is not None}, given.time_s)
    elif isinstance(acted, Contribution):
        states = {f"state {name!r}": state for name, state in acted.series.items()}
        _check_rows(effect, place, {"": acted.voltage_v, **states}, given.time_s)


def _article(name: str) -> str:
    return f"an {name}" if name[0] in "AEIO" else f"a {name}"


def _check_rows(effect: Effect, place: str, rows: Mapping[str, Any], time_s: Array) -> None:
    """Raises OwnEffectError for a row of another shape or not of numbers; NoNumberError where values lack."""
    for name, row in rows.items():
        what = f"{effect.file}: {place}{f', {name},' if name else ''} gives"
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
