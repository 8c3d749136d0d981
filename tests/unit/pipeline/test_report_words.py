"""Findings in plain words: they say what the numbers say, also when that is unwelcome."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from aesi.physics.effects import CATALOGUE
from aesi.pipeline.report.words import discoveries, runs
from aesi.pipeline.report.words.sizes import finding_line
from aesi.pipeline.report.write import write_discovery_report, write_run_report


def test_a_gain_is_told_with_both_errors_and_the_regime(views):
    text = runs.run_finding(views.run_view(200))
    assert "is 4.1 mV with ESPM + AESI I and 13.2 mV with the ESPM alone" in text
    assert "in free run" in text


def test_a_harmful_correction_is_called_harmful(views):
    view = views.run_view(200)
    worse = {"name": view.chosen, "free_run": {"test_mser_pct": -42.0, "test_rmse_mv": 15.7}}
    text = runs.run_finding(replace(view, models=(view.models[0], worse)))
    assert "does not help" in text
    assert "13.2 mV to 15.7 mV" in text


def test_a_correction_that_does_nothing_was_told_with_three_errors_of_one_size(views):
    """'2.980 mV with DFN + AESI I, 2.980 mV with the DFN recalibrated alone and 3.0 mV with the DFN as declared. The
    correction removes 0.0 % ...'"""
    view = views.run_view(200)
    for corrected in ("ESPM", "ESPM recalibrated"):
        for after, reduction in ((2.9801, 0.01), (2.9803, -0.01)):
            row = {"name": corrected, "free_run": {"test_rmse_mv": 2.9802}}
            figures = {"test_rmse_mv": after, "test_mser_pct": reduction}
            models = ({**view.models[0], **row, "name": "ESPM"}, {**view.models[1], "free_run": figures}, row)
            assert runs.run_finding(replace(view, models=models, corrected=corrected)) == (
                "The data-driven correction makes no difference here: in free run on the test records the error is "
                f"2.98 mV with and without it. Use the {corrected} alone."
            )


def test_an_error_of_661_mv_did_not_say_that_the_model_ran_empty(views):
    view = views.run_view(200)
    physics, chosen, other = view.models
    physics, chosen = (
        row | {"free_run": row["free_run"] | {"test_until_ran_out_rmse_mv": left}}
        for row, left in ((physics, 240.14), (chosen, 234.84))
    )
    chosen |= {"test_records": {"a": {"ran_out_s": 7976.0}, "b": {}}}
    emptied = replace(view, models=(physics, chosen, other))
    assert runs.run_finding(emptied) == runs.run_finding(view).removesuffix(".") + (
        "; a simulation runs empty or full on a at 7976 s, from where on its error shows only that it ran out, not "
        f"how accurate it is: before that the error is 240.1 mV by ESPM and 234.8 mV by {view.chosen}."
    )
    assert runs.run_finding(
        replace(emptied, models=(view.models[0], chosen | {"free_run": view.models[1]["free_run"]}))
    ).endswith("not how accurate it is.")


def test_a_correction_was_judged_by_records_on_which_none_of_it_is_applied(views):
    """'The correction removes 0.2 % ...', of a drive whose rows all lay below the charge that it was trained on."""
    view = views.run_view(200)
    physics, chosen, other = view.models

    def finding(**kept):
        records = {name: {"kept_pct": share, "outside_pct": 100.0} for name, share in kept.items()}
        return runs.run_finding(replace(view, models=(physics, chosen | {"test_records": records}, other)))

    before = runs.run_finding(view).removesuffix(".")
    told = finding(empty=0.0, full=97.0)
    assert told.startswith(
        f"{before}; empty cannot show what the correction is worth, since none of it is applied"
    )
    assert finding(cold=0.4, empty=0.0).startswith(f"{before}; cold and empty cannot show")
    assert finding(near=20.0, full=None) == f"{before}."


def test_a_correction_that_is_applied_nowhere_was_laid_to_test_records_outside_its_range(views):
    """'... none of it is applied so far outside the range it was trained on: train on records that span ...', of one
    that had improved no left-out drive, also on rows that it was trained on."""
    view = views.run_view(200)
    physics, chosen, other = view.models
    known = {"kept_pct": 0.0, "amplitude": 0.0, "outside_pct": 0.0, "mean_degc": 24.0, "beyond_k": 0.0}
    cold = known | {"outside_pct": 83.0, "mean_degc": 12.0, "beyond_k": -11.6}
    row = chosen | {"test_records": {"known": known, "cold": cold}}
    nowhere = "the correction improved no left-out training drive, so that it is applied nowhere"
    before = runs.run_finding(view).removesuffix(".")
    assert runs.run_finding(replace(view, models=(physics, row, other))) == f"{before}; {nowhere}."
    alone = "this is the physics model and the error of the first measured voltage, which decays."
    assert runs.outside_finding(row) == (
        f"known: 0 % of the rows lie outside the range the correction was trained on; {nowhere}: {alone} "
        f"cold: 83 % of the rows lie outside the range the correction was trained on; {nowhere}: {alone}"
    )


