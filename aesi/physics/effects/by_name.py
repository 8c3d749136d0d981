"""Look-up of effects by id, in the catalogue and in the user's own files."""

from __future__ import annotations

import copyreg
import importlib.util
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from hashlib import sha256
from importlib.machinery import SourceFileLoader
from os import PathLike
from pathlib import Path
from typing import Any

from aesi.errors import InputError
from aesi.physics.effect import ActiveEffect, Effect
from aesi.physics.effects.catalogue import CATALOGUE, no_such_effect
from aesi.physics.effects.own_effect import check_own, load_failure


def find_effect(name: str, file: str | None = None) -> Effect:
    """The effect of that id, from the catalogue or from a user's own file.

    Raises InputError with the nearest match for an unknown id.
    """
    return load_effect(file) if file is not None else named_effect(name, CATALOGUE)


def known_effects(files: Iterable[str | PathLike[str]] = ()) -> dict[str, Effect]:
    """id -> Effect: the catalogue, and the user's own from their files.

    Raises InputError for a file that holds no effect, and for an id that two files define.
    """
    known = dict(CATALOGUE)
    for file in files:
        effect = load_effect(file)
        other = known.setdefault(effect.id, effect)
        if other.file != effect.file:
            raise InputError(
                f"{other.file} and {effect.file} both define the effect {effect.id!r}; rename one."
            )
    return known


def selected(
    known: Mapping[str, Effect], only: Iterable[str] = (), without: Iterable[str] = ()
) -> dict[str, Effect]:
    """The effects of `known` in `only` (all where it is empty), minus those in `without`; a name may be several ids
    with commas between them.

    Raises InputError with the nearest match for an unknown id, and for an id in both.
    """
    kept, left_out = (
        {named_effect(name.strip(), known).id for names in given for name in names.split(",")}
        for given in (only, without)
    )
    for name in sorted(kept & left_out):
        raise InputError(f"{name} is named both to be tried alone and to be left out; drop one of the two.")
    kept = kept or set(known)
    return {name: effect for name, effect in known.items() if name in kept - left_out}


def activated(
    effects: Iterable[tuple[str, Mapping[str, float]]], files: Iterable[str | PathLike[str]] = ()
) -> tuple[ActiveEffect, ...]:
    """Effects by id with their parameter values, in the order given; `files` hold the user's own.

    Raises InputError for an unknown effect and for one that is named twice, ParameterError for inadmissible values.
    """
    known = known_effects(files)
    active = tuple(named_effect(name, known).activate(**values) for name, values in effects)
    for name, times in Counter(effect.id for effect in active).items():
        if times > 1:
            raise InputError(
                f"the effect {name} is named {times} times; give it once, with all its parameters."
            )
    return active


def named_effect(name: str, known: Mapping[str, Effect]) -> Effect:
    """The effect of that id in `known`.  Raises InputError with the nearest match for an unknown id."""
    if name in known:
        return known[name]
    raise InputError(no_such_effect(name, known))


def load_effect(path: str | PathLike[str]) -> Effect:
    """The user's own effect: runs the Python file at `path`, which has to define `EFFECT`.

    The file is executed as code; name only files that you trust. While its content is unchanged, the same object is
    returned.
    Raises InputError where there is no such file, no Effect in it, or an Effect that fails `check_own`.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise InputError(f"there is no effect file {file}.")
    try:
        return _load(str(file), file.read_bytes())
    except OSError as error:
        raise InputError(f"the effect file {file} cannot be read: {error.strerror or error}.") from None


@lru_cache(maxsize=32)
def _load(path: str, content: bytes) -> Effect:
    name = f"aesi_user_effect_{sha256(path.encode()).hexdigest()[:12]}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or not isinstance(spec.loader, SourceFileLoader):
        raise InputError(f"{path} is not a Python file; an effect file ends in .py.")
    module = importlib.util.module_from_spec(spec)
    try:
        # Not by the loader: it identifies its cached byte code only by a time in whole seconds and a size.
        exec(spec.loader.source_to_code(content, path), module.__dict__)
    except (Exception, SystemExit) as error:  # SystemExit would end the command as if it had succeeded
        raise InputError(load_failure(path, content, error)) from error
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise InputError(f"{path} defines no EFFECT of type aesi.physics.Effect.")
    check_own(effect, path)
    if effect.id in CATALOGUE:
        raise InputError(f"{path}: the id {effect.id!r} is taken by the catalogue; choose another.")
    return replace(effect, file=path, code=content)


def listing(effects: Iterable[Effect]) -> str:
    """One line per effect: id, kind, summary."""
    return "\n".join(f"{e.id:36s} {e.kind_told:11s} {e.summary}" for e in effects)


def describe(effect: Effect) -> str:
    """One effect as plain text: equation, validity, source, parameters."""
    lines = [f"{effect.id} ({effect.kind_told})", effect.summary + ".", "", effect.equation, ""]
    lines += [effect.validity, f"Source: {effect.source}", "", "Parameters:"]
    for key, p in effect.parameters.items():
        scale = ", logarithmic" if p.log else ", fitted by its square" if p.even else ""
        vanishes = "" if p.neutral is None else f", vanishes at {p.neutral:g}"
        about = f": {p.description}" if p.description else ""
        lines.append(f"  {key} [{p.unit}] in [{p.bounds[0]:g}, {p.bounds[1]:g}]{scale}{vanishes}{about}")
        lines.append(f"      typically {p.default:g}; range: {p.source}")
    return "\n".join(lines if effect.parameters else lines[:-1])


def saved_effect(active: ActiveEffect) -> tuple[dict[str, Any], dict[str, bytes]]:
    """(effect as JSON, file name -> content to store beside it). A user's own effect is stored as a copy: its original
    may be edited, or be missing where the folder is copied to."""
    content, code = active.to_dict(), active.effect.code
    if code is None:
        return content, {}
    name = f"{active.id}.py"
    return content | {"file": name, "sha256": sha256(code).hexdigest()}, {name: code}


def active_effect(content: Mapping[str, Any], folder: Path | None = None) -> ActiveEffect:
    """Inverse of `ActiveEffect.to_dict`, and of `saved_effect` in the folder that it was saved to.

    Raises InputError for an unknown effect and for a file that was edited since, ParameterError for its values.
    """
    file = content.get("file")
    if file is not None and folder is not None:
        file = str(folder / file)  # an absolute path, as saved before copies were kept, stays as it is
    effect = find_effect(str(content["effect"]), file)
    said = content.get("sha256")
    if said is not None and sha256(effect.code or b"").hexdigest() != said:
        raise InputError(
            f"{file} was edited since the model was saved with it, and what was fitted and calibrated beside it is no "
            "longer of it; restore it, or run again with the effect as it is now."
        )
    return effect.activate(**content["parameters"])


def _pickle_parts(effect: Effect) -> tuple[Any, ...]:
    """How an effect is pickled: by id where it can be looked up, so that unpickling gives the catalogue's object; else
    by value."""
    if effect.file is None and CATALOGUE.get(effect.id) is not effect:
        by_value = object.__reduce_ex__(effect, 2)
        assert isinstance(by_value, tuple)
        return by_value
    return find_effect, (effect.id, effect.file)


copyreg.pickle(Effect, _pickle_parts)
