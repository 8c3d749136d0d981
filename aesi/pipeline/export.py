"""Export of a cell with its found effects for other tools: a BPX file, or a script for PyBaMM."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from aesi.constants import SECONDS_PER_HOUR
from aesi.errors import InputError, not_written
from aesi.numerics.files.whole import write_whole
from aesi.physics import Cell, ModelName
from aesi.physics.arguments import check_choice
from aesi.physics.cell.parts import NO_FILM, UNITY
from aesi.physics.effect import ActiveEffect
from aesi.physics.folded import folded
from aesi.physics.model import PLAIN, EspmModel
from aesi.pipeline.product.declared import declared_model
from aesi.pipeline.product.hybrid import HybridModel

Target = Literal["bpx", "pybamm"]
SUFFIX = {"bpx": ".json", "pybamm": ".py"}
PYBAMM_MODELS: Mapping[ModelName, str] = {"espm": "SPMe", "dfn": "DFN"}
"""PyBaMM's name of the model that a script solves unless it is asked for another."""
OWN_FIELDS: Mapping[str, Mapping[str, Any]] = {
    "resistance of films": {"film_ohm_m2": NO_FILM},
    "rates over stoichiometry": {"rate_factor": UNITY},
    "double layers": {"double_layer_f_m2": 0.0},
}
"""What a calibrated cell holds in its section User-defined that no other tool takes over: fields of its electrodes, and
what they are where it has none."""


@dataclass(frozen=True)
class Exported:
    """files : that were written.  held, left : sentences on their content, and on what the target cannot hold."""

    files: tuple[Path, ...]
    held: tuple[str, ...]
    left: tuple[str, ...]


@dataclass(frozen=True)
class _Pybamm:
    """Content for PyBaMM beside the BPX file."""

    options: dict[str, Any]
    values: dict[str, float]


def files_written(out: Path, to: Target) -> tuple[Path, ...]:
    """The files that `export` writes: `out`, and for PyBaMM the BPX file that its script reads.

    Raises InputError for an unknown target, and where `out` has the wrong suffix.
    """
    check_choice("to", to, Target)
    if out.suffix != SUFFIX[to]:
        raise InputError(f"{out} has to end in {SUFFIX[to]} for --to {to}.")
    return (out,) if to == "bpx" else (out, out.with_suffix(".bpx.json"))


def export(model: Path, out: Path, to: Target = "bpx") -> Exported:
    """Write a BPX file, or a Python script for PyBaMM with its BPX file beside it.

    model : a BPX file, or a folder of a saved model, whose effects are written as far as the target holds them.
    Raises InputError for an unknown target, where `out` has the wrong suffix or cannot be written, or the BPX file
    beside a new script would replace another.
    """
    *script, bpx = files_written(out, to)
    declared = declared_model(model)
    found = folded(declared.cell, declared.effects)
    # A file is simulated with the model that it was fitted with.
    if declared_model(found.cell).model != declared.model:
        found = replace(found, cell=replace(found.cell, fitted_with=declared.model))
    held = [
        *declared.cell.unread,
        *(f"{_effect_words(effect)}: written into the cell." for effect in found.held),
    ]
    left = (
        []
        if declared.correction is None
        else ["the sparse correction and its bands: no part of a cell file."]
    )
    if not found.same_window(declared.cell):
        held.append("State of charge 0 and 1 are now those of the changed electrodes.")
    if to == "bpx":
        left += _unheld_sentences(found.left, declared, "BPX has no field for")
        left += _beyond_bpx(found.cell)
        if found.cell.contact_resistance_ohm:
            left.append(
                f"{found.cell.contact_resistance_ohm:.4g} ohm of contacts: in the section User-defined, which they do "
                "not read; --to pybamm hands it over."
            )
        return Exported((_write(bpx, _bpx(found.cell)),), tuple(held), tuple(left))
    left += _beyond_bpx(found.cell)
    more, unknown = _for_pybamm(found.cell, found.left)
    held += [
        f"{_effect_words(effect)}: as an option of the model."
        for effect in found.left
        if effect not in unknown
    ]
    left += _unheld_sentences(unknown, declared, "PyBaMM's model from BPX has no counterpart of")
    text = _bpx(found.cell)
    _check_not_replaced(out, bpx, text)
    scripts = [_write(path, _script(bpx.name, more, declared.model)) for path in script]
    return Exported((*scripts, _write(bpx, text)), tuple(held), tuple(left))


