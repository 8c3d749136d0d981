"""Judging an answer by hand-worked cases, rates with their intervals, and the limit on processor time."""

import signal
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.bench import blind
from aesi.bench.detectable import Detectability, _said_more, detectability
from aesi.bench.limit import NoAnswer, OutOfTime, answer_of, processor_limit
from aesi.bench.scoring import answer_words, calibration, judge, proportion, rate
from aesi.data.blind import BlindCase
from aesi.errors import SimulationError
from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement

CELLS = Path(__file__).resolve().parents[3] / "experiments" / "cells"


def answer(verdict, *effects, groups=()):
    return {"verdict": verdict, "effects": list(effects), "indistinguishable": [list(g) for g in groups]}


def test_the_exact_name_is_right_by_every_measure():
    given = judge("self_heating", (), (), answer("found", "self_heating"))
    assert given.exact
    assert given.grouped
    assert given.lenient
    assert (given.named, given.false_names) == (1.0, ())


def test_a_member_of_a_small_group_is_grouped_and_not_exact():
    said = answer(
        "found", "electrolyte_transport", groups=[("electrolyte_transport", "series_resistance", "a")]
    )
    given = judge("series_resistance", (), (), said)
    assert (given.exact, given.grouped, given.false_names) == (False, True, ())
    large = answer(
        "found", "electrolyte_transport", groups=[("electrolyte_transport", "series_resistance", "a", "b")]
    )
    given = judge("series_resistance", (), (), large)
    assert (given.grouped, given.false_names) == (False, ("electrolyte_transport",))


def test_listed_alternatives_count_for_the_lenient_judge_alone():
    given = judge(
        "series_resistance", ("electrolyte_transport",), (), answer("found", "electrolyte_transport")
    )
    assert (given.exact, given.grouped, given.lenient) == (False, False, True)
    assert given.false_names == ("electrolyte_transport",)


def test_twins_are_exact_where_the_group_says_so():
    pair = [("leakage_current", "current_sensor_offset")]
    assert judge("leakage_current", (), (), answer("found", "current_sensor_offset", groups=pair)).exact
    assert not judge("leakage_current", (), (), answer("found", "current_sensor_offset")).exact


@pytest.mark.parametrize("label", ["none", "unknown"])
def test_a_name_beside_unknown_is_a_false_name(label):
    given = judge(label, (), (), answer("unknown", "ocp_shape"))
    assert given.false_names == ("ocp_shape",)
    assert not given.exact
    silent = judge(label, (), (), answer("unknown"))
    assert silent.false_names == ()
    assert silent.exact == (label == "unknown")


def test_the_reduction_is_neutral_where_the_truth_is_a_porous_electrode():
    said = answer("found", "reaction_nonuniformity")
    assert judge("none", (), ("reaction_nonuniformity",), said).exact
    assert judge("none", (), (), said).false_names == ("reaction_nonuniformity",)
    both = answer("found", "ocv_hysteresis", "reaction_nonuniformity")
    assert judge("ocv_hysteresis", (), ("reaction_nonuniformity",), both).exact


def test_half_a_pair_is_half_named():
    given = judge("ocv_hysteresis+series_resistance", (), (), answer("found", "series_resistance"))
    assert (given.exact, given.grouped, given.named) == (False, False, 0.5)


def test_intervals_are_those_of_clopper_and_pearson():
    # Their closed form at 0 of n: 1 - (0.025)**(1/n).
    found = proportion(0, 100)
    assert found.interval_pct == (0.0, pytest.approx(100 * (1 - 0.025 ** (1 / 100)), abs=0.05))
    assert rate([], "exact").pct is None
    assert rate([{"exact": True}, {"exact": False}], "exact").named("exact")["exact_pct"] == 50.0


def test_confidence_is_held_against_right_answers_by_tenths():
    rows = [{"confidence": 0.95, "grouped": k < 9} for k in range(10)] + [
        {"confidence": 0.0, "grouped": False}
    ]
    low, high = calibration(rows)
    assert (low["shown_pct"], low["right_pct"], low["right_cases"]) == (0.0, 0.0, 1)
    assert (high["shown_pct"], high["right_pct"], high["right_cases"]) == (95.0, 90.0, 10)


def test_work_without_end_is_stopped():
    def stubborn():
        while True:
            try:
                sum(range(1000))
            except Exception:
                continue

    with pytest.raises(OutOfTime), processor_limit(0.2):
        stubborn()
    with processor_limit(0.2):
        time.sleep(0.5)  # waiting costs no processor time
    with processor_limit(None):
        pass


