"""One name, one thing: no public class or type is defined twice under one name."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def types_of(path: Path) -> Iterator[str]:
    """Public classes and type aliases (`Row = Mapping[str, Any]`) at the top of a module."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        match node:
            case ast.ClassDef(name=name) | ast.Assign(targets=[ast.Name(id=name)]):
                if name[0].isupper() and not name.isupper():
                    yield name


def twice_defined() -> dict[str, list[str]]:
    homes = defaultdict(list)
    for package in ("aesi", "flows"):
        for path in sorted((ROOT / package).rglob("*.py")):
            for name in types_of(path):
                homes[name].append(str(path.relative_to(ROOT)))
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


def test_no_type_is_defined_twice():
    assert twice_defined() == {}


def test_a_type_defined_twice_would_be_seen(tmp_path):
    module = tmp_path / "module.py"
    module.write_text("class Cell: ...\nRow = dict[str, int]\nLIMIT = 3\n_Own = int\n")
    assert list(types_of(module)) == ["Cell", "Row"]