def test_a_correction_that_does_not_beat_the_physics_it_was_learned_on_is_told_so(views):
    view = views.run_view(200)
    row = {"name": "ESPM recalibrated", "free_run": {"test_rmse_mv": 3.9}}
    learned = replace(view, models=(*view.models, row), corrected="ESPM recalibrated")
    assert runs.run_finding(learned) == (
        "On held-out test records, in free run, the RMSE is 3.9 mV with the ESPM recalibrated and 13.2 mV with the "
        f"ESPM as declared. The correction learnt on top of it does not help: {view.chosen} leaves 4.1 mV."
    )
    assert runs.refit_finding(learned) == ""
    better = replace(learned, models=(*view.models, {**row, "free_run": {"test_rmse_mv": 9.0}}))
    assert runs.refit_finding(better) == ""  # all of it is in the first sentence
    assert runs.refit_finding(view) == ""
    figures = view.models[1]["free_run"] | {"test_rmse_mv": 4.0, "test_mser_recalibrated_pct": -300.0}
    refit_does = replace(view, models=(view.models[0], {**view.models[1], "free_run": figures}))
    told_twice = runs.refit_finding(refit_does)  # that the refit errs less, and by how much
    assert told_twice == "Recalibrate the ESPM first (cell.start: recalibrated)."
    first = "and nothing learnt, the ESPM errs less there: 2.0 mV."
    assert runs.run_finding(refit_does).endswith(first)
    none = replace(refit_does, chosen="ESPM", models=({**view.models[0], "free_run": figures},))
    assert runs.run_finding(none).startswith("No correction of the voltage error was chosen")
    assert runs.run_finding(none).endswith(first)
    assert "errs less there" not in runs.run_finding(view)


def test_training_records_of_another_cell_than_the_validation_ones_are_told_of(views):
    view = views.run_view(200)
    declared, refitted = (
        {"name": name, "free_run": {"test_rmse_mv": 3.0, "valid_rmse_mv": error}}
        for name, error in (("ESPM", 1.4), ("ESPM recalibrated", 31.4))
    )
    foreign = replace(view, models=(declared, refitted), corrected="ESPM recalibrated")
    assert "the ESPM recalibrated errs by 31.4 mV and the ESPM by 1.4 mV" in runs.validation_finding(foreign)
    assert runs.validation_finding(view) == ""


def test_a_refit_that_errs_more_on_its_own_records_was_laid_to_the_validation_ones(views):
    """Of an LFP cell's drive, whose potential falls steeply near full: 66.8 mV as declared, 82.5 refitted."""
    rows = (
        {"name": name, "free_run": {"train_rmse_mv": train, "valid_rmse_mv": valid}}
        for name, train, valid in (("ESPM", 66.8, 136.0), ("ESPM recalibrated", 82.5, 143.5))
    )
    failed = replace(views.run_view(200), models=tuple(rows), corrected="ESPM recalibrated")
    assert runs.validation_finding(failed).startswith(
        "On the training records themselves the ESPM recalibrated errs by 82.5 mV and the ESPM by 66.8 mV"
    )


def test_a_refit_was_called_worse_beside_two_equal_figures(views):
    """4.2411 and 4.2413 mV were told as "errs by 4.241 mV and the ESPM by 4.241 mV"."""
    view = views.run_view(200)

    def of(declared, refitted):
        rows = (
            {"name": name, "free_run": {"train_rmse_mv": error, "valid_rmse_mv": error}}
            for name, error in (("ESPM", declared), ("ESPM recalibrated", refitted))
        )
        return replace(view, models=tuple(rows), corrected="ESPM recalibrated")

    assert runs.validation_finding(of(4.2411, 4.2413)) == ""
    assert "errs by 4.25 mV and the ESPM by 4.24 mV" in runs.validation_finding(of(4.2411, 4.2461))


@pytest.mark.parametrize(
    ("declared", "recalibrated", "corrected", "said"),
    [
        (5.0, None, 5.0004, "5.00 mV with and without it. Use the ESPM alone."),
        (5.0, None, 4.9996, "5.00 mV with and without it. Use the ESPM alone."),
        (9.0, 4.1001, 4.1004, "4.10 mV with and without it. Use the ESPM recalibrated alone."),
        (9.0, 4.1004, 4.1001, "4.10 mV with and without it. Use the ESPM recalibrated alone."),
    ],
)
def test_a_correction_was_said_to_help_or_to_harm_beside_two_equal_figures(
    views, declared, recalibrated, corrected, said
):
    view = views.run_view(200)
    errors = {"ESPM": declared, "ESPM recalibrated": recalibrated, "ESPM + AESI I": corrected}
    rows = tuple(
        {
            "name": name,
            "free_run": {"test_rmse_mv": error, "test_mser_pct": 100.0 * (1.0 - (error / declared) ** 2)},
        }
        for name, error in errors.items()
        if error is not None
    )
    basis = "ESPM" if recalibrated is None else "ESPM recalibrated"
    assert runs.run_finding(replace(view, models=rows, corrected=basis)).endswith(said)


def test_an_equal_correction_was_told_as_one_with_a_lower_error(views):
    view = views.run_view(200)
    rows = [
        {"name": name, "free_run": {"test_rmse_mv": error}}
        for name, error in (("ESPM + AESI I", 4.1004), ("ESPM + ridge", 4.1001))
    ]
    assert runs.others_finding(replace(view, models=(view.models[0], *rows))) == ""


def test_what_a_mere_refit_and_a_constant_leave_stands_beside_the_gain(views):
    view = views.run_view(200)
    assert runs.constant_finding(view) == ""
    figures = view.models[1]["free_run"] | {"test_rmse_mv": 4.0, "test_mser_recalibrated_pct": 36.0}
    constant = {"name": "ESPM + constant", "free_run": {"test_rmse_mv": 4.8}}
    beside = replace(view, models=(view.models[0], {**view.models[1], "free_run": figures}, constant))
    assert runs.refit_finding(beside).endswith(
        "errs by 5.0 mV there: the correction leaves 36.0 % less mean squared error than that."
    )
    assert "as a constant, gives an RMSE of 4.8 mV there" in runs.constant_finding(beside)
    assert runs.constant_finding(replace(beside, chosen="ESPM + constant")) == ""


