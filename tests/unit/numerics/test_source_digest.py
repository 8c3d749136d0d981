"""The hash of the program changes with what a number depends on, and with nothing else."""

import pytest

from aesi.numerics.files import source_digest as module


@pytest.fixture
def package(tmp_path, monkeypatch):
    for name in ("tracer/decide/verdict.py", "tracer/decide/confidence.json", "pipeline/report/run.py"):
        path = tmp_path / "aesi" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("1")
    monkeypatch.setattr(module, "ROOT", tmp_path / "aesi")
    return tmp_path / "aesi"


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        ("tracer/decide/verdict.py", True),
        ("tracer/decide/confidence.json", True),  # a kept row's confidence outlived the table it was read off
        ("tracer/decide/new.py", True),
        ("pipeline/report/run.py", False),
        ("tracer/decide/notes.md", False),
    ],
)
def test_what_a_number_depends_on_changes_the_digest(package, name, counts):
    digest = module.source_digest.__wrapped__
    before = digest()
    (package / name).write_text("2")
    assert (digest() != before) is counts


def test_a_folder_beside_counts_whole(package):
    digest, report = module.source_digest.__wrapped__, package / "pipeline" / "report"
    before = digest(report)
    (report / "run.py").write_text("2")
    assert digest(report) != before
