"""One name, one thing: nothing public is defined twice under one name, and what a text names is there."""

import ast
import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping
from importlib import import_module
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


Meant = Mapping[str, Collection[str] | None]
"""Folder -> names that may be elsewhere too, None for all."""


def twice_defined(names_of: Callable[[Path], Iterator[str]], meant: Meant) -> dict[str, list[str]]:
    homes = defaultdict(list)
    for package in ("aesi", "flows"):
        for path in sorted((ROOT / package).rglob("*.py")):
            place = path.relative_to(ROOT).as_posix()
            may = [names for folder, names in meant.items() if place.startswith(folder)]
            for name in names_of(path):
                if not any(names is None or name in names for names in may):
                    homes[name].append(place)
    return {name: paths for name, paths in homes.items() if len(paths) > 1}


OF_A_BENCHMARK = {"run", "plan", "chosen", "judged", "lost", "summary", "table", "main"}
PROTOCOLS: Meant = {
    "flows/commands/": None,
    "aesi/physics/effects/": None,
    "flows/benchmarks/": OF_A_BENCHMARK,
    "aesi/bench/": OF_A_BENCHMARK,
}
"""Where equal names are meant: a command is called as what it runs, every benchmark has its `run`, its cases and their
table, and an effect's functions belong to its file."""
FLOORS = {
    "calibrate": ["aesi/calibration/fit.py", "aesi/pipeline/api.py", "flows/jobs/calibration.py"],
    "discover": ["aesi/pipeline/api.py", "aesi/tracer/discovery.py", "flows/jobs/start.py"],
}
"""One use case on the floors that it passes: the algorithm, the Python door, the tracked job."""


def test_no_type_is_defined_twice():
    assert twice_defined(types_of, {}) == {}


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


def texts() -> Iterator[tuple[Path, str]]:
    """Documentation, notebooks and sources, in which modules, files and names are told of."""
    for pattern in ("*.md", "docs/**/*.md", "docs/**/*.ipynb", "aesi/**/*.py", "flows/**/*.py"):
        for path in sorted(ROOT.glob(pattern)):
            if path.name != "CHANGELOG.md":
                yield path.relative_to(ROOT), path.read_text(encoding="utf-8")


def known(dotted: str) -> bool:
    """Whether `package.module.Name.attribute` can be imported."""
    parts = dotted.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:cut]))
        except ModuleNotFoundError:
            continue
        for part in parts[cut:]:
            if not hasattr(found, part):
                return part in getattr(found, "__dataclass_fields__", {})
            found = getattr(found, part)
        return True
    return False


def test_every_dotted_name_that_a_text_tells_of_is_there():
    told = {
        (dotted, str(path))
        for path, text in texts()
        for dotted in re.findall(r"(?<![\w/.-])(?:aesi|flows)(?:\.[A-Za-z_]\w*){2,}", text)
    }
    assert [place for place in sorted(told) if not known(place[0])] == []


def test_every_file_that_a_text_tells_of_is_there():
    told = {
        (name, str(path))
        for path, text in texts()
        for name in re.findall(
            r"(?<![\w/.-])(?:aesi|flows|tests|docs|experiments)(?:/[\w.-]+)*/[\w-]+(?:\.\w+)+", text
        )
    }
    assert [place for place in sorted(told) if not (ROOT / place[0]).exists()] == []
