"""The rules of the verdict, on searches whose outcomes are set by hand."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.tracer.fit import fit_hypothesis
from aesi.tracer.problem import Problem
from aesi.tracer.records import prepare_all
from aesi.tracer.search import Admission, Archive, Breadth, Scored, Search, only_by_freedom, select
from aesi.tracer.verdict import CONFIDENT, judge

NOISE_V = 1e-3
ADMITTED = Admission(True, "", 100.0, 1e-2, 1e-3, 10.0)


@pytest.fixture
def ranked(cell, few, make):
    """ranked({hypothesis: (nats over the base, rms in V)}, base rms): a search with these outcomes."""
    problem = Problem(cell, prepare_all(cell, [make(n=900)], 0.9, 0.0), few)
    empty = fit_hypothesis(problem, ())
    unit = empty.residual_v / np.sqrt(np.mean(empty.residual_v**2))

    def build(outcomes, base_rms_v=10e-3):
        search = Search(problem, np.random.default_rng(0), Archive(None, ""))
        for hypothesis, (nats, rms_v) in {(): (0.0, base_rms_v), **outcomes}.items():
            evidence = empty.log_evidence + nats
            fit = replace(empty, hypothesis=hypothesis, residual_v=rms_v * unit, log_evidence=evidence)
            left = float(np.sqrt(max(rms_v**2 - NOISE_V**2, 0.0)))
            search.scored[frozenset(hypothesis)] = Scored(fit, rms_v, left)
            for name in hypothesis:
                rest = frozenset(hypothesis) - {name}
                search.admissions[rest, frozenset(hypothesis)] = ADMITTED
        return search

    return build


def verdict_of(search, *hypothesis):
    steps = [search.scored[frozenset()], search.scored[frozenset(hypothesis)]]
    return judge(search, steps, NOISE_V, 0.0)


def test_an_effect_far_ahead_of_its_rivals_is_found(ranked):
    verdict = verdict_of(
        ranked({("series_resistance",): (500.0, 1.05e-3), ("ocv_hysteresis",): (300.0, 5e-3)}),
        "series_resistance",
    )
    assert verdict.word == "found"
    assert verdict.effects == ("series_resistance",)
    assert verdict.confidence > 0.95


def test_an_effect_behind_another_explanation_is_not_called_found(ranked):
    pair = ("ocv_hysteresis", "current_sensor_gain")
    verdict = verdict_of(
        ranked({("series_resistance",): (300.0, 1.05e-3), pair: (340.0, 1.02e-3)}), "series_resistance"
    )
    assert verdict.word == "unknown"
    assert verdict.confidence > 1.0 - CONFIDENT
    assert "50 % are asked for" in verdict.reason
    assert "series_resistance" in verdict.reason


def test_a_rival_that_is_a_look_alike_costs_no_confidence(ranked):
    verdict = verdict_of(
        ranked({("series_resistance",): (300.0, 1.05e-3), ("ocv_hysteresis",): (304.0, 1.06e-3)}),
        "series_resistance",
    )
    assert verdict.word == "found"
    assert verdict.groups == (("series_resistance", "ocv_hysteresis"),)
    assert verdict.confidence > CONFIDENT


def test_what_leaves_far_more_is_no_look_alike_whatever_its_evidence(ranked):
    verdict = verdict_of(
        ranked({("series_resistance",): (300.0, 1.2e-3), ("ocv_hysteresis",): (298.0, 4e-3)}),
        "series_resistance",
    )
    assert verdict.groups == ()


PARTIAL = {("series_resistance",): (300.0, 4e-3)}


def test_beside_unknown_a_clear_effect_is_named(ranked):
    verdict = verdict_of(ranked(PARTIAL | {("ocv_hysteresis",): (100.0, 8e-3)}), "series_resistance")
    assert verdict.word == "unknown"
    assert verdict.effects == ("series_resistance",)
    assert verdict.groups == ()


def test_beside_unknown_an_effect_is_named_with_its_look_alike(ranked):
    verdict = verdict_of(ranked(PARTIAL | {("ocv_hysteresis",): (296.0, 4.1e-3)}), "series_resistance")
    assert verdict.effects == ("series_resistance",)
    assert verdict.groups == (("series_resistance", "ocv_hysteresis"),)


@pytest.mark.parametrize(
    ("rival", "outcome"),
    [
        (("ocv_hysteresis",), (295.0, 8.5e-3)),
        (("ocv_hysteresis", "current_sensor_gain"), (200.0, 3.9e-3)),
        (("ocv_hysteresis", "current_sensor_gain"), (305.0, 4.2e-3)),
    ],
    ids=["close in evidence", "a pair better on unseen data", "a pair ahead in evidence"],
)
def test_beside_unknown_an_effect_with_a_rival_is_not_named(ranked, rival, outcome):
    verdict = verdict_of(ranked(PARTIAL | {rival: outcome}), "series_resistance")
    assert verdict.word == "unknown"
    assert verdict.effects == verdict.groups == ()


def test_beside_unknown_an_effect_on_its_bound_is_not_named(ranked):
    search = ranked(PARTIAL)
    key = frozenset(("series_resistance",))
    free = verdict_of(search, *key)
    knobs = tuple(search.problem.knobs(("series_resistance",)))
    x = np.array([0.0 if k.sd is not None else k.working_bounds[1] for k in knobs])
    search.scored[key] = replace(search.scored[key], fit=replace(search.scored[key].fit, knobs=knobs, x=x))
    assert free.effects == ("series_resistance",)
    assert verdict_of(search, *key).effects == ()


def test_beside_unknown_only_the_clear_one_of_two_is_named(ranked):
    alone, both = ("series_resistance",), ("series_resistance", "ocv_hysteresis")
    other = ("series_resistance", "current_sensor_gain")
    outcomes = {alone: (300.0, 5e-3), both: (400.0, 3.0e-3), other: (395.0, 4.5e-3)}
    assert verdict_of(ranked(outcomes), *both).effects == alone
    del outcomes[other]
    assert verdict_of(ranked(outcomes), *both).effects == both


def test_evidence_counts_among_those_that_explain_unseen_data_about_as_well(ranked):
    fast, whole = ("series_resistance",), ("solid_diffusivity",)
    search = ranked({fast: (500.0, 7e-3), whole: (300.0, 4e-3)})
    ahead, better = (search.scored[frozenset(h)] for h in (fast, whole))
    assert search.far_behind(ahead, better)
    assert not search.far_behind(better, ahead)
    verdict = verdict_of(ranked({fast: (500.0, 7e-3), whole: (300.0, 1.05e-3)}), *whole)
    assert (verdict.word, verdict.effects) == ("found", whole)


def test_a_flexible_curve_needs_more_than_solvers_differ_by(ranked):
    search = ranked({("series_resistance",): (300.0, 1.3e-3), ("ocp_shape",): (400.0, 1.1e-3)})
    plain, curve = (search.scored[frozenset((h,))] for h in ("series_resistance", "ocp_shape"))
    curve = replace(curve, fit=replace(curve.fit, knobs=(*curve.fit.knobs, *curve.fit.knobs[:3])))
    assert not only_by_freedom(plain, curve, search.material_v)
    search.polarisation_v = 60e-3
    assert search.material_v == pytest.approx(np.hypot(0.35 * search.noise_v, 0.012 * 60e-3))
    assert only_by_freedom(plain, curve, search.material_v)


@pytest.mark.parametrize(
    ("breadth", "effects"),
    [
        (Breadth(), {"current_sensor_gain", "ocv_hysteresis"}),
        (Breadth(least_share=0.5), {"current_sensor_gain"}),
        (Breadth(most_left_v=9e-3), {"current_sensor_gain"}),
    ],
    ids=["no limit", "too little explained", "too much left"],
)
def test_half_of_a_pair_may_leave_more_by_itself_than_nothing_does(ranked, monkeypatch, breadth, effects):
    """The symptom: a gain that the evidence favours left more in all than no effect, and no pair was tried."""
    gain, hysteresis = ("current_sensor_gain",), ("ocv_hysteresis",)
    search = ranked(
        {gain: (900.0, 11e-3), hysteresis: (30.0, 9.5e-3), (*gain, *hysteresis): (1000.0, NOISE_V)}
    )

    def grow(parent, limit=None):
        one_more = len(parent.hypothesis) + 1
        scored = [s for s in search.scored.values() if len(s.hypothesis) == one_more]
        return [s for s in scored if set(parent.hypothesis) < set(s.hypothesis)]

    monkeypatch.setattr(search, "grow", grow)
    steps = select(search, 3, lambda base, one: 2 if one.structured_v < 0.5e-3 else 0, breadth)
    assert set(steps[-1].hypothesis) == effects
