"""The notebooks: they run from top to bottom, and are committed with what they print (docs/hooks/notebooks.py).

Here their cells are executed as one program, without a kernel, so that no notebook server is needed to test them.
"""

import contextlib
import io
import json
import re
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).resolve().parents[2] / "notebooks").glob("*.ipynb"))
QUICK = {"interoperability"}
"""Run with every test; the others search, which takes minutes."""
REMEDY = "python docs/hooks/notebooks.py makes them again"
FIGURES_AS_FAR = 0.05
"""Share by which a figure that no search has chosen may differ from machine to machine. A convention."""
RUNS = [pytest.param(path, marks=() if path.stem in QUICK else pytest.mark.slow) for path in NOTEBOOKS]


def cells(path, kind):
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in found if cell["cell_type"] == kind]


def test_there_are_notebooks():
    assert {path.stem for path in NOTEBOOKS} == {"own_data", "close_the_loop", "interoperability"}


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_committed_as_it_ran_from_top_to_bottom(path):
    code = cells(path, "code")
    assert [cell["execution_count"] for cell in code] == list(range(1, len(code) + 1))
    kinds = {output["output_type"] for cell in code for output in cell["outputs"]}
    assert kinds & {"stream", "execute_result", "display_data"}
    assert "error" not in kinds
    assert "".join(cells(path, "markdown")[0]["source"]).startswith("# ")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_what_a_notebook_shows_names_no_folder_of_a_machine(path):
    outputs = json.dumps([cell["outputs"] for cell in cells(path, "code")])
    assert re.findall(r"/(?:home|root|tmp|work|Users)/\w+", outputs) == []
    assert path.stat().st_size < 500_000


@pytest.mark.parametrize("path", RUNS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    monkeypatch.setenv("AESI_HOME", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.chdir(path.parent)
    namespace = {"__name__": "__main__"}
    for number, cell in enumerate(cells(path, "code"), start=1):
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            exec(compile("".join(cell["source"]), f"{path.name}, code cell {number}", "exec"), namespace)
        shown = "".join("".join(each["text"]) for each in cell["outputs"] if each["output_type"] == "stream")
        if _words(shown) != _words(said.getvalue()):
            pytest.fail(f"cell {number} shows\n{shown}\nof\n{said.getvalue()}\n{REMEDY}")
        if path.stem in QUICK:
            assert _figures(shown) == pytest.approx(_figures(said.getvalue()), rel=FIGURES_AS_FAR), REMEDY


def _words(text):
    """Lines without figures, which differ from machine to machine where a search chooses."""
    return [re.sub(r"[-+]?\d[\d.,]*", "#", line.strip()) for line in text.strip().splitlines()]


def _figures(text):
    return [float(each) for each in re.findall(r"-?\d+(?:\.\d+)?", text)]
