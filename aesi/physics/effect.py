"""What an effect is: what it says about itself, and the pure functions by which it acts.

An effect acts at one or more of four places, each a function of plain values that returns changed copies:

    on_model     (EspmModel, **parameters) -> EspmModel       the cell and the model's constitutive choices
    on_record    (Record, **parameters) -> Record             time, current, temperature that the cell really saw
    on_voltage   (Trace, **parameters) -> Contribution        a voltage in series with the cell, with own states
    on_reading   (Trace, **parameters) -> (n,) V              the voltage as the instrument wrote it

Nothing in the core knows an effect by name: a new one is a file, a line of registration and a test, or a
file of the user's own that `load_effect` reads.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np

from aesi.errors import ParameterError, SimulationError
from aesi.numerics.typing import Array
from aesi.over_time import stamp
from aesi.parameters import Parameter, checked
from aesi.physics.model import EspmModel

Acted = TypeVar("Acted")
Kind = Literal["physics", "parameter", "instrument"]
Measurable = Literal["temperature"]
"""Quantities that a record may hold beside current and voltage."""
Refinement = Literal["discretisation", "reduction"]
"""Approximations between the declared porous electrode and what is solved."""


@dataclass(frozen=True, eq=False)
class Record:
    """What the cell saw: (n,) s, (n,) A discharge positive, (n,) K or None where the model finds it."""

    time_s: Array
    current_a: Array
    temperature_k: Array | None = None


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


@dataclass(frozen=True, eq=False)
class Contribution:
    """Voltage to add (n,) V, and states to report by name."""

    voltage_v: Array
    series: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect; `doc` is the docstring of its file: summary, equation, where it holds, source.

    infers : the quantity that the effect supplies where it was not measured; with the measurement it has nothing to
    say and does not compete.
    refines : the approximation of the model itself that the effect takes back; it is settled before anything is sought
    in the cell.
    of_design : True for what a cell is made with and keeps (potentials, geometry, transport, kinetics); a file that was
    fitted to this very cell has it right, as far as the model goes.
    of_every_record : True for physics by constants of the cell, and for its age: what no record is without where
    another one of those days has it.
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
    infers: Measurable | None = None
    refines: Refinement | None = None
    of_design: bool = False
    of_every_record: bool = False
    ohmic: bool = False
    experiment: str = ""
    told_apart: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Effect({self.id!r}, {self.kind}, parameters {', '.join(self.parameters) or 'none'})"

    def activate(self, **values: float) -> ActiveEffect:
        """This effect with the given parameters, defaults elsewhere.

        Raises ParameterError for an unknown name or a value out of bounds.
        """
        try:
            return ActiveEffect(self, tuple(checked(self.parameters, values).items()))
        except ParameterError as error:
            raise ParameterError(f"{self.id}: {error}") from None

    def activate_only(self, **values: float) -> ActiveEffect:
        """This effect with the given parameters, and the others at their neutral values, where they have one."""
        still = {name: p.neutral for name, p in self.parameters.items() if p.neutral is not None}
        return self.activate(**{**still, **values})

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
        """What one of the effect's functions makes of what it is given; what a user's own raises names its file."""
        try:
            return function(given, **self.parameters)
        except Exception as error:
            if self.effect.file is not None:
                error.add_note(f"raised by {function.__name__} of {self.effect.file}")
            raise

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready; `aesi.physics.effects.active_effect` gives it back."""
        out: dict[str, Any] = {"effect": self.effect.id, "parameters": self.parameters}
        if self.effect.file is not None:
            out["file"] = self.effect.file
        return out


def check_contribution(file: str, added: object, trace: Trace) -> None:
    """Raises TypeError or ValueError, which stop a search, for what no on_voltage of a user's own may give."""
    if not isinstance(added, Contribution):
        raise TypeError(
            f"{file}: on_voltage gives an object of type {type(added).__name__}, not a Contribution."
        )
    check_row_of(file, "on_voltage", added.voltage_v, trace)
    for name, state in added.series.items():
        if name in trace.series:
            raise ValueError(
                f"{file}: on_voltage gives a state {name!r}, which the run has; name it otherwise."
            )
        check_row_of(file, f"on_voltage, state {name!r},", state, trace)


def check_row_of(file: str, what: str, row: Any, trace: Trace) -> None:
    """Raises ValueError for a row of another shape; SimulationError, which a search passes by, where values lack."""
    shape = np.shape(row)
    if shape != trace.time_s.shape:
        raise ValueError(
            f"{file}: {what} gives the shape {shape}, where the record has {trace.time_s.shape}."
        )
    unknown = ~np.isfinite(row)
    if unknown.any():
        at = float(trace.time_s[int(np.argmax(unknown))])
        raise SimulationError(f"{file}: {what} gives no number at {stamp(at)} s.")
