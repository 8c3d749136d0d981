"""The set of packages in constraints.txt."""

import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).resolve().parents[2]
PINS = [line.split("==") for line in (ROOT / "constraints.txt").read_text().splitlines() if "==" in line]


def test_a_pin_asked_for_a_newer_python_than_the_project():
    """With Debian's Python 3.11.2 pip tried all combinations of all others, for hours and without a word, since one pin
    wanted 3.11.5."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    (oldest,) = (s.version for s in SpecifierSet(project["requires-python"]) if s.operator == ">=")
    refused, seen = [], 0
    for name, version in PINS:
        try:
            found = metadata(name)
        except PackageNotFoundError:
            continue
        if found["Version"] != version:
            continue
        seen += 1
        # Not by index: a KeyError where a package has put importlib_metadata in the standard library's place.
        wants = found.get("Requires-Python") or ""
        if not SpecifierSet(wants).contains(f"{oldest}.0"):
            refused.append(f"{name}=={version}: {wants}")
    if not seen:
        pytest.skip("no pinned package is installed")
    assert refused == []
