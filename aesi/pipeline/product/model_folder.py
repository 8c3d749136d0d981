"""A saved model as a folder of data: nothing in it is executed when it is read, but for effects of the user's own.

model.json holds the schema, the names of the parts and the caller's own values; <part>.json one part each
(cell.bpx, effects, correction, intervals, bands); arrays.npz the plain arrays that the JSON refers to by name; and
<effect>.py a copy of each effect of the user's own.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from aesi.errors import InputError
from aesi.numerics.files.arrays import read_arrays
from aesi.numerics.files.whole import write_whole
from aesi.numerics.typing import Array
from aesi.pipeline.written import ARRAYS, HEAD, MODEL

SCHEMA = "aesi.model/1"
ARRAY_KEY = "array:"
"""Prefix of a string that stands for an array of arrays.npz. The rest is the place of the string itself, the part and
the keys down to it, so that a text of the user's that begins so is taken for what it is."""


def write_model(
    folder: Path, head: Mapping[str, Any], parts: Mapping[str, Any], files: Mapping[str, bytes]
) -> None:
    """Write the parts (JSON values and numpy arrays, nested) and the head to a folder, made where missing.

    files : name -> content of those that parts name.
    Raises InputError where it is a file, or below one.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise InputError(
            f"{folder} cannot be a folder: a file of that name is there; name another."
        ) from None
    arrays: dict[str, Array] = {}
    texts = {name: _json_text(_without_arrays(content, name, arrays)) for name, content in parts.items()}
    head_text = _json_text({"schema": SCHEMA, "parts": sorted(parts), **head})
    # The head goes first and comes last: without it nobody takes a folder for a model that is half another one's.
    (folder / HEAD).unlink(missing_ok=True)
    for name, text in texts.items():
        write_whole(part_file(folder, name), text)
    for name, code in files.items():
        write_whole(folder / name, code)
    np.savez_compressed(folder / ARRAYS, allow_pickle=False, **arrays)
    write_whole(folder / HEAD, head_text)


def read_model(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Inverse of `write_model`: head and parts.

    Raises InputError naming the file that is missing or not as it was written.
    """
    written = f"a model folder is written by `aesi run` or `aesi discover`{_below(folder)}"
    if folder.is_file():
        raise InputError(f"{folder} is a file, not the folder of a model; {written}")
    if folder.is_dir() and not (folder / HEAD).exists():
        raise InputError(f"the folder {folder} holds no {HEAD}, so it is no model; {written}")
    head = _read_json(folder / HEAD, written)
    schema = head.get("schema") if isinstance(head, dict) else None
    if schema != SCHEMA:
        raise InputError(f"{folder / HEAD} has schema {schema!r}; this version reads {SCHEMA!r}.")
    names = head.get("parts")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{folder / HEAD} has no list of parts; save the model again.")
    arrays = _read_arrays(folder / ARRAYS)
    parts = {}
    for name in names:
        try:
            parts[name] = _with_arrays(_read_json(part_file(folder, name)), name, arrays)
        except KeyError as error:
            raise InputError(
                f"{folder / ARRAYS} lacks {error}, which {part_file(folder, name).name} names; save the model again."
            ) from None
    return head, parts


def _below(folder: Path) -> str:
    """A question after the newest model in a folder of runs, where somebody named that instead."""
    heads = [head for pattern in (MODEL, f"*/{MODEL}") for head in folder.glob(f"{pattern}/{HEAD}")]
    newest = max(heads, key=lambda head: head.stat().st_mtime, default=None)
    return "." if newest is None else f"; did you mean {newest.parent}?"


def part_file(folder: Path, name: str) -> Path:
    """Path of a part's file."""
    return folder / f"{name}.json"


def _without_arrays(value: Any, path: str, arrays: dict[str, Array]) -> Any:
    """The value with every numpy array moved to `arrays` and a reference left in its place."""
    if isinstance(value, np.ndarray):
        arrays[path] = value
        return ARRAY_KEY + path
    if isinstance(value, Mapping):
        return {key: _without_arrays(item, f"{path}.{key}", arrays) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_arrays(item, f"{path}.{index}", arrays) for index, item in enumerate(value)]
    return value.item() if isinstance(value, np.generic) else value


def _with_arrays(value: Any, path: str, arrays: Mapping[str, Array]) -> Any:
    """Inverse of `_without_arrays`."""
    if isinstance(value, str) and value == ARRAY_KEY + path:
        return arrays[path]
    if isinstance(value, dict):
        return {key: _with_arrays(item, f"{path}.{key}", arrays) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_arrays(item, f"{path}.{index}", arrays) for index, item in enumerate(value)]
    return value


def _json_text(content: Any) -> str:
    return json.dumps(content, indent=1, allow_nan=False)


def _read_json(path: Path, hint: str = "save the model again.") -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path} does not exist; {hint}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}); {hint}") from None


def _read_arrays(path: Path) -> dict[str, Array]:
    try:
        return read_arrays(path)
    except FileNotFoundError:
        raise InputError(f"{path} does not exist; save the model again.") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path} cannot be read ({error}); save the model again.") from None
