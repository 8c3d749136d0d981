"""The content of a BPX file as a mapping of BPX 1.x, checked against the schema before it is used.

The schema is checked by the `bpx` package. Its own check of the stoichiometry limits executes the text of the
open-circuit potentials as Python code, so these are read by `aesi.physics.cell.expression` first and not passed
to it.
"""

from __future__ import annotations

import copy
import json
import re
import warnings
from collections.abc import Mapping
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from aesi.errors import CellError, did_you_mean, in_words, wanted
from aesi.physics.cell.relations import relation

STANDIN_TABLE = {"x": [0.0, 1.0], "y": [1.0, 0.0]}
OCP_FIELDS = ("OCP [V]", "OCP (lithiation) [V]", "OCP (delithiation) [V]")
OF_ELECTRODES = (*OCP_FIELDS, "Diffusivity [m2.s-1]", "Entropic change coefficient [V.K-1]")
RELATIONS = {
    "Negative electrode": OF_ELECTRODES,
    "Positive electrode": OF_ELECTRODES,
    "Electrolyte": ("Conductivity [S.m-1]", "Diffusivity [m2.s-1]"),
}
"""Section -> those of its fields that may be functions."""
VERSIONS = r"[01]\.\d+(\.\d+)?"


def load_bpx(
    source: str | PathLike[str] | Mapping[str, Any],
) -> tuple[dict[str, Any], str, tuple[str, ...]]:
    """(content of a BPX file or mapping as BPX 1.x, its name for messages, fields of its cell that BPX 1.x lacks).

    Raises CellError for content that cannot be read, fails the schema, or describes a cell that is not modelled.
    """
    raw, where = _load(source)
    _check_whole_numbers(raw, where)
    v1 = _as_v1(raw, where)
    _check_modelled(v1, where)
    _check_schema(v1, where)
    return v1, where, _fields_without_counterpart(raw, v1)


def _fields_without_counterpart(raw: Mapping[str, Any], v1: Mapping[str, Any]) -> tuple[str, ...]:
    """The fields of a cell in BPX 0.x that have no counterpart in BPX 1.x."""
    state = v1.get("State") or {}
    kept = {*v1["Parameterisation"]["Cell"], *(name for section in state.values() for name in section or {})}
    return tuple(name for name in raw["Parameterisation"]["Cell"] if name not in kept)


