"""The description of an experiment: a validated record that is read from a YAML file.

Paths in the file are relative to its own folder. The results are written below the workspace, in a folder named after
the experiment; the name therefore has only letters, digits, `_` and `-`. The sections are in sections.py.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard, get_args, get_origin

from pydantic import BaseModel, Field, ValidationError, field_validator, model_validator

from aesi.errors import ConfigError, wanted
from aesi.logins import without_logins
from aesi.pipeline.experiment.sections import (
    SHORT_FOR,
    CellConfig,
    ConformalConfig,
    DataConfig,
    DiscoverConfig,
    FallbackConfig,
    LibraryConfig,
    RandomSeed,
    RunnerConfig,
    SearchConfig,
    Section,
    TrackingConfig,
)
from aesi.records.horizons import divides

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

NO_PART = ("note", "tracking", "runner")
"""Sections without influence on the result. Those of `runner` and `tracking` may hold the password of a server."""
LIMITS = ("workers", "timeout_s", "memory_mb")
"""Keys of `search` without influence on the result: what a candidate may take."""
NO_ROLES = "give `train` and `test` records, or one `record` with `repeats`"


def model_names() -> tuple[str, ...]:
    """Names of all models that an experiment can compare: the physics models, the two ensembles, the baselines."""
    from aesi.pipeline.experiment.physics_models import PHYSICS_NAMES
    from aesi.sparse import ENSEMBLES
    from aesi.sparse.baselines import BASELINES

    return (*PHYSICS_NAMES, *ENSEMBLES, *BASELINES)


class ExperimentConfig(Section):
    """One experiment.

    name : name of the experiment (letters, digits, `_` and `-`), and of its folder below `runs/`.
    note : purpose of the experiment in one line, shown in the report and in the tracking store.
    seed : random seed of the whole experiment.
    data : the records, and which of them train, validate and test.
    cell : the declared cell.
    fallback : data and cell that are used if the measured data are not available; only with `data.kind: catalogue`.
    library : the candidate terms of the correction.
    search : the evolutionary search for the terms.
    conformal : the prediction intervals.
    models : the models that the tables compare; all of them by default.
    tracking : where runs are tracked.
    runner : where candidates are evaluated.
    discover : what `aesi discover` needs in addition to cell and data.

    `base` is the folder that relative paths start from; it is not part of the file and of the hash.
    """

    name: str
    note: str = ""
    seed: RandomSeed = 0
    data: DataConfig
    cell: CellConfig = CellConfig()
    fallback: FallbackConfig | None = None
    library: LibraryConfig = LibraryConfig()
    search: SearchConfig = SearchConfig()
    conformal: ConformalConfig = ConformalConfig()
    models: tuple[str, ...] = Field(default_factory=model_names, min_length=1)
    tracking: TrackingConfig = TrackingConfig()
    runner: RunnerConfig = RunnerConfig()
    discover: DiscoverConfig | None = None
    base: Path = Field(default_factory=Path.cwd, exclude=True)

    @field_validator("models")
    @classmethod
    def _known(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [name for name in value if name not in model_names()]
        if unknown:
            known = ", ".join(map(repr, model_names()))
            raise ValueError(f"there is no model {unknown[0]!r}; known are {known}")
        twice = next((name for name in value if value.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"{twice} is named twice; give it once")
        return value

    @model_validator(mode="after")
    def _has_something_to_do(self) -> ExperimentConfig:
        if not self.data.has_roles and self.discover is None:
            raise ValueError(f"data: {NO_ROLES}")
        if self.fallback is not None and self.data.kind != "catalogue":
            raise ValueError(
                f"fallback: it stands in for a data set that cannot be had, and data are of kind: {self.data.kind}; "
                "leave it out"
            )
        return self

    @model_validator(mode="after")
    def _discovers_what_it_says(self) -> ExperimentConfig:
        if self.discover is not None and self.data.kind == "virtual":
            if self.discover.listed:
                raise ValueError(
                    "discover: kind: virtual brings its own records; leave out fit, test and good"
                )
            if self.discover.hold is not None:
                raise ValueError("discover: the hold of kind: virtual is known; leave out hold")
        elif self.discover is not None and self.discover.ends_nothing:
            raise ValueError(
                "discover.until_s cuts test records, and discover.test names none; name them, or leave out until_s "
                "(fit_until_s cuts the records of fit)"
            )
        return self

    @model_validator(mode="after")
    def _tells_of_named_records(self) -> ExperimentConfig:
        wanted = self.discover.listed if self.discover is not None else ()
        parts: list[tuple[str, ExperimentConfig | FallbackConfig]] = [("", self)]
        if self.fallback is not None:
            parts.append(("fallback.", self.fallback))
        for where, part in parts:
            named = dict.fromkeys((*part.data.listed, *wanted))
            for told, by_record in (
                ("data.from_s cuts", part.data.from_s),
                ("data.to_s cuts", part.data.to_s),
                ("cell.soc0_of is about", part.cell.soc0_of),
            ):
                if unknown := [name for name in by_record if name not in named]:
                    raise ValueError(
                        f"{where}{told} {unknown[0]}, which is no record here; there are: {', '.join(named) or 'none'}"
                    )
        return self

    @model_validator(mode="after")
    def _horizons_in_whole_steps(self) -> ExperimentConfig:
        for data in (self.data, *([] if self.fallback is None else [self.fallback.data])):
            for horizon_s in self.conformal.horizons_s or ():
                if not divides(data.dt_s, horizon_s):
                    raise ValueError(
                        f"conformal.horizons_s: {horizon_s:g} s is no whole number of steps of data.dt_s, "
                        f"{data.dt_s:g} s; give multiples of it, or leave horizons_s out"
                    )
        return self

    @field_validator("name")
    @classmethod
    def _is_a_folder_name(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,99}", value):
            raise ValueError(
                f"{value!r} has to be at most 100 letters, digits, `_` and `-`: it becomes a folder below runs/"
            )
        if value == "Default":
            raise ValueError("'Default' is the name of MLflow's own experiment; give another")
        return value

    def on_fallback(self) -> ExperimentConfig:
        """The experiment with the data and the cell of its fallback, and without its note, which is about the named
        data; itself where it has no fallback."""
        if self.fallback is None:
            return self
        changes = {"data": self.fallback.data, "cell": self.fallback.cell, "fallback": None, "note": ""}
        return self.model_copy(update=changes)

    def path(self, name: str) -> Path:
        """The path of a file that the experiment reads; relative names start from the folder of the experiment file."""
        path = Path(name).expanduser()
        return path if path.is_absolute() else (self.base / path).resolve()

    @property
    def digest(self) -> str:
        """Hash of all settings that influence the result. Runner, tracking, note and limits of resources do not."""
        return self._hash()

    @property
    def setting(self) -> str:
        """The hash without the seed. Runs with the same setting differ by chance alone, so that their mean and spread
        are meaningful."""
        return self._hash("seed")

    def _hash(self, *without: str) -> str:
        content = self.model_dump(mode="json", exclude={*NO_PART, "base", *without})
        for key in LIMITS:
            content["search"].pop(key)
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def read_experiment(path: str | Path, overrides: Sequence[str] = ()) -> ExperimentConfig:
    """The experiment in a YAML file.

    overrides : `key.subkey=value` texts that replace keys of the file, the values in YAML.
    Raises ConfigError, one sentence: the file, the key, what was found, and what is admissible.
    """
    from aesi.pipeline.yaml_text import parse_yaml

    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: there is no such experiment file.{_neighbours(path)}") from None
    except IsADirectoryError:
        raise ConfigError(f"{path} is a folder; give an experiment file.{_neighbours(path / 'x')}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read as text ({error}).") from None
    try:
        content = parse_yaml(text)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}") from None
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: holds no keys; an experiment starts with `name:`, `data:`, `cell:`.")
    seen: set[str] = set()
    for override in overrides:
        key = overridden_key(override)
        if key in seen:  # otherwise the last one would count without a message
            raise ConfigError(f"{path}: {key!r} is overridden twice; give it once.")
        lost = next((other for other in sorted(seen) if other.startswith(f"{key}.")), None)
        if lost is not None:
            raise ConfigError(
                f"{path}: {key!r} replaces {lost!r}, which is overridden before it; give {key!r} first."
            )
        seen.add(key)
        _override(content, override)
    return parse_experiment(content, base=path.resolve().parent, where=str(path))


def overridden_key(override: str) -> str:
    """The key, such as `search.candidates`, of an override `key=value`."""
    return override.partition("=")[0].strip()


def parse_experiment(
    content: Mapping[str, Any], base: Path | None = None, where: str = "experiment"
) -> ExperimentConfig:
    """The experiment in a mapping of keys.

    base : folder that relative paths start from, by default the current one.  where : source of the mapping, for
    errors. Raises ConfigError as `read_experiment` does.
    """
    try:
        return ExperimentConfig.model_validate({**content, "base": base or Path.cwd()})
    except ValidationError as error:
        details = error.errors()
        unknown = (
            one for one in details if one["type"] == "extra_forbidden"
        )  # a misspelt key is missing as well
        raise ConfigError(f"{where}: {_sentence(next(unknown, details[0]))}") from None


def _neighbours(path: Path) -> str:
    """End of the sentence on a missing file: the nearest name in its folder, or the experiment files there."""
    if not path.parent.is_dir():
        return ""
    names = sorted(p.name for p in path.parent.glob("*.yaml"))
    near = get_close_matches(path.name, names, n=1)
    if near:
        return f" Did you mean {path.parent / near[0]}?"
    return f" There are: {', '.join(names)}." if names else ""


def _override(content: dict[str, Any], override: str) -> None:
    """Set a key of the mapping in place, from a text `a.b=value` with the value in YAML.  Raises ConfigError if the
    text cannot be read, or if a part of the key is a value without keys."""
    from aesi.pipeline.yaml_text import parse_yaml

    key, equals, text = override.partition("=")
    told = f"--set {without_logins(override)}"
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ConfigError(f"{told}: has to read key=value, for instance search.candidates=50.")
    parts = _with_whole_names(parts)
    try:
        value = parse_yaml(text)
    except ValueError as error:
        raise ConfigError(f"{told}: {without_logins(text)!r} {without_logins(str(error))}") from None
    for depth, part in enumerate(parts[:-1]):
        child = content.setdefault(part, {})
        if isinstance(child, str) and part in SHORT_FOR:
            child = content[part] = {SHORT_FOR[part]: child}
        if not isinstance(child, dict):
            raise ConfigError(f"{told}: {'.'.join(parts[: depth + 1])} is a value and has no keys.")
        content = child
    content[parts[-1]] = value


def _sentence(detail: ErrorDetails) -> str:
    """One validation error of pydantic as a sentence: the key, what was found, and what is admissible."""
    location = [str(part) for part in detail["loc"]]
    key = ".".join(location)
    if detail["type"] == "extra_forbidden":
        known = _keys_at(location[:-1])
        near = get_close_matches(location[-1], known, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else f" Known here: {', '.join(known)}."
        return f"unknown key {key!r}.{hint}"
    if detail["type"] == "missing":
        if location[-1].isdigit():
            number = int(location[-1]) + 1
            return f"{'.'.join(location[:-1])!r} lacks its value number {number}; please give it."
        return f"{key!r} is missing; please give it."
    if detail["type"] == "value_error":
        said = str(detail["ctx"]["error"]).rstrip(".")
        return f"{key}: {said}." if key else f"{said}."
    found = without_logins(repr(detail["input"]))
    if detail["type"] in ("model_type", "model_attributes_type"):
        return f"{key} = {found} is not admissible: it takes keys: {', '.join(_keys_at(location))}."
    return f"{key} = {found} is not admissible: it {wanted(detail)}."


def _keys_at(location: Sequence[str]) -> list[str]:
    """The keys of the section at a location; empty if there is no section."""
    section: type[BaseModel] = ExperimentConfig
    for part in location:
        inner = _section_at(section, part)
        if inner is None:
            return []
        section = inner
    return [name for name in section.model_fields if name != "base"]


def _with_whole_names(parts: Sequence[str]) -> list[str]:
    """The parts of a key, with what follows a mapping of single values in one: the name of a record may hold dots."""
    section: type[BaseModel] = ExperimentConfig
    for depth, part in enumerate(parts[:-1], start=1):
        inner = _section_at(section, part)
        if inner is None:
            single = part in section.model_fields and _holds_single_values(
                section.model_fields[part].annotation
            )
            return [*parts[:depth], ".".join(parts[depth:])] if single else list(parts)
        section = inner
    return list(parts)


def _section_at(section: type[BaseModel], key: str) -> type[BaseModel] | None:
    """The section at a key of a section; None where the key is unknown or holds a value."""
    field = section.model_fields.get(key)
    types = (field.annotation, *get_args(field.annotation)) if field else ()
    return next((one for one in types if _is_section(one)), None)


def _holds_single_values(annotation: object) -> bool:
    """Whether it is a mapping whose values are no mappings."""
    return get_origin(annotation) is dict and get_origin(get_args(annotation)[1]) is not dict


def _is_section(annotation: object) -> TypeGuard[type[BaseModel]]:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)