def test_the_band_that_a_simulation_has_is_told_beside_that_of_an_observer(views):
    told = runs.interval_finding(views.run_view(200).models[1])
    assert told.endswith("The band in free run covers 91.0 % of them and is 24.0 mV wide.")


def test_a_band_of_92_mv_about_an_error_of_3_was_told_without_the_start_that_makes_it(views):
    row = views.run_view(200).models[1]
    told = runs.interval_finding(
        row | {"free_run_intervals": row["free_run_intervals"] | {"start_v": 0.0123}}
    )
    assert told.endswith(
        "24.0 mV wide. It includes the uncertainty of the initial state of charge, which is read from a voltage: one "
        "standard deviation is 12.3 mV. Give cell.soc0 if it is known."
    )


def test_errors_that_are_told_apart_late_have_more_digits(views):
    view = views.run_view(200)
    row = {"name": "ESPM recalibrated", "free_run": {"test_rmse_mv": 4.13}}
    figures = {"test_rmse_mv": 4.12, "test_mser_pct": 90.3}
    models = (view.models[0], {**view.models[1], "free_run": figures}, row)
    said = runs.run_finding(replace(view, models=models, corrected="ESPM recalibrated"))
    assert "4.12 mV with ESPM + AESI I, 4.13 mV with the ESPM recalibrated alone" in said
    assert "removes 0.5 % of the mean squared error" in said


def test_a_headline_called_records_held_out_that_the_declared_model_had_seen(views):
    seen = replace(views.run_view(200), seen=("SC03",))
    assert runs.run_finding(seen).startswith(
        "On test records, of which the declared model has seen SC03, in free run, the RMSE is 4.1 mV"
    )
    view = views.discovery_view(200)
    assert " RMSE on held-out data: " in discoveries.discovery_consequence(view)
    seen = replace(view, discovery=view.discovery | {"seen": ["SC03", "NEDC"]})
    words = " RMSE on test data, of which the declared model has seen SC03 and NEDC: "
    assert words in discoveries.discovery_consequence(seen)


def test_the_correction_was_credited_with_what_the_recalibration_does(views, tmp_path):
    """A pouch cell's drive: 18.9 mV as declared, 9.1 recalibrated, 6.5 corrected were told as 88.2 % less."""
    view = views.run_view(200)
    row = {"name": "ESPM recalibrated", "free_run": {"test_rmse_mv": 8.2}}
    learned = replace(view, models=(*view.models, row), corrected="ESPM recalibrated")
    assert runs.run_finding(learned) == (
        "On held-out test records, in free run, the RMSE is 4.1 mV with ESPM + AESI I, 8.2 mV with the ESPM "
        "recalibrated alone and 13.2 mV with the ESPM as declared. The correction removes 75.0 % of the mean squared "
        "error that the ESPM recalibrated leaves (90.3 % of that of the ESPM as declared)."
    )
    assert runs.own_share(learned) == pytest.approx(75.0)
    assert runs.own_share(replace(learned, chosen="ESPM recalibrated")) is None
    page = write_run_report(tmp_path / "r.html", learned).read_text()
    tiles = page[page.index('<div class="stats">') : page.index('<p class="lead">')]
    assert "75.0\xa0%" in tiles
    assert "than the ESPM recalibrated, test, free run" in tiles
    assert "90.3" not in tiles


def test_the_correction_was_credited_with_a_recalibration_that_is_no_row_of_the_table(views, tmp_path):
    """`models` without `ESPM recalibrated`: 99.8 % was told, of which the recalibration took 99.5."""
    view = views.run_view(200)
    figures = view.models[1]["free_run"] | {
        "test_mser_recalibrated_pct": 75.0,
        "train_rmse_mv": 4.0,
        "train_mser_pct": 75.0,  # 8.0 mV as declared
        "train_mser_recalibrated_pct": 84.0,  # 10.0 mV recalibrated
    }
    learned = replace(
        view, models=(view.models[0], {**view.models[1], "free_run": figures}), corrected="ESPM recalibrated"
    )
    assert runs.run_finding(learned) == (
        "On held-out test records, in free run, the RMSE is 4.1 mV with ESPM + AESI I, 8.2 mV with the ESPM "
        "recalibrated alone and 13.2 mV with the ESPM as declared. The correction removes 75.0 % of the mean squared "
        "error that the ESPM recalibrated leaves (90.3 % of that of the ESPM as declared)."
    )
    assert runs.own_share(learned) == pytest.approx(75.0)
    page = write_run_report(tmp_path / "r.html", learned).read_text()
    tiles = page[page.index('<div class="stats">') : page.index('<p class="lead">')]
    assert "8.2\xa0mV" in tiles
    assert "than the ESPM recalibrated, test, free run" in tiles
    alone = replace(learned, models=learned.models[1:])
    assert "the ESPM recalibrated errs by 10.0 mV and the ESPM by 8.0 mV" in runs.validation_finding(alone)


def test_other_corrections_that_do_better_are_told(views):
    view = views.run_view(200)
    names = {"ESPM + AESI I": 4.1, "ESPM + ridge": 3.9, "ESPM + constant": 3.2, "ESPM + boosting": 5.0}
    rows = [{"name": name, "free_run": {"test_rmse_mv": error}} for name, error in names.items()]
    physics = [{"name": "ESPM recalibrated", "free_run": {"test_rmse_mv": 1.0}}]
    assert runs.others_finding(replace(view, models=(view.models[0], *rows, *physics))) == (
        "2 of 3 other corrections learnt on the same records have a lower RMSE there; the lowest is that of ESPM + "
        "constant, 3.2 mV."
    )
    assert runs.others_finding(replace(view, models=(view.models[0], rows[0], rows[3]))) == ""
    assert runs.others_finding(replace(view, models=(view.models[0], rows[0], rows[1]))) == (
        "The other correction learnt on the same records, ESPM + ridge, has a lower RMSE there: 3.9 mV."
    )


