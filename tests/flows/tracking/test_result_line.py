"""What a tracked run says of itself in one sentence."""

from flows.tracking.experiment_log import candidates_line, result_line

ROW = {
    "name": "ESPM + AESI I",
    "free_run": {"test_mser_pct": 99.86, "test_rmse_mv": 1.014, "test_mser_recalibrated_pct": 2.16},
    "intervals": {"coverage_pct": 90.53, "nominal_pct": 90.0},
}


def test_a_run_says_what_is_the_recalibrations_and_what_the_corrections():
    assert result_line(ROW) == (
        "ESPM + AESI I: 99.9 % less squared error on test in free run (1.01 mV), 2.2 % less than recalibrated; "
        "90.5 % covered one step ahead at 90 %."
    )


def test_a_nominal_level_of_97_5_is_not_98():
    line = result_line(ROW | {"intervals": {"coverage_pct": 97.31, "nominal_pct": 97.5}})
    assert line.endswith("97.3 % covered one step ahead at 97.5 %.")


def test_what_was_not_judged_is_not_told():
    alone = {"test_mser_pct": 0.0, "test_rmse_mv": 27.16, "test_mser_recalibrated_pct": None}
    assert result_line({"name": "ESPM", "free_run": alone, "intervals": None}) == (
        "ESPM: 0.0 % less squared error on test in free run (27.16 mV)."
    )


def test_a_reduction_below_nought_is_more_and_not_a_negative_less():
    worse = {"test_mser_pct": -1.72, "test_rmse_mv": 8.54, "test_mser_recalibrated_pct": 26.47}
    assert result_line({"name": "ESPM + AESI II", "free_run": worse, "intervals": None}) == (
        "ESPM + AESI II: 1.7 % more squared error on test in free run (8.54 mV), 26.5 % less than recalibrated."
    )


def test_a_run_named_one_candidate_where_its_models_are_the_mean_of_several():
    assert candidates_line((12,)) == "Candidate 12 of the search"
    assert candidates_line((12, 3)) == "The mean of candidates 12 and 3 of the search"
    assert candidates_line((12, 3, 7)) == "The mean of candidates 12, 3 and 7 of the search"
