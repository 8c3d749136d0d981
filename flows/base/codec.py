"""Records to bytes and back without pickle: a checksum, and a .npz of a JSON tree and the arrays it refers to.

Only plain values, slices, numpy arrays and the dataclasses of the `aesi` package pass, so that reading a file can
build data and nothing else. The checksum makes a damaged file an error instead of a wrong result.
"""

from __future__ import annotations

import dataclasses
import hashlib
import io
import json
import zipfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

MAGIC = b"AESI1"
TREE = "tree"


class Uncodable(TypeError):
    """The object holds something that is not data (a function, a fitted forest, an open file)."""


class Damaged(ValueError):
    """The bytes are not what `dumps` wrote, or of records that another version of the package has."""


def dumps(value: Any) -> bytes:
    """The value as bytes. Raises Uncodable naming the type that cannot be stored."""
    arrays: dict[str, np.ndarray] = {}
    tree = json.dumps(_encode(value, arrays)).encode()
    buffer = io.BytesIO()
    arrays[TREE] = np.frombuffer(tree, dtype=np.uint8)
    np.savez(buffer, allow_pickle=False, **arrays)
    body = buffer.getvalue()
    return MAGIC + hashlib.sha256(body).digest() + body


def loads(data: bytes) -> Any:
    """The value that `dumps` wrote. Raises Damaged where the bytes are truncated, altered or foreign."""
    head = len(MAGIC) + hashlib.sha256().digest_size
    body = data[head:]
    if data[:head] != MAGIC + hashlib.sha256(body).digest():
        raise Damaged("its checksum is wrong")
    try:
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            tree = json.loads(archive[TREE].tobytes())
            arrays = {name: archive[name] for name in archive.files if name != TREE}
        return _decode(tree, arrays)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise Damaged(f"not a stored record: {error}") from None
    except (AttributeError, ImportError, TypeError) as error:
        raise Damaged(f"stored by another version: {error}") from None


def _encode(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    if value is None or type(value) in (bool, int, float, str):
        return value
    if isinstance(value, np.generic):
        value = np.asarray(value)
        return {"scalar": _store(value, arrays)}
    if isinstance(value, np.ndarray):
        return {"array": _store(value, arrays)}
    if isinstance(value, list):
        return [_encode(item, arrays) for item in value]
    if type(value) is tuple:  # one with names would come back without them
        return {"tuple": [_encode(item, arrays) for item in value]}
    if isinstance(value, Mapping):
        return {"dict": [[_encode(k, arrays), _encode(v, arrays)] for k, v in value.items()]}
    if isinstance(value, Path):
        return {"path": str(value)}
    if isinstance(value, slice):
        return {"slice": [value.start, value.stop, value.step]}
    if dataclasses.is_dataclass(value) and not isinstance(value, type) and _is_ours(type(value)):
        fields = {
            field.name: _encode(getattr(value, field.name), arrays)
            for field in dataclasses.fields(value)
            if field.init
        }
        return {"class": [type(value).__module__, type(value).__qualname__], "fields": fields}
    raise Uncodable(f"a {type(value).__module__}.{type(value).__qualname__} is not data")


def _store(array: np.ndarray, arrays: dict[str, np.ndarray]) -> str:
    if array.dtype.hasobject:
        raise Uncodable("an array of Python objects is not data")
    name = f"a{len(arrays)}"
    arrays[name] = array
    return name


def _decode(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(tree, list):
        return [_decode(item, arrays) for item in tree]
    if not isinstance(tree, dict):
        return tree
    if "array" in tree:
        return arrays[tree["array"]]
    if "scalar" in tree:
        return arrays[tree["scalar"]][()]
    if "tuple" in tree:
        return tuple(_decode(item, arrays) for item in tree["tuple"])
    if "dict" in tree:
        return {_decode(k, arrays): _decode(v, arrays) for k, v in tree["dict"]}
    if "path" in tree:
        return Path(tree["path"])
    if "slice" in tree:
        return slice(*tree["slice"])
    return _class(*tree["class"])(**{name: _decode(v, arrays) for name, v in tree["fields"].items()})


def _class(module: str, name: str) -> type:
    if module.split(".")[0] != "aesi":
        raise ValueError(f"{module}.{name} is none of the package's records")
    found: Any = import_module(module)
    for part in name.split("."):
        found = getattr(found, part)
    if not (isinstance(found, type) and dataclasses.is_dataclass(found)):
        raise ValueError(f"{module}.{name} is no record")
    return found


def _is_ours(kind: type) -> bool:
    return kind.__module__.split(".")[0] == "aesi"