def test_errors_a_hundredth_apart_were_told_as_a_tenth_apart_or_as_equal(views, tmp_path):
    view = views.run_view(200)
    errors = {"ESPM recalibrated": 1.099, "ESPM + AESI I": 1.056, "ESPM + ridge": 1.046}
    rows = [{"name": name, "terms": 1, "free_run": {"test_rmse_mv": mv}} for name, mv in errors.items()]
    rows[1]["free_run"] |= {"test_mser_pct": 99.0, "test_mser_recalibrated_pct": 7.7}
    close = replace(view, models=(view.models[0], *rows), corrected="ESPM recalibrated")
    assert runs.others_finding(close).endswith("ESPM + ridge, has a lower RMSE there: 1.05 mV.")
    page = write_run_report(tmp_path / "r.html", close).read_text(encoding="utf-8")
    tiles = page[page.index('<div class="stats">') : page.index('<p class="lead">')]
    assert "1.06\xa0mV" in tiles
    assert "1.10\xa0mV" in tiles


@pytest.mark.parametrize("figures", [{}, {"free_run": None}, {"free_run": {"test_rmse_mv": None}}])
def test_a_model_that_diverged_has_no_figures_to_tell(views, figures):
    view = views.run_view(200)
    broken = replace(
        view, models=(view.models[0], {"name": view.chosen, "intervals": {"coverage_pct": None}, **figures})
    )
    assert "could be evaluated" in runs.run_finding(broken)
    assert runs.interval_finding(broken.models[1]) == ""


def test_extrapolation_is_told_where_there_is_any():
    assert "12.5 % of the test samples" in runs.outside_finding({"free_run": {"outside_pct": 12.5}})
    assert runs.outside_finding({"free_run": {"outside_pct": 0.0}}) == ""


def test_a_correction_that_had_faded_to_nothing_was_told_as_held_at_the_edge():
    cold = {"outside_pct": 100.0, "kept_pct": 0.001, "mean_degc": -0.2, "beyond_k": -23.8}
    near = {"outside_pct": 41.0, "kept_pct": 93.4, "mean_degc": 24.8, "beyond_k": 0.5}
    same = {"outside_pct": 0.0, "kept_pct": 100.0, "mean_degc": 24.0, "beyond_k": 0.0}
    model = {"free_run": {"outside_pct": 47.0}, "test_records": {"cold": cold, "near": near, "same": same}}
    assert runs.outside_finding(model) == (
        "cold: 100 % of the rows lie outside the range the correction was trained on; at -0.2 degC, 24 K below what it "
        "was trained at, none of the correction is applied: this is the physics model and the error of the first "
        "measured voltage, which decays. near: 41 % of the rows lie outside the range the correction was trained on; "
        "the correction fades towards the physics, to 93 % of its size on average."
    )


def test_choosing_no_correction_is_said_plainly(views):
    text = runs.run_finding(replace(views.run_view(200), chosen="ESPM"))
    assert text.startswith("No correction")


def test_one_step_that_loses_to_persistence_is_said_to_lose():
    assert "no better than" in runs.persistence_finding(
        {"one_step": {"test_rmse_mv": 4.5, "persistence_rmse_mv": 4.03}}
    )
    assert ", better than" in runs.persistence_finding(
        {"one_step": {"test_rmse_mv": 3.5, "persistence_rmse_mv": 4.03}}
    )
    assert runs.persistence_finding({}) == ""


@pytest.mark.parametrize(
    ("verdict", "phrase"),
    [
        ("found", "lacks 1.25 mohm [1.10, 1.40] of self-heating"),
        ("none", "These data show nothing"),
        ("unknown", "no effect"),
    ],
)
def test_each_verdict_has_its_sentence(views, verdict, phrase):
    text = discoveries.discovery_finding(views.discovery_view(200, verdict=verdict))
    assert phrase in text
    assert ("97 % confidence" in text) == (verdict == "found")  # it belongs to a name


@pytest.mark.parametrize(
    ("effect", "kind", "phrase"),
    [
        (
            "ambient_temperature",
            "parameter",
            'Ambient temperature of "synthetic 5 Ah cell" is not as declared',
        ),
        ("clock_skew", "instrument", "The data, not the cell, show clock skew"),
    ],
)
def test_a_wrong_parameter_and_a_fault_are_not_called_missing_physics(views, effect, kind, phrase):
    view = views.discovery_view(200)
    rows = [{"effect": effect, "kind": kind, "score": 1.0}]
    found = replace(view, discovery={**view.discovery, "effects": [effect], "candidates": rows})
    assert discoveries.discovery_finding(found).startswith(phrase)


def test_a_finding_that_the_test_part_contradicts_says_so_at_once(views):
    view = views.discovery_view(200)
    text = discoveries.discovery_finding(replace(view, discovery={**view.discovery, "contradicted": True}))
    assert text.startswith(discoveries.discovery_finding(view))
    assert text.endswith(". The test part contradicts it.")


