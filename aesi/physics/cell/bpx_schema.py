"""A BPX file as the mapping of BPX 1.x that it holds, checked against the schema before anything reads it.

The schema is checked by the `bpx` package. Its own check of the stoichiometry limits runs the text of the
open-circuit potentials as Python code, so these are read by `aesi.physics.cell.expression` first and withheld
from it.
"""

from __future__ import annotations

import copy
import json
import warnings
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from aesi.errors import CellError
from aesi.physics.cell.relations import relation

STANDIN_TABLE = {"x": [0.0, 1.0], "y": [1.0, 0.0]}
OCP_FIELDS = ("OCP [V]", "OCP (lithiation) [V]", "OCP (delithiation) [V]")


def load_bpx(source: str | PathLike[str] | Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """The content of a BPX file or mapping as BPX 1.x, and what to call it in sentences.

    Raises CellError for what cannot be read, fails the schema, or describes a cell that is not modelled.
    """
    raw, where = _load(source)
    v1 = _as_v1(raw, where)
    _refuse_what_is_not_modelled(v1, where)
    _check_schema(v1, where)
    return v1, where


def _load(source: str | PathLike[str] | Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    if isinstance(source, Mapping):
        return copy.deepcopy(dict(source)), "BPX data"
    path = Path(source)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise CellError(f"cannot read the cell file {path}: {error.strerror or error}.") from None
    except UnicodeDecodeError as error:
        raise CellError(
            f"{path} is not text ({error.reason} at byte {error.start}), so no BPX file; is it a record?"
        ) from None
    try:
        raw = json.loads(text)
    except json.JSONDecodeError as error:
        raise CellError(
            f"{path} is not JSON ({error.msg} in line {error.lineno}), so no BPX file; is it a record?"
        ) from None
    if not isinstance(raw, dict):
        raise CellError(f"{path} does not hold a BPX object with a Header and a Parameterisation.")
    return raw, str(path)


def _as_v1(raw: dict[str, Any], where: str) -> dict[str, Any]:
    from bpx import convert_v0_to_v1, is_legacy_bpx

    if not isinstance(raw.get("Parameterisation"), dict):
        raise CellError(
            f"{where}: no 'Parameterisation' section; a BPX file needs Header and Parameterisation."
        )
    try:
        return convert_v0_to_v1(raw) if is_legacy_bpx(raw) else raw
    except (ValueError, TypeError, AttributeError) as error:
        raise CellError(f"{where}: {str(error).rstrip('.')}.") from None


def _refuse_what_is_not_modelled(v1: dict[str, Any], where: str) -> None:
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


def _check_schema(v1: dict[str, Any], where: str) -> None:
    import bpx
    from pydantic import ValidationError

    shown = copy.deepcopy(v1)
    shown.pop("Validation", None)
    shown["Parameterisation"].pop("User-defined", None)
    for section in ("Negative electrode", "Positive electrode"):
        fields = shown["Parameterisation"][section]
        for name in OCP_FIELDS:
            if name in fields:
                relation(fields[name], f"{where}: {section}, {name}")
                fields[name] = STANDIN_TABLE
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            bpx.parse_bpx_obj(shown)
    except ValidationError as error:
        raise CellError(f"{where}: {_first_fault(error)}") from None
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise CellError(f"{where} fails the BPX schema: {error}.") from None


def _first_fault(error: Any) -> str:
    faults = error.errors()
    # Where several forms of an electrode were tried, the faults of a missing field name the field itself.
    first = min(faults, key=lambda fault: fault["type"] != "missing")
    place = " > ".join(str(part) for part in first["loc"])
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    if first["type"] == "missing":
        return f"the field {place!r} is missing{more}."
    return f"{place or 'the file'}: {first['msg'].rstrip('.')}{more}."
