"""The documentation as a site: it builds without a warning, and its generated parts follow the code."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel, Field

from flows.benchmarks.history import Entry

ROOT = Path(__file__).resolve().parents[2]


def hook(name):
    spec = spec_from_file_location(f"docs_{name}", ROOT / "docs" / "hooks" / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_effect_is_in_the_catalogue_page_with_its_parameters():
    from aesi.physics.effects import CATALOGUE

    page = hook("generate").catalogue()
    for effect in CATALOGUE.values():
        assert f"### {effect.id}\n" in page
        for name in effect.parameters:
            assert f"| `{name}` |" in page


COMMANDS = (
    *("run", "worker", "tables", "compare", "candidate", "ui", "bench", "effects"),
    *("discover", "batch", "calibrate", "simulate", "predict", "impedance", "export"),
    *("data list", "data get", "data convert"),
)


def test_the_command_line_page_has_every_command_and_no_other():
    page = hook("generate").command_line()
    assert sorted(re.findall(r"^## aesi (.*)$", page, re.MULTILINE)) == sorted(COMMANDS)


def sections_of_an_experiment(section, name=""):
    """Each section with its dotted name, by the annotations alone."""
    yield name, section
    for key, field in section.model_fields.items():
        for each in (field.annotation, *get_args(field.annotation)):
            if isinstance(each, type) and issubclass(each, BaseModel) and name != "fallback":
                yield from sections_of_an_experiment(each, f"{name}.{key}".lstrip("."))


def test_every_key_of_an_experiment_is_in_its_table_with_unit_default_and_meaning():
    from aesi.pipeline.experiment.config import ExperimentConfig

    page = hook("generate").experiment()
    tables = dict(re.findall(r"^### (.*)\n\n.*\n\n((?:\|.*\n)+)", page, re.MULTILINE))
    sections = dict(sections_of_an_experiment(ExperimentConfig))
    assert set(tables) == {f"`{name}`" if name else "The file itself" for name in sections}
    for name, section in sections.items():
        lines = tables[f"`{name}`" if name else "The file itself"].splitlines()[2:]
        rows = {line.split("`")[1]: [cell.strip() for cell in line[1:-1].split(" | ")] for line in lines}
        assert set(rows) == set(section.model_fields) - {"base"}
        for key, (_, kind, unit, default, meaning) in rows.items():
            field = section.model_fields[key]
            assert kind
            assert len(meaning) > 8, f"{name}.{key}: {meaning}"
            ending = key.rpartition("_")[2]
            assert unit == {"s": "s", "mb": "MB"}.get(ending, unit), f"{name}.{key} in {unit}"
            assert (default == "required") == field.is_required()
            if default.startswith("`"):
                plain = list(field.default) if isinstance(field.default, tuple) else field.default
                assert json.loads(default.strip("`")) == plain


def test_a_key_that_nobody_described_builds_no_table():
    class Section(BaseModel):
        """A section.

        told : s, what it is.
        """

        told: float = 1.0
        untold: int = 2

    experiment = hook("parts/experiment")
    assert experiment.unit_of(experiment.told(Section)["told"]) == ("s", "what it is")
    with pytest.raises(KeyError, match="untold"):
        experiment.tables(Section, {})


def test_the_largest_seed_was_told_as_one_that_is_refused():
    class Section(BaseModel):
        """A section.

        seed : where it starts.  share : of the rows.
        """

        seed: int = Field(0, le=2**32 - 1)
        share: float = Field(0.5, gt=0.0, le=1.5)

    _, *rows = hook("parts/experiment").tables(Section, {}).splitlines()
    assert "| `seed` | whole number to 4,294,967,295 |" in "\n".join(rows)
    assert "| `share` | number above 0 to 1.5 |" in "\n".join(rows)


def test_the_bands_of_virtual_cells_are_of_the_newest_run(tmp_path, monkeypatch):
    generate = hook("generate")
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(generate, "ROOT", tmp_path)
    assert "No run has been recorded" in generate.bands()
    entry = {"machine": "a machine", "commit": "0123456789", "load": None}
    figures = ("coverage_pct", "coverage_se_pct", "coverage_sd_pct", "worst_bin_coverage_pct", "width_mv")
    line = dict(zip(figures, (90.04, 0.71, 3.5, 88.0, 10.0), strict=True))
    line |= {
        "bench": "bands",
        "method": "scaled",
        "cells": 24,
        "interval_score_mv": 12.0,
        "score_ratio": 1.234,
    }
    older = [{**line, "layout": "all", "horizon_s": None, "coverage_pct": 80.0}]
    newer = [
        {**line, "layout": "repeats", "horizon_s": 1.0},
        {**line, "layout": "repeats", "horizon_s": 1.0, "method": "one width"},
        {**line, "layout": "all", "horizon_s": None},
    ]
    entries = [
        {**entry, "date": "2027-01-01", "lines": older},
        {**entry, "date": "2027-02-01", "lines": newer},
    ]
    (tmp_path / "docs" / "benchmarks.json").write_text(json.dumps({"entries": entries}))
    assert [row for row in generate.bands().splitlines() if row.startswith("| ")][1:] == [
        "| all | scaled | whole drive | 90.0 ± 0.7 | 3.5 | 88.0 | 10.0 | 12.0 | 1.23 |",
        "| repeats | scaled | 1 s | 90.0 ± 0.7 | 3.5 | 88.0 | 10.0 | 12.0 | 1.23 |",
    ]


def test_deviations_that_were_recorded_over_all_cells_are_told_over_one_less():
    parts = hook("parts/recorded")
    line = {"bench": "bands", "cells": 5, "coverage_sd_pct": 4.0, "coverage_se_pct": 1.79, "score_ratio": 1.1}
    other = {"bench": "design", "cells": 5, "coverage_sd_pct": 4.0}
    entry = Entry(parts.BY_CELLS_UNTIL, "0123456789", "a machine", None, (line, other))
    told = parts.by_one_less(entry).lines
    # By hand: the square root of 5/4 is 1.118.
    assert told == (line | {"coverage_sd_pct": 4.47, "coverage_se_pct": 2.0}, other)
    later = replace(entry, date="2026-12-02")
    assert parts.by_one_less(later) is later


def test_benchmarks_come_from_the_recorded_lines_alone(tmp_path, monkeypatch):
    generate = hook("generate")
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(generate, "ROOT", tmp_path)
    assert "No run has been recorded" in generate.recorded("scale")
    line = {
        "bench": "scale",
        "runner": "dask",
        "rows": 9,
        "terms": 3,
        "workers": 2,
        "one_s": 0.123456,
        "peer_s": None,
    }
    entry = {"machine": "a machine", "commit": "0123456789", "load": 0.5}
    entries = [
        {**entry, "date": "2026-01-01", "lines": [{**line, "ratio_by_processor": 1.9}]},
        {**entry, "date": "2026-02-01", "lines": [{**line, "ratio_by_processor": 1.8}]},
    ]
    (tmp_path / "docs" / "benchmarks.json").write_text(json.dumps({"entries": entries}))
    page = generate.recorded("scale")
    assert "Measured on a machine, 2026-02-01, commit `0123456`, load 0.5 at the start." in page
    assert "2026-01-01, commit" not in page  # the newest of each case alone
    assert "| one_s | 0.1235 |" in page
    assert "| peer_s | – |" in page
    moved = "| scale | dask, 9, 3, 2 | ratio_by_processor | 1.9 (2026-01-01) → 1.8 (2026-02-01) |"
    assert moved in generate.over_time()


def test_the_answers_on_speed_name_every_peer_that_was_timed():
    speed = hook("parts/speed")
    lines = [
        {"bench": "espm", "ratio": 250.4, "rmse_mv": 0.0424},
        {"bench": "dfn", "ratio": None, "rmse_mv": 0.2},
        {"bench": "spci", "method": "enbpi", "peer": "MAPIE EnbPI", "ratio": 24.1, "score_ratio": 2.3},
        {"bench": "spci", "method": "split", "peer": "MAPIE ACI", "ratio": 9e4, "score_ratio": 2.9},
        {"bench": "spci", "method": "spci_boosted", "peer": "SPCI", "ratio": 561_070.0, "score_ratio": 1.032},
        {"bench": "ensemble", "peer": "PySINDy STLSQ", "ratio": 210.7},
        {"bench": "ensemble", "peer": "PySINDy STLSQ", "ratio": 969.4},
        {"bench": "search", "storage": "memory", "ours_ms": 0.2463, "peer_ms": 21.14, "ratio": 85.8},
        {"bench": "search", "storage": "SQLite", "ours_ms": 62.93, "peer_ms": 1124.0, "ratio": 17.9},
        {"bench": "tracking", "overhead_pct": 10.78},
        {"bench": "scale", "workers": 2, "ratio": 1.962},
    ]
    said = {
        "physics": "The single particle 250 times as fast as PyBaMM's, 0.042 mV RMSE off a fine mesh",
        "intervals": "`enbpi` 24 times as fast as MAPIE EnbPI; the default `spci_boosted` some 560,000 times as fast "
        "as SPCI, which is refitted at every step, with an interval score 1.03 times the best possible",
        "search": "Its ensembles 211 to 969 times as fast as PySINDy STLSQ on the same resamples",
        "costs": "The search 0.25 ms a candidate, Optuna's NSGA-II 21; tracking 11 % on the smallest library; "
        "2 workers are 2.0 times as fast as one",
    }
    for subject, sentence in said.items():
        assert getattr(speed, subject)([]) == "No run has been recorded"
        assert getattr(speed, subject)(lines) == sentence


def test_lines_of_two_kinds_stand_in_two_tables_and_many_are_folded_away(tmp_path, monkeypatch):
    generate = hook("generate")
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(generate, "ROOT", tmp_path)
    curve = [{"bench": "dfn", "load": f"load {k}", "who": "ours", "rmse_mv": 0.1} for k in range(20)]
    lines = [*curve, {"bench": "dfn", "summary": True, "ratio": 78.7}]
    entry = {"machine": "a machine", "commit": "0123456789", "load": None, "date": "2026-01-01"}
    (tmp_path / "docs" / "benchmarks.json").write_text(json.dumps({"entries": [{**entry, "lines": lines}]}))
    page = generate.recorded("dfn")
    assert "| figure | value |\n|---|---:|\n| ratio | 78.7 |" in page
    assert '??? note "20 lines"\n\n    | load | who | rmse_mv |\n' in page


def test_every_recorded_benchmark_has_its_place_on_a_page():
    from flows.benchmarks.history import read_history

    pages = "".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "benchmarks").glob("*.md"))
    entries = read_history(ROOT / "docs" / "benchmarks.json")
    recorded = {line["bench"] for entry in entries for line in entry.lines}
    assert {name for name in recorded if pages.count(f"<!-- generated: bench {name} -->") != 1} == set()


def test_ratios_of_times_were_recorded_over_milliseconds_that_had_been_rounded():
    from flows.benchmarks.history import latest, read_history

    newest = latest(read_history(ROOT / "docs" / "benchmarks.json")).values()
    lines = [line for _, line in newest if line["bench"] == "spci"]
    assert lines
    for line in lines:
        assert line["ours_s"] != round(line["ours_s"], 3), line["method"]
        assert line["ratio"] == pytest.approx(line["peer_step_s"] * line["n_test"] / line["ours_s"], abs=0.06)


def test_a_marker_that_no_generator_knows_stayed_in_its_page():
    known = hook("generate").GENERATORS
    for page in sorted((ROOT / "docs").rglob("*.md")):
        asked = re.findall(r"<!-- generated: (.*?) -->", page.read_text(encoding="utf-8"))
        assert [name for name in asked if name not in known and not name.startswith("bench ")] == [], page


def test_every_command_that_writes_a_table_names_the_page_that_has_its_marks(monkeypatch):
    """A table moved to another page, and its command would have been refused after the move."""
    from importlib import import_module

    from flows.benchmarks import BENCHMARKS
    from flows.benchmarks.page import check_marks

    monkeypatch.chdir(ROOT)
    told = [
        (name, options, page.relative_to(ROOT))
        for page in sorted((ROOT / "docs").rglob("*.md"))
        for name, options in re.findall(
            r"aesi bench ([a-z_]+)([^\n`]*--set write=[^\n`]*)", page.read_text(encoding="utf-8")
        )
    ]
    assert {name for name, *_ in told} == {"blind", "cells", "left_out", "real", "splits"}
    for name, options, page in told:
        written = re.search(r"--set write=(\S+)", options)[1]
        module = import_module(BENCHMARKS[name])
        archive = "archive=true" in options
        check_marks(written, *(module.ARCHIVE_MARKS if archive else (module.BEGIN, module.END)))
        assert str(page) == written  # it stands beside its table


def test_the_newest_of_labelled_runs_comes_first_and_all_of_them_stand_side_by_side(tmp_path, monkeypatch):
    generate = hook("generate")
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(generate, "ROOT", tmp_path)
    assert "No run has been recorded" in generate.recorded("blind")
    line = {"bench": "blind", "strict": True, "summary": True, "cases": 15, "seed": 3}
    rate = {"effect_exact_pct": 60.5, "effect_exact_95_pct": [43.4, 76.0], "effect_exact_cases": 38}
    rate |= {"parameter_error_median": 0.008191836}
    entry = {"machine": "a machine", "date": "2026-01-01", "load": 0.5}
    entries = [
        {**entry, "commit": "0123456789", "lines": [{**line, **rate, "label": "before"}]},
        {**entry, "commit": "abcdef0123", "lines": [{**line, "label": "after"}]},
    ]
    (tmp_path / "docs" / "benchmarks.json").write_text(json.dumps({"entries": entries}))
    page = generate.recorded("blind")
    _, newest, every = page.split("???")
    assert "| | seed 3, commit `abcdef0`, 2026-01-01 |" in newest
    assert "| effects named exactly | – |" in newest
    assert "| | before, seed 3, commit `0123456` | after, seed 3, commit `abcdef0` |" in every
    # 23 of 38 are 60.53 %, which a line holds as 60.5 and which stood here as 60 % beside the 61 % of the prose.
    assert "| effects named exactly | 23 of 38: 61 % [43, 76] | – |" in every
    assert (
        "| largest error of a parameter relative to its value, median (earlier runs) | 0.82 % | – |" in every
    )


SCRIPTS = ("record", "picture", "finding", "ship", "notebooks", "constant")


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_script_that_was_asked_for_help_worked_instead(name, tmp_path):
    """That of the benchmarks added an empty entry to the history."""
    before = (ROOT / "docs" / "benchmarks.json").read_bytes()
    command = [sys.executable, str(ROOT / "docs" / "hooks" / f"{name}.py"), "--help"]
    done = subprocess.run(
        command, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert "usage:" in done.stdout.lower()
    assert (ROOT / "docs" / "benchmarks.json").read_bytes() == before


@pytest.mark.parametrize(("name", "arguments"), [("record", ["--lines", "none.jsonl"]), ("ship", [])])
def test_a_script_without_anything_to_keep_leaves_what_is_there(name, arguments, tmp_path, monkeypatch):
    """Without an experiment the records of the package were removed, and none came in their place."""
    from aesi.data.laboratory import cache

    (tmp_path / "none.jsonl").write_text("Reading ...\n")
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "benchmarks.json").write_text('{"entries": []}\n')
    script = hook(name)
    monkeypatch.setattr(cache, "SHIPPED", kept)
    monkeypatch.setattr(script, "TARGET", kept / "benchmarks.json", raising=False)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        script.main(*([arguments] if name == "record" else []))
    assert ended.value.code == 2
    assert (kept / "benchmarks.json").read_text() == '{"entries": []}\n'


def test_arguments_of_a_docstring_become_a_list():
    pytest.importorskip("griffe", reason="the documentation's own packages are not installed")
    text = "What it is.\n\nx : (n,) V.  y, z : two\nlines.  u : s.\nReturns n.\nRaises E.\n\n    a : code"
    assert hook("docstrings").as_lists("What it is.  x : V.") == "What it is.\n\n- `x`: V."
    assert hook("docstrings").as_lists(text).splitlines() == [
        *("What it is.", "", "", "- `x`: (n,) V.", "- `y`, `z`: two", "    lines.", "- `u`: s."),
        *("", "Returns n.", "", "Raises E.", "", "    a : code"),
    ]


def test_what_aesi_offers_is_in_the_reference():
    import aesi

    page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
    shown = {line.rpartition(".")[2] for line in page.splitlines() if line.startswith("::: ")}
    assert set(aesi.__all__) <= shown


def test_formulas_become_mathml_and_code_is_left_alone():
    change = hook("formulas").on_page_markdown
    assert "<math" in change("an $x_1$ here")
    assert change("`$x$` and\n```\n$ aesi run $HOME\n```\n") == "`$x$` and\n```\n$ aesi run $HOME\n```\n"
    assert change("costs 5$ or 6$") == "costs 5$ or 6$"


def test_a_formula_within_a_list_item_ended_the_list():
    markdown = pytest.importorskip("markdown", reason="the documentation's own packages are not installed")
    text = "- one $x$,\n\n    $$x\n    = 1$$\n\n    which is one.\n\n- two\n"
    html = markdown.markdown(hook("formulas").on_page_markdown(text), extensions=["md_in_html"])
    assert html.count("<ul>") == 1
    assert html.count("<li>") == 2
    assert html.count("<math") == 2
    for page in sorted((ROOT / "docs" / "theory").glob("*.md")):
        html = markdown.markdown(hook("formulas").on_page_markdown(page.read_text(encoding="utf-8")))
        assert not re.search(r"\s- <strong>", html), page.name


def test_an_option_of_a_command_broke_behind_its_hyphens():
    html = '<div class="language-console"><span class="w"> </span>--out<span class="w"> </span>x--y</div> --z'
    shown = hook("options").on_page_content(html)
    assert shown == html.replace("--out", '<span class="option">--out</span>')
    assert hook("options").on_page_content("<code>--set a=1</code> --b") == (
        '<code><span class="option">--set</span> a=1</code> --b'
    )


def test_a_table_with_more_figures_than_lines_has_a_figure_a_row(tmp_path, monkeypatch):
    generate = hook("generate")
    (tmp_path / "docs").mkdir()
    monkeypatch.setattr(generate, "ROOT", tmp_path)
    lines = [
        {"bench": "spci", "method": name, "coverage_pct": 90.0, "width": 0.5, "fit_s": 1.0}
        for name in ("split", "aci")
    ]
    entry = {"machine": "a machine", "commit": "0123456789", "load": None, "date": "2026-01-01"}
    (tmp_path / "docs" / "benchmarks.json").write_text(json.dumps({"entries": [{**entry, "lines": lines}]}))
    page = generate.recorded("spci")
    assert "| method | split | aci |\n|---|---:|---:|\n| coverage_pct | 90 | 90 |" in page


def test_what_the_page_of_the_cells_says_in_short_is_what_its_table_says():
    page = (ROOT / "docs" / "cells.md").read_text(encoding="utf-8")
    short, table = page.split("## Every record")
    rows = [
        [cell.strip() for cell in line[1:-1].split("|")]
        for line in table.splitlines()
        if line.count("|") == 11
    ]
    head, unseen = rows[0], [row for row in rows[2:] if "(fitted)" not in row[1]]

    def told(cells, column, *starts):
        found = [row[head.index(column)] for row in unseen if row[0] in cells and row[1].startswith(starts)]
        return sorted(round(float(each.split()[0])) for each in found)  # it may have run out, and says when

    def said(values):
        return f"{values[0]} to {values[-1]} mV"

    def but_one(values):
        return f"{said(values[:-1])}, one {values[-1]}"

    both, cold = ("panasonic_ncr18650pf", "lg_18650hg2"), ("10degC", "0degC", "n10degC", "40degC")
    assert f"NMC pouch, four records) | {said(told(('about_energy_nmc',), 'declared', ''))} |" in short
    assert f"| {said(told(both, 'declared', '25degC'))} | {said(told(both, 'declared', *cold))} |" in short
    assert (
        f"| {said(told(both, 'with temperature', '25degC'))} | {but_one(told(both, 'with temperature', *cold))} |"
        in short
    )
    assert f"| {said(told(both, 'aged', '25degC'))} | {but_one(told(both, 'aged', *cold))} |" in short


def test_the_medians_that_the_page_of_the_cells_begins_with_are_those_of_its_archives():
    page = (ROOT / "docs" / "cells.md").read_text(encoding="utf-8")
    short, rest = page.split("## Every record")
    table = rest.split("<!-- table of aesi bench cells, archive -->")[1].split("\n\n")[0]
    rows = [[cell.strip() for cell in line[1:-1].split("|")] for line in table.strip().splitlines()]
    column = rows[0].index("with temperature")
    medians = {(row[0], row[1]): round(float(row[column].split()[0])) for row in rows[2:]}
    said = re.findall(r"^\| (-?\d+) °C \| (\d+) \| (\d+)", short, re.MULTILINE)
    assert [chamber for chamber, *_ in said] == ["25", "10", "0", "-10", "-20"]
    for chamber, panasonic, hg2 in said:
        assert medians["panasonic_ncr18650pf", f"{chamber} degC"] == int(panasonic)
        if chamber != "25":  # five drives of another chamber: `test_counts.py` takes their median
            assert medians["lg_18650hg2", f"{chamber} degC"] == int(hg2)


@pytest.mark.parametrize(("name", "least"), [("limits.md", 25), ("index.md", 20), ("benchmarks/index.md", 9)])
def test_figures_in_short_stand_on_the_pages_that_they_link_to(name, least):
    page = ROOT / "docs" / name
    rows = [line[1:-1].split(" | ") for line in page.read_text(encoding="utf-8").splitlines() if "](" in line]
    rows = [row for row in rows if len(row) >= 3]
    assert len(rows) >= least
    for where, *figures, links in rows:
        told = " | ".join(figures)
        pages = {page.parent / target for target in re.findall(r"\]\(([^)#]+)", links)}
        text = " ".join(each.read_text(encoding="utf-8") for each in pages)
        for figure in re.findall(r"(?<![\w.])\d+(?:\.\d+)?", f"{where} {told}"):
            found = re.search(rf"(?<![\d.]){re.escape(figure)}(?!\d|\.\d)", text)
            assert found, f"{figure} of: {where} | {told}"


def test_every_formula_of_the_documentation_is_understood():
    change = hook("formulas").on_page_markdown
    pages = [page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md")]
    html = "".join(re.sub(r'aria-label="[^"]*"', "", change(page)) for page in pages)
    formulas = re.findall(r"<math.*?</math>", html, re.DOTALL)
    assert len(formulas) > 100  # of none every one is understood
    assert [math for math in formulas if "\\" in math] == []


def test_pages_refer_to_files_that_exist():
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md"]:
        targets = re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8"))
        assert targets
        assert [target for target in targets if not (ROOT / target).exists()] == []


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    if shutil.which("mkdocs", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("the documentation's own packages are not installed")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr[-4000:]
    html = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert "fonts.googleapis" not in html
    assert re.findall(r'<(?:script|link)[^>]*(?:src|href)="https?:[^"]*"', html) == []
    # Read from the disk, a link to a folder opened a list of its files.
    assert re.findall(r'href="(?!https?:)[^"#]*/(?:#[^"]*)?"', html) == []
