"""Intervals of parameters inside their bounds and on them, against densities worked out by quadrature."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from aesi.physics.effects import CATALOGUE
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import prepare_all
from aesi.tracer.decide.evidence import searched_answer
from aesi.tracer.decide.verdict import Thresholds, structured_v, tolerance_v, verdict_on
from aesi.tracer.likelihood.credible import interval_distances
from aesi.tracer.likelihood.fit import FittedHypothesis
from aesi.tracer.likelihood.gaussian import BlockSums, Posterior
from aesi.tracer.report.candidate_effects import (
    CandidateEffect,
    best_first,
    estimates,
    ranking,
    why_not_chosen,
)
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.forward import forward_search, refitted


def posterior(gram, moment, x):
    sums = BlockSums(np.ones(1), np.array([moment]), np.array([gram]), np.zeros(1), np.ones(1))
    return Posterior(sums, np.asarray(x, dtype=float), ())


GRAM = np.array([[4.0, 1.5], [1.5, 3.0]])


def test_inside_the_bounds_an_interval_is_that_of_a_normal():
    one = posterior(GRAM, [0.5, -0.2], [0.1, 0.2])
    below_above = interval_distances(one, np.tile([-9.0, 9.0], (2, 1)), 0.9)
    half = 1.6448536 * np.sqrt(np.diagonal(np.linalg.inv(GRAM + np.eye(2))))
    assert below_above == pytest.approx(np.column_stack([half, half]))


@pytest.mark.parametrize("pushed", [-1.0, -20.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_on_a_bound_an_interval_begins_there_and_holds_its_share_of_the_density(pushed, side):
    moment = np.array([side * pushed, 0.7])
    bounds = np.array([sorted([0.0, side * 5.0]), [-9.0, 9.0]])
    below_above = interval_distances(posterior(GRAM, moment, np.zeros(2)), bounds, 0.9)
    inward = below_above[0, 0 if side < 0 else 1]
    assert below_above[0].min() == 0.0

    d, other = np.linspace(0.0, 5.0, 20001), np.linspace(-6.0, 6.0, 601)[:, None]
    a = GRAM + np.eye(2)
    z = side * d[None, :]
    log_p = (
        moment[0] * z
        + moment[1] * other
        - 0.5 * (a[0, 0] * z**2 + 2 * a[0, 1] * z * other + a[1, 1] * other**2)
    )
    density = np.exp(log_p).sum(axis=0)
    share = np.cumsum(density) / density.sum()
    assert inward == pytest.approx(np.interp(0.9, share, d), rel=5e-3, abs=5e-4)


def test_a_parameter_that_ended_at_zero_has_an_interval_with_a_width_and_a_unit(cell, few, make):
    data = make((CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.006),))
    problem = InverseProblem(cell, prepare_all(cell, [data], 0.9, 0.3), few)
    path = forward_search(problem, 2, Archive(None, ""))
    rows = ranking(path, verdict_on(path, Thresholds()), lambda one: None)
    assert {row.effect for row in rows} == set(few)
    for row in rows:
        assert set(row.parameters) == set(few[row.effect].parameters)
        for name, told in row.parameters.items():
            assert told.low <= told.value <= told.high
            assert told.low < told.high, (row.effect, name)
            assert told.unit == few[row.effect].parameters[name].unit
    resistance = next(row for row in rows if row.effect == "series_resistance").parameters["resistance_ohm"]
    assert resistance.value == resistance.low == 0.0
    assert 1e-6 < resistance.high < 1e-2


def fitted(hypothesis, total, evidence):
    one = Mock(spec=FittedHypothesis)
    one.hypothesis, one.at_bounds = hypothesis, ()
    one.score = SimpleNamespace(total=total, evidence=evidence)
    return one


def test_what_said_more_of_unseen_data_and_was_not_taken_had_no_reason():
    chosen = fitted(("series_resistance",), 100.0, 90.0)
    path = SimpleNamespace(
        chosen=chosen, admission_nats=5.0, problem=SimpleNamespace(competing=lambda: range(20))
    )
    more = fitted(("series_resistance", "porosity"), 103.9, 91.0)
    assert why_not_chosen(path, more) == (
        "scores 3.9 nats higher on unseen data than the chosen hypothesis, but not by more than the 5.0 nats that "
        "chance may give one more effect"
    )
    other = fitted(("porosity", "electrolyte_transport"), 100.7, 88.0)
    assert why_not_chosen(path, other) == (
        "scores 0.7 nats higher on unseen data than the chosen hypothesis, but 5.0 nats lower in marginal likelihood, "
        "which has a penalty for each effect"
    )
    assert why_not_chosen(path, fitted(("porosity",), 99.0, 95.0)) == (
        "scores 1.0 nats lower on unseen data than the chosen hypothesis"
    )
    assert why_not_chosen(path, chosen) == "the choice of the search, with which too much is left unexplained"


def test_gains_are_of_the_search_not_of_the_trust_that_its_choice_was_refitted_at(cell, few, make):
    """The symptoms: effects that gain nothing stood in the ranking with a hundred nats; a finding stood 1,600 nats
    before hypotheses that score as high."""
    data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=3e-4),))
    problem = InverseProblem(cell, prepare_all(cell, [data], 0.9, 0.3), few)
    search = forward_search(problem, 2, Archive(None, ""))
    exact = refitted(replace(problem, trust="exact"), search, Archive(None, ""))
    assert exact.search is search
    of_search, of_exact = (
        {row.effect: row for row in ranking(one, verdict_on(search, Thresholds()), lambda _: None)}
        for one in (search, exact)
    )
    for name in of_search:
        assert of_exact[name].score == of_search[name].score
        assert of_exact[name].remark == of_search[name].remark
    assert next(iter(of_exact)) == search.chosen.hypothesis[0]  # first, also where a longer one gains more
    # Against a base that is held more tightly the same finding gains more.
    assert exact.gain(exact.chosen) > search.gain(search.chosen) + 1.0


def test_what_a_growth_left_on_a_bound_of_its_parent_has_an_interval_too(cell, make):
    names = ("series_resistance", "film_growth", "current_sensor_gain")
    truth = [CATALOGUE[name].activate() for name in names[:2]]
    tried = {name: CATALOGUE[name] for name in names}
    problem = InverseProblem(cell, prepare_all(cell, [make(truth)], 0.9, 0.3), tried)
    path = forward_search(problem, 2, Archive(None, ""))
    grown = [
        (one, owner) for step in path.steps for one in step.grown for owner, _ in one.held if owner in names
    ]
    assert grown
    for one, owner in grown:
        told = estimates(path, one, owner)
        assert set(told) == set(CATALOGUE[owner].parameters)
        assert all(t.low < t.high for t in told.values())


def test_of_effects_that_say_nothing_another_one_was_listed_first_in_each_version():
    rows = [
        CandidateEffect(effect, "physics", score, None, {}, (effect,), "")
        for effect, score in (("first", 0.0), ("second", 3e-14), ("third", 5.0), ("last", -0.1))
    ]
    assert [row.effect for row in best_first(rows)] == ["third", "first", "second", "last"]


def test_the_reason_has_the_errors_of_the_fit_that_the_verdict_is_about(cell, few, make):
    """The symptom: a finding refitted with the file as declared was told with the errors of the search before."""
    data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=3e-4),))
    problem = InverseProblem(cell, prepare_all(cell, [data], 0.9, 0.3), few)
    answer = searched_answer(problem, 2, Archive(None, ""), Thresholds(), lambda *_: None)
    path, verdict = answer.path, answer.verdict
    assert path.problem.trust == "exact" != answer.paths["tight"].problem.trust
    before_mv, left_mv = 1e3 * structured_v(path, path.base), 1e3 * verdict.structured_v
    assert f" {before_mv:.2f} mV beyond the noise without the finding" in verdict.reason
    assert verdict.reason.endswith(f" {left_mv:.2f} mV with it")
    assert verdict.tolerance_v == tolerance_v(path.problem, Thresholds())
