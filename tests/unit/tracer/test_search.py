"""Where a search looks for the next effect, and which of several that say as much it takes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.errors import CellError
from aesi.numerics.metrics import rms
from aesi.physics import simulate
from aesi.physics.effect import Effect
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.free_parameter import STATE_OF_CHARGE, coordinates_of, effect_parameters
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.likelihood.fit import HypothesisFitter
from aesi.tracer.likelihood.growth import EffectGrowth, Parent
from aesi.tracer.likelihood.model_error import PRIORS, Size
from aesi.tracer.search import growths, reach
from aesi.tracer.search.archive import Archive
from aesi.tracer.search.forward import FINALISTS, _ForwardSearch, admissible, forward_search, needed
from aesi.tracer.search.growths import PROMISING, growths_on, most_promising, promising_first
from aesi.tracer.search.hypothesis_fits import MOVED_SDS, base_of, fitted_hypothesis, linearised_as_declared
from aesi.tracer.search.plausible import ALIKE_NATS, most_plausible
from aesi.tracer.search.reach import REACH_FACTOR, least_error_v

from .conftest import NOISE_V, steps

ADDED_OHM = 2e-3
ALLOWED_V = 0.6e-3
SIZE = PRIORS["tight"].nearest(Size(2e-4))


@pytest.fixture(scope="module")
def resisting(cell, few):
    """The problem of a cell with a resistance that it does not declare, and what may be tried."""

    def problem(make):
        data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=ADDED_OHM),))
        names = (*few, "electrolyte_transport", "charge_transfer_kinetics")
        return inverse_problem(cell, [data], 0.9, effects={name: CATALOGUE[name] for name in names})

    return problem


def own_coordinates(fit):
    return [x for f, x in zip(fit.free, fit.point.x, strict=True) if f.own and f.owner != STATE_OF_CHARGE]


def test_an_effect_grows_about_the_declared_values_as_it_fits_though_the_rest_had_made_up_for_it(
    resisting, make
):
    problem = resisting(make)
    blocks, archive = blocks_of(problem), Archive(None, "")
    base = base_of(problem, blocks, archive)
    assert max(np.abs(own_coordinates(base))) > MOVED_SDS  # a resistance that is not there, as slow kinetics
    there = linearised_as_declared(problem, blocks, base)
    assert own_coordinates(there) == [0.0] * len(own_coordinates(base))
    whole = fitted_hypothesis(problem, blocks, ("series_resistance",), None, archive)
    gains = [
        EffectGrowth(Parent(problem, blocks, one), "series_resistance", SIZE).grow().score.total
        for one in (base, there)
    ]
    off = [abs(gain - whole.score.total) for gain in gains]
    assert off[1] < min(off[0], 3.0)


def test_a_hypothesis_that_moved_nothing_far_is_grown_where_it_is(cell, few, make):
    problem = inverse_problem(cell, [make()], 0.9, effects=few)
    blocks = blocks_of(problem)
    assert linearised_as_declared(problem, blocks, base_of(problem, blocks, Archive(None, ""))) is None


def test_why_an_effect_could_not_be_tried_was_asked_of_the_first_record_alone(cell, make):
    """Beside a record that could be simulated the reason was none: "no start of the fit could be simulated"."""
    reason = "a record this long is refused."

    def shorter(record):
        if record.time_s[-1] > 2500.0:
            raise CellError(reason)
        return record

    refusing = Effect("refusing", "instrument", "Refuses.", on_record=shorter)
    records = [
        replace(make(n=n), name=name) for name, n in (("short", 2400), ("long", 2700), ("longer", 2800))
    ]
    problem = inverse_problem(cell, records, 0.9, holdout=0.0, effects={"refusing": refusing})
    told = f"on long and longer: {reason}"
    assert problem.failure_reason(("refusing",)) == told
    found = forward_search(problem, 1, Archive(None, ""))
    assert found.notes == (f"refusing: not tried; {told}",)
    alone = inverse_problem(cell, records[1:], 0.9, holdout=0.0, effects={"refusing": refusing})
    assert alone.failure_reason(("refusing",)) == reason  # of no record more than of another
    given = replace(problem, effects={}, fixed=(refusing.activate(),))
    assert given.failure_reason(()) == told
    good = inverse_problem(
        cell, records[:1], 0.9, holdout=0.0, effects={"refusing": refusing}, good=records[1:]
    )
    assert good.failure_reason(("refusing",)) == "no start of the fit could be simulated."


def said(total, evidence, names=1):
    return SimpleNamespace(score=SimpleNamespace(total=total, evidence=evidence), hypothesis=("x",) * names)


def test_of_effects_that_say_as_much_the_one_of_the_most_usual_values_is_taken():
    best, alike, worse = (
        said(10.0, 1.0),
        said(10.0 - 0.9 * ALIKE_NATS, 5.0),
        said(10.0 - 2 * ALIKE_NATS, 99.0),
    )
    assert most_plausible([best, alike, worse], 20) is alike
    assert most_plausible([best, worse], 20) is best
    assert most_plausible([], 20) is None


def test_a_name_is_paid_for_with_how_many_might_have_been_given():
    nothing, named = said(10.0, 5.0, names=0), said(11.0, 5.0 + np.log(20.0) - 0.1)
    assert most_plausible([nothing, named], 20) is nothing
    assert most_plausible([nothing, named], 10) is named


def test_a_pair_is_grown_from_whichever_of_its_effects_says_more_with_the_other():
    names = ["best", "other", *(f"effect {k}" for k in range(PROMISING))]
    parents = [SimpleNamespace(fit=SimpleNamespace(hypothesis=(name,))) for name in names[:2]]
    says = {("best", "other"): 20.0, ("other", "best"): 30.0, ("other", "effect 3"): 25.0}
    promised = [
        (p, name, says.get((*p.fit.hypothesis, name), 10.0))
        for p in parents
        for name in names
        if name not in p.fit.hypothesis
    ]
    tried = [(p.fit.hypothesis[0], name) for p, name in most_promising(promised)]
    assert tried[:2] == [("other", "best"), ("other", "effect 3")]
    assert ("best", "other") not in tried
    assert len(tried) == PROMISING


def test_a_declared_parameter_under_test_is_expected_as_far_off_as_files_are():
    kinetics = effect_parameters(
        "charge_transfer_kinetics", CATALOGUE["charge_transfer_kinetics"].parameters, 30.0
    )
    loose = [p.spread.loose for p in CATALOGUE["charge_transfer_kinetics"].parameters.values()]
    assert [one.sd for one in kinetics] == loose
    contact = effect_parameters("series_resistance", CATALOGUE["series_resistance"].parameters, 30.0)
    assert contact[0].sd == CATALOGUE["series_resistance"].parameters["resistance_ohm"].spread.loose / 30.0
    lost = effect_parameters("lithium_inventory_loss", CATALOGUE["lithium_inventory_loss"].parameters, 30.0)
    assert lost[0].sd > CATALOGUE["lithium_inventory_loss"].parameters["loss"].spread.loose  # cells age


BLOCKS = SimpleNamespace(of_row=np.zeros(100, dtype=int), compared=np.ones(100, dtype=bool))


COMPETING = 20
PROBLEM = SimpleNamespace(competing=lambda: range(COMPETING), approximated_v=0.0)
WAVE_V = 3e-4 * np.sin(np.arange(100.0))


def left(residual_v, total, evidence=None, names=("one",)):
    """A fit without parameters that leaves this of unseen data."""
    evidence = total if evidence is None else evidence
    score = SimpleNamespace(total=total, evidence=evidence, shifts={"block": np.zeros((1, 0))})
    point = SimpleNamespace(residual_v=residual_v, jacobian_v=np.zeros((100, 0)))
    return SimpleNamespace(score=score, point=point, at_bounds=(), hypothesis=names)


def test_an_effect_that_says_much_is_a_step_though_it_is_no_end_before_it_lowers_the_error():
    before = left(WAVE_V, 0.0, names=())
    moved, lower = left(-WAVE_V, 50.0), left(0.5 * WAVE_V, 50.0)
    assert admissible(PROBLEM, BLOCKS, before, moved, 5.0)
    assert not needed(PROBLEM, BLOCKS, before, moved, 5.0)
    assert admissible(PROBLEM, BLOCKS, before, lower, 5.0)
    assert needed(PROBLEM, BLOCKS, before, lower, 5.0)


def test_an_effect_that_says_little_or_ends_on_a_bound_is_no_step():
    before = left(WAVE_V, 0.0, names=())
    on_bound = left(0.5 * WAVE_V, 50.0)
    on_bound.at_bounds = ("one.value",)
    assert not admissible(PROBLEM, BLOCKS, before, left(0.5 * WAVE_V, 4.0), 5.0)
    assert not admissible(PROBLEM, BLOCKS, before, on_bound, 5.0)


def test_an_effect_that_moves_less_than_what_the_model_approximates_is_no_step():
    before, small = left(WAVE_V, 0.0, names=()), left(0.9 * WAVE_V, 50.0)
    assert admissible(PROBLEM, BLOCKS, before, small, 5.0)
    rough = SimpleNamespace(competing=PROBLEM.competing, approximated_v=3e-5)
    assert not admissible(rough, BLOCKS, before, small, 5.0)
    assert admissible(rough, BLOCKS, before, left(0.5 * WAVE_V, 50.0), 5.0)


def test_what_one_of_many_names_foretells_by_luck_is_no_step_where_it_makes_the_data_less_likely():
    before = left(WAVE_V, 0.0, names=())
    paid = float(np.log(COMPETING))
    assert not admissible(PROBLEM, BLOCKS, before, left(0.5 * WAVE_V, 8.5, evidence=paid - 0.1), 5.0)
    assert admissible(PROBLEM, BLOCKS, before, left(0.5 * WAVE_V, 8.5, evidence=paid + 0.1), 5.0)


def test_nothing_is_fitted_where_all_effects_together_leave_far_more_than_a_right_one(cell, few, make):
    many = {name: CATALOGUE[name] for name in (*few, "leakage_current", "current_sensor_offset")}
    assert len(many) > FINALISTS > len(few)
    right = make((CATALOGUE["series_resistance"].activate(resistance_ohm=ADDED_OHM),))
    strange = replace(right, voltage_v=right.voltage_v + 5e-3 * np.sin(right.time_s / 30.0))
    asked = ((right, many), (strange, many), (strange, few))
    problems = [inverse_problem(cell, [data], 0.9, effects=effects) for data, effects in asked]
    paths = [forward_search(one, 1, Archive(None, ""), allowed_v=ALLOWED_V) for one in problems]
    assert paths[0].chosen.hypothesis == ("series_resistance",)
    assert paths[0].beyond_reach_v is None
    assert paths[1].chosen is paths[1].base
    assert paths[1].steps == ()
    assert paths[2].steps  # no more than are fitted at most: looking spares nothing
    assert paths[2].beyond_reach_v is None
    assert paths[1].beyond_reach_v == pytest.approx(5e-3 / np.sqrt(2.0), rel=0.2)


def test_what_the_other_model_may_account_for_is_not_out_of_reach_of_this_one(cell, few, make):
    many = {name: CATALOGUE[name] for name in (*few, "leakage_current", "current_sensor_offset")}
    data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=ADDED_OHM),))
    strange = replace(data, voltage_v=data.voltage_v + 5e-3 * np.sin(data.time_s / 30.0))
    problem = inverse_problem(cell, [strange], 0.9, effects=many)
    for reduced_v, begun in ((1e-3, False), (4e-3, True)):  # 3.5 mV are left by all effects together
        path = forward_search(
            replace(problem, reduced_v=reduced_v), 1, Archive(None, ""), allowed_v=ALLOWED_V
        )
        assert bool(path.steps) == begun


def test_what_moves_the_voltage_far_is_followed_before_it_is_called_out_of_reach(cell, few, make):
    many = {name: CATALOGUE[name] for name in (*few, "leakage_current", "clock_skew")}
    data = make((CATALOGUE["clock_skew"].activate(lag_s=2.0),))
    problem = inverse_problem(cell, [data], 0.9, effects=many)
    path = forward_search(problem, 1, Archive(None, ""), allowed_v=ALLOWED_V)
    growths = growths_on([Parent(problem, path.blocks, path.base)], {}, Archive(None, ""))
    begun = least_error_v(path.base, [growth.possible_changes_v() for growth in growths], problem.white_v)
    assert begun > REACH_FACTOR * ALLOWED_V
    assert path.beyond_reach_v is None
    assert path.chosen.hypothesis == ("clock_skew",)


def test_what_was_within_reach_is_within_reach_with_more_names(cell, few, make, monkeypatch):
    many = {name: CATALOGUE[name] for name in (*few, "leakage_current", "current_sensor_offset")}
    data = make((CATALOGUE["series_resistance"].activate(resistance_ohm=ADDED_OHM),))
    problem = inverse_problem(cell, [data], 0.9, effects=many)
    archive = Archive(None, "")

    def looked(most, archive):
        return forward_search(problem, most, archive, allowed_v=ALLOWED_V)

    once = looked(1, archive)
    monkeypatch.setattr(reach, "least_error_v", lambda *_: np.inf)
    again = looked(2, archive)
    assert once.chosen.hypothesis == again.chosen.hypothesis == ("series_resistance",)
    assert again.beyond_reach_v is None
    assert looked(2, Archive(None, "")).beyond_reach_v == np.inf


def test_what_all_effects_leave_is_told_beyond_the_noise():
    """An error of 3 mV that no mark takes up and 4 mV that one does, beside noise of 1 mV."""
    even, odd = np.tile([1.0, 1.0], 50), np.tile([1.0, -1.0], 50)
    point = SimpleNamespace(residual_v=3e-3 * even + 4e-3 * odd, jacobian_v=np.zeros((100, 1)))
    left_v = [
        least_error_v(SimpleNamespace(point=point), marks, np.full(100, 1e-3))
        for marks in ([], [7.0 * odd[:, None]], [odd[:, None], even[:, None]])
    ]
    assert left_v == pytest.approx([np.sqrt(24.0) * 1e-3, np.sqrt(8.0) * 1e-3, 0.0], abs=1e-9)


def test_with_the_other_model_what_says_most_with_either_is_grown(monkeypatch):
    names = [f"effect {k}" for k in range(PROMISING + 4)]
    said = {name: 10.0 - k for k, name in enumerate(names)}
    promised = dict.fromkeys(names, 0.0) | {names[-1]: 50.0}  # by this model alone
    simulated = set(names) - {names[-2]}
    monkeypatch.setattr(growths, "_key", lambda parent, name, what: name)
    monkeypatch.setattr(
        growths,
        "_first_slopes",
        lambda offered: {n: np.array([[promised[n]]]) for n in offered if n in simulated},
    )
    monkeypatch.setattr(growths, "expected_score", lambda parent, slopes_v: slopes_v[0, 0])
    parent = SimpleNamespace(fit=SimpleNamespace(score=SimpleNamespace(total=0.0)))
    offered = [SimpleNamespace(parent=parent, effect=name) for name in names]
    kept, slopes = promising_first(offered, SimpleNamespace(near=lambda name, size: np.array([said[name]])))
    # What cannot be simulated is grown, too, so that it is told of.
    assert {g.effect for g in kept} == {*names[: PROMISING - 2], *names[-2:]}
    assert set(slopes) == set(names[PROMISING - 2 : -2])
    alone, none = promising_first(offered, SimpleNamespace(near=lambda name, size: None))
    assert (alone, none) == (offered, {})


def test_a_fit_had_to_start_where_a_change_to_first_order_leaves_volts(monkeypatch, resisting, make):
    problem = resisting(make)
    blocks, archive = blocks_of(problem), Archive(None, "")
    base = base_of(problem, blocks, archive)
    grown = EffectGrowth(Parent(problem, blocks, base), "series_resistance", SIZE).grow()
    first = [f.owner == STATE_OF_CHARGE for f in grown.free]
    far = replace(grown, score=replace(grown.score, shift=np.where(first, 4.0, grown.score.shift)))
    begun = []
    monkeypatch.setattr(HypothesisFitter, "descend", lambda self, x, *_: begun.append(x) or x)
    fitted_hypothesis(problem, blocks, ("series_resistance",), far, Archive(None, ""))
    fitter = HypothesisFitter(problem, blocks, ("series_resistance",))
    left, left_far = (
        rms(fitter.residual(x)) for x in (*begun, coordinates_of(fitter.free, far.values_by_key))
    )
    assert left < 0.6 * left_far


def test_a_fit_ended_beside_a_lag_of_zero_where_rows_at_steps_of_the_current_are_read_after_them(cell, few):
    rng, time = np.random.default_rng(1), np.arange(1200.0)
    current = steps(len(time), 45.0, rng)
    voltage = simulate(cell, time, current, 0.9, hold="backward").voltage_v + NOISE_V * rng.normal(size=1200)
    record = Measurement(time, current, voltage, name="held", hold="backward")
    effects = {**few, "clock_skew": CATALOGUE["clock_skew"]}
    problem = inverse_problem(cell, [record], soc0=0.9, effects=effects)
    fitter = HypothesisFitter(problem, blocks_of(problem), ())
    lag = [one.key for one in fitter.free].index(("clock_skew", "lag_s"))
    late = np.zeros(len(fitter.free))
    early = late.copy()
    early[lag] = -0.01  # a millisecond
    size = PRIORS[problem.trust].nearest(PRIORS[problem.trust].median)
    assert fitter.cost(early, size) > fitter.cost(late, size) + 100.0
    found = fitter.descend(early, size, 8)
    assert found[lag] >= 0.0
    assert fitter.cost(found, size) <= fitter.cost(late, size)


@pytest.mark.parametrize(("reached", "fitted"), [(20.0, FINALISTS), (4.5, FINALISTS + 1), (-900.0, 12)])
def test_growths_beyond_the_finalists_are_fitted_where_no_fit_does_what_they_promise(reached, fitted):
    """Twelve growths promise 11.5, 10.5 .. 0.5 nats; every fit reaches as much."""
    promised = [
        SimpleNamespace(hypothesis=(str(k),), score=SimpleNamespace(total=11.5 - k)) for k in range(12)
    ]
    best = SimpleNamespace(score=SimpleNamespace(total=-100.0))
    fit = SimpleNamespace(score=SimpleNamespace(total=reached), at_bounds=())
    search = SimpleNamespace(_fitted=lambda *_: fit, report=lambda *_: None, problem=None)
    assert len(_ForwardSearch._finalists_fitted(search, promised, best)) == fitted
