"""The shape of the house: imports point down, the package stands without its platform, help is instant."""

import ast
import importlib
import re
import resource
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

IMPORT_ALL = """
import importlib, pkgutil, sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {"prefect", "mlflow", "optuna", "dask", "distributed", "flows"}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Absent())
import aesi
names = [m.name for m in pkgutil.walk_packages(aesi.__path__, "aesi.")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""


def test_the_package_imports_without_orchestrator_tracker_and_optimiser():
    done = subprocess.run([sys.executable, "-c", IMPORT_ALL], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 30


def test_imports_point_down():
    command = [str(Path(sys.executable).with_name("lint-imports"))]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_no_folder_holds_more_than_a_dozen_files_but_the_effects():
    crowded = {}
    for package in ("aesi", "flows"):
        for folder in (ROOT / package, *(ROOT / package).rglob("*/")):
            modules = [path for path in folder.glob("*.py") if path.name != "__init__.py"]
            if len(modules) > 12:
                crowded[folder.relative_to(ROOT).as_posix()] = len(modules)
    assert list(crowded) == ["aesi/physics/effects"], crowded


def test_the_picture_of_the_architecture_shows_the_layers_that_are_checked_in_their_order():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    checked = [sorted(part.strip() for part in layer.split("|")) for layer in layers]
    picture = (ROOT / "docs" / "images" / "architecture.svg").read_text(encoding="utf-8")
    drawn: dict[int, list[str]] = {}
    for height, names in re.findall(
        r'<text x="\d+" y="(\d+)"[^>]*>(?:<tspan[^>]*>)?((?:aesi\.|flows)[^<]*)', picture
    ):
        drawn.setdefault(int(height), []).extend(name.strip() for name in names.split(","))
    assert [sorted(drawn[height]) for height in sorted(drawn)] == checked


@pytest.mark.parametrize(
    "arguments", [["--help"], ["run", "--help"], ["discover", "--help"], ["data", "--help"]]
)
def test_help_answers_within_a_second(arguments):
    seconds = []
    for _ in range(3):  # the first may have to read the interpreter's files from disk
        before = busy_s()
        done = subprocess.run(
            [sys.executable, "-m", "flows.cli", *arguments], capture_output=True, check=True
        )
        seconds.append(busy_s() - before)
        assert b"Usage" in done.stdout
    assert min(seconds) < 1.0


def busy_s() -> float:
    """CPU time of the processes that ended so far: on a machine with other work, the clock tells of that."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_help_loads_nothing_heavy():
    code = "import sys, flows.cli; print([m for m in sys.modules if m in HEAVY])"
    heavy = (
        "HEAVY = {'numpy', 'pandas', 'scipy', 'prefect', 'mlflow', 'optuna', 'numba', 'sklearn', 'pydantic'}"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"{heavy}; {code}"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "work",
    [
        f"import flows.jobs.start as start; start.RunRequest({str(ROOT / 'experiments' / 'smoke.yaml')!r}).config",
        "import aesi.pipeline.discovery.cases, flows.jobs.start",
    ],
    ids=["experiment", "discovery"],
)
def test_what_comes_before_the_stages_loads_none_of_what_they_need(work):
    heavy = {"scipy.stats", "scipy.signal", "sklearn", "pandas", "plotly", "prefect", "mlflow", "optuna"}
    code = f"{work}; import sys; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("hook", sorted((ROOT / "docs" / "hooks").rglob("*.py")), ids=lambda path: path.stem)
def test_what_makes_the_docs_imports_what_there_is(hook):
    """Its scripts run by hand, so that no other test sees a module that has moved."""
    for node in ast.walk(ast.parse(hook.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).split(".")[0] in {"aesi", "flows"}:
            module = importlib.import_module(str(node.module))
            for name in node.names:
                if not hasattr(module, name.name):
                    importlib.import_module(f"{node.module}.{name.name}")