def _unheld_sentences(effects: Sequence[ActiveEffect], model: HybridModel, why: str) -> list[str]:
    """A sentence for each effect that the target does not hold, and one for all that were fitted beside a finding."""
    beside = [effect for effect in effects if model.was_beside(repr(effect))]
    said = [f"{_effect_words(effect)}: {why} it." for effect in effects if effect not in beside]
    names = list(dict.fromkeys(effect.id for effect in beside))
    return [*said, *([f"{', '.join(names)}, fitted beside what was found: {why} that."] if names else [])]


def _check_not_replaced(script: Path, bpx: Path, text: str) -> None:
    """Raises InputError where a file of that name is there which no earlier export left and nobody asked to replace."""
    if bpx.exists() and not script.exists() and bpx.read_bytes() != text.encode():
        raise InputError(
            f"{bpx}, which is written beside {script.name}, is there and holds something else; give the script another "
            "name, or move that file."
        )


def _beyond_bpx(cell: Cell) -> list[str]:
    """Sentences on what a calibrated cell holds in its section User-defined that neither target takes over."""
    return [f"{name}: in the section User-defined, which they do not read." for name in own_fields_of(cell)]


def own_fields_of(cell: Cell) -> tuple[str, ...]:
    """Names of those `OWN_FIELDS` that the cell has values for, which no other tool reads."""
    both = (cell.negative, cell.positive)
    return tuple(
        name
        for name, none in OWN_FIELDS.items()
        if any(getattr(side, field) != value for side in both for field, value in none.items())
    )


def without_own_fields(cell: Cell) -> Cell:
    """The cell as another tool reads its file: `OWN_FIELDS` at what they are where a file has none."""
    none = {field: value for fields in OWN_FIELDS.values() for field, value in fields.items()}
    return cell.with_negative(**none).with_positive(**none)


def pybamm_contacts(cell: Cell) -> tuple[dict[str, Any], dict[str, float]]:
    """Options and values of PyBaMM for the contacts of a cell, which BPX has no field for."""
    if not cell.contact_resistance_ohm:
        return {}, {}
    return {"contact resistance": "true"}, {"Contact resistance [Ohm]": cell.contact_resistance_ohm}


def _for_pybamm(cell: Cell, effects: tuple[ActiveEffect, ...]) -> tuple[_Pybamm, list[ActiveEffect]]:
    """Options and values of PyBaMM for what BPX does not hold, and the effects that have none."""
    options, values = pybamm_contacts(cell)
    unknown = []
    for effect in effects:
        known = _options_of(cell, effect)
        if known is None:
            unknown.append(effect)
            continue
        options |= known.options
        values |= known.values
    return _Pybamm(options, values), unknown


def _options_of(cell: Cell, active: ActiveEffect) -> _Pybamm | None:
    """PyBaMM's counterpart of what an effect does to the particles' surface; None where it has none.

    The double layer is left out: the form of the surface potential that it needs there moves the voltage by 4 mV.
    """
    effect = active.effect
    if effect.on_model is None or effect.on_record or effect.on_voltage or effect.on_reading:
        return None
    before = EspmModel(cell)
    after = effect.on_model(before, **active.parameters)
    if replace(after, negative=before.negative, positive=before.positive) != before:
        return None
    options: dict[str, Any] = {}
    values: dict[str, float] = {}
    for name, side in (("Negative", after.negative), ("Positive", after.positive)):
        if replace(side, transfer_coefficient=PLAIN.transfer_coefficient) != PLAIN:
            return None
        if {after.negative.transfer_coefficient, after.positive.transfer_coefficient} != {0.5}:
            options["intercalation kinetics"] = "asymmetric Butler-Volmer"
            values[f"{name} electrode Butler-Volmer transfer coefficient"] = side.transfer_coefficient
    return _Pybamm(options, values)


def _bpx(cell: Cell) -> str:
    return json.dumps(cell.to_bpx(), indent=1, allow_nan=False) + "\n"


