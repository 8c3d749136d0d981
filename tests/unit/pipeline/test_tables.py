"""Tables: rows in, text out."""

import csv
import io

import pytest

from aesi.pipeline.report import table_formats, tables

ESPM = {
    "name": "ESPM",
    "terms": 0,
    "free_run": {"train_mser_pct": 0.0, "test_mser_pct": 0.0, "test_rmse_mv": 18.7},
    "one_step": {"test_rmse_mv": 18.7, "persistence_rmse_mv": 4.03},
}
HYBRID = {
    "name": "ESPM + AESI I",
    "terms": 56,
    "free_run": {
        "train_mser_pct": 71.25,
        "test_mser_pct": 44.444,
        "test_rmse_mv": 13.94,
        "diverged": 1,
        "spread": {"test_mser_pct": [40.0, 47.5]},
    },
    "one_step": {"test_rmse_mv": 3.9, "persistence_rmse_mv": 4.03},
    "k_step": {"1": 4.0, "10": 8.25, "60": 12.5},
    "intervals": {
        "nominal_pct": 90,
        "coverage_pct": 90.5,
        "average_width_v": 0.0123,
        "winkler_v": 0.02,
        "worst_bin_coverage_pct": 81.0,
        "spread": {"coverage_pct": [90.25, 90.75]},
    },
    "seeds": 3,
}
MODELS = [ESPM, HYBRID]


def row_of(table, name):
    return dict(zip(table.header, next(r for r in table.rows if r[0] == name), strict=True))


def test_table_1_puts_the_bare_model_beside_the_hybrid():
    table = tables.free_run_table(MODELS)
    assert row_of(table, "ESPM")["MSER test, %"] == "0.00"
    assert row_of(table, "ESPM + AESI I")["MSER test, %"] == "44.44 [40.00, 47.50] (1 diverged)"
    assert "3 seeds" in table.caption


@pytest.mark.parametrize("build", tables.TABLES)
def test_every_caption_states_its_regime(build):
    assert "Regime: " in build(MODELS).caption


def test_a_nominal_level_between_whole_percents_is_not_rounded():
    level = 100.0 * (1.0 - 0.001)
    assert row_of(tables.interval_table([HYBRID]), HYBRID["name"])["nominal, %"] == "90"
    row = {**HYBRID, "intervals": HYBRID["intervals"] | {"nominal_pct": level}}
    assert row_of(tables.interval_table([row]), HYBRID["name"])["nominal, %"] == "99.9"


def test_one_step_stands_beside_persistence():
    row = row_of(tables.one_step_table(MODELS), "ESPM + AESI I")
    assert (row["RMSE test, mV"], row["persistence test, mV"]) == ("3.900", "4.030")


def test_widths_leave_in_millivolts():
    row = row_of(tables.interval_table(MODELS), "ESPM + AESI I")
    assert row["average width, mV"] == "12.300"
    assert row["Winkler, mV"] == "20.000"


def test_coverage_of_several_seeds_stands_with_its_range():
    table = tables.interval_table(MODELS)
    assert row_of(table, "ESPM + AESI I")["coverage, %"] == "90.50 [90.25, 90.75]"
    assert "lowest and highest of 3 seeds" in table.caption


def test_ranges_of_the_bands_stood_without_a_word_on_what_they_are():
    bands = HYBRID["intervals"]
    table = tables.free_run_band_table(
        [{**HYBRID, "free_run_intervals": bands, "bands_by_horizon": {"1": bands}}]
    )
    assert [cells[2] for cells in table.rows] == ["90.50 [90.25, 90.75]"] * 2
    assert "lowest and highest of 3 seeds" in table.caption


def test_seeds_that_agree_need_no_range():
    row = {**HYBRID, "free_run": {"test_mser_pct": 58.731, "spread": {"test_mser_pct": [58.731, 58.732]}}}
    assert row_of(tables.free_run_table([row]), "ESPM + AESI I")["MSER test, %"] == "58.73"


def test_the_table_of_methods_holds_the_experiments_own_too():
    forest = {"coverage_pct": 87.5, "average_width_v": 0.014, "nominal_pct": 90}
    table = tables.method_table([{**HYBRID, "intervals_by_method": {"spci_refitted": forest}}])
    assert row_of(table, "ESPM + AESI I, as in Table 2")["average width, mV"] == "12.300"
    assert row_of(table, "ESPM + AESI I, spci_refitted")["average width, mV"] == "14.000"


def test_a_model_without_intervals_has_no_row_in_table_2():
    assert [row[0] for row in tables.interval_table(MODELS).rows] == ["ESPM + AESI I"]


def test_horizons_are_sorted_as_numbers():
    models = [{"name": "m", "k_step": {"60": 3.0, "1": 1.0, "10": 2.0}}]
    assert tables.k_step_table(models).header == ("model", "1 s, mV", "10 s, mV", "60 s, mV")


def test_persistence_stands_below_the_horizons():
    models = [{"name": "m", "k_step": {"1": 1.0, "60": 3.0}, "k_step_persistence": {"1": 0.9, "60": 8.0}}]
    assert tables.k_step_table(models).rows[-1] == ("persistence", "0.90", "8.00")


def test_columns_without_any_value_are_left_out():
    assert "time, s" not in tables.free_run_table(MODELS).header
    timed = [dict(HYBRID, seconds=12.34)]
    assert row_of(tables.free_run_table(timed), "ESPM + AESI I")["time, s"] == "12.3"


def test_absent_and_nan_values_show_as_a_dash():
    models = [ESPM, {"name": "broken", "free_run": {"test_mser_pct": float("nan")}}]
    row = row_of(tables.free_run_table(models), "broken")
    assert row["MSER test, %"] == table_formats.ABSENT
    assert row["RMSE test, mV"] == table_formats.ABSENT


def test_markdown_is_a_pipe_table_of_constant_width():
    lines = table_formats.to_markdown(tables.free_run_table(MODELS)).splitlines()
    assert lines[0].startswith("Table 1.")
    pipes = [line for line in lines if line.startswith("|")]
    assert len(pipes) == 2 + len(MODELS)
    assert len({line.count("|") for line in pipes}) == 1


def test_latex_escapes_what_latex_would_eat():
    text = table_formats.to_latex(tables.free_run_table([dict(ESPM, name="50% & a_b#1")]))
    assert r"50\% \& a\_b\#1" in text
    assert r"\toprule" in text
    assert text.count(r"\begin{") == text.count(r"\end{")
    columns = len(tables.free_run_table(MODELS).header)
    assert all(line.count(" & ") == columns - 1 for line in text.splitlines() if line.endswith(r"\\"))


def test_csv_reads_back_and_leaves_absent_values_empty():
    models = [ESPM, {"name": "a, b", "free_run": {"test_mser_pct": 1.0}}]
    text = table_formats.to_csv(tables.free_run_table(models))
    comment, rest = text.split("\n", 1)
    assert comment.startswith("# Table 1.")
    rows = list(csv.DictReader(io.StringIO(rest)))
    assert rows[1]["model"] == "a, b"
    assert rows[1]["RMSE test, mV"] == ""
    assert float(rows[0]["RMSE test, mV"]) == 18.7


def test_render_skips_tables_nothing_is_known_for():
    text = tables.render([ESPM], "md")
    assert "Table 1." in text
    assert "Table 2." not in text


@pytest.mark.parametrize("format", ["md", "tex", "csv"])
def test_render_writes_every_table_in_every_format(format):
    text = tables.render(MODELS, format)
    for table in tables.all_tables(MODELS):
        assert table.caption[:20] in text
