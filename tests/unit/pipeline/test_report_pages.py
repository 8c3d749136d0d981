"""The two reports as files: complete, offline, escaped, and thinned without loss."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from aesi.pipeline.report import sections
from aesi.pipeline.report.arrays.embed import STORED, ArrayStore, embed
from aesi.pipeline.report.page import FILTERS, _environment, write_page
from aesi.pipeline.report.plots import records
from aesi.pipeline.report.table_formats import Table
from aesi.pipeline.report.write import write_discovery_report, write_run_report


def payload(html):
    return json.loads(re.search(r'id="payload">(.*?)</script>', html, re.DOTALL)[1])


def without_plotly(html):
    head, rest = html.split("<script>", 1)
    return head + rest.split("</script>", 1)[1]


@pytest.fixture(scope="module")
def run_html(views, tmp_path_factory):
    return write_run_report(tmp_path_factory.mktemp("run") / "report.html", views.run_view(6000)).read_text(
        "utf-8"
    )


@pytest.fixture(scope="module")
def discovery_html(views, tmp_path_factory):
    path = tmp_path_factory.mktemp("discovery") / "report.html"
    return write_discovery_report(path, views.discovery_view(6000)).read_text("utf-8")


def test_the_finding_comes_before_the_evidence(run_html, discovery_html):
    assert run_html.index("<h1>") < run_html.index('data-figure="voltage_test"')
    assert discovery_html.index("self-heating") < discovery_html.index('data-figure="residual_test"')


def test_a_run_whose_physics_is_not_among_its_models_ended_without_a_report(views, tmp_path):
    view = views.run_view(600)
    alone = replace(
        view,
        models=tuple(row for row in view.models if row["name"] == view.chosen),
        corrected="ESPM recalibrated",
    )
    assert "<h1>" in write_run_report(tmp_path / "report.html", alone).read_text("utf-8")


@pytest.mark.parametrize("figures", ["intervals", "one_step", "free_run"])
def test_a_run_whose_chosen_model_lacks_figures_ended_without_a_report(views, tmp_path, figures):
    view = views.run_view(400)
    rows = [{key: value for key, value in row.items() if key != figures} for row in view.models]
    text = write_run_report(tmp_path / "report.html", replace(view, models=tuple(rows))).read_text("utf-8")
    assert "test, one step ahead" not in text or figures != "intervals"
    assert "AESI II" in text


def test_nothing_is_loaded_from_elsewhere(run_html, discovery_html):
    for html in (run_html, discovery_html):
        assert not re.findall(r"<(?:script|link|img)[^>]+(?:src|href)=\"(?!data:)", html)
        assert html.count("plotly.js v") == 1


def test_every_placed_figure_has_its_data_and_the_other_way_round(run_html, discovery_html):
    for html in (run_html, discovery_html):
        placed = re.findall(r'data-figure="([^"]+)"', html)
        assert sorted(placed) == sorted(payload(html)["figures"])


def test_every_axis_has_a_title_with_its_unit_or_names(run_html, discovery_html):
    for html in (run_html, discovery_html):
        for name, figure in payload(html)["figures"].items():
            for key, axis in figure["layout"].items():
                if re.fullmatch(r"[xy]axis\d*", key) and axis.get("showticklabels", True):
                    title = axis.get("title", {}).get("text", "")
                    categories = key.startswith("y") or name == "violin"
                    assert "," in title or categories, (name, key, title)


def test_both_regimes_are_named(run_html):
    text = without_plotly(run_html)
    assert "Regime: free run" in text
    assert "Regime: one step ahead" in text
    assert "persistence" in text.lower()


def test_names_from_files_are_escaped(views, tmp_path):
    nasty = "</script><script>alert(1)</script>"
    view = views.run_view(300)
    view = replace(view, experiment=nasty, notes=(nasty,), traces=(replace(view.traces[3], name=nasty),))
    html = without_plotly(write_run_report(tmp_path / "r.html", view).read_text("utf-8"))
    assert "<script>alert" not in html


def test_a_view_with_nothing_but_the_table_still_makes_a_page(views, tmp_path):
    view = views.run_view(300)
    bare = replace(view, traces=(), candidates=(), terms=(), bootstrap=None, notes=(), settings={})
    html = write_run_report(tmp_path / "r.html", bare).read_text("utf-8")
    assert "Nothing was dropped" in html
    assert payload(html)["figures"] == {}


@pytest.mark.parametrize("verdict", ["none", "unknown"])
def test_a_discovery_without_an_effect_makes_a_page(views, tmp_path, verdict):
    view = views.discovery_view(300, verdict=verdict)
    bare = replace(view, files=(), dependence=(), experiments=())
    html = without_plotly(write_discovery_report(tmp_path / "r.html", bare).read_text("utf-8"))
    assert "What was missing" not in html
    assert f'class="verdict {verdict}"' in html


def test_hypotheses_may_lack_figures(views, tmp_path):
    view = views.discovery_view(300)
    bare = {**view.discovery, "candidates": [{"effect": "x", "kind": "physics", "score": 1.0}]}
    html = write_discovery_report(tmp_path / "r.html", replace(view, discovery=bare)).read_text("utf-8")
    assert ">–</td>" in html


def test_the_thinned_figure_says_so_and_keeps_every_sample(views, tmp_path):
    view = views.run_view(6000)
    html = write_run_report(tmp_path / "r.html", view).read_text("utf-8")
    assert "zooming in shows every sample" in html
    content = payload(html)
    traces = content["figures"]["voltage_test"]["data"]
    measured = next(t for t in traces if t["name"] == "measured")
    stored = content["arrays"][measured["meta"]["y"]]
    samples = np.frombuffer(base64.b64decode(stored["data"]), dtype="<f4")
    np.testing.assert_array_equal(samples, view.of("test")[0].measured_v.astype("f4"))
    assert len(measured["y"]) < len(samples)
    assert max(measured["y"]) == pytest.approx(samples.max(), rel=1e-6)


def test_very_long_records_are_thinned_before_they_are_stored(views):
    trace = views.trace("long", "test", STORED + 50_000, np.random.default_rng(0))
    store = ArrayStore()
    embedded = embed(records.profile_figure([trace], "voltage"), store)
    assert embedded.samples == STORED + 50_000
    assert embedded.kept <= STORED
    assert embedded.drawn < 5000


def test_the_same_array_is_stored_once():
    store = ArrayStore()
    assert store.add(np.arange(5.0)) == store.add(np.arange(5.0))
    assert len(store.arrays) == 1


def test_numbers_of_another_kind_with_the_same_bytes_are_another_array():
    store = ArrayStore()
    assert store.add(np.zeros(4, dtype="f4")) != store.add(np.zeros(2))
    assert sorted(each["dtype"] for each in store.arrays.values()) == ["f4", "f8"]


def test_an_interrupted_write_leaves_the_old_report(views, tmp_path, monkeypatch):
    path = tmp_path / "r.html"
    path.write_text("old")
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_page(path, "figures.html", {}, title="t")
    assert path.read_text() == "old"


def test_a_further_section_is_a_file_a_line_and_a_test(views, monkeypatch, tmp_path):
    added = sections.ReportSection(
        "caveats",
        "What to keep in mind",
        shows=("ranking", "a figure that no run has"),
        sentences=lambda view: (f"{view.cell} was measured once.",),
        pairs=lambda view: {"experiment": view.experiment},
    )
    monkeypatch.setattr(sections, "SECTIONS", (*sections.SECTIONS, added))
    page = write_run_report(tmp_path / "report.html", views.run_view(600)).read_text()
    assert '<section id="caveats">' in page
    assert "was measured once." in page
    assert '<section id="model">' in page


@pytest.mark.parametrize(
    ("interval", "digits"),
    [
        ({"value": 8.019e-3, "low": 8.004e-3, "high": 8.035e-3}, 4),  # [0.008, 0.00803] was shown
        ({"value": 2.0, "low": 1.0, "high": 3.0}, 3),
        ({"value": 0.0, "low": -1e-3, "high": 1e-3}, 3),
        ({"value": 5.0}, 3),
        ({"value": 5.0, "low": 5.0, "high": 5.0}, 3),
    ],
)
def test_an_interval_narrower_than_a_thousandth_was_shown_as_a_point(interval, digits):
    assert FILTERS["resolving"](interval) == digits


def test_thousands_are_written_out():
    shown = [FILTERS["significant"](value) for value in (2049.6, 0.000123, 98.76, 8.82e4, 3.2e7, None)]
    assert shown == ["2,050", "0.000123", "98.8", "88,200", "3.2e+07", "–"]


@pytest.mark.parametrize("models", [2, 12])
def test_a_table_of_many_models_and_horizons_shows_the_models_of_the_headline(models):
    rows = tuple((f"model, {k}, {horizon} s", "1.0") for k in range(models) for horizon in (1, 10, 60))
    table = Table("bands", "", ("model", "width, mV"), rows)
    page = _environment().from_string('{% import "macros.html" as m %}{{ m.data_table(table, names) }}')
    shown, _, folded = page.render(table=table, names=("model, 1",)).partition("<details>")
    assert (shown + folded).count("model, 1, 60 s") == (1 if models == 2 else 2)
    assert shown.count('scope="row"') == (6 if models == 2 else 3)
    assert folded.count('scope="row"') == (0 if models == 2 else 36)


def test_one_hypothesis_was_told_as_all_1_hypotheses(views, tmp_path):
    view = views.discovery_view(200)
    rows = view.discovery["candidates"][:1]
    moved = {"effect": "solid_diffusivity", "parameter": "negative_factor", "declared": 1.0, "value": 0.2}
    moved |= {"unit": "dimensionless", "deviations": -4.0, "one_sd": 0.3, "at_limit": False}
    one = {**view.discovery, "candidates": rows, "own_parameters": {"recalibrated": [moved]}}
    text = write_discovery_report(tmp_path / "r.html", replace(view, discovery=one)).read_text()
    assert "<summary>The hypothesis with its parameters</summary>" in text
    assert "<summary>How the refit changed the declared parameter</summary>" in text
