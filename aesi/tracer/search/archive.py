"""Fitted coordinates kept in a file, so that an interrupted search resumes.

The file is keyed on all that a fit depends on: cell, data, own parameters, the definition of each effect (its code, its
parameters, its bounds) and the program itself, so that an edited effect, or another version, is fitted again. A user's
own effect may depend on a helper module or a table that cannot be found from here. Its key therefore also holds the
errors that it leaves on the records.
"""

from __future__ import annotations

import hashlib
import inspect
import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from types import CodeType

import numpy as np

from aesi.numerics.files.source_digest import source_digest
from aesi.numerics.metrics import rms
from aesi.numerics.typing import Array
from aesi.physics.effect import Effect
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE, starts, values_of
from aesi.tracer.case.problem import InverseProblem, ValuesByOwner
from aesi.tracer.likelihood.fit import FittedHypothesis

PROGRAM = __name__.partition(".")[0]
"""The package whose digest covers the code of its own effects."""


class Archive:
    """Coordinates by name of a fit (`fit_name`), appended as one JSON line each; lines of another case are skipped.

    path : of the file; None keeps the fits of this run alone.  context : digest of the case (`context_of`).
    fits : finished fits of this run by the same name, which need no further simulation.
    other_model : the archive of the same case with the other model of the cell.
    """

    def __init__(self, path: Path | None, context: str, other_model: Archive | None = None) -> None:
        self.path, self.context, self.other_model = path, context, other_model
        self._lock = threading.Lock()
        text = "" if path is None or not path.exists() else path.read_text(encoding="utf-8", errors="replace")
        self._kept = _stored(text, context)
        # An interrupted search may have left half a line, which the next entry must not be joined to.
        self._line_end = "\n" if text and not text.endswith("\n") else ""
        self.fits: dict[str, FittedHypothesis] = {}

    def get(self, name: str, size: int) -> Array | None:
        """(size,) coordinates where that fit ended; None where there is none of this name and size."""
        kept = self._kept.get(name)
        return kept if kept is not None and kept.shape == (size,) else None

    def near(self, name: str, size: int) -> Array | None:
        """As `get`, of the fit with the other model of the cell."""
        return None if self.other_model is None else self.other_model.get(name, size)

    def put(self, name: str, x: Array) -> None:
        """Store the coordinates of a fit, unless its name is stored already."""
        with self._lock:
            if name in self._kept:
                return
            self._kept[name] = x
            if self.path is not None:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                with self.path.open("a", encoding="utf-8") as file:
                    entry = {"context": self.context, "fit": name, "x": [float(v) for v in x]}
                    file.write(self._line_end + json.dumps(entry) + "\n")
                self._line_end = ""


def _stored(text: str, context: str) -> dict[str, Array]:
    """Name of a fit -> its coordinates, from the lines of a file's text that belong to a context."""
    kept = {}
    for line in text.splitlines():
        try:
            entry = json.loads(line)
            if entry["context"] == context:
                kept[entry["fit"]] = np.array(entry["x"], dtype=float)
        except (ValueError, KeyError, TypeError):
            continue  # cut off while it was written
    return kept


def fit_name(problem: InverseProblem, kind: str, hypothesis: Sequence[str]) -> str:
    """Name of a fit in the archive: its kind, the trust and the open ages and energies, its effects in order."""
    ages = ", several ages" if problem.several_ages else ""
    energies = "" if problem.energies else ", energies as declared"
    return f"{kind} {problem.trust}{ages}{energies}: {'+'.join(hypothesis)}"


def context_of(problem: InverseProblem) -> str:
    """Digest of all that a fit of this problem depends on: a stored fit is valid as long as it stays the same."""
    text = [
        source_digest(),
        _value_text(problem.cell),
        problem.model,
        *(identity(e) for e in problem.effects.values()),
        *(f"{e.id} {_residual_texts(problem, e)}" for e in problem.effects.values() if _is_user_defined(e)),
    ]
    text += [f"fixed {active.values} {identity(active.effect)}" for active in problem.fixed]
    if any(_is_user_defined(active.effect) for active in problem.fixed):
        text.append(f"fixed {_residual_text(problem, {})}")
    text += [
        f"{r.data.digest} {r.thin.digest} {r.thin_hold} {r.n_fit} {r.soc0} {r.soc0_sd} {r.noise_v}"
        for r in problem.records
    ]
    text += ["good" for r in problem.records if r.good]
    return hashlib.sha256("\n".join(text).encode()).hexdigest()[:16]