def test_an_alarm_while_a_limit_ended_left_its_timer_running(monkeypatch):
    set_timer = signal.setitimer

    def ringing_first(which, seconds, interval=0.0):
        if seconds == 0.0:
            signal.raise_signal(signal.SIGPROF)
        return set_timer(which, seconds, interval)

    monkeypatch.setattr(signal, "setitimer", ringing_first)
    before = signal.getsignal(signal.SIGPROF)
    with processor_limit(1000.0):
        pass
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGPROF) is before


def test_a_case_without_an_answer_says_why():
    def refused():
        raise SimulationError("no charge left")

    def endless():
        while True:
            sum(range(1000))

    assert answer_of(refused, None) == NoAnswer("error", "no charge left")
    assert answer_of(endless, 0.1) == NoAnswer("out of time", "more than 0.1 s of processor time")
    assert answer_of(lambda: 3, 10.0) == 3


def test_a_case_that_the_laboratory_cannot_make_is_counted_and_stops_nothing(monkeypatch):
    def refused(spec, cells):
        raise SimulationError("drive: stopped at its maximum voltage")

    monkeypatch.setattr(blind, "generate", refused)
    row = blind.judged(blind.chosen(cases=1)[0], str(CELLS))
    assert row["verdict"] == blind.NOT_MADE
    assert row["ours_s"] >= 0.0
    assert "maximum voltage" in row["error"]
    summary = blind.summary([row])
    assert (summary["cases"], summary["not_made"], summary["exact_cases"]) == (0, 1, 0)


def test_a_case_that_the_tracer_refused_ended_all(monkeypatch):
    """What its label says of unseen data was asked of the tracer again, which refused again."""
    short = Measurement(np.arange(20.0), np.zeros(20), np.full(20, 3.7), name="short")
    spec = blind.chosen(cases=1)[0]
    case = BlindCase(
        spec, (short,), "series_resistance", (), (), 0.5, CELLS / "lg_m50_chen2020.bpx.json", {"rms_mv": 1.0}
    )
    monkeypatch.setattr(blind, "generate", lambda spec, cells: case)
    row = blind.judged(spec, str(CELLS))
    assert (row["verdict"], row["exact"], row["seen_nats"]) == ("error", False, None)


def test_a_model_that_fails_on_the_held_out_part_ended_the_benchmark(monkeypatch):
    spec = blind.chosen(cases=1)[0]
    case = BlindCase(
        spec, (), "series_resistance", (), (), 0.5, CELLS / "lg_m50_chen2020.bpx.json", {"rms_mv": 1.0}
    )
    content = answer("found", "series_resistance") | {
        "confidence": 0.9, "margin": 3.0, "noise_floor_mv": 1.0, "contradicted": False, "candidates": [],
        "before": {"test": {"rmse_mv": 9.0}}, "recalibrated": {"test": {"rmse_mv": 5.0}}, "after": {"test": {}},
    }  # fmt: skip
    monkeypatch.setattr(blind, "generate", lambda *_: case)
    monkeypatch.setattr(blind, "_content", lambda _: content)
    monkeypatch.setattr(blind, "detectability", lambda *_: Detectability(9.0))
    row = blind.judged(spec, str(CELLS))
    assert (row["exact"], row["after_test_mv"], row["after_over_noise"], row["fitted"]) == (
        True,
        None,
        None,
        False,
    )
    last = blind.summary([row])
    assert (last["exact_pct"], last["after_over_noise_median"], last["fitted_called_found_cases"]) == (
        100.0,
        None,
        0,
    )
    assert "| found: series_resistance | yes | yes |  |  |" in blind.table([row])[-1]


def test_a_name_beside_unknown_is_another_answer_than_a_finding():
    assert answer_words({"verdict": "unknown", "effects": ["a", "b"]}) == "unknown: a+b"
    assert answer_words({"verdict": "found", "effects": ["a", "b"]}) == "a+b"
    assert answer_words({"verdict": "none", "effects": []}) == "none"
    assert answer_words({"verdict": "not run"}) == "not run"


def test_a_label_without_anything_to_compare_it_with_gained_infinitely_many_nats():
    told = SimpleNamespace(score=SimpleNamespace(total=-7.0))
    assert _said_more(lambda effects: told if effects else None, ("clock_skew",)) is None
    assert _said_more(lambda effects: None if effects else told, ("clock_skew",)) is None
    assert _said_more(lambda effects: told, ("clock_skew",)) == 0.0