def test_a_written_model_that_does_worse_on_the_test_part_is_told_in_the_first_lines(views):
    view = views.discovery_view(200)
    worse = replace(view, discovery={**view.discovery, "after": {"test": {"rmse_mv": 9.3}}})
    advice = "o not use the written model: recalibration alone has a lower error on the test part"
    assert discoveries.discovery_finding(worse).endswith(f". D{advice}.")
    assert discoveries.short_finding(worse.discovery).endswith(f"; d{advice}")
    worst = replace(view, discovery={**view.discovery, "after": {"test": {"rmse_mv": 9.5}}})
    assert (
        "the declared model and recalibration alone have a lower error on"
        in discoveries.discovery_finding(worst)
    )
    hardly = replace(view, discovery={**view.discovery, "after": {"test": {"rmse_mv": 6.21}}})
    assert discoveries.discovery_finding(hardly).endswith(
        ". Recalibration alone has a lower error on the test part than the written model."
    )
    same = replace(view, discovery={**view.discovery, "after": {"test": {"rmse_mv": 6.2004}}})
    assert "lower error" not in discoveries.discovery_finding(same)


def test_a_written_model_that_leaves_more_of_what_it_was_fitted_to_than_a_refit_was_told_without_a_word(
    views,
):
    view = views.discovery_view(200, verdict="unknown")
    states = {name: {"fit": {"rmse_mv": left}} for name, left in (("recalibrated", 5.05), ("after", 28.46))}
    text = discoveries.short_finding(view.discovery | states)
    assert text.endswith("; recalibration alone has a lower error on the fitted part")
    as_good = states | {"after": {"fit": {"rmse_mv": 5.2}}}
    assert "the fitted part" not in discoveries.short_finding(view.discovery | as_good)


def test_a_contradicted_temperature_is_told_in_the_first_sentence(views):
    view = views.discovery_view(200, verdict="unknown")
    doubted = replace(view, discovery=view.discovery | {"other_temperature": ["a", "b"]})
    assert ". The voltage of a and b contradicts their temperature." in discoveries.discovery_finding(doubted)


def test_the_first_sentence_buried_the_verdict_under_figures_that_the_lines_below_repeat(views, tmp_path):
    """Of a cold drive it had seven lines on the page."""
    view = views.discovery_view(200, verdict="unknown")
    warning = (
        "the RMSE on the test part is 9.30 mV with the written model and 6.20 mV with the recalibrated model."
    )
    left = {"after": {"fit": {"rmse_mv": 9.0}, "test": {"rmse_mv": 9.3}}, "warnings": [warning]}
    named = {"effects": ["self_heating"], "written": ["self_heating"]}
    told = replace(view, discovery=view.discovery | left | named)
    assert discoveries.discovery_finding(told) == (
        "1.25 mohm [1.10, 1.40] of self-heating explains a part of the error. A systematic error remains that no "
        "effect of the catalogue explains. Do not use the written model: recalibration alone has a lower error on the "
        "test part."
    )
    text = write_discovery_report(tmp_path / "r.html", told).read_text().replace("\xa0", " ")
    header = text[text.index("<h1>") : text.index("</header>")]
    assert header.count("he RMSE on the test part is") == 1
    assert "9.30" not in header[: header.index("</h1>")]
    second = header[header.index("</h1>") : header.index('role="alert"')]
    assert "model/ holds the model with the finding added. RMSE on held-out data: 9.4 mV as" in second


def test_a_declared_model_that_is_written_unchanged_was_shown_as_a_third_one(views, tmp_path):
    """A drive that no fit carried over from: `as written` hid `as declared` in each plot, and its figures were the
    same; that no other model was written was nowhere told."""
    view = views.discovery_view(200, verdict="unknown")
    content = view.discovery | {"after": view.discovery["before"], "written": []}
    assert list(discoveries.states_of(content)) == ["before", "recalibrated"]
    assert discoveries.written_finding(content).startswith("model/ holds the declared model, unchanged: no")
    refused = content | {"not_adopted": "the recalibrated model: these data do not test it"}
    assert discoveries.written_finding(refused) == (
        "model/ holds the declared model, unchanged. Not adopted: the recalibrated model: these data do not test "
        "it."
    )
    assert discoveries.short_finding(content).endswith(
        "; recalibration alone has a lower error on the test part than the declared model, which model/ holds"
    )
    text = write_discovery_report(tmp_path / "r.html", replace(view, discovery=content)).read_text()
    assert "as written" not in text
    assert "model/ holds the declared model, unchanged" in text[: text.index("</header>")]
    assert discoveries.written_finding(view.discovery) == "model/ holds the recalibrated model."
    other = view.discovery | {"after": {"test": {"rmse_mv": 1.0}}, "effects": [], "written": ["porosity"]}
    assert discoveries.written_finding(other) == (
        "model/ holds a recalibrated model with porosity, in place of an error that no hypothesis explains."
    )


def test_a_declared_cell_was_called_recalibrated_where_only_the_start_of_a_record_was_fitted(views):
    """With one effect tried alone: the model erred by 3 mV as recalibrated, and by 8 mV when it was simulated."""
    view = views.discovery_view(200, verdict="unknown")
    start = {"effect": "soc0", "parameter": "drive", "value": 0.8413, "deviations": -1.6}
    content = view.discovery | {"own_parameters": {"recalibrated": [start], "after": [start]}}
    text = discoveries.written_finding(content)
    assert text.startswith("model/ holds the declared cell: recalibration fitted nothing of it")
    assert "(initial state of charge: drive at 0.841)" in text
    of_the_cell = {"effect": "porosity", "parameter": "factor", "value": 1.1, "deviations": 0.1}
    both = content | {"own_parameters": {"recalibrated": [start, of_the_cell]}}
    assert discoveries.written_finding(both) == "model/ holds the recalibrated model."