def identity(effect: Effect) -> str:
    """The definition of an effect as a text: id, parameters with bounds and spreads, and the code of the file that
    defines it, with the values that its functions are bound to."""
    return f"{effect.id} {_parameters(effect.parameters)} {[_value_text(place) for place in _hooks(effect)]}"


def _hooks(effect: Effect) -> tuple[Callable[..., object] | None, ...]:
    """The functions by which an effect acts on a simulation; None where it does not act there."""
    return effect.on_model, effect.on_record, effect.on_voltage, effect.on_reading


def _is_user_defined(effect: Effect) -> bool:
    """Whether a function of an effect is defined outside this program, so that the program's digest does not cover
    it."""
    return any(not _module(place).startswith(f"{PROGRAM}.") for place in _hooks(effect) if place is not None)


def _module(function: Callable[..., object]) -> str:
    return _module(function.func) if isinstance(function, partial) else str(function.__module__)


def _residual_texts(problem: InverseProblem, effect: Effect) -> list[str]:
    """RMS residual on the records (`_residual_text`) with an effect at the starts of its fits, at its bounds and at its
    typical values."""
    free = problem.parameters_of(effect.id)
    ends = np.array([(*one.bounds, one.coordinate(one.typical)) for one in free]).reshape(-1, 3)
    return [
        _residual_text(problem, {effect.id: {}, **values_of(free, x, (effect.id,))})
        for x in (*starts(free), *ends.T)
    ]


def _residual_text(problem: InverseProblem, values: ValuesByOwner) -> str:
    """RMS residual on the fitted rows, V, as a text of the digits that round-off does not reach."""
    begins = {str(i): record.soc0 for i, record in enumerate(problem.records)}
    predicted = problem.predict({STATE_OF_CHARGE: begins, **values})
    return "cannot be simulated" if predicted is None else f"{rms(problem.measured - predicted):.8g}"


def _parameters(parameters: Mapping[str, object]) -> str:
    return repr(sorted((name, repr(p)) for name, p in parameters.items()))


def _value_text(value: object) -> str:
    """A value as a text that is the same in every process: a dataclass by all of its fields, even those that its repr
    leaves out; a function by its code and the values it is bound to."""
    if is_dataclass(value) and not isinstance(value, type):
        text = f"{type(value).__name__} {[(one.name, _value_text(getattr(value, one.name))) for one in fields(value)]}"
        return f"{text} {_code(type(value).__call__)}" if callable(value) else text
    if isinstance(value, partial):
        bound = [
            _value_text(one) for one in (*value.args, *chain.from_iterable(sorted(value.keywords.items())))
        ]
        return f"{_value_text(value.func)} of {bound}"
    if isinstance(value, np.ndarray):
        return repr(value.tolist())
    if isinstance(value, CodeType):
        return f"{value.co_code.hex()} {value.co_names} {[_value_text(one) for one in value.co_consts]}"
    if isinstance(value, frozenset):
        return repr(sorted(map(repr, value)))
    if isinstance(value, dict):
        return repr([(_value_text(key), _value_text(one)) for key, one in value.items()])
    if isinstance(value, list | tuple):
        return f"{type(value).__name__} {[_value_text(one) for one in value]}"
    return _code(value) if callable(value) else repr(value)


def _code(function: Callable[..., object]) -> str:
    """Text of the file that defines a function; without a file, its compiled code."""
    cells = [_value_text(cell.cell_contents) for cell in getattr(function, "__closure__", None) or ()]
    try:
        module = inspect.getmodule(function)
        file = inspect.getsourcefile(function) if module is None else getattr(module, "__file__", None)
        if file:
            return f"{Path(file).read_text(encoding='utf-8')} {cells}"
    except (OSError, TypeError):
        pass  # no file: it was typed in
    return f"{_value_text(getattr(function, '__code__', repr(function)))} {cells}"
