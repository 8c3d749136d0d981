"""Every Python and console block of the README and the documentation, run in the order of its page.

A page runs in one working folder and one namespace. Jobs that take minutes run as smaller ones of the same
kind; nothing else about the text is changed. A block of text below a console or Python block shows lines of its output,
whose words are compared; figures may differ from machine to machine.
"""

import contextlib
import doctest
import io
import os
import re
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]

STAND_INS = {
    "aesi run experiments/virtual_30ah.yaml": "aesi run experiments/smoke.yaml --set name=virtual_30ah",
    "aesi run experiments/measured_nmc_drive.yaml": "aesi run experiments/measured_nmc_drive.yaml "
    "--set search.candidates=4 --set search.resamples=10 --set library.d=[1,2]",
}
"""A job of minutes -> one of the same kind that takes seconds."""

SECONDS = 600


def _load_blocks():
    spec = spec_from_file_location("blocks", Path(__file__).with_name("blocks.py"))
    module = module_from_spec(spec)
    sys.modules["blocks"] = module
    spec.loader.exec_module(module)
    return module.blocks


blocks = _load_blocks()


def test_a_directive_that_means_nothing_was_passed_over(tmp_path):
    """A reason with a semicolon was cut there, and its rest taken for another directive."""
    page = tmp_path / "page.md"
    page.write_text("<!-- test: skip=hours; on two cores -->\n```console\n$ aesi\n```\n")
    with pytest.raises(ValueError, match="there is no on two cores"):
        blocks(page)
    page.write_text("<!-- test: skip=hours, on two cores; slow -->\n```console\n$ aesi\n```\n")
    (block,) = blocks(page)
    assert block.directives == {"skip": "hours, on two cores", "slow": ""}


@pytest.fixture
def workspace(tmp_path, monkeypatch):
    """A folder that looks like a checkout to relative paths, with its own tracking store."""
    for name in ("experiments", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("AESI_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def _tested(page, slow):
    found = [block for block in blocks(page) if block.is_tested]
    return any("slow" in block.directives for block in found) if slow else bool(found)


def _name(page):
    return str(page.relative_to(ROOT))


@pytest.mark.parametrize("page", [p for p in PAGES if p.exists() and _tested(p, False)], ids=_name)
def test_the_quick_examples_of_a_page_run(page, workspace, request):
    _run_page(page, request, slow=False)
    _require_ignored(workspace)


@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if p.exists() and _tested(p, True)], ids=_name)
def test_all_examples_of_a_page_run(page, workspace, request):
    _run_page(page, request, slow=True)
    _require_ignored(workspace)


def _run_page(page, request, slow):
    namespace = {"__name__": "__main__"}
    said = None
    for block in blocks(page):
        if block.language == "text" and said is not None:
            _require_words(block.body, said, f"{_name(page)}, line {block.line}")
        if block.is_tested:
            said = None
        if not block.is_tested or "skip" in block.directives or ("slow" in block.directives and not slow):
            continue
        if "needs" in block.directives:
            _require(request, block.directives["needs"])
        where = f"{_name(page)}, line {block.line}"
        if "file" in block.directives:
            target = Path(block.directives["file"])
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.body, encoding="utf-8")
        elif block.language == "python":
            said = _run_python(block.body, where, namespace)
        else:
            said = _run_console(block.body, where)


def _require_ignored(workspace):
    """Whoever follows a page in a checkout leaves nothing that git would offer to commit."""
    left = [path.name + "/" * path.is_dir() for path in workspace.iterdir() if not path.is_symlink()]
    if not left:
        return
    command = ["git", "-C", str(ROOT), "check-ignore", "--no-index", *left]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == 128:
        return  # no git, no checkout
    assert set(left) <= set(done.stdout.splitlines())


def _require(request, data_set):
    folder = request.getfixturevalue("shared_data")
    if not (folder / "measured" / data_set).is_dir():
        pytest.skip(f"{data_set} is not on this machine")
    request.getfixturevalue("monkeypatch").setenv("AESI_DATA", str(folder))


def _run_python(body, where, namespace):
    """Plain code is executed, and what it printed returned; a transcript with prompts is compared with its output."""
    if not body.startswith(">>> "):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(body, where, "exec"), namespace)
        return printed.getvalue()
    test = doctest.DocTestParser().get_doctest(body, namespace, where, where, 0)
    said = io.StringIO()
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert runner.run(test, out=said.write, clear_globs=False).failed == 0, said.getvalue()
    namespace.update(test.globs)
    return None


def _require_words(shown, said, where):
    """Each line that a page shows is one of those that its commands wrote, whatever its figures."""
    words = {_without_figures(line) for line in said.splitlines()}
    missing = [line for line in shown.splitlines() if line != "..." and _without_figures(line) not in words]
    assert not missing, f"{where} shows\n{missing}\nof\n{said}"


def _without_figures(line):
    return re.sub(r"[-+]?\d[\d.,]*", "#", line.strip())


def _run_console(body, where):
    """What the commands of a block wrote; None where one of them stood in for another."""
    said, stands_in = "", False
    for command, shown in _session(body):
        for long, short in STAND_INS.items():
            stands_in |= long in command
            command = command.replace(long, short)
        done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=SECONDS)
        assert done.returncode == 0, f"{where}: {command}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
        if shown:
            matches = doctest.OutputChecker().check_output(
                shown, done.stdout, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
            )
            assert matches, f"{where}: {command}\nsays\n{done.stdout}\nnot\n{shown}"
        said += done.stdout + done.stderr
    return None if stands_in else said


def _session(body):
    """Commands (after `$ `, continued by a backslash) with the output shown below each."""
    pairs = []
    lines = iter(body.replace("\\\n", "").splitlines())
    for line in lines:
        if line.startswith("$ "):
            pairs.append([line[2:], ""])
        else:
            pairs[-1][1] += line + "\n"
    return [(command, shown) for command, shown in pairs]
