"""What a calibration says of parameters that its records do not tell."""

import pytest

from aesi.pipeline.report.words.calibrations import _with_interval, open_line, pulse_sentence, to_text


def content(weights: list[dict[str, float]], total: int) -> dict[str, object]:
    return {
        "parameters": {f"p{i}": {} for i in range(total)},
        "undetermined": [{"weights": w, "narrowed": 0.9, "sentence": ""} for w in weights],
    }


def test_many_open_combinations_are_one_sentence_that_names_the_heaviest():
    many = [{"p0": 0.9, "p1": 0.4}, {"p2": -0.8, "p0": 0.6}, {"p3": 1.0}, {"p4": 1.0}, {"p0": 1.0}]
    assert open_line(content(many, 9)) == (
        "these records determine 4 of 9 combinations of parameters better than their priors do; "
        "the others (p0, p2, p3 and others) stay near the priors"
    )


def test_nothing_open_is_no_sentence():
    assert open_line(content([], 3)) == ""


def test_a_capacity_that_was_not_fitted_has_no_interval_without_a_width():
    said = _with_interval({"value": 14.2999, "low": None, "high": None})
    assert said == "14.3 | not fitted; the notes say what it rests on"


def test_an_interval_is_told_with_the_digits_that_show_its_width():
    assert _with_interval({"value": 14.2999, "low": 14.297, "high": 14.3028}) == "14.2999 | 14.297 to 14.3028"
    assert _with_interval({"value": 1.061, "low": 1.044, "high": 1.077}) == "1.061 | 1.044 to 1.077"


def test_pulses_that_are_not_read_are_told_with_their_records():
    content = {"pulse_resistance": {"seconds": 10.0, "model_error_pct": None, "left_out": {"a": 2, "b": 1}}}
    assert pulse_sentence(content).endswith(
        "no record has such a pulse. Left out of them: 2 in a and 1 in b, since rows more than 2 s apart leave open "
        "when the pulse begins, so that its resistance would be read too low; log a row a second there."
    )


@pytest.mark.parametrize(
    ("model_error_pct", "off"),
    [
        (2.34, "and what the file is off by at such pulses in them, 2.3 % RMS."),
        (None, "without what the model itself is off by, since no record has such a pulse."),
    ],
)
def test_a_report_says_at_what_a_record_was_taken_and_what_the_records_tell_of_each_parameter(
    model_error_pct, off
):
    file = {"before_rmse_mv": 2.0, "after_rmse_mv": 1.0, "as_simulated_rmse_mv": 1.5, "capacity_share": 1.0}
    whole = {"ran_out_s": None, "until_ran_out_rmse_mv": None}
    ran_out = {"ran_out_s": 740.0, "until_ran_out_rmse_mv": 1.25}
    told = {"low": 0.9, "high": 1.1, "unit": "factor", "prior_from": "convention", "value": 1.0}
    text = to_text(
        {
            "cell": "mine",
            "model": "espm",
            "declared_degc": 25.0,
            "files": [
                file | whole | {"name": "a", "temperature_degc": None},
                file | ran_out | {"name": "b", "temperature_degc": 9.5},
            ],
            "health": {},
            "pulse_resistance": {
                "seconds": 10.0,
                "soc": [0.8, 0.2],
                "rows": [
                    {
                        "temperature_degc": -10.0,
                        "fitted": False,
                        "mohm": [120.4, None],
                        "low_mohm": [75.96, None],
                        "high_mohm": [199.2, None],
                    }
                ],
                "model_error_pct": model_error_pct,
            },
            "size_assumed": "no record tells it.",
            "parameters": {
                "contact": told | {"of_prior": 1.001},
                "negative.rate": told | {"of_prior": 0.034},
            },
            "impedance": [],
            "undetermined": [],
            "at_bounds": [],
            "warnings": ["a starts elsewhere."],
            "notes": [],
        }
    )
    assert "**Warning:** a starts elsewhere." in text
    assert "| degC | at 80 % charge | at 20 % charge |" in text
    assert "| -10 * | 120 [76, 199] | cannot give the pulse |" in text
    assert f"95 % intervals: what these records leave open, {off}" in text
    assert "\n\\* no record within 8 K: " in text
    assert "\nNo record tells it.\n" in text
    assert "| a | 25.0, as declared | 2.00 |" in text
    assert "| b | 9.5 | 2.00 | 1.00 | 1.50 (1.25 mV until it runs out at 740 s) | 1.000 |" in text
    assert "| negative.rate | 1 | 0.9 to 1.1 | factor | 3 | convention |" in text
    assert "| contact | 1 | 0.9 to 1.1 | factor | 100 | convention |" in text
    assert text.index("| negative.rate |") < text.index("| contact |")  # the best known first, as on the page
