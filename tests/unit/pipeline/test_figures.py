"""The figures of the paper."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.numerics.blocks import coverage, moving_block_weights
from aesi.pipeline.report import style
from aesi.pipeline.report.figures import before_and_after_maps, paper_figures
from aesi.pipeline.report.plots import ensemble, hypotheses, maps, records, timeline
from aesi.pipeline.report.views import BootstrapView
from aesi.pipeline.report.write import discovery_figures
from aesi.sparse.search.rows import spans_of


def test_every_figure_of_the_paper_is_there(views):
    names = set(paper_figures(views.run_view(600)))
    assert {
        "bootstrap_coverage",
        "profile_current",
        "profile_voltage",
        "error_map_espm_train",
        "error_map_espm_valid",
        "error_map_espm_test",
        "error_map_before",
        "error_map_after",
        "voltage_train",
        "voltage_valid",
        "voltage_test",
        "violin",
        "ranking",
        "intervals_1",
        "intervals_1_zoom",
        "intervals_2",
        "intervals_2_zoom",
    } == names


def test_figures_without_data_are_left_out(views):
    view = replace(views.run_view(600), bootstrap=None, terms=(), traces=views.run_view(600).of("train"))
    assert set(paper_figures(view)) == {
        "profile_current",
        "profile_voltage",
        "error_map_espm_train",
        "voltage_train",
    }


def test_compared_maps_share_their_colours(views):
    figures = before_and_after_maps(views.run_view(600))
    limits = {fig.data[0].zmax for fig in figures.values()}
    assert len(limits) == 1
    before, after = (np.nanmean(fig.data[0].z) for fig in figures.values())
    assert after < before


def test_the_error_is_measured_minus_model_in_millivolts(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    fig = records.voltage_figure([trace], "ESPM + AESI I", "ESPM")
    error = next(t for t in fig.data if t.name == "ESPM" and t.yaxis == "y2")
    np.testing.assert_allclose(error.y, 1e3 * (trace.measured_v - trace.physics_v))


def test_the_measurement_is_inside_the_drawn_band_exactly_where_it_is_inside_the_band(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    prediction = trace.predictions["ESPM + AESI I"]
    fig = records.voltage_figure([trace], "ESPM + AESI I", "ESPM")
    low, high = (t.y for t in fig.data if t.name.startswith("band"))
    drawn = (low <= 0) & (high >= 0)
    inside = (prediction.free_run_lower_v <= trace.measured_v) & (
        trace.measured_v <= prediction.free_run_upper_v
    )
    np.testing.assert_array_equal(drawn, inside)


def test_samples_outside_the_trained_range_are_marked_and_no_others(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    outside = np.arange(500) >= 450
    of_chosen = replace(trace.predictions["ESPM + AESI I"], outside=outside)
    of_another = replace(trace.predictions["ESPM + AESI II"], outside=~outside)
    both = {"ESPM + AESI I": of_chosen, "ESPM + AESI II": of_another}
    fig = records.voltage_figure([replace(trace, predictions=both)], "ESPM + AESI I", "ESPM")
    marked = next(t for t in fig.data if t.name.startswith("outside"))
    np.testing.assert_array_equal(np.isfinite(marked.y), outside)
    inside = records.voltage_figure([trace], "ESPM + AESI I", "ESPM")
    assert not any(t.name.startswith("outside") for t in inside.data)


def test_a_caption_speaks_of_a_band_only_where_one_is_drawn(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    prediction = replace(trace.predictions["ESPM + AESI I"], free_run_lower_v=None)
    without = replace(trace, predictions={"ESPM + AESI I": prediction})
    captions = [
        records.voltage_figure([t], "ESPM + AESI I", "ESPM").layout.meta["caption"] for t in (trace, without)
    ]
    assert ["band" in caption for caption in captions] == [True, False]


def test_records_stand_end_to_end_without_overlap(views):
    rng = np.random.default_rng(0)
    placed, unit = timeline.end_to_end([views.trace(n, "test", 100, rng) for n in "ab"])
    assert unit == "s"
    assert placed[0].x[-1] <= placed[1].x[0]


def test_the_name_of_a_record_too_short_for_it_is_left_out(views):
    long, short = (
        views.discovery_trace(name, "test", n, np.random.default_rng(0))
        for name, n in (("a", 900), ("a_long_name", 30))
    )
    fig = records.residual_figure((long, short, long), {"before": "as declared"})
    assert [note.text for note in fig.layout.annotations] == ["a", "a"]


def test_losses_within_one_decade_still_have_ticks():
    near = [{"oob": x, "valid": 2 * x, "terms": 5} for x in (0.16, 0.25)]
    far = [*near, {"oob": 16.0, "valid": 40.0, "terms": 9}]
    assert ensemble.front_figure(near).layout.xaxis.dtick is None  # powers of ten alone would show none
    assert ensemble.front_figure(far).layout.xaxis.dtick == 1


def test_long_tests_are_shown_in_hours(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    placed, unit = timeline.end_to_end([replace(trace, time_s=trace.time_s * 1000)])
    assert unit == "h"
    assert placed[0].x[-1] == pytest.approx(49_900 / 3600)


def test_the_zoom_finds_the_lively_stretch(views):
    trace = views.trace("t", "test", 6000, np.random.default_rng(0))
    calm = trace.current_a.copy()
    calm[:4000] = 0.0
    fig = records.interval_figure([replace(trace, current_a=calm)], "ESPM + AESI I", zoom_s=60.0)
    error = next(t for t in fig.data if t.name == "measured error")
    late = 1e3 * (trace.measured_v - trace.physics_v)[4000:]
    assert np.isin(error.y[-100:], late).all()


def test_expected_coverage_of_the_bootstrap_matches_a_simulation():
    rng = np.random.default_rng(0)
    n, block, resamples = 5000, 100, 400
    shares = []
    for _ in range(resamples):
        hit = np.zeros(n, dtype=bool)
        for start in rng.integers(0, n - block + 1, -(-n // block)):
            hit[start : start + block] = True
        shares.append(hit.mean())
    expected = ensemble.expected_unique_fraction([n], block)
    assert abs(np.mean(shares) - expected) < 4 * np.std(shares) / np.sqrt(resamples)


def test_the_bootstrap_of_single_samples_is_the_classic_one():
    assert ensemble.expected_unique_fraction([10_000], 1) == pytest.approx(1 - np.exp(-1), abs=1e-4)


@pytest.mark.parametrize(("lengths", "block"), [((1099,), 109), ((900,), 500), ((1000, 1000), 130)])
def test_the_last_block_of_the_bootstrap_was_expected_to_be_whole(lengths, block):
    """Of 1,099 rows in blocks of 109 the last block has 9: 66.5 % were expected, and 63.5 are drawn."""
    drawn = coverage(moving_block_weights(spans_of(lengths), block, 2000, np.random.default_rng(0)))
    sure = 4.0 * np.std(drawn) / np.sqrt(len(drawn))
    assert ensemble.expected_unique_fraction(lengths, block) == pytest.approx(np.mean(drawn), abs=sure)


@pytest.mark.parametrize(
    ("lengths", "block"), [((300,) * 6, 60), ((300, 50, 900), 60), ((3600, 1200, 700), 500)]
)
def test_the_bootstrap_of_several_records_was_expected_to_be_that_of_one(lengths, block):
    drawn = coverage(moving_block_weights(spans_of(lengths), block, 400, np.random.default_rng(0)))
    fig = ensemble.bootstrap_figure(BootstrapView(lengths, block, drawn))
    expected = float(fig.layout.meta["caption"].rpartition("(dashed) ")[2].removesuffix(" %."))
    assert expected == pytest.approx(100.0 * drawn.mean(), abs=1.0)


def test_the_caption_of_the_bootstrap_states_mean_and_expectation():
    fig = ensemble.bootstrap_figure(BootstrapView((1000,), 10, np.array([0.6, 0.7])))
    assert "mean (full line) 65.0 %" in fig.layout.meta["caption"]


def test_the_caption_of_the_terms_says_what_their_names_are_made_of():
    rows = [{"term": "T1(I)*T1(c_eL)", "importance": 2.0}, {"term": "sin(I_60s)", "importance": 1.0}]
    caption = ensemble.importance_figure(rows).layout.meta["caption"]
    assert "Chebyshev" in caption
    assert "I, the current; c_eL, electrolyte concentration at the positive collector" in caption
    assert "I_60s, the current smoothed over 60 s" in caption
    assert "c_sp" not in caption


def test_hypotheses_are_ranked_and_the_chosen_marked(views):
    discovery = views.discovery_view(200).discovery
    fig = hypotheses.ranking_figure(discovery["candidates"], {}, ["self_heating"])
    order = list(fig.layout.yaxis.categoryarray)
    assert order[-1] == "★ self heating"
    assert order.index("clock skew") < order.index("★ self heating")
    assert "no effect: own parameters alone" in order


def test_a_hypothesis_that_shares_its_score_names_the_others():
    rows = [
        {
            "effect": "series_resistance",
            "kind": "physics",
            "score": 3000.0,
            "hypothesis": ["series_resistance"],
        },
        {
            "effect": "porosity",
            "kind": "parameter",
            "score": 3001.0,
            "hypothesis": ["series_resistance", "porosity"],
        },
    ]
    fig = hypotheses.ranking_figure(rows, {}, ["series_resistance"])
    assert list(fig.layout.yaxis.categoryarray) == [
        "no effect: own parameters alone",
        "★ series resistance",
        "porosity, beside series resistance",
    ]


def test_hypotheses_stand_as_far_as_they_are_behind_the_best():
    rows = [
        {"effect": "a", "kind": "physics", "score": 3000.0},
        {"effect": "b", "kind": "instrument", "score": 2999.0},
        {"effect": "c", "kind": "physics", "score": -2.0},
    ]
    fig = hypotheses.ranking_figure(rows, {}, ["a"])
    behind = {
        y: (x, told[0])
        for dots in fig.data
        for y, x, told in zip(dots.y, dots.x, dots.customdata, strict=True)
    }
    assert behind == {
        "★ a": (0.1, 0.0),
        "b": (1.0, 1.0),
        "c": (3002.0, 3002.0),
        "no effect: own parameters alone": (3000.0, 3000.0),
    }
    worse = hypotheses.ranking_figure([rows[2]], {}, [])
    assert worse.layout.yaxis.categoryarray[-1] == "no effect: own parameters alone"


def test_a_ranking_without_a_star_was_said_to_have_one():
    rows = [{"effect": "a", "kind": "physics", "score": 3.0}]
    captions = [hypotheses.ranking_figure(rows, {}, chosen).layout.meta["caption"] for chosen in (["a"], [])]
    assert [("(star)" in caption, "ahead of what was chosen" in caption) for caption in captions] == [
        (True, False),
        (False, True),
    ]


def test_a_kind_nobody_foresaw_is_still_shown():
    fig = hypotheses.ranking_figure([{"effect": "x", "kind": "numerical", "score": 1.0}], {}, [])
    assert [dots.name for dots in fig.data] == ["numerical", "no effect"]


def test_a_hypothesis_without_a_figure_on_the_test_part_has_none_in_the_ranking():
    rows = [
        {"effect": "a", "kind": "physics", "score": 3.0, "test_rmse_mv": 1.25},
        {"effect": "b", "kind": "physics", "score": 2.0, "test_rmse_mv": None},
    ]
    dots = hypotheses.ranking_figure(rows, {}, ["a"]).data[0]
    assert [told for _, told in dots.customdata] == [", test RMSE 1.25 mV", ""]


def test_violin_medians_are_those_of_the_squared_residual():
    residual = np.random.default_rng(0).standard_normal(20_001) * 1e-3
    fig = maps.violin_figure({"m": residual}, {"m": "#0072B2"})
    assert 10 ** np.median(fig.data[0].x) == pytest.approx(np.median((1e3 * residual) ** 2), rel=1e-6)


def test_the_models_that_err_least_stand_side_by_side_and_the_rest_apart(views):
    """Of twelve models names were clipped, colours came again, and the order said nothing."""
    view = views.run_view(300)
    given = view.traces[-1].predictions["ESPM + AESI I"]
    shares = {"ESPM + AESI I": 0.75, "ESPM + a": 0.9, "ESPM + b": 0.8, "ESPM + c": 0.2, "ESPM + d": 0.5}

    def with_all(trace):
        made = {
            name: replace(given, free_run_v=trace.physics_v + share * (trace.measured_v - trace.physics_v))
            for name, share in shares.items()
        }
        return replace(trace, predictions=made)

    figures = paper_figures(replace(view, traces=tuple(map(with_all, view.traces))))
    names = [violin.name for violin in figures["violin"].data]  # from the lowest up
    assert names == ["ESPM", "ESPM + d", "ESPM + AESI I", "ESPM + b", "ESPM + a"]
    assert [violin.name for violin in figures["violin_rest"].data] == ["ESPM + c"]
    colours = [violin.line.color for violin in figures["violin"].data]
    assert colours == [style.PHYSICS, style.GREY, style.CHOSEN, style.GREY, style.GREY]


def test_a_wide_band_flattened_the_errors(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    given = trace.predictions["ESPM + AESI I"]
    for half_v, cut in ((0.2, True), (1e-3, False)):
        wide = replace(
            given, free_run_lower_v=given.free_run_v - half_v, free_run_upper_v=given.free_run_v + half_v
        )
        fig = records.voltage_figure(
            [replace(trace, predictions={"ESPM + AESI I": wide})], "ESPM + AESI I", "ESPM"
        )
        assert (fig.layout.yaxis2.range is not None) == cut
        assert ("the band goes on beyond it" in fig.layout.meta["caption"]) == cut
        if cut:
            error = 1e3 * (trace.measured_v - trace.physics_v)
            assert fig.layout.yaxis2.range[0] <= error.min() < error.max() <= fig.layout.yaxis2.range[1]
            assert fig.layout.yaxis2.range[1] < 50.0


def test_the_refit_was_left_out_of_the_residuals_beside_a_finding(views):
    figures = discovery_figures(views.discovery_view(400))
    for name in ("against_current", "against_soc"):
        assert {"as declared", "recalibrated", "with the finding added"} <= {
            t.name for t in figures[name].data
        }
    assert {"map_before", "map_recalibrated", "map_after"} <= set(figures)
    without = discovery_figures(views.discovery_view(400, verdict="none"))
    assert {name for name in without if name.startswith("map_")} == {"map_before", "map_recalibrated"}


def test_the_resistance_within_seconds_is_drawn_measured_and_of_each_state(views):
    view = views.discovery_view(400)
    row = {"measured_mohm": 6.0, "before_mohm": 9.0, "recalibrated_mohm": None, "after_mohm": 6.1}
    told = {"by_soc": [{"soc": 0.25, **row}, {"soc": 0.75, **row}], "by_current": []}
    figures = discovery_figures(replace(view, discovery={**view.discovery, "step_resistance": told}))
    assert "step_by_current" not in figures
    drawn = {t.name: t for t in figures["step_by_soc"].data}
    assert list(drawn) == ["measured", "as declared", "recalibrated", "with the finding added"]
    assert list(drawn["measured"].x) == [25.0, 75.0]
    assert list(drawn["as declared"].y) == [9.0, 9.0]
    assert not {"step_by_soc", "step_by_current"} & set(discovery_figures(view))


def test_what_was_measured_is_a_wider_black_line(views):
    view = views.discovery_view(200)
    fig = records.residual_figure(view.of("test"), {"before": "as declared", "after": "as written"})
    widths = {t.name: (t.line.color, t.line.width) for t in fig.data}
    assert widths["measured"][0] == "#000000"
    assert widths["measured"][1] > widths["as written"][1]


def test_a_current_that_a_row_holds_since_the_row_before_was_drawn_in_straight_lines(views):
    trace = views.discovery_trace("a", "test", 300, np.random.default_rng(0))
    held = [trace, replace(trace, hold="backward")]
    fig = records.residual_figure(held, {"before": "as declared"})
    shapes = [(t.name, t.line.shape) for t in fig.data if t.line.shape != "linear"]
    assert shapes == [("current", "vh")]  # vertical at the row before, then along up to its own


def test_the_profile_of_a_run_drew_a_held_current_in_straight_lines(views):
    figures = paper_figures(replace(views.run_view(200), hold="backward"))
    current, voltage = (figures[f"profile_{quantity}"].data for quantity in ("current", "voltage"))
    assert {t.line.shape for t in current} == {"vh"}
    assert {t.line.shape for t in voltage} == {"linear"}


def test_a_prediction_outside_its_own_interval_is_explained(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    fig = records.interval_figure([trace], "ESPM + AESI I")
    assert "the middle of the interval is the better estimate" in fig.layout.meta["caption"]
    colours = {
        name: {t.line.color for t in fig.data if t.name == name} for name in ("interval", "predicted error")
    }
    assert not colours["interval"] & colours["predicted error"]


def test_a_model_that_runs_empty_does_not_flatten_the_measured_voltage(views):
    trace = views.discovery_trace("a", "test", 300, np.random.default_rng(0))
    empty = trace.before_v.copy()
    empty[200:] = -5.0
    fig = records.residual_figure((replace(trace, before_v=empty),), {"before": "as declared"})
    low, high = fig.layout.yaxis.range
    span = float(np.ptp(trace.measured_v))
    assert low == pytest.approx(float(trace.measured_v.min()) - 0.1 * span)
    assert high == pytest.approx(float(trace.measured_v.max()) + 0.1 * span)


def test_a_part_of_a_record_is_placed_in_it(views):
    trace = views.trace("t", "test", 500, np.random.default_rng(0))
    for first, title in (
        (0.0, "time, s"),
        (1260.0, "time after 1260 s of the record, s"),
        (629.999, "time after 630 s of the record, s"),
    ):
        placed, unit = timeline.end_to_end([replace(trace, time_s=trace.time_s - trace.time_s[0] + first)])
        assert timeline.time_title(placed, unit) == title


@pytest.mark.parametrize(("largest_mv", "told"), [(5.0, False), (200.0, True)])
def test_bins_beyond_the_colours_of_a_map_were_drawn_as_if_they_ended_there(largest_mv, told):
    current_a, soc = (a.ravel() for a in np.meshgrid(np.linspace(-5.0, 5.0, 240), np.linspace(0.1, 0.9, 240)))
    error_v = np.full(current_a.size, 5e-3)
    error_v[(current_a > 4.5) & (soc > 0.87)] = largest_mv / 1e3
    figure = maps.map_figure(
        current_a, soc, error_v, "errors", True, maps.shared_limit(current_a, soc, [error_v], True)
    )
    assert ("lie beyond the colours" in figure.layout.meta["caption"]) == told