def _effect_words(effect: ActiveEffect) -> str:
    """An effect with its values and their units, 'series_resistance (resistance_ohm 0.01 ohm)'."""
    values = ", ".join(
        f"{name} {value:.4g} {effect.effect.parameters[name].unit}" for name, value in effect.values
    )
    return f"{effect.id} ({values})" if values else effect.id


def _write(path: Path, text: str) -> Path:
    try:
        write_whole(path, text)
    except OSError as error:
        raise InputError(not_written(path, error)) from None
    return path


def _script(bpx: str, more: _Pybamm, model: ModelName) -> str:
    return SCRIPT.format(
        bpx=bpx,
        options=repr(more.options),
        values=repr(more.values),
        physics=PYBAMM_MODELS[model],
        hour_s=SECONDS_PER_HOUR,
    )


SCRIPT = '''"""The cell of {bpx} in PyBaMM, written by `aesi export --to pybamm`.

    python FILE.py                     a 1C discharge, its voltage printed
    from FILE import simulation        simulation(time_s, current_a, soc0).solve(t_eval=..., t_interp=...)

Current is positive on discharge. Give PyBaMM the times at which the current bends as t_eval: it may step over a pulse.
"""

import json
import warnings
from pathlib import Path

import numpy as np
import pybamm

BPX = Path(__file__).parent / "{bpx}"
OPTIONS = {options}
VALUES = {values}
"""What BPX has no field for."""


def parameter_values(soc0: float = 1.0) -> pybamm.ParameterValues:
    """The cell's parameters; state of charge 0 and 1 are the file's limits of stoichiometry."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about open-circuit voltages that the file does not repeat
        values = pybamm.ParameterValues.create_from_bpx(BPX)
    values.update(VALUES, check_already_exists=False)
    values["Ambient temperature [K]"] = values["Initial temperature [K]"]  # its isothermal model is at the ambient one
    parts = json.loads(BPX.read_text(encoding="utf-8"))["Parameterisation"]
    for name, full in (("negative", "Maximum stoichiometry"), ("positive", "Minimum stoichiometry")):
        part = parts[name.capitalize() + " electrode"]
        low, high = part["Minimum stoichiometry"], part["Maximum stoichiometry"]
        share = soc0 if full == "Maximum stoichiometry" else 1.0 - soc0
        concentration = (low + share * (high - low)) * part["Maximum concentration [mol.m-3]"]
        values[f"Initial concentration in {{name}} electrode [mol.m-3]"] = concentration
    return values


def simulation(time_s=None, current_a=None, soc0: float = 1.0, model=pybamm.lithium_ion.{physics}) -> pybamm.Simulation:
    """PyBaMM's simulation under a current (A) that is a straight line between the times (s); 1C without.

    Solve a current by solve() or solve(t_eval=time_s): with solve([0, end]) PyBaMM may step over pulses after a rest.
    """
    values = parameter_values(soc0)
    if time_s is not None:
        current = pybamm.Interpolant(np.asarray(time_s, float), np.asarray(current_a, float), pybamm.t)
        values.update({{"Current function [A]": current}})
    physics = model(options=OPTIONS)
    points = {{"x_n": 30, "x_s": 20, "x_p": 30, "r_n": 60, "r_p": 60}}  # the default 20 a particle miss by millivolts
    meshes = dict(physics.default_submesh_types)
    for side in ("negative", "positive"):  # closer at the surface, where even ones miss a step by millivolts
        graded = {{"side": "right", "stretch": 2.0}}
        meshes[f"{{side}} particle"] = pybamm.MeshGenerator(pybamm.Exponential1DSubMesh, submesh_params=graded)
    return pybamm.Simulation(physics, parameter_values=values, var_pts=points, submesh_types=meshes)


if __name__ == "__main__":
    solution = simulation().solve([0, {hour_s:.0f}])
    time_s, voltage_v = solution["Time [s]"].entries, solution["Voltage [V]"].entries
    print(f"{{voltage_v[0]:.4f}} V at the start, {{voltage_v[-1]:.4f}} V after {{time_s[-1]:.0f}} s")
'''
