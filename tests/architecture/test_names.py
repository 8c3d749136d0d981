"""One name, one thing: no public class, type or function is defined twice under one name."""

import ast
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def types_of(path: Path) -> Iterator[str]:
    """Public classes and type aliases (`Row = Mapping[str, Any]`) at the top of a module."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        match node:
            case ast.ClassDef(name=name) | ast.Assign(targets=[ast.Name(id=name)]):
                if name[0].isupper() and not name.isupper():
                    yield name


def functions_of(path: Path) -> Iterator[str]:
    """Public functions at the top of a module."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("_"):
            yield node.name


def twice_defined(
    names_of: Callable[[Path], Iterator[str]], left_out: tuple[str, ...] = ()
) -> dict[str, list[str]]:
    homes = defaultdict(list)
    for package in ("aesi", "flows"):
        for path in sorted((ROOT / package).rglob("*.py")):
            place = path.relative_to(ROOT).as_posix()
            if not place.startswith(left_out):
                for name in names_of(path):
                    homes[name].append(place)
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


PROTOCOLS = ("flows/commands/", "flows/benchmarks/", "aesi/bench/", "aesi/physics/effects/")
"""Where equal names are meant: a command is called as what it runs, every benchmark has its `run`, and an effect's
functions belong to its file."""
FLOORS = {
    "calibrate": ["aesi/calibration/fit.py", "aesi/pipeline/api.py", "flows/jobs/calibration.py"],
    "discover": ["aesi/pipeline/api.py", "aesi/tracer/discovery.py", "flows/jobs/start.py"],
}
"""One use case on the floors that it passes: the algorithm, the Python door, the tracked job."""


def test_no_type_is_defined_twice():
    assert twice_defined(types_of) == {}


def test_no_function_is_defined_twice():
    assert twice_defined(functions_of, PROTOCOLS) == FLOORS


def test_a_type_defined_twice_would_be_seen(tmp_path):
    module = tmp_path / "module.py"
    module.write_text("class Cell: ...\nRow = dict[str, int]\nLIMIT = 3\n_Own = int\n")
    assert list(types_of(module)) == ["Cell", "Row"]


def test_a_function_defined_twice_would_be_seen(tmp_path):
    module = tmp_path / "module.py"
    module.write_text(
        "def run(): ...\nasync def wait(): ...\ndef _own(): ...\nclass Cell:\n    def run(self): ...\n"
    )
    assert list(functions_of(module)) == ["run", "wait"]
