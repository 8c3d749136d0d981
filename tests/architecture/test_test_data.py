"""Test data choose nothing: who names them at all is written here, and why.

Checked over the syntax tree: a name, an attribute or an argument called `test` or `tests` (also `split.test` and a role
that is looked up by its name), outside the benchmarks, whose business is the truth, and the reports, which draw it.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WORDS = {"test", "tests"}
MAY = {
    "aesi/records/split.py": "defines the split",
    "aesi/data/virtual.py": "makes the paper's records",
    "aesi/data/catalogue.py": "says which tests a data set holds",
    "aesi/data/blind": "makes the cases of the benchmark",
    "aesi/pipeline/experiment/sections.py": "names of records in the experiment's file",
    "aesi/pipeline/experiment/drives.py": "cuts the split",
    "aesi/pipeline/experiment/sources.py": "reads the records of every role",
    "aesi/pipeline/experiment/judging/evaluate.py": "judges the models, already chosen",
    "aesi/pipeline/experiment/judging/figures.py": "works out their figures",
    "aesi/pipeline/api.py": "takes them from the caller",
    "aesi/pipeline/experiment/comparison.py": "compares runs by what the evaluation left",
    "aesi/pipeline/distinct.py": "refuses what is fitted too",
    "aesi/pipeline/batch": "hands the files of each cell on",
    "aesi/pipeline/discovery/budget.py": "thins each by its own length",
    "aesi/pipeline/discovery/cases.py": "reads the files",
    "aesi/pipeline/discovery/searchable.py": "refuses what is fitted too",
    "aesi/pipeline/discovery/discover.py": "hands them to the tracer",
    "aesi/tracer/discovery.py": "hands them to the outcome",
    "flows/commands/cell.py": "takes --test from the command line",
    "flows/jobs/discovery.py": "logs their names",
    "flows/results/compare.py": "tells by their digests which runs were judged on the same",
    "flows/tracking/experiment_log.py": "logs names and digests of the records",
}


def uses(source: str) -> Iterator[int]:
    """Lines that name test data, or look up a role of the split."""
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.Name(id=word) | ast.Attribute(attr=word) | ast.arg(arg=word) if word in WORDS:
                yield node.lineno
            case ast.Call(func=ast.Name(id="getattr"), args=[_, ast.Name(id="role"), *_]):
                yield node.lineno
            case ast.Call(func=ast.Name(id="getattr"), args=[_, ast.Constant(value=word), *_]) if (
                word in WORDS
            ):
                yield node.lineno


def modules() -> list[Path]:
    found = [p for package in ("aesi", "flows") for p in sorted((ROOT / package).rglob("*.py"))]
    return [p for p in found if not {"bench", "benchmarks", "report"} & set(p.relative_to(ROOT).parts)]


def test_only_who_makes_judges_or_hands_on_names_test_data():
    strangers = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules()
        if not any(str(path.relative_to(ROOT)).startswith(known) for known in MAY)
        for line in uses(path.read_text(encoding="utf-8"))
    ]
    assert strangers == []


def test_the_list_names_nobody_who_no_longer_names_test_data():
    """A file that is gone, or has passed the work on: whatever came to stand there would be let through unseen."""
    named = [
        path.relative_to(ROOT).as_posix() for path in modules() if any(uses(path.read_text(encoding="utf-8")))
    ]
    assert [known for known in MAY if not any(path.startswith(known) for path in named)] == []


@pytest.mark.parametrize(
    "line", ["x = split.test", "for r in tests: pass", "getattr(split, role)", "getattr(split, 'test')"]
)
def test_a_reader_of_test_data_would_be_seen(line):
    assert list(uses(line)) == [1]