def _load(source: str | PathLike[str] | Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """(content of a BPX file or mapping as it is, its name for messages)."""
    if isinstance(source, Mapping):
        return copy.deepcopy(dict(source)), "BPX data"
    if not isinstance(source, str | PathLike):
        raise CellError(
            f"an object of type {type(source).__name__} is no cell; give the path of a BPX file, or its content "
            "as a dict."
        )
    path = Path(source)
    raw = _parsed(path, _text_of(path))
    if not isinstance(raw, dict):
        raise CellError(f"{path} does not hold a BPX object with a Header and a Parameterisation.")
    return raw, str(path)


def _text_of(path: Path) -> str:
    """The text of a file.  Raises CellError for one that cannot be read or is not UTF-8."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        beside = [one.name for one in path.parent.glob("*.json")]
        raise CellError(
            f"there is no cell file {path}{did_you_mean(path.name, beside)} Give the path of a BPX file (.json)."
        ) from None
    except OSError as error:
        raise CellError(f"cannot read the cell file {path}: {error.strerror or error}.") from None
    except UnicodeDecodeError as error:
        if path.read_bytes().lstrip().startswith(b"{"):
            raise CellError(
                f"{path} is not written in UTF-8, as JSON has to be (byte {error.start}); save it as UTF-8."
            ) from None
        raise CellError(
            f"{path} is not text ({error.reason} at byte {error.start}), so no BPX file; is it a record?"
        ) from None


def _parsed(path: Path, text: str) -> Any:
    """The JSON value of a text.  Raises CellError for other text and for a field that is there twice."""
    try:
        return json.loads(text, object_pairs_hook=_unique_fields)
    except json.JSONDecodeError as error:
        raise CellError(
            f"{path} is not JSON ({error.msg} in line {error.lineno}), so no BPX file{_fault_clause(text)}"
        ) from None
    except _RepeatedField as error:
        raise CellError(f"{path}: the field {error} is there twice in one section; leave one.") from None
    except ValueError:  # the only other one of `json`: Python converts no more than 4,300 digits
        raise CellError(
            f"{path} holds a whole number of thousands of digits, which no value of a cell has; correct it."
        ) from None
    except RecursionError:
        raise CellError(
            f"{path} nests its sections more deeply than any BPX file does, so it is none; copy or export it again."
        ) from None


def _fault_clause(text: str) -> str:
    """End of a message on a file that is not JSON: its likely fault, from its beginning."""
    if not text.strip():
        return ": it is empty; copy or export it again."
    if text.lstrip().startswith(("{", "[")):
        return ": it is damaged or cut short; correct that line, or copy or export it again."
    return "; is it a record or an experiment?"


class _RepeatedField(Exception):
    """Raised for a name that occurs twice in a JSON object."""


def _unique_fields(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a dict.  Raises _RepeatedField for a repeated name, of which `json` would silently take the last."""
    content: dict[str, Any] = {}
    for name, value in pairs:
        if name in content:
            raise _RepeatedField(repr(name))
        content[name] = value
    return content


def _check_whole_numbers(content: Any, where: str) -> None:
    """Raises CellError, naming sections and field, for a whole number that no float holds. Of those that are written
    with a point or an exponent, the values are checked."""
    if isinstance(content, Mapping):
        for name, value in content.items():
            _check_whole_numbers(value, f"{where}: {name}")
    elif isinstance(content, list | tuple | np.ndarray):
        for value in content:
            _check_whole_numbers(value, where)
    elif isinstance(content, int):
        try:
            float(content)
        except OverflowError:
            raise CellError(
                f"{where} holds a whole number of more than 308 digits, which no value of a cell has; correct it."
            ) from None


def _as_v1(raw: dict[str, Any], where: str) -> dict[str, Any]:
    """The content as BPX 1.x.  Raises CellError for another version and for content that cannot be converted."""
    from bpx import convert_v0_to_v1, is_legacy_bpx

    if not isinstance(raw.get("Parameterisation"), dict):
        raise CellError(
            f"{where}: no 'Parameterisation' section; a BPX file needs Header and Parameterisation."
        )
    header = raw.get("Header")
    version = header.get("BPX") if isinstance(header, dict) else None
    if not re.fullmatch(VERSIONS, str(version)):
        raise CellError(
            f"{where}: the version of BPX in its Header is {version!r}, and versions 0.x and 1.x are read; the field "
            'is "BPX": "1.1.0".'
        )
    try:
        return convert_v0_to_v1(raw) if is_legacy_bpx(raw) else raw
    except (ValueError, TypeError, AttributeError) as error:
        raise CellError(f"{where}: {str(error).rstrip('.')}.") from None


def _check_modelled(v1: dict[str, Any], where: str) -> None:
    """Raises CellError for a cell without a section, of blended electrodes, or whose Header is of the SPM."""
    parts = v1["Parameterisation"]
    for section in ("Cell", "Electrolyte", "Negative electrode", "Separator", "Positive electrode"):
        if not isinstance(parts.get(section), dict):
            raise CellError(
                f"{where}: no section {section!r}; this model needs the parameters of a full cell."
            )
    for section in ("Negative electrode", "Positive electrode"):
        if "Particle" in parts[section]:
            raise CellError(
                f"{where}: {section} is a blend of materials; only single materials are modelled."
            )

    if isinstance(v1.get("Header"), dict) and v1["Header"].get("Model") == "SPM":
        raise CellError(
            f"{where}: its Header is of the model 'SPM', which has no electrolyte, and its parameters are those of a "
            'full cell; write "Model": "SPMe" there, or "DFN".'
        )


def _check_schema(v1: dict[str, Any], where: str) -> None:
    """Raises CellError for the first fault by the schema of BPX. Relations are checked by `relation`, and potentials
    replaced by `STANDIN_TABLE`, since the package would execute their text."""
    import bpx
    from pydantic import ValidationError

    shown = copy.deepcopy(v1)
    shown.pop("Validation", None)
    shown["Parameterisation"].pop("User-defined", None)
    for section, names in RELATIONS.items():
        fields = shown["Parameterisation"][section]
        for name in names:
            if name in fields:
                relation(fields[name], f"{where}: {section}, {name}")
            if name in fields and name in OCP_FIELDS:
                fields[name] = STANDIN_TABLE
    _check_no_truth_value({name: part for name, part in shown.items() if name != "Header"}, where)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bpx.parse_bpx_obj(shown)
    except ValidationError as error:
        raise CellError(f"{where}: {_fault_sentence(error)}") from None
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise CellError(f"{where} fails the BPX schema: {error}.") from None


def _check_no_truth_value(content: Mapping[str, Any], where: str) -> None:
    """Raises CellError, naming sections and field, for `true` or `false`: the schema takes them for 1 and 0."""
    for name, value in content.items():
        if isinstance(value, bool):
            raise CellError(f"{where}: {name} is {value}; give a number.")
        if isinstance(value, Mapping):
            _check_no_truth_value(value, f"{where}: {name}")


def _fault_sentence(error: Any) -> str:
    """The first fault of a ValidationError in words, with the number of the others and what to do."""
    faults = error.errors()
    # Where several forms of an electrode were tried, only the faults of a missing field name the field itself.
    first = min(faults, key=lambda fault: fault["type"] != "missing")
    known = _known_fields()
    place = _place(first, known)
    others = len({_place(fault, known) for fault in faults}) - 1
    more = f" (and {others} more)" if others else ""
    name = str(first["loc"][-1]) if first["loc"] else ""
    if first["type"] == "missing":
        beside = [
            fault["loc"][-1]
            for fault in faults
            if fault["type"] == "extra_forbidden" and fault["loc"][:-1] == first["loc"][:-1]
        ]
        misspelt = get_close_matches(name, beside, n=1)
        if misspelt:
            return f"the field {place!r} is missing, and {misspelt[0]!r} there is no field of BPX; rename it."
        return f"the field {place!r} is missing{more}; give it."
    if first["type"] == "extra_forbidden":
        hint = did_you_mean(name, () if name in known else known)
        if hint == ".":
            hint = "; take it out, or put it into the section 'User-defined'."
        return f"{place!r} is no field of BPX there{more}{hint}"
    if first["type"] == "value_error":
        return f"{place or 'the file'}: {str(first['ctx']['error']).rstrip('.')}{more}."
    return f"{place or 'the file'} = {in_words(first['input'])} {wanted(first)}{more}."


def _place(fault: Mapping[str, Any], known: set[str]) -> str:
    """Text with the sections and the field of a fault, without the types that pydantic lists below a field."""
    parts = [str(part) for part in fault["loc"]]
    while len(parts) > 1 and fault["type"] != "extra_forbidden" and parts[-1] not in known:
        parts.pop()
    return " > ".join(parts)


def _known_fields() -> set[str]:
    """The names of all fields and sections of BPX."""
    from bpx import schema
    from pydantic import BaseModel

    models = (one for one in vars(schema).values() if isinstance(one, type) and issubclass(one, BaseModel))
    return {field.alias for model in models for field in model.model_fields.values() if field.alias}
