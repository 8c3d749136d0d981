"""The keys of an experiment file as tables, from the fields of its sections and what their docstrings say of them."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from datetime import date
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

KEY = re.compile(r"(?:^|(?<=  ))(\w+) : ", re.MULTILINE)
UNIT = re.compile(r"(s|C|MB|rows), (?:by |to |of |that )?")
WORDS = {str: "text", float: "number", int: "whole number", bool: "`true` or `false`", date: "day"}
LIMITS = {"gt": "above {}", "ge": "from {}", "lt": "below {}", "le": "to {}"}
NOT_KEYS = ("base",)
"""Fields that no file sets: the folder of the file itself."""


def tables(root: type[BaseModel], choices: Mapping[str, Iterable[str]]) -> str:
    """A heading and a table a section, the outermost first.

    choices : of keys that take names, by dotted key, the names that there are.
    """
    parts = []
    places = {section: name for name, section in sections(root)}
    for section, name in places.items():
        title = f"`{name}`" if name else "The file itself"
        parts += [
            f"### {title}\n",
            f"{_code(summary(section))}\n",
            *_table(name, section, places, choices),
            "",
        ]
    return "\n".join(parts)


def sections(root: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    """Each section with its dotted name, once: what a fallback holds are sections that stand before."""
    seen: set[type[BaseModel]] = set()
    left = [("", root)]
    while left:
        name, section = left.pop(0)
        if section not in seen:
            seen.add(section)
            yield name, section
            inner = [(f"{name}.{key}".lstrip("."), _section(field)) for key, field in fields(section).items()]
            left[:0] = [(key, each) for key, each in inner if each is not None]


def fields(section: type[BaseModel]) -> dict[str, FieldInfo]:
    """The keys of a section."""
    return {key: field for key, field in section.model_fields.items() if key not in NOT_KEYS}


def summary(section: type[BaseModel]) -> str:
    """The first paragraph of a section's docstring, which is about no single key."""
    return " ".join(inspect.cleandoc(section.__doc__ or "").split("\n\n")[0].split())


def told(section: type[BaseModel]) -> dict[str, str]:
    """What the docstring says of each key, `key : unit, meaning`, in one line."""
    found = {}
    for paragraph in inspect.cleandoc(section.__doc__ or "").split("\n\n"):
        _, *pieces = KEY.split(paragraph)
        for key, text in zip(pieces[::2], pieces[1::2], strict=True):
            found[key] = " ".join(text.split()).removesuffix(".")
    return found


def unit_of(text: str) -> tuple[str, str]:
    """The unit that a meaning begins with, '' without, and the meaning."""
    found = UNIT.match(text)
    return (found[1], text[len(found[1]) + 2 :]) if found else ("", text)


def _table(
    name: str,
    section: type[BaseModel],
    places: Mapping[type[BaseModel], str],
    choices: Mapping[str, Iterable[str]],
) -> list[str]:
    meanings = told(section)
    rows = ["| key | type | unit | default | meaning |", "|---|---|---|---|---|"]
    for key, field in fields(section).items():
        unit, meaning = unit_of(meanings[key])
        inner = _section(field)
        dotted = f"{name}.{key}".lstrip(".")
        kind = (
            f"[section](#{places[inner].replace('.', '')})"
            if inner
            else _limited(_words(field.annotation), field.metadata)
        )
        if dotted in choices:
            meaning = f"{meaning}. There are {', '.join(f'`{each}`' for each in choices[dotted])}"
        cells = (f"`{key}`", kind, unit, _default(field, inner is not None), _code(meaning))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return rows


def _section(field: FieldInfo) -> type[BaseModel] | None:
    for each in (field.annotation, *get_args(field.annotation)):
        if isinstance(each, type) and issubclass(each, BaseModel):
            return each
    return None


def _words(annotation: Any) -> str:
    """A type as one would say it, with its limits."""
    origin, inner = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _limited(_words(inner[0]), inner[1:])
    if origin in (Union, UnionType):
        return " or ".join(_words(each) for each in inner if each is not NoneType)
    if origin is Literal:
        return ", ".join(f"`{each}`" for each in inner)
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return f"list, each {_words(inner[0])}"
        return f"list of {len(inner)}, each {_words(inner[0])}"
    if origin is dict:
        held = _words(inner[1])
        return f"name: {{{held}}}" if get_origin(inner[1]) is dict else f"name: {held}"
    return WORDS[annotation]


def _limited(words: str, metadata: Iterable[Any]) -> str:
    """With the limits that pydantic checks; validators of other kinds say theirs when they refuse."""
    bounds = [bound for each in metadata for bound in (getattr(each, "metadata", None) or [each])]
    limits = [
        said.format(_exact(getattr(bound, name)))
        for bound in bounds
        for name, said in LIMITS.items()
        if getattr(bound, name, None) is not None
    ]
    return " ".join([words, *limits])


def _exact(bound: float) -> str:
    """A whole number to its last digit: in six digits the largest seed is one that is refused."""
    return f"{bound:,}" if isinstance(bound, int) else f"{bound:g}"


def _default(field: FieldInfo, is_section: bool) -> str:
    if field.is_required():
        return "required"
    if is_section:
        return ""
    if field.default_factory is not None:
        return "all"
    plain = list(field.default) if isinstance(field.default, tuple) else field.default
    return f"`{json.dumps(plain)}`"


def _code(text: str) -> str:
    """What Python calls None is null in a file."""
    return re.sub(r"\bNone\b", "`null`", text)
