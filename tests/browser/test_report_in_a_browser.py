"""The reports in a real browser: drawn, quiet, offline, refined on zoom, legible at both widths."""

import pytest

from aesi.pipeline.report.compare import ComparedRun, write_comparison
from aesi.pipeline.report.write import write_discovery_report, write_run_report


@pytest.fixture(scope="module")
def run_report(views, tmp_path_factory):
    return write_run_report(tmp_path_factory.mktemp("run") / "report.html", views.run_view(20_000))


@pytest.fixture(scope="module")
def discovery_report(views, tmp_path_factory):
    return write_discovery_report(tmp_path_factory.mktemp("d") / "report.html", views.discovery_view(20_000))


PAPER_PX = 720
"""The text of a page of A4 at 96 dots an inch, less its margins."""
SHOWN = "[...document.querySelectorAll('.plot')].filter(d => !d.closest('details:not([open])'))"


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (400, False), (1280, True)])
@pytest.mark.parametrize("report", ["run_report", "discovery_report"])
def test_all_plots_are_drawn_without_a_word_from_the_console(page, request, report, width, dark):
    page.open(request.getfixturevalue(report), width, dark=dark)
    assert page.errors == []
    assert all(url.startswith(("file:", "data:")) for url in page.requests)
    assert page.evaluate(f"{SHOWN}.length") >= 8
    assert page.evaluate(f"{SHOWN}.every(d => d.querySelectorAll('.main-svg').length)")
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.evaluate(f"{SHOWN}.every(d => d.querySelector('.main-svg').clientWidth <= d.clientWidth)")


def test_text_is_light_on_a_dark_page(page, discovery_report):
    colour = "getComputedStyle(document.querySelector('.plot .xtick text')).fill"
    page.open(discovery_report, dark=True)
    dark = page.evaluate(colour)
    page.open(discovery_report, dark=False)
    assert dark != page.evaluate(colour)


def test_dragging_shows_the_samples_that_the_overview_left_out(page, run_report):
    page.open(run_report)
    div = "document.querySelector('[data-figure=voltage_test]')"
    index = page.evaluate(f"{div}.data.findIndex(t => t.name === 'measured')")
    shown = f"{div}.data[{index}].x"
    overview = page.evaluate(f"{shown}.length")
    page.drag(f"{div}.querySelector('.nsewdrag')", 0.10, 0.12)
    page.wait_for(f"{shown}.length < {overview} / 2")
    low, high = page.evaluate(f"{div}._fullLayout.xaxis.range")
    inside = page.evaluate(f"{shown}.filter(x => {low} <= x && x <= {high}).length")
    assert 20 < high - low < 120
    assert inside == pytest.approx(10 * (high - low), abs=1.5)  # 10 Hz: every sample is there
    page.evaluate(f"{div}.querySelector('[data-title=\"Reset axes\"]').dispatchEvent(new Event('click'))")
    page.wait_for(f"{shown}.length === {overview} || {shown}.length > {overview} - 5")
    assert page.errors == []


def test_folded_figures_are_drawn_when_opened(page, run_report):
    page.open(run_report)
    div = "document.querySelector('details [data-figure=voltage_train]')"
    assert page.evaluate(f"{div}.querySelectorAll('.main-svg').length") == 0
    page.evaluate(f"{div}.closest('details').open = true")
    page.wait_for(f"{div}.querySelectorAll('.main-svg').length > 0")


def test_printing_opens_and_draws_everything(page, run_report):
    page.open(run_report)
    assert page.pdf().startswith(b"%PDF")
    assert page.evaluate("[...document.querySelectorAll('.plot')].every(d => d.querySelector('.main-svg'))")


@pytest.mark.parametrize("report", ["run_report", "discovery_report"])
def test_no_table_is_wider_than_the_paper(page, request, report):
    page.open(request.getfixturevalue(report), width=PAPER_PX)
    page.evaluate("document.querySelectorAll('details').forEach(d => d.open = true)")
    page.call("Emulation.setEmulatedMedia", media="print")
    try:
        wide = "[...document.querySelectorAll('table')].filter(t => t.getBoundingClientRect().right > innerWidth)"
        assert page.evaluate(f"{wide}.map(t => t.textContent.trim().slice(0, 80))") == []
    finally:
        page.call("Emulation.setEmulatedMedia", media="")


def test_on_a_phone_the_names_of_a_wide_table_stay_beside_its_last_column(page, run_report):
    page.open(run_report, width=400)
    wide = "[...document.querySelectorAll('.scroll')].reduce((a, b) => a.scrollWidth > b.scrollWidth ? a : b)"
    assert page.evaluate(f"{wide}.scrollWidth > {wide}.clientWidth + 50")
    page.evaluate(f"{wide}.scrollLeft = {wide}.scrollWidth")
    seen = f"{wide}.querySelector('tbody th').getBoundingClientRect()"
    assert page.evaluate(f"{seen}.left >= 0 && {seen}.right < innerWidth / 2")


@pytest.mark.slow
def test_a_hundred_thousand_samples_stay_smooth(page, views, tmp_path):
    path = write_discovery_report(tmp_path / "r.html", views.discovery_view(100_000))
    page.open(path)
    div = "document.querySelector('[data-figure=residual_test]')"
    zoom = f"""(async () => {{ const start = performance.now();
        await Plotly.relayout({div}, {{'xaxis.range': [1000, 60000]}});
        await new Promise(done => setTimeout(done, 61)); await Plotly.relayout({div}, {{}});
        return performance.now() - start; }})()"""
    assert page.evaluate(zoom) < 2000


def test_a_long_setting_pushed_all_runs_but_the_first_off_the_page(page, tmp_path):
    """The digests of five records, in one line, took half of the page for each run."""
    digests = [", ".join(f"{16 * run + record:016x}" for record in range(5)) for run in range(4)]
    keys = [f"data.key_{k}" for k in range(9)]  # more than there are runs: a column is a run
    runs = [
        ComparedRun(f"{k:032x}", "smoke, seed 0", "smoke", "2026-01-01 00:00", dict.fromkeys(keys, long), {})
        for k, long in enumerate(digests)
    ]
    table = "document.querySelector('#settings table')"
    page.open(write_comparison(tmp_path / "page.html", runs), 1280, shown=f"{table} !== null")
    assert page.evaluate(f"{table}.rows[0].cells.length") == 5
    assert page.evaluate(f"{table}.scrollWidth <= {table}.parentElement.clientWidth")


def test_a_run_called_by_many_settings_hid_all_figures_of_all_runs(page, tmp_path):
    """The name of the row, which stays where it is, was as wide as the page."""
    changes = "library.feedback=true, search.regime=one_step, search.top_share=1, library.inputs=null, "
    changes += "models=[ESPM,AESI I,AESI II,ridge,SINDy-C,PySINDy ensemble,DMD with control]"
    runs = [
        ComparedRun(
            f"{k:032x}", f"smoke, seed {k}: {changes}", "smoke", "2026-01-01 00:00", {"seed": str(k)}, {}
        )
        for k in range(2)
    ]
    written = write_comparison(tmp_path / "page.html", runs)
    table = "[...document.querySelectorAll('table')].find(t => t.rows[0].cells[0].textContent === 'run')"
    page.open(written, 1280, shown=f"{table} !== undefined")
    name = f"{table}.querySelector('tbody td')"
    assert page.evaluate(f"{name}.textContent.includes('PySINDy')")
    assert page.evaluate(f"{table}.scrollWidth <= {table}.parentElement.clientWidth")