def test_a_model_that_is_written_beside_a_refit_and_does_better_was_not_shown(views):
    """A refit of other parameters than the recalibrated model's is a model of its own, without an effect in it."""
    view = views.discovery_view(200, verdict="unknown")
    content = view.discovery | {"written": [], "after": {"fit": {"rmse_mv": 4.0}, "test": {"rmse_mv": 5.0}}}
    assert discoveries.states_of(content)["after"] == "as written"
    assert "6.2 mV recalibrated, 5.0 mV as written;" in discoveries.discovery_consequence(
        replace(view, discovery=content)
    )


def test_the_cell_is_named_once(views):
    view = views.discovery_view(200)
    found = replace(view, discovery={**view.discovery, "effects": ["self_heating", "ambient_temperature"]})
    text = discoveries.discovery_finding(found)
    assert "self-heating; its ambient temperature (1.25 mohm [1.10, 1.40]) is not as declared" in text
    assert text.count(view.cell) == 1


def test_a_partial_find_says_that_something_is_left(views):
    view = views.discovery_view(200, verdict="unknown")
    partial = replace(view, discovery={**view.discovery, "effects": ["self_heating"]})
    text = discoveries.discovery_finding(partial)
    assert "self-heating" in text
    assert "A systematic error remains" in text


def test_the_refit_stands_apart_from_the_finding(views):
    text = discoveries.discovery_consequence(views.discovery_view(200))
    assert [text.index(v) for v in ("9.4 mV", "6.2 mV", "1.1 mV")] == sorted(
        text.index(v) for v in ("9.4 mV", "6.2 mV", "1.1 mV")
    )


def test_a_refit_that_does_as_well_is_said_to(views):
    view = views.discovery_view(200)
    assert "refit" not in discoveries.discovery_consequence(view).split(";")[1]
    same = {**view.discovery, "recalibrated": {"test": {"rmse_mv": 1.1}}}
    text = discoveries.discovery_finding(replace(view, discovery=same))
    assert text.startswith("One of two explanations: the declared model")
    assert "recalibrating them gives as low an error on the held-out data" in text


@pytest.mark.parametrize(
    ("verdict", "phrases"),
    [
        (
            "none",
            (
                "the voltage error beyond sensor noise is 0.30 mV in cross-validation",
                "account for up to 0.80 mV",
                "no reason to add",
            ),
        ),
        ("found", ("with the finding added, the voltage", "is 0.30 mV", "up to 0.80 mV count as explained")),
        (
            "unknown",
            ("is 4.00 mV in", "only up to 0.80 mV would", "A measured cell nearly always ends as unknown"),
        ),
    ],
)
def test_the_verdict_says_what_it_rests_on(views, verdict, phrases):
    text = discoveries.reason_finding(views.discovery_view(200, verdict=verdict).discovery)
    assert [phrase for phrase in phrases if phrase not in text] == []


def test_the_error_of_what_the_search_chose_was_taken_for_that_of_the_written_model(views):
    """1.04 mV beside the 18.05 mV of the model in model/, which holds none of what the search chose."""
    view = views.discovery_view(200, verdict="unknown")
    assert discoveries.reason_finding(view.discovery, {"series_resistance": "contacts"}).startswith(
        "Why: with the hypothesis that the search chose (contacts), the voltage error beyond sensor noise is 4.00 mV in"
    )


@pytest.mark.parametrize("changed", [{"chosen": []}, {"good": ["reference"]}])
def test_the_error_of_the_bare_model_was_told_as_that_of_a_hypothesis(views, changed):
    """Beside good records, a verdict without a name is on the model without an effect."""
    unknown = views.discovery_view(200, verdict="unknown").discovery | changed
    assert discoveries.reason_finding(unknown).startswith(
        "Why: with no effect added, the voltage error beyond sensor noise is 4.00 mV in"
    )


def test_a_rest_that_several_hypotheses_explain_names_the_best(views):
    discovery = {**views.discovery_view(200, verdict="unknown").discovery, "structured_mv": 0.3}
    assert discoveries.reason_finding(discovery) == "Why: as the tracer words it."


def test_a_rest_that_follows_nothing_is_not_called_little(views):
    unknown = views.discovery_view(200, verdict="unknown").discovery
    assert "functions of the model's variables predict little of it" in discoveries.rest_finding(unknown)
    assert "is not known" in discoveries.rest_finding({**unknown, "explainable_mv": None})
    assert "much of it is systematic, and missing physics may explain it" in discoveries.rest_finding(
        {**unknown, "explainable_mv": 4.5}
    )
    assert "little systematic error remains" in discoveries.rest_finding(views.discovery_view(200).discovery)
    easier = {**unknown, "explainable_mv": 7.2, "after": {"fit": {"rmse_mv": 9.4}, "test": {"rmse_mv": 4.8}}}
    assert "7.2 mV of its 9.4 mV on the fitted data" in discoveries.rest_finding(easier)


