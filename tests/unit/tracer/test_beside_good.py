"""Records beside others of the same cell that are known to be good: what is different about the first?"""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.errors import DataError
from aesi.physics import simulate
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.case.free_parameter import acting_on, shared_owner
from aesi.tracer.case.problem import BESIDE_TIMES
from aesi.tracer.decide.good_records import checked_against_ageing, error_beyond_noise_v, verdict_beside
from aesi.tracer.decide.shared_effects import in_all_records
from aesi.tracer.decide.verdict import Thresholds, Verdict
from aesi.tracer.discovery import inverse_problem
from aesi.tracer.search.archive import context_of
from aesi.tracer.search.growths import addable
from aesi.tracer.search.plausible import score_lag

OFFSET_V = 8e-3
TRIED = ("series_resistance", "current_sensor_gain", "voltage_sensor_offset", "ocv_hysteresis")


@pytest.fixture
def erring(cell, make):
    """A record of a cell in which its model errs: by up to 4 mV with the state of charge, alike in all records, and by
    1 mV over each 100 s for itself."""

    def measurement(name, seed, offset_v=0.0, effects=(), n=7200):
        data = make(effects, seed=seed, n=n)
        charge = 0.9 - np.cumsum(data.current_a) / (3600.0 * cell.capacity_ah)
        rng = np.random.default_rng(100 + seed)
        own = np.repeat(rng.normal(0.0, 2e-3, len(data) // 100 + 1), 100)[: len(data)]
        error = 4e-3 * np.sin(20.0 * charge) + own
        return replace(data, voltage_v=data.voltage_v + error + offset_v, name=name)

    return measurement


@pytest.fixture
def tried():
    return {name: CATALOGUE[name] for name in TRIED}


def test_an_offset_within_the_models_error_is_found_beside_a_good_record(cell, tried, erring):
    good, other = erring("good", 1), erring("other", 2, OFFSET_V)
    found = discover(cell, [other], soc0=0.9, effects=tried, good=[good])
    assert found.verdict.word == "found"
    assert found.verdict.effects == ("voltage_sensor_offset",)
    size = next(c for c in found.candidates if c.effect == "voltage_sensor_offset").parameters["offset_v"]
    assert size.low <= OFFSET_V <= size.high
    assert "other" in found.verdict.reason
    residuals = {f.name: f for f in found.files if f.part == "fit"}
    assert np.mean(residuals["other"].residual_v("after")) == pytest.approx(0.0, abs=2e-3)
    shift = residuals["good"].voltages["after"] - residuals["good"].voltages["recalibrated"]
    assert np.max(np.abs(shift)) < 2e-3  # the fault is not one of the good record


def test_nothing_is_found_without_a_fault(cell, tried, erring):
    found = discover(cell, [erring("other", 2)], soc0=0.9, effects=tried, good=[erring("good", 1)])
    assert found.verdict.word == "none"
    assert found.verdict.effects == ()


CONTACT = CATALOGUE["series_resistance"]


def test_a_contact_that_good_records_have_too_was_found_as_a_difference(cell, tried, erring):
    in_both = [CONTACT.activate(resistance_ohm=5e-4)]
    good, other = erring("good", 1, effects=in_both), erring("other", 2, effects=in_both)
    found = discover(cell, [other], soc0=0.9, effects=tried, good=[good])
    assert (found.verdict.word, found.verdict.effects) == ("none", ())
    (note,) = (note for note in found.notes if "taken as common to all" in note)
    assert note.startswith("series_resistance gains ")


def test_a_lag_that_constant_current_cannot_show_was_taken_as_common_to_all(cell, make):
    """A discharge at constant current says nothing of a lag."""
    tried = {name: CATALOGUE[name] for name in ("series_resistance", "voltage_sensor_offset", "clock_skew")}
    other = make([CATALOGUE["clock_skew"].activate(skew=0.0, lag_s=1.0)], n=7200)
    time, current = np.arange(3600.0), np.r_[0.0, np.full(3599, 9.0)]
    noise = 1e-3 * np.random.default_rng(5).normal(size=3600)
    good = Measurement(time, current, simulate(cell, time, current, 0.9).voltage_v + noise, name="steady")
    found = discover(cell, [other], soc0=0.9, effects=tried, good=[good])
    assert found.verdict.effects == ("clock_skew",)
    (note,) = (note for note in found.notes if "do not tell whether" in note)
    assert note.startswith("clock_skew gains ")


def test_a_contact_beyond_that_of_the_good_records_has_the_size_of_the_difference(cell, tried, erring):
    good, other = (
        erring(name, seed, effects=[CONTACT.activate(resistance_ohm=ohm)])
        for name, seed, ohm in (("good", 1, 5e-4), ("other", 2, 10e-4))
    )
    found = discover(cell, [other], soc0=0.9, effects=tried, good=[good])
    assert (found.verdict.word, found.verdict.effects) == ("found", ("series_resistance",))
    size = next(c for c in found.candidates if c.effect == "series_resistance").parameters["resistance_ohm"]
    assert size.low <= 5e-4 <= size.high


def test_what_is_open_in_all_records_may_go_as_far_as_where_it_is_tried(cell, make):
    """Also of an instrument, of what cells have another spread of, and on a logarithmic scale."""
    problem = replace(inverse_problem(cell, [make()], 0.9, good=[make(seed=3)]), trust="beside")
    for name in ("clock_skew", "series_resistance", "current_sensor_gain", "solid_diffusivity"):
        opened = in_all_records(problem, name)
        tried = np.array([(f.sd, f.centre) for f in problem.parameters_of(name)])
        again = [(f.sd, f.centre) for f in opened.parameters_of(name)]
        shared = [(f.sd, f.centre) for f in opened.free(()) if f.owner == shared_owner(name)]
        assert np.array(again) == pytest.approx(tried)
        assert np.array(shared) == pytest.approx(tried)


def test_a_good_record_only_has_what_all_records_share():
    shared = shared_owner("clock_skew")
    values = {"soc0": {"0": 0.9}, shared: {"lag_s": 0.1}, "clock_skew": {"skew": 0.01, "lag_s": 0.3}}
    assert acting_on(CATALOGUE, values, good=True) == {"clock_skew": {"lag_s": 0.1}}
    there = acting_on(CATALOGUE, values, good=False)["clock_skew"]
    assert there == {"lag_s": pytest.approx(0.4), "skew": 0.01}
    gains = {shared_owner("current_sensor_gain"): {"gain": 1.1}, "current_sensor_gain": {"gain": 1.02}}
    assert acting_on(CATALOGUE, gains, good=False)["current_sensor_gain"]["gain"] == pytest.approx(1.122)


def test_effects_under_test_move_the_other_records_alone(cell, tried, erring):
    problem = inverse_problem(cell, [erring("other", 2)], 0.9, effects=tried, good=[erring("good", 1)])
    problem = replace(problem, trust="beside")
    soc0 = {"soc0": {str(i): r.soc0 for i, r in enumerate(problem.records)}}
    moved = problem.predict({**soc0, "voltage_sensor_offset": {"offset_v": OFFSET_V}}) - problem.predict(soc0)
    assert moved[problem.slices[0]] == pytest.approx(OFFSET_V)
    assert moved[problem.slices[1]] == pytest.approx(0.0)
    owners = {f.owner for f in problem.free(("voltage_sensor_offset",))}
    assert {"voltage_sensor_offset", shared_owner("voltage_sensor_offset")} <= owners


def test_every_simulation_of_a_good_record_was_kept_as_long_as_the_search_lasted(monkeypatch, cell, make):
    from aesi.tracer.case import problem as module

    good, other = replace(make(seed=1, n=600), name="good"), replace(make(seed=2, n=600), name="other")
    effects = {"voltage_sensor_offset": CATALOGUE["voltage_sensor_offset"]}
    problem = inverse_problem(cell, [other], 0.9, effects=effects, good=[good])
    counted, simulation = [], module.fit_simulation
    monkeypatch.setattr(module, "fit_simulation", lambda *given: counted.append(1) or simulation(*given))

    def simulated(good_soc0, offset_v):
        """Simulations of both records."""
        before = len(counted)
        values = {"soc0": {"0": 0.9, "1": good_soc0}, "voltage_sensor_offset": {"offset_v": offset_v}}
        assert problem.predict(values) is not None
        return len(counted) - before

    assert simulated(0.9, 0.0) == 2
    assert simulated(0.9, 1e-3) == 1  # an effect under test does not act on the good one
    assert all(simulated(0.9 + 1e-4 * k, 0.0) == 2 for k in range(1, module.CACHED_VOLTAGES + 1))
    assert simulated(0.9, 0.0) == 2  # forgotten by now


def test_what_the_cell_is_made_with_and_its_age_do_not_compete_beside_good_records(cell, make):
    alone, beside = (
        replace(inverse_problem(cell, [make()], 0.9, good=good), trust="beside")
        for good in ([], [make(seed=3)])
    )

    def tried(problem):
        return set(addable(SimpleNamespace(problem=problem, fit=SimpleNamespace(hypothesis=()))))

    assert tried(beside) == {
        "ambient_temperature",
        "series_resistance",
        "leakage_current",
        "current_sensor_gain",
        "current_sensor_offset",
        "voltage_sensor_offset",
        "clock_skew",
    }
    assert tried(beside) < tried(alone)


def test_good_records_count_where_the_others_have_been(cell, make):
    short, whole = replace(make(seed=2, n=900), name="short"), replace(make(seed=1), name="good")
    problem = replace(inverse_problem(cell, [short], 0.9, 0.0, good=[whole]), trust="beside")
    z, good = problem.declared_soc, problem.good_rows
    outside = good & (z < z[~good].min() - 0.06)
    assert outside.any()
    assert not problem.independent[outside].any()
    assert problem.independent[~good].sum() > 0
    measured = replace(problem, trust="measured").independent
    assert problem.independent[~good] == pytest.approx(BESIDE_TIMES * measured[~good])


def test_a_good_record_elsewhere_says_nothing(cell, tried, make):
    low = replace(make(seed=1, soc0=0.2, n=600), name="low")
    with pytest.raises(DataError, match="passes through the states of charge of made"):
        discover(cell, [make(seed=2, n=600)], soc0=0.9, effects=tried, good=[low])


def test_without_good_records_nothing_is_told_apart(cell, tried, make):
    data = make()
    alone, beside = (
        inverse_problem(cell, [data], 0.9, effects=tried, good=good) for good in ([], [make(seed=3)])
    )
    assert not alone.has_good
    assert not alone.good_rows.any()
    assert {f.owner for f in alone.free(())} == {"soc0", "voltage_sensor_offset"}
    assert context_of(alone) != context_of(beside)
    assert alone.active({"soc0": {"0": 0.9}}) == alone.fixed


def test_the_noise_of_one_kind_of_record_was_taken_off_the_error_of_the_other(monkeypatch):
    rows, residual_v = np.array([True, True, False, False]), np.array([5e-3, -5e-3, 13e-3, -13e-3])
    monkeypatch.setattr("aesi.tracer.decide.good_records.held_out_residual", lambda blocks, one: residual_v)
    problem = SimpleNamespace(white_v=np.array([3e-3, 3e-3, 5e-3, 5e-3]), noise_v=np.sqrt(17.0) * 1e-3)
    path = SimpleNamespace(blocks=None, problem=problem)
    assert [error_beyond_noise_v(path, None, kind) for kind in (rows, ~rows)] == pytest.approx([4e-3, 12e-3])


@dataclass(frozen=True)
class Named:
    """A hypothesis of which only the names are asked for."""

    hypothesis: tuple[str, ...]


@pytest.mark.parametrize(("gain", "named"), [(30.0, ()), (50.0, ("a",))])
def test_what_leaves_more_than_the_good_records_has_to_say_it_at_that_error(monkeypatch, gain, named):
    """Twice the error is a quarter of the nats: of 30 are left 7.5, where 10 were asked for. What is left then, 16 mV,
    is that of the model without the name; it was that of the refused one."""
    good = np.array([True, False])
    problem = SimpleNamespace(
        good_rows=good,
        compared=np.ones(2, dtype=bool),
        independent=np.full(2, 1e6),
        noise_v=1e-3,
        records=[SimpleNamespace(name="other", good=False)],
    )
    base, chosen = Named(()), Named(("a",))
    path = SimpleNamespace(
        problem=problem, base=base, chosen=chosen, steps=(), admission_nats=10.0, gain=lambda one: gain
    )
    left = {base: 16e-3, chosen: 8e-3}
    monkeypatch.setattr(
        "aesi.tracer.decide.good_records.error_beyond_noise_v",
        lambda path, one, rows: 4e-3 if rows[0] else left[one],
    )
    monkeypatch.setattr("aesi.tracer.decide.good_records.look_alikes", lambda *given: ((), 1.0))
    verdict = verdict_beside(path, Thresholds())
    assert (verdict.word, verdict.effects) == ("unknown", named)
    assert verdict.structured_v == (8e-3 if named else 16e-3)
    assert ("8.0 mV with it" in verdict.reason) == bool(named)
    # Without a name the confidence of `unknown` is read off the logarithm of what is left over what may be, 16 over
    # 4 mV with 0.6 that right hypotheses leave anyway, and what two records of a million rows each differ by.
    may_be = np.hypot(4.0, np.hypot(0.45, 0.4))
    assert verdict.margin == (1.0 if named else pytest.approx(np.log(16.0 / may_be), abs=2e-3))


def said(name, total, scatter=1.0):
    """A hypothesis that says so much of unseen data, in blocks that differ by `scatter`."""
    blocks = total / 8.0 + scatter * np.tile([1.0, -1.0], 4)
    return SimpleNamespace(
        hypothesis=(name,), score=SimpleNamespace(total=total, log_density={"block": blocks})
    )


def test_what_an_age_says_as_well_is_a_look_alike_and_what_it_says_better_takes_the_name():
    named = Verdict(
        "found", ("current_sensor_gain",), (("current_sensor_gain", "clock_skew"),), 0.0, 0.0, 1.0, "so"
    )
    gain = said("current_sensor_gain", 40.0)
    worse, same, better = (said("lithium_inventory_loss", total) for total in (10.0, 39.0, 70.0))
    assert checked_against_ageing(named, gain, [worse]) == named
    alike = checked_against_ageing(named, gain, [worse, same])
    assert (alike.word, alike.effects) == ("found", named.effects)
    assert alike.confidence_sets == (("current_sensor_gain", "clock_skew", "lithium_inventory_loss"),)
    assert "of another age" in alike.reason
    other = checked_against_ageing(named, gain, [worse, better])
    assert (other.word, other.effects, other.confidence_sets) == ("unknown", (), ())
    assert other.aged == ("lithium_inventory_loss",)
    assert "30.0 nats higher" in other.reason
    assert "leave out --good" in other.reason


def test_an_age_that_lags_less_than_any_other_rival_is_what_the_confidence_is_read_off():
    named = Verdict("found", ("series_resistance",), (), 0.0, 0.0, 1.0, "so", margin=9.0)
    believed = said("series_resistance", 40.0)
    assert checked_against_ageing(named, believed, [said("film_growth", 10.0)]).margin == 9.0
    scattered = said("film_growth", 10.0, scatter=3.0)
    nats, deviation = score_lag(believed, scattered)
    assert checked_against_ageing(named, believed, [scattered]).margin == nats / deviation < 9.0


def test_where_nothing_is_named_an_age_that_says_enough_is_told():
    left = Verdict("unknown", (), (), 0.0, 8e-3, 4e-3, "left", margin=0.7)
    told = checked_against_ageing(left, said("nothing", 0.0), [said("lithium_inventory_loss", 30.0)])
    assert (told.word, told.effects, told.aged) == ("unknown", (), ("lithium_inventory_loss",))
    assert "than no effect, and" in told.reason
    assert checked_against_ageing(left, said("nothing", 0.0), []) == left


def test_an_aged_cell_was_a_current_that_reads_too_low(cell, erring):
    aged = [CATALOGUE["active_material_loss_negative"].activate(loss=0.2)]
    good, other = erring("good", 1, n=5400), erring("other", 2, effects=aged, n=5400)
    gain = {"current_sensor_gain": CATALOGUE["current_sensor_gain"]}
    before = discover(cell, [other], soc0=0.9, effects=gain, good=[good])
    assert before.verdict.effects == ("current_sensor_gain",)
    found = discover(
        cell, [other], soc0=0.9, effects=gain | {e.effect.id: e.effect for e in aged}, good=[good]
    )
    assert found.verdict.effects == () or found.verdict.confidence_sets[0] == (
        "current_sensor_gain",
        "active_material_loss_negative",
    )
    assert "another age" in found.verdict.reason


def test_a_fault_is_found_beside_a_good_record_that_the_model_follows_to_the_noise(cell, tried, make):
    good, other = (replace(make(seed=seed, n=5400), name=name) for seed, name in ((1, "good"), (2, "other")))
    other = replace(other, current_a=1.02 * other.current_a)
    found = discover(cell, [other], soc0=0.9, effects=tried, good=[good])
    assert (found.verdict.word, found.verdict.effects) == ("found", ("current_sensor_gain",))
    assert found.verdict.confidence < 0.99


def test_lost_lithium_that_nothing_else_explains_is_told_beside_a_fresh_record(cell, tried, make):
    lost = CATALOGUE["lithium_inventory_loss"].activate(loss=0.15)
    good, other = (
        replace(make(seed=1, n=5400), name="good"),
        replace(make([lost], seed=2, n=5400), name="other"),
    )
    effects = {"voltage_sensor_offset": tried["voltage_sensor_offset"], "lithium_inventory_loss": lost.effect}
    found = discover(cell, [other], soc0=0.9, effects=effects, good=[good])
    assert (found.verdict.word, found.verdict.effects) == ("unknown", ())
    assert found.verdict.aged == ("lithium_inventory_loss",)