def test_how_far_the_label_is_ahead_of_another_answer():
    """A contact resistance of 8 mohm, answered with an offset of the voltage, and with a film that grows."""
    cell = CELLS / "lg_m50_chen2020.bpx.json"
    rng, time_s = np.random.default_rng(0), np.arange(0.0, 2400.0, 2.0)
    current_a = np.repeat(rng.normal(3.0, 4.0, 40), 30).clip(-5.0, 12.0)
    current_a[:30] = 0.0
    added = CATALOGUE["series_resistance"].activate(resistance_ohm=8e-3)
    voltage_v = simulate(Cell.from_bpx(cell), time_s, current_a, 0.8, [added]).voltage_v
    record = Measurement(time_s, current_a, voltage_v + 1e-3 * rng.standard_normal(1200), name="drive")
    spec = SimpleNamespace(model="SPMe")
    case = BlindCase(spec, (record,), "series_resistance", (), (), 0.8, cell, {"rms_mv": 20.0})
    answers = (["voltage_sensor_offset"], ["film_growth"], [], case.effects)
    offset, film, none, same = (detectability(case, answer) for answer in answers)
    assert 100.0 < film.ahead_nats < offset.ahead_nats
    assert none.ahead_nats == none.seen_nats == offset.seen_nats > 100.0
    assert same.ahead_nats == 0.0
    assert detectability(case) == Detectability(offset.seen_nats)
    assert detectability(replace(case, label="none"), ["ocp_shape"]) == Detectability()


def test_misses_that_say_as_much_as_the_label_are_counted():
    kept = {
        "label": "clock_skew",
        "kind": "single",
        "processor_s": 1.0,
        "confidence": None,
        "verdict": "found",
        "contradicted": False,
        "false_name": True,
        "seen_nats": 9.0,
        "parameters_covered": [],
    }
    wrong = kept | {
        "exact": False,
        "grouped": False,
        "right": False,
        "fitted": False,
        "effects": ["ocp_shape"],
    }
    right = kept | {"exact": True, "grouped": True, "right": True, "fitted": False, "effects": ["clock_skew"]}
    right |= {"ahead_nats": None, "after_over_noise": 1.0, "size_error": None}
    rows = [
        right,
        wrong | {"ahead_nats": -0.4},
        wrong | {"ahead_nats": 40.0},
        wrong,
    ]  # the last by earlier code
    told = blind.summary([row | {"all_named": row["exact"]} for row in rows])
    assert (told["seen_exact_cases"], told["seen_missed_alike_cases"]) == (4, 2)
    assert told["seen_missed_alike_pct"] == 50.0


def test_cases_that_somebody_has_seen_are_left_out():
    names = [spec.name for spec in blind.chosen(cases=5)]
    assert [spec.name for spec in blind.chosen(cases=3, after=2)] == names[2:]


def test_a_case_without_an_answer_counted_as_one_without_a_false_name():
    row = {"label": "none", "kind": "none", "seen_nats": None, "processor_s": 1.0, "confidence": None}
    row |= {
        "exact": False,
        "grouped": False,
        "right": False,
        "fitted": False,
        "effects": [],
        "contradicted": False,
    }
    named = row | {"verdict": "found", "effects": ["ocp_shape"], "false_name": True}
    summary = blind.summary([named, row | {"verdict": "error", "false_name": False}])
    assert (summary["none_false_name_pct"], summary["none_false_name_cases"]) == (100.0, 1)
    assert (summary["none_lenient_cases"], summary["no_answer"]) == (2, 1)


def test_a_size_without_an_interval_was_left_out_of_how_many_intervals_hold_the_truth():
    size = {"value": 2.0, "low": None, "high": None}
    assert blind._parameters(*of_gain(2.0, size)) == ([0.0], [False])


def of_gain(true, size):
    """A case that lacks a gain of the current sensor, and the answer that names it."""
    label = "current_sensor_gain"
    case = BlindCase(None, (), label, (), (), 0.5, CELLS, {f"{label}.gain": true})
    found = {"effects": [label], "candidates": [{"effect": label, "parameters": {"gain": size}}]}
    return case, found


def test_a_gain_that_was_missed_entirely_counted_as_three_per_cent_off():
    size = {"value": 1.0, "low": 0.99, "high": 1.01}
    errors, covered = blind._parameters(*of_gain(1.03, size))
    assert errors == [pytest.approx(1.0)]
    assert covered == [False]
    assert blind._parameters(*of_gain(1.0, size)) == ([], [])  # no distance to be off by