@pytest.mark.parametrize("left_mv", [1.0, 9.0])
@pytest.mark.parametrize("share", [0.0, 0.2, 0.9])
@pytest.mark.parametrize("good", [(), ("reference",)])
@pytest.mark.parametrize("adopted", [True, False])
@pytest.mark.parametrize(
    ("verdict", "effects", "structured_mv"),
    [
        ("none", [], 0.3),
        ("found", ["self_heating"], 0.3),
        ("unknown", [], 0.3),
        ("unknown", [], 4.0),
        ("unknown", ["self_heating"], 0.3),
        ("unknown", ["self_heating"], 4.0),
    ],
)
def test_the_remaining_error_was_told_against_the_verdict(
    views, verdict, effects, structured_mv, adopted, good, share, left_mv
):
    """Of one fit that left 0.14 mV the verdict said that no effect explains the error; of a declared model that leaves
    9 mV beside a noise of 1 it was said that little systematic error remains; of data that lack nothing, that missing
    physics may explain the rest."""
    view = views.discovery_view(200, verdict=verdict)
    content = view.discovery | {
        "effects": effects,
        "structured_mv": structured_mv,
        "good": good,
        "not_adopted": None if adopted else "it does not run over the declared range",
        "after": {"fit": {"rmse_mv": left_mv}, "test": {"rmse_mv": left_mv}},
        "explainable_mv": share * left_mv,
        "noise_floor_mv": 1.0,
        "tolerance_mv": 0.8,
    }
    first = discoveries.discovery_finding(replace(view, discovery=content))
    rest = discoveries.rest_finding(content)
    explained = structured_mv <= content["tolerance_mv"]
    assert ("no effect of the catalogue explains" in first) == (verdict == "unknown" and not explained)
    assert ("missing physics may explain" in rest) == (verdict == "unknown" and share > 0.5)
    assert ("points to a fault of an instrument" in rest) == (
        verdict == "unknown" and share < 0.5 and left_mv > 1.0
    )
    little = "little systematic error" in rest
    assert not (little and left_mv > 1.0)
    assert not (little and share > 0.5)
    assert ("model/ does not hold" in rest) == (verdict != "unknown" and not adopted)
    assert ("that the verdict rests on" in rest) == (verdict != "unknown" and adopted and left_mv > 1.0)


def test_good_records_of_another_age_were_no_reason(views):
    unknown = views.discovery_view(200, verdict="unknown").discovery
    aged = {**unknown, "good": ["reference"], "of_another_age": ["lithium_inventory_loss"]}
    assert discoveries.reason_finding(aged) == "Why: as the tracer words it."


def test_a_lower_error_was_told_beside_two_equal_figures(views, tmp_path):
    view = views.discovery_view(200)
    close = view.discovery | {"after": {"fit": {"rmse_mv": 1.0}, "test": {"rmse_mv": 6.21}}}
    told = replace(view, discovery=close)
    assert "Recalibration alone has a lower error" in discoveries.discovery_finding(told)
    assert "6.20 mV recalibrated, 6.21 mV with the finding added" in discoveries.discovery_consequence(told)
    page = write_discovery_report(tmp_path / "r.html", told).read_text()
    tiles = page[page.index('<div class="stats">') :][:2000]
    assert "6.20" in tiles
    assert "6.21" in tiles


def test_no_verdict_is_called_certain():
    found = {"verdict": "found", "effects": ["self_heating"]}
    assert discoveries.name_confidence({**found, "confidence": 1.0}) == " (over 99 % confidence in this name)"
    assert discoveries.name_confidence({**found, "confidence": 0.97}) == " (97 % confidence in this name)"
    assert discoveries.name_confidence({"verdict": "unknown", "effects": [], "confidence": 0.99}) == ""


def test_the_confidence_in_a_group_of_look_alikes_was_told_of_one_of_its_names():
    row = {"kind": "instrument", "parameters": {}, "hypothesis": []}
    found = {
        "verdict": "found",
        "effects": ["current_sensor_offset"],
        "confidence": 0.86,
        "indistinguishable": [["current_sensor_offset", "leakage_current"]],
        "candidates": [{**row, "effect": name} for name in ("current_sensor_offset", "leakage_current")],
    }
    said = "86 % confidence that it is one of: current sensor offset, leakage current"
    assert discoveries.name_confidence(found) == f" ({said})"
    assert said in discoveries.short_finding(found, with_confidence=True)
    assert "(not told apart: current sensor offset or leakage current)" in discoveries.short_finding(found)
    two = {**found, "effects": ["current_sensor_offset", "series_resistance"]}
    assert discoveries.name_confidence(two).endswith(
        "in these names, or in look-alikes of them: current sensor offset or leakage current)"
    )


def test_the_range_that_the_data_cover_is_told(views):
    view = views.discovery_view(3601)
    t = view.traces[0]
    soc, current_a = np.linspace(0.9, 0.2, 3601), np.linspace(-5.0, 12.5, 3601)
    text = discoveries.span_finding(replace(view, traces=(replace(t, soc=soc, current_a=current_a),)))
    assert "span 1.0 h, 20 to 90 % state of charge" in text
    assert "of -5 to 12.5 A" in text
    idle = replace(view, traces=(replace(t, current_a=np.linspace(-0.00163, 12.6, 3601)),))
    assert "currents of 0 to 12.6 A" in discoveries.span_finding(idle)
    still = replace(view, traces=(replace(t, soc=soc[:1], current_a=np.full(1, 5.0)),))
    assert " h, 90 % state of charge and currents of 5 A (" in discoveries.span_finding(still)
    unknown = replace(t, soc=np.full(3601, np.nan), current_a=current_a)
    with warnings.catch_warnings(action="error"):
        text = discoveries.span_finding(replace(view, traces=(unknown, replace(t, soc=soc))))
    assert "20 to 90 % state of charge" in text
    assert discoveries.span_finding(replace(view, traces=())) == ""


def test_look_alikes_stand_next_to_the_verdict(views):
    view = views.discovery_view(200)
    text = discoveries.look_alike_finding(view.discovery, view.titles)
    assert text == "These data cannot tell apart self-heating and ambient temperature."
    assert discoveries.look_alike_finding(views.discovery_view(200, verdict="none").discovery) == ""


