"""Machine code kept on disk: found again, made again after an update, and never opened where it no longer fits."""

import ast
import os
import re
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from aesi.numerics import compiled

ROOT = Path(compiled.__file__).parents[2]
LAYOUT = """
from typing import NamedTuple
class Point(NamedTuple):
    x: float
    y: float
"""
KERNEL = """
from aesi.numerics.compiled import kept_njit
from aesi.part_kernels import weighed

@kept_njit()
def total(point):
    return weighed(point.x) + weighed(point.y)
"""
PART = """
from numba import njit

@njit(inline="always")
def weighed(x):
    return {weight} * x
"""
ASK = """
from aesi.{home} import Point
from aesi.total_kernels import total
print(total(Point(1.0, 2.0)), sum(total.stats.cache_hits.values()))
"""


@pytest.fixture
def package(tmp_path):
    """A small package in place of ours, with its compiler."""
    home = tmp_path / "aesi"
    (home / "numerics" / "files").mkdir(parents=True)
    for name in (
        "numerics/compiled.py",
        "numerics/files/first_use.py",
        "numerics/files/cache_folder.py",
        "errors.py",
    ):
        shutil.copy(ROOT / "aesi" / name, home / name)
    for name in ("__init__.py", "numerics/__init__.py", "numerics/files/__init__.py"):
        (home / name).touch()
    (home / "layout.py").write_text(LAYOUT)
    (home / "total_kernels.py").write_text(KERNEL)
    (home / "part_kernels.py").write_text(PART.format(weight=10.0))
    return home


def ask(package, home="layout", **environment):
    """Value, and how many functions were found compiled, in a new process."""
    settings = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "AESI"))}
    done = subprocess.run(
        [sys.executable, "-c", ASK.format(home=home)],
        env=settings | {"PYTHONPATH": str(package.parent)} | environment,
        cwd=package.parent, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    value, hits = done.stdout.split()
    return float(value), int(hits)


def test_a_command_that_compiled_for_a_minute_said_nothing(package):
    told = (
        "from aesi.numerics.files.first_use import on_first_compilation as listen\n"
        "listen(lambda: print('compiling'))"
    )
    settings = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA")}
    words = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", f"{told}\n{ASK.format(home='layout')}"],
            env=settings | {"PYTHONPATH": str(package.parent)},
            cwd=package.parent, capture_output=True, text=True, check=True,
        )  # fmt: skip
        words.append(done.stdout.split())
    assert words == [["compiling", "30.0", "0"], ["30.0", "1"]]


def test_an_update_that_changes_another_file_or_moves_a_class_is_compiled_again(package):
    assert ask(package) == (30.0, 0)
    assert ask(package) == (30.0, 1)
    (package / "part_kernels.py").write_text(PART.format(weight=20.0))
    assert ask(package) == (60.0, 0)
    (package / "layout.py").rename(package / "plain_layout.py")
    assert ask(package, "plain_layout") == (60.0, 0)
    assert ask(package, "plain_layout") == (60.0, 1)
    assert len(list(package.rglob("*.nbi"))) == 1  # that of earlier sources is gone


def test_where_the_package_cannot_be_written_the_folder_of_the_cache_is_used(package, tmp_path):
    kept = tmp_path / "kept"
    (package / "__pycache__").write_text("no folder")  # root may write anywhere, but not into this
    assert ask(package, AESI_CACHE=str(kept)) == (30.0, 0)
    assert list(kept.rglob("*.nbi"))


def test_a_folder_that_the_user_names_is_used(package, tmp_path):
    chosen = tmp_path / "chosen"
    assert ask(package, NUMBA_CACHE_DIR=str(chosen)) == (30.0, 0)
    assert not list(package.rglob("*.nbi"))


def test_two_threads_that_define_functions_at_once_left_a_folder_in_the_working_folder(monkeypatch, tmp_path):
    seen = []

    def slow_njit(**_):
        def define(function):
            before = compiled.SETTINGS.CACHE_DIR
            time.sleep(0.05)
            seen.append((before, compiled.SETTINGS.CACHE_DIR))
            return function

        return define

    monkeypatch.setattr(compiled, "njit", slow_njit)
    chosen = str(tmp_path)
    monkeypatch.setattr(compiled.SETTINGS, "CACHE_DIR", chosen)
    with ThreadPoolExecutor(2) as threads:
        list(threads.map(compiled.kept_njit(), [compiled.sources, compiled.cache_folder]))
    assert sorted(Path(before).name.split("-")[0] for before, _ in seen) == ["cache_folder", "compiled"]
    assert all(before == after for before, after in seen)
    assert chosen == compiled.SETTINGS.CACHE_DIR


def test_machine_code_is_kept_in_no_other_way():
    others = {
        path.name
        for path in (ROOT / "aesi").rglob("*.py")
        if re.search(r"njit\([^)]*cache=", path.read_text("utf-8"))
    }
    assert others == {"compiled.py"}


def test_the_named_tuples_of_signatures_stand_in_layouts():
    for room in ("espm", "dfn"):
        for path in (ROOT / "aesi" / "physics" / room).glob("*.py"):
            classes = [
                node
                for node in ast.walk(ast.parse(path.read_text("utf-8")))
                if isinstance(node, ast.ClassDef)
            ]
            tuples = [c.name for c in classes if any(ast.unparse(base) == "NamedTuple" for base in c.bases)]
            assert not tuples or path.name.endswith("layout.py"), (path.name, tuples)


def test_the_sources_of_a_kernel_are_followed_through_files_with_compiled_functions():
    physics = ROOT / "aesi" / "physics"
    found = compiled.sources(physics / "dfn" / "record_kernels.py")
    asked = ["dfn/layout.py", "espm/layout.py", "espm/kernels.py", "espm/transport_kernels.py"]
    assert {physics / name for name in asked} <= found
    assert ROOT / "aesi" / "constants.py" in found