def test_what_fits_as_well_only_beside_another_was_told_as_if_it_did_alone(views, tmp_path):
    view = views.discovery_view(200)
    rows = [
        row | {"hypothesis": ["ambient_temperature", "porosity"]}
        if row["effect"] == "ambient_temperature"
        else row | {"hypothesis": ["self_heating", row["effect"]]}
        for row in view.discovery["candidates"]
    ]
    told = replace(view, discovery=view.discovery | {"candidates": rows})
    assert discoveries.look_alike_finding(told.discovery, view.titles) == (
        "These data cannot tell apart self-heating and ambient temperature (beside porosity)."
    )
    page = write_discovery_report(tmp_path / "r.html", told).read_text()
    assert "<li>self-heating, ambient temperature (beside porosity)</li>" in page


def test_lists_read_as_english():
    assert discoveries.listed(["a"]) == "a"
    assert discoveries.listed(["a", "b"]) == "a and b"
    assert discoveries.listed(["a", "b", "c"]) == "a, b and c"


@pytest.mark.parametrize(
    ("effects", "written", "after"),
    [
        (["a"], ["a"], "with the finding added"),
        (["a"], ["b"], "as written"),
        (["a"], [], "as written"),
        ([], ["b"], "as written"),
        ([], [], None),
    ],
)
def test_an_error_is_said_to_be_with_the_finding_only_where_that_is_what_is_written(effects, written, after):
    of_its_own = effects or written
    errors = {
        "before": {"fit": 8.0},
        "recalibrated": {"fit": 5.0},
        "after": {"fit": 1.0 if of_its_own else 5.0},
    }
    shown = discoveries.states_of(errors | {"effects": effects, "written": written})
    assert shown.get("after") == after
    assert list(shown)[:2] == ["before", "recalibrated"]


@pytest.mark.parametrize(
    ("tried", "phrase"),
    [
        ([], "has a systematic error; no effect was tried."),
        (["clock_skew"], "that clock skew, which alone was tried, does not explain."),
        (["clock_skew", "film_growth"], "that none of the 2 effects that were tried explains."),
        (list(CATALOGUE), "that no effect of the catalogue explains."),
    ],
)
def test_an_unknown_says_which_effects_were_tried(views, tried, phrase):
    view = views.discovery_view(200, verdict="unknown")
    view = replace(view, discovery={**view.discovery, "tried": tried})
    assert discoveries.discovery_finding(view).endswith(phrase)
    rest = phrase.removeprefix("has a systematic error").removesuffix(".")
    assert finding_line(view.discovery).endswith(rest.strip())
    told = (discoveries.reason_finding(view.discovery), discoveries.next_finding(view.discovery))
    assert ("A measured cell nearly always" in told[0], "Next: add data of another kind" in told[1]) == (
        bool(tried),
        bool(tried),
    )


def test_who_gave_a_known_good_record_was_told_to_give_one(views):
    alone = views.discovery_view(200, verdict="unknown").discovery
    beside = alone | {"good": ["drive"]}
    for said in (discoveries.reason_finding, discoveries.next_finding):
        assert "known-good record" in said(alone)
        assert "known-good record" not in said(beside)
    assert discoveries.next_finding(beside).endswith("start it from the declared file.")


def test_an_error_as_of_another_cells_file_was_told_as_that_of_a_measured_cell_alone(views):
    near = views.discovery_view(200, verdict="unknown").discovery | {"structured_mv": 49.9}
    assert "check that the cell file is of this cell" not in discoveries.next_finding(near)
    far = discoveries.next_finding(near | {"structured_mv": 91.75})
    assert (
        "Next: check that the cell file is of this cell (those of others are off by 50 mV and more), " in far
    )


def test_an_unknown_says_what_came_nearest_and_what_to_do_next(views):
    view = views.discovery_view(200, verdict="unknown")
    said = discoveries.next_finding(view.discovery, view.titles)
    assert said.startswith("Best candidate, not named: self-heating (ends on a bound: ")
    assert said.endswith(
        "aesi run learns a correction of the remaining error; start it from the declared file."
    )
    named = discoveries.next_finding(view.discovery | {"effects": ["self_heating"]})
    assert named.startswith("Next: ")
    assert named.endswith("aesi run learns a correction of the remaining error.")
    assert discoveries.next_finding(views.discovery_view(200).discovery) == ""
    assert "models of measured cells have errors of some 9 mV" in discoveries.reason_finding(view.discovery)


def test_the_closest_rival_of_a_finding_is_named_with_its_distance(views):
    view = views.discovery_view(200)
    assert discoveries.closest_finding(view) == (
        "No other hypothesis explains these data as well: ambient temperature comes closest, 7.0 nats behind."
    )
    beside = views.discovery_row("series_resistance", "physics", 413.0, 1.1)
    beside |= {"hypothesis": ["self_heating", "series_resistance"]}
    rows = [row for row in view.discovery["candidates"] if row["effect"] == "self_heating"]
    alone = replace(view, discovery=view.discovery | {"candidates": [*rows, beside]})
    assert discoveries.closest_finding(alone) == "No other hypothesis explains these data as well."


def test_a_noise_of_half_a_tenth_of_a_millivolt_was_shown_as_twice_as_much(views, tmp_path):
    view = views.discovery_view(400)
    quiet = replace(view, discovery=view.discovery | {"noise_floor_mv": 0.05})
    assert discoveries.discovery_consequence(quiet).endswith("the noise floor is 0.05 mV.")
    write_discovery_report(tmp_path / "report.html", quiet)
    page = (tmp_path / "report.html").read_text()
    assert page.count("0.05") >= 3  # the tile and two sentences
