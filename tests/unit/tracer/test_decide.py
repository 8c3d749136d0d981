"""Verdicts as pure functions of frozen evidence, the archive, and the map from margin to frequency."""

import os
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path as FilePath
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.errors import SimulationError
from aesi.physics import Cell, simulate
from aesi.physics.cell.relations import scaled
from aesi.physics.effect import Contribution
from aesi.physics.effects import CATALOGUE
from aesi.records import Measurement
from aesi.tracer.case.blocks import blocks_of
from aesi.tracer.case.problem import InverseProblem
from aesi.tracer.case.records import prepare_all
from aesi.tracer.decide.carry_over import (
    FAST_C,
    ORDINARY_C,
    LeftOut,
    full_course,
    left_out_errors,
    range_fault,
)
from aesi.tracer.decide.confidence import HIGHEST, FrequencyMap, fitted_map
from aesi.tracer.decide.evidence import named_options, plausible_or_unknown
from aesi.tracer.decide.model_to_write import (
    UNTESTED,
    Option,
    carries_best,
    model_to_write,
    refused_refit,
    stand_in_notes,
    why_not_refit,
    worst_ratio,
)
from aesi.tracer.decide.verdict import (
    Thresholds,
    Verdict,
    across_models,
    look_alikes,
    partly_explained,
    predicted_share,
    structured_v,
    unexplained_v,
    verdict_on,
)
from aesi.tracer.likelihood.fit import prediction_sd_v, scored
from aesi.tracer.likelihood.growth import Parent
from aesi.tracer.likelihood.model_error import MEASURED_V, PRIORS
from aesi.tracer.likelihood.model_state import ModelState
from aesi.tracer.likelihood.surrogates import FAMILY_WISE, admission_nats, largest_gains
from aesi.tracer.search.archive import Archive, context_of, identity
from aesi.tracer.search.forward import forward_search
from aesi.tracer.search.hypothesis_fits import base_of, fitted_hypothesis, values_without
from aesi.tracer.search.one_cause import with_one_effect
from aesi.tracer.search.path import Path, Step
from aesi.tracer.search.plausible import most_plausible, plausibility
from aesi.tracer.search.wrong_parameters import beyond_spread, with_wrong_parameters, wrong_sds

CELLS = FilePath(__file__).resolve().parents[3] / "experiments" / "cells"


@pytest.fixture
def archive():
    """Of one test: a fit is kept by its name, whatever its data."""
    return Archive(None, "")


@pytest.fixture
def path(cell, few, make, archive):
    data = make((CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.006),))
    problem = InverseProblem(cell, prepare_all(cell, [data], 0.9, 0.3), few)
    return forward_search(problem, 2, archive)


def test_a_search_leaves_what_a_verdict_needs(path):
    assert path.chosen.hypothesis == ("ocv_hysteresis",)
    verdict = verdict_on(path, Thresholds())
    assert verdict == verdict_on(path, Thresholds())
    assert verdict.word == "found"
    assert verdict.margin > 0
    assert path.gain(path.chosen) > 50
    assert {frozenset(e.hypothesis) for e in path.explanations()} >= {
        frozenset(),
        frozenset({"ocv_hysteresis"}),
    }


def test_what_is_left_beyond_the_tolerance_is_unknown_and_names_nothing(path):
    bare = replace(path, chosen=path.base)
    verdict = verdict_on(bare, Thresholds())
    assert (verdict.word, verdict.effects) == ("unknown", ())
    left_v = unexplained_v(path.problem, path.blocks, path.base, verdict.tolerance_v)
    assert verdict.structured_v == left_v > verdict.tolerance_v
    assert left_v == pytest.approx(structured_v(path, path.base), rel=0.05)  # few parameters, well known
    generous = verdict_on(bare, Thresholds(solver_v=0.1))
    assert generous.word == "none"


def test_what_needs_declared_parameters_that_no_cell_has_is_unknown(path):
    verdict = verdict_on(path, Thresholds())
    assert plausible_or_unknown(path, verdict) == verdict
    place = [f.key for f in path.chosen.free].index(("solid_diffusivity", "positive_factor"))
    x = path.chosen.point.x.copy()
    x[place] = 3.9
    covariance = path.chosen.score.covariance.copy()
    covariance[place, place] = 0.5**2
    point, score = replace(path.chosen.point, x=x), replace(path.chosen.score, covariance=covariance)
    far = replace(path, chosen=replace(path.chosen, point=point, score=score))
    told = plausible_or_unknown(far, verdict)
    assert (told.word, told.effects, told.groups, told.margin) == ("unknown", (), (), 0.0)
    assert "ocv_hysteresis explains the data only if solid_diffusivity is further" in told.reason
    covariance[place, place] = 2.0**2  # may as well be as declared
    assert plausible_or_unknown(far, verdict) == verdict


def test_a_wrong_parameter_is_named_with_what_is_needed_beside_it(cell, few, make, archive):
    hysteresis = CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.006)
    slow = CATALOGUE["solid_diffusivity"].activate(negative_factor=0.12, positive_factor=1.0)
    problem = InverseProblem(cell, prepare_all(cell, [make((hysteresis, slow))], 0.9, 0.3), few)
    path = forward_search(problem, 0, archive)
    one, two = (
        fitted_hypothesis(problem, path.blocks, names, path.base, archive)
        for names in (("ocv_hysteresis",), ("series_resistance", "ocv_hysteresis"))
    )
    assert beyond_spread(problem, one) == ["solid_diffusivity"]
    far = replace(path, chosen=one)
    assert with_wrong_parameters(far, 1, archive) is far
    named = with_wrong_parameters(far, 2, archive).chosen.hypothesis
    assert named == ("ocv_hysteresis", "solid_diffusivity")
    assert with_wrong_parameters(replace(path, chosen=two), 3, archive).chosen.hypothesis == named


def test_the_effect_that_wrong_parameters_made_up_for_is_named_in_their_place(cell, few, make, archive):
    hysteresis = CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.006)
    coarse = CATALOGUE["particle_radius"].activate(negative_factor=1.9)
    effects = {**few, "particle_radius": CATALOGUE["particle_radius"]}
    problem = InverseProblem(cell, prepare_all(cell, [make((hysteresis, coarse))], 0.9, 0.3), effects)
    path = forward_search(problem, 0, archive)
    one, right, other = (
        fitted_hypothesis(problem, path.blocks, names, path.base, archive)
        for names in (
            ("ocv_hysteresis",),
            ("ocv_hysteresis", "particle_radius"),
            ("ocv_hysteresis", "voltage_sensor_offset"),
        )
    )
    assert beyond_spread(problem, one)
    assert not beyond_spread(problem, right)
    refused = Step((one,), (), (other, right), None, admission_nats=1e9)
    named = with_wrong_parameters(replace(path, steps=(refused,), chosen=one), 2, archive)
    assert named.chosen is right


@pytest.mark.parametrize("parameters", [1, 6, 12])
def test_as_many_cells_have_a_declared_parameter_called_wrong_as_are_admitted_an_effect(parameters):
    most = np.abs(np.random.default_rng(parameters).normal(size=(20_000, parameters))).max(axis=1)
    share = np.mean(most > wrong_sds(parameters))
    assert share == pytest.approx(FAMILY_WISE, abs=4 * np.sqrt(FAMILY_WISE / 20_000))


def test_a_given_state_of_charge_is_believed_no_closer_than_the_voltage_contradicts_it(path):
    problem = path.problem
    record = problem.records[0]
    doubted = replace(record, start=replace(record.start, doubt=0.02))
    for trust in ("tight", "loose", "exact", "measured"):
        sds = [replace(problem, records=(one,), trust=trust).free(())[0].sd for one in (record, doubted)]
        assert sds == [max(record.soc0_sd, record.start.doubt), 0.02]


def test_what_a_hypothesis_cannot_tell_of_a_block_is_not_asked_of_it(path):
    one, blocks = path.base, path.blocks
    wild = np.zeros((len(one.point.residual_v), 1))
    wild[blocks.rows[5]] = 1.0  # a parameter that one block alone could tell
    point = replace(
        one.point,
        x=np.append(one.point.x, 0.0),
        residual_v=one.point.residual_v + 1.0 * wild[:, 0],
        jacobian_v=np.column_stack([one.point.jacobian_v, wild]),
        bounds=np.vstack([one.point.bounds, [[-9.0, 9.0]]]),
    )
    flexible = replace(one, point=point, score=scored(path.problem, blocks, point))
    sd_v = prediction_sd_v(path.problem, blocks, flexible, PRIORS[path.problem.trust].median)
    assert sd_v[blocks.rows[5]] == pytest.approx(1.0, rel=1e-3)
    assert max(sd_v[blocks.rows[4]]) < 1e-3
    assert structured_v(path, flexible) > 0.1
    assert unexplained_v(path.problem, blocks, flexible, 1e-3) < 2 * structured_v(path, one)


def test_what_the_data_could_not_have_spoken_against_is_not_found(path):
    blocks, one = path.blocks, path.chosen
    assert predicted_share(path.problem, blocks, one, 1e-3, "charge") > Thresholds().predicted_share
    assert verdict_on(path, Thresholds()).word == "found"
    by_charge = np.zeros((len(one.point.residual_v), len(blocks.folds["charge"])))
    for k, fold in enumerate(blocks.folds["charge"]):
        by_charge[np.isin(blocks.of_row, fold), k] = 1.0  # a parameter for each range of charge
    point = replace(
        one.point,
        x=np.append(one.point.x, np.zeros(by_charge.shape[1])),
        jacobian_v=np.column_stack([one.point.jacobian_v, by_charge]),
        bounds=np.vstack([one.point.bounds, np.tile([-9.0, 9.0], (by_charge.shape[1], 1))]),
    )
    anything = replace(one, point=point, score=scored(path.problem, blocks, point))
    steady = replace(blocks, folds={k: v for k, v in blocks.folds.items() if k != "rate"})
    assert predicted_share(path.problem, steady, anything, 1e-3, "charge") < 0.1
    verdict = verdict_on(replace(path, chosen=anything, blocks=steady), Thresholds())
    assert (verdict.word, verdict.effects) == ("unknown", ())
    assert "other currents" in verdict.reason


def test_what_only_a_model_without_error_could_tell_is_not_foretold(path):
    blocks, one = path.blocks, path.base
    soc = path.problem.declared_soc
    emptier = (np.max(soc) - soc) / np.ptp(soc)
    point = replace(
        one.point,
        x=np.append(one.point.x, 0.0),
        jacobian_v=np.column_stack([one.point.jacobian_v, 1e-3 * np.exp(12.0 * emptier)]),
        bounds=np.vstack([one.point.bounds, [[-9.0, 9.0]]]),
    )
    smooth = replace(one, point=point, score=scored(path.problem, blocks, point))
    shares = [predicted_share(path.problem, blocks, each, 4e-4, "charge") for each in (one, smooth)]
    assert shares[0] > 0.8
    assert shares[1] < shares[0] - 0.2


def test_at_one_current_there_are_no_ranges_of_it_and_own_parameters_are_not_written(
    cell, few, make, archive
):
    problem = InverseProblem(cell, prepare_all(cell, [make()], 0.9, 0.3), few)
    assert "rate" in blocks_of(problem).folds
    time = np.arange(0.0, 2400.0, 4.0)
    current = np.full(len(time), 0.8 * cell.nominal_capacity_ah)
    voltage = simulate(cell, time, current, soc0=0.95).voltage_v
    noisy = voltage + 1e-3 * np.random.default_rng(0).normal(size=len(time))
    one = InverseProblem(cell, prepare_all(cell, [Measurement(time, current, noisy)], 0.95, 0.3), few)
    blocks = blocks_of(one)
    assert "rate" not in blocks.folds
    assert "charge" in blocks.folds
    base = base_of(one, blocks, archive)
    declared = Option.of(one, blocks, None)
    assert not Option.of(one, blocks, base).tested(declared.usual_error_v)
    held = replace(one, trust="measured")
    assert Option.of(held, blocks, base_of(held, blocks_of(held), archive)).tested(declared.usual_error_v)
    moved = Option.of(one, blocks, base)
    declared = replace(declared, left_out=LeftOut((1.0,), (1.0,)))
    assert model_to_write(declared, [moved])[0] is declared.state
    assert why_not_refit(declared, [moved], [moved], declared.state) == f"the recalibrated model: {UNTESTED}"
    assert why_not_refit(declared, [moved], [moved], moved.state) is None
    third = replace(declared, state=replace(declared.state), left_out=LeftOut((0.5,), (0.5,)))
    why = why_not_refit(declared, [moved], [moved, third], third.state)  # it was written without a reason
    assert why.startswith(f"the recalibrated model: {UNTESTED}; model/ holds another fit of its parameters")
    assert "left-out data is 500.0 mV (1000.0 mV with the declared model)" in why
    named = replace(moved, state=replace(moved.state, hypothesis=("ambient_temperature",)))
    assert model_to_write(declared, [moved], [named]) == (declared.state, f"ambient_temperature: {UNTESTED}")


def test_data_that_order_nothing_give_look_alikes(path):
    lenient = replace(path, steps=tuple(replace(step, admission_nats=-1e6) for step in path.steps))
    verdict = verdict_on(lenient, Thresholds(alike_sds=1e6, solver_v=0.1))
    (group,), (every,), (told,) = verdict.groups, verdict.confidence_sets, verdict.look_alike_notes
    assert group[0] == "ocv_hysteresis"
    assert len(group) == 3
    assert every[:3] == group
    assert all(name in told for name in every[3:])
    assert len(every) > 3


def test_what_is_named_beside_unknown_is_what_the_search_on_a_measured_cell_left(path):
    verdict = partly_explained(path, verdict_on(replace(path, chosen=path.base), Thresholds()), Thresholds())
    assert (verdict.word, verdict.effects) == ("unknown", ("ocv_hysteresis",))
    assert verdict.structured_v == structured_v(path, path.chosen)


def test_an_effect_is_admitted_by_the_largest_gain_on_surrogates(path):
    step = path.steps[0]
    slopes = {g.hypothesis[-1]: g.slopes_v for g in step.grown}
    parent = Parent(path.problem, path.blocks, path.base)
    few = largest_gains(parent, dict(list(slopes.items())[:2]), 200, np.random.default_rng(1))
    every = largest_gains(parent, slopes, 200, np.random.default_rng(1))
    assert np.all(every >= few - 1e-9)  # sums over more columns round otherwise
    assert np.mean(every > admission_nats(parent, slopes)) <= 0.04  # 1 % of draws that set nothing
    assert step.admission_nats == pytest.approx(admission_nats(parent, slopes), rel=1e-9)
    assert step.admission_nats < step.best_gain


def test_what_was_fitted_carries_to_a_part_left_out(path):
    error = left_out_errors(path.problem, path.blocks, path.chosen)
    assert error.pooled_v < 1.3e-3 < left_out_errors(path.problem, path.blocks, None).pooled_v
    assert range_fault(ModelState.of(path.problem, path.chosen), (*ORDINARY_C, *FAST_C)) is None


def test_harm_counts_as_far_as_the_start_of_a_record_left_out_is_known(cell, few, make):
    lost = (CATALOGUE["series_resistance"].activate(resistance_ohm=5e-4),)
    prepared = prepare_all(cell, [make(lost), make(lost, seed=2)], 0.9, 0.0)

    def left(sd, records=prepared):
        known = tuple(replace(r, start=replace(r.start, sd=sd)) for r in records)
        problem = InverseProblem(cell, known, few)
        return problem, left_out_errors(problem, blocks_of(problem), None)

    problem, known = left(1e-6)
    unsure, told = left(0.02)
    error_v = problem.measured - problem.predict({"soc0": {"0": 0.9, "1": 0.9}})
    plain = tuple(np.sqrt(np.mean(error_v[rows] ** 2)) for rows in problem.slices)
    assert known.by_record == told.by_record == pytest.approx(plain)
    worth_v = np.abs(unsure.start_slope_v)
    assert 1e-3 < worth_v.min() < worth_v.max() < 1.0
    shares = 1.0 / (1.0 + (worth_v / MEASURED_V) ** 2)
    ratios = np.square(told.by_range) / np.square(known.by_range)
    assert shares.min() < ratios.min() < ratios.max() < shares.max() < 0.9
    assert (
        left(0.02, prepared[:1])[1] == left(1e-6, prepared[:1])[1]
    )  # begins where the rest of its record ends


def test_models_are_held_against_each_other_on_all_rows_where_a_lag_shows(cell, few):
    time = np.arange(0.0, 1800.0, 0.1)
    rng = np.random.default_rng(0)
    current = cell.nominal_capacity_ah * np.repeat(0.5 + 0.5 * rng.standard_normal(1800), 10)
    voltage = simulate(cell, time, current, 0.9).voltage_v
    late = np.append(voltage[:1], voltage[:-1]) + 1e-3 * rng.standard_normal(len(time))
    records = [Measurement(time, current, late, name=name) for name in ("one", "two")]
    problem = InverseProblem(cell, prepare_all(cell, records, 0.9, 0.0), few)
    assert len(problem.records[0].thin) < 0.2 * len(time)  # means over seconds
    whole = left_out_errors(problem, blocks_of(problem), None)
    run = problem.run(problem.records[0].data, 0.9, (), problem.records[0].hold)
    assert whole.by_record == pytest.approx([np.sqrt(np.mean((late - run.voltage_v) ** 2))] * 2)
    seen_v = problem.measured - problem.predict({"soc0": {"0": 0.9, "1": 0.9}})
    assert whole.by_record[0] > 1.5 * np.sqrt(np.mean(seen_v**2))


def test_a_hypothesis_is_put_where_the_data_without_a_part_put_it(path):
    fold = path.blocks.folds["end"][0]
    values = values_without(path.problem, path.blocks, path.chosen, fold)
    assert values["ocv_hysteresis"]["magnitude_v"] == pytest.approx(0.006, rel=0.1)
    assert values != path.chosen.values
    seen_all = values_without(path.problem, path.blocks, path.chosen, ())
    assert seen_all["ocv_hysteresis"] == pytest.approx(path.chosen.values["ocv_hysteresis"], rel=0.02)


def test_what_is_written_is_never_far_worse_than_another_model_on_a_record_left_out(path):
    def option(*left_mv):
        left_v = tuple(1e-3 * v for v in left_mv)
        return Option(ModelState(path.problem), LeftOut(left_v, left_v))

    cold = option(8.0, 32.0)  # gains in the cold, as much as it loses at the temperature of the first record
    declared, both = option(5.0, 41.0), option(5.5, 38.0)
    assert cold.left_out.pooled_v < both.left_out.pooled_v < declared.left_out.pooled_v
    assert worst_ratio(cold, [cold, declared, both]) == pytest.approx(1.6)
    assert carries_best([declared, cold, both]) is both
    assert carries_best([declared, option(1.0, np.inf)]) is declared
    exact, off = option(0.0), option(1.0)
    assert carries_best([off, exact]) is exact
    assert (worst_ratio(exact, [exact, off]), worst_ratio(off, [exact, off])) == (1.0, np.inf)
    assert model_to_write(declared, [cold, both])[0] is both.state
    nowhere = [option(20.0, np.inf), option(5.0, np.inf)]  # of a record that none runs on nothing is told
    assert carries_best(nowhere) is nowhere[1]
    assert worst_ratio(nowhere[0], nowhere) == pytest.approx(4.0)
    nearly = option(5.0, 39.0)  # its worst ratio within 5 % of the least, which is above 1.05 itself
    assert worst_ratio(nearly, [nearly, cold, both]) > worst_ratio(both, [nearly, cold, both]) > 1.05
    assert model_to_write(nearly, [cold, both])[0] is nearly.state
    state, why = model_to_write(declared, [both], [cold])
    assert state is both.state
    assert "another model has a smaller error on left-out records" in str(why)
    named = option(5.2, 38.5)  # within 5 % of the best on either
    assert model_to_write(declared, [option(5.4, 38.0)], [named]) == (named.state, None)
    refined = option(4.0, 20.0)  # what was named, with the own parameters open
    assert model_to_write(declared, [option(5.4, 38.0)], [named, refined]) == (refined.state, None)


def test_all_that_may_be_written_is_held_against_each_other_on_the_same_rows(cell, few, make, archive):
    effect = CATALOGUE["ocv_hysteresis"].activate(magnitude_v=0.006)
    problem = InverseProblem(
        cell, prepare_all(cell, [make((effect,)), make((effect,), seed=2)], 0.9, 0.0), few
    )
    tight = forward_search(problem, 1, archive)
    measured = forward_search(replace(problem, trust="measured"), 0, archive)
    assert len(measured.blocks) != len(tight.blocks)
    declared = Option.of(problem, tight.blocks, None)
    options = named_options(measured, tight, tight.blocks, archive)
    assert [one.state.problem.trust for one in options] == ["measured", "tight"]
    assert {len(one.left_out.by_range) for one in options} == {len(declared.left_out.by_range)}
    assert model_to_write(declared, [], options)[1] is None


def test_what_needs_an_impossible_cell_is_not_written(path):
    """Eight coefficients of an LFP cell's potential at their limits left 254 mV of a slow discharge, the file 7."""

    def option(left_mv, *beyond):
        left_v = (1e-3 * left_mv,)
        return Option(ModelState(path.problem), LeftOut(left_v, left_v), beyond_spread=beyond)

    declared, impossible, usual = option(20.0), option(8.0, "ocp_shape", "solid_diffusivity"), option(12.0)
    assert model_to_write(declared, [impossible, usual])[0] is usual.state
    assert model_to_write(declared, [impossible])[0] is declared.state
    state, why = model_to_write(declared, [], [impossible])
    assert state is declared.state
    assert "it needs ocp_shape and solid_diffusivity further from the declared value than" in str(why)
    (said,) = refused_refit(declared, [usual, impossible], option(13.0))
    assert said.startswith(
        "the recalibrated model is not written: it needs ocp_shape and solid_diffusivity further"
    )
    assert refused_refit(declared, [impossible], option(7.0)) == ()  # it is no better
    assert refused_refit(declared, [usual], option(13.0)) == refused_refit(declared, [], option(13.0)) == ()
    off = replace(path.chosen, point=replace(path.chosen.point, x=np.full(len(path.chosen.free), 9.0)))
    needed = {one.owner for one in off.free if one.own and one.owner in path.problem.effects}
    assert set(Option.of(path.problem, path.blocks, off).beyond_spread) == needed
    assert Option.of(path.problem, path.blocks, path.chosen).beyond_spread == ()


def test_effects_that_stand_in_are_written_where_they_leave_less_and_are_said_to_be_no_finding(path):
    def option(left_mv, *effects):
        left_v = (1e-3 * left_mv,)
        return Option(ModelState(path.problem, hypothesis=effects), LeftOut(left_v, left_v))

    declared, plain, more = option(20.0), option(15.0), option(9.0, "series_resistance")
    assert model_to_write(declared, [plain, more])[0] is more.state
    assert model_to_write(declared, [plain, option(16.0, "series_resistance")])[0] is plain.state
    (said,) = stand_in_notes(more.state, ())
    assert "series_resistance" in said
    assert "does not show that the cell lacks it" in said
    assert stand_in_notes(more.state, ("series_resistance",)) == stand_in_notes(plain.state, ()) == ()
    _, why = model_to_write(declared, [more], [option(19.9, "ocv_hysteresis")])
    assert "recalibrated model with series_resistance, whose error on left-out data is 9.0 mV" in str(why)


def test_what_does_harm_in_a_range_of_charge_is_not_written(path):
    def option(record_mv, *range_mv):
        ranges = tuple(1e-3 * v for v in range_mv)
        return Option(ModelState(path.problem), LeftOut((1e-3 * record_mv,), ranges))

    declared = option(22.0, 10.0, 30.0)
    chance = option(18.0, 10.0, 36.0)  # by a fifth an RMS of some seven independent samples may be off
    harmful = option(12.0, 17.0, 2.0)
    may_err = option(18.0, 16.0, 20.0)  # models of measured cells err by 13 mV at most
    assert model_to_write(declared, [harmful])[0] is declared.state
    assert model_to_write(declared, [option(21.5, 9.0, 29.0)])[0] is declared.state  # as good
    assert model_to_write(declared, [harmful, may_err])[0] is may_err.state
    assert model_to_write(declared, [chance])[0] is chance.state
    assert "larger than that of the declared model in a range of charge" in str(
        model_to_write(declared, [], [harmful])[1]
    )
    assert model_to_write(declared, [], [harmful, may_err]) == (may_err.state, None)


def test_a_model_that_runs_out_of_salt_where_the_declared_one_does_not_is_refused(path):
    def fault(diffusivity_factor, rate_c):
        poor = CATALOGUE["electrolyte_transport"].activate(diffusivity_factor=diffusivity_factor)
        widened = replace(path.problem, effects={**path.problem.effects, poor.id: poor.effect})
        return range_fault(ModelState(widened, {"soc0": {"0": 0.9}, poor.id: poor.parameters}), (rate_c,))

    assert range_fault(ModelState(path.problem), (4.0,)) is None
    assert fault(0.5, 4.0) is fault(0.2, 2.0) is None
    told = fault(0.2, 4.0)
    assert "a full discharge at 4C runs out of lithium or of salt" in told
    assert "before it reaches its voltage limit" in told


def test_the_reason_why_a_discharge_cannot_be_simulated_brought_a_second_full_stop_into_a_sentence():
    def run(course, soc0, effects, hold):
        if effects:
            raise SimulationError("the electrolyte ran out of salt.")
        return SimpleNamespace(
            voltage_v=np.full(len(course), 3.5), series={"depleted": np.zeros(len(course))}
        )

    cell = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")
    problem = SimpleNamespace(
        cell=cell, records=(), fixed=(), run=run, active=lambda values, good: ("resistance",)
    )
    fault = range_fault(ModelState(problem, {}), (1.0,))
    assert fault == "a full discharge at 1C cannot be simulated (the electrolyte ran out of salt)"


def test_the_first_fit_after_an_interrupted_search_was_joined_to_the_half_line_that_it_left(tmp_path):
    file = tmp_path / "fits.jsonl"
    Archive(file, "case").put("one", np.array([1.0]))
    with file.open("a", encoding="utf-8") as half:
        half.write('{"context": "case", "fit": "cut')
    resumed = Archive(file, "case")
    resumed.put("two", np.array([2.0]))
    resumed.put("three", np.array([3.0]))
    again = Archive(file, "case")
    assert [float(again.get(name, 1)[0]) for name in ("one", "two", "three")] == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("rate_c", [1.0, -0.5])
def test_a_full_course_goes_through_the_whole_charge_of_the_cell(rate_c):
    cell = Cell.from_bpx(CELLS / "nmc_30ah.bpx.json")  # which holds 6 % more than its nominal capacity
    course, soc0 = full_course(cell, rate_c, None)
    moved = course.discharged_ah("linear")[-1] / cell.capacity_ah
    assert 1.0 <= abs(moved) < 1.01
    run = simulate(cell, course.time_s, course.current_a, soc0, hold="linear", on_depletion="clip")
    if rate_c > 0:
        assert run.voltage_v.min() < cell.lower_voltage_v
    else:
        assert run.voltage_v.max() > cell.upper_voltage_v


@pytest.mark.parametrize(("share", "at_fault"), [(0.79, True), (0.81, False)])
def test_running_empty_at_the_end_of_a_discharge_is_no_fault(path, monkeypatch, share, at_fault):
    def end(state, rate, temperature):
        return (1000.0 * share, "runs empty") if state.values else (1000.0, None)

    monkeypatch.setattr("aesi.tracer.decide.carry_over._course_end", end)
    moved = ModelState(path.problem, {"soc0": {"0": 0.9}})
    assert range_fault(moved, ORDINARY_C) == ("runs empty" if at_fault else None)


@pytest.mark.parametrize(
    "change",
    [
        lambda cell: cell.with_positive(rate_constant=0.2 * cell.positive.rate_constant),
        lambda cell: cell.with_negative(diffusivity=scaled(cell.negative.diffusivity, 0.3)),
        lambda cell: replace(cell, contact_resistance_ohm=0.02),
        lambda cell: replace(cell, initial_temperature_k=273.15),
    ],
)
def test_fits_of_another_cell_of_the_same_name_were_taken_for_this_one_s(path, change):
    """They were where its state of charge was that of a full charge, which no kinetics move."""
    problem = path.problem
    assert context_of(replace(problem, cell=change(problem.cell))) != context_of(problem)
    assert context_of(replace(problem, cell=replace(problem.cell))) == context_of(problem)


def test_fits_of_another_version_were_taken_for_this_one_s(path, monkeypatch):
    here = context_of(path.problem)
    monkeypatch.setattr("aesi.tracer.search.archive.source_digest", lambda: "another")
    assert context_of(path.problem) != here


def _typed(text: str, **more: object):
    """A function as typed into a session: no file holds it."""
    names = {"__name__": "typed", **more}
    exec(text, names)
    return names["act"]


@pytest.mark.parametrize(
    "functions",
    [
        lambda: (partial(np.multiply, 1.0), partial(np.multiply, 2.0)),
        lambda: (partial(np.full, shape=3), partial(np.full, shape=4)),
        lambda: tuple(partial(np.stack, arrays=(np.eye(1, 3000, k)[0],)) for k in (1000, 1001)),
        lambda: (_typed("act = lambda x: x * 1.1"), _typed("act = lambda x: x * 1.2")),
        lambda: (_typed("act = lambda x: abs(x)"), _typed("act = lambda x: max(x)")),
        lambda: tuple(_typed("def made(k):\n return lambda x: k * x\nact = made(k)", k=k) for k in (1, 2)),
    ],
)
def test_an_archive_took_the_fits_of_an_effect_that_computes_something_else(functions):
    effect = CATALOGUE["series_resistance"]
    one, other = (identity(replace(effect, on_model=function)) for function in functions())
    assert one != other


def test_an_effect_that_was_typed_in_could_not_be_kept_and_is_the_same_in_every_process():
    program = (
        "from dataclasses import replace\nfrom aesi.physics.effects.catalogue import CATALOGUE\n"
        "from aesi.tracer.search.archive import identity\n"
        "def act(x):\n return (lambda y: y in {'a', 'b', 'c', 'd'})(x)\n"
        "print(identity(replace(CATALOGUE['series_resistance'], on_model=act)))"
    )
    said = [
        subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True, text=True, check=True, env={**os.environ, "PYTHONHASHSEED": seed},
        ).stdout
        for seed in "12"
    ]  # fmt: skip
    assert said[0] == said[1]


def test_of_three_names_that_one_cause_stands_for_the_third_was_lost(monkeypatch):
    wrong = {name: e for name, e in CATALOGUE.items() if any(p.spread for p in e.parameters.values())}
    names = tuple(wrong)[:3]
    cause = next(e for e in CATALOGUE.values() if e.kind == "parameter" and e.id not in wrong)
    one = SimpleNamespace(hypothesis=(cause.id,), at_bounds=())
    problem = SimpleNamespace(effects={**wrong, cause.id: cause}, competing=lambda: ())
    path = Path(problem, None, SimpleNamespace(), (), SimpleNamespace(hypothesis=names))
    monkeypatch.setattr("aesi.tracer.search.one_cause.fitted_hypothesis", lambda *given: one)
    monkeypatch.setattr("aesi.tracer.search.one_cause.most_plausible", lambda fits, many: fits[1])
    assert with_one_effect(path, None)[1] == (cause.id, *names)


def test_without_an_effect_to_name_no_hypothesis_was_more_plausible_than_another():
    """The penalty of no names was 0 times the logarithm of 0."""
    less, more = (
        SimpleNamespace(hypothesis=(), score=SimpleNamespace(evidence=nats, total=0.0))
        for nats in (-2.0, 1.0)
    )
    assert plausibility(more, 0) == 1.0
    assert most_plausible([less, more], 0) is more


def test_an_effect_that_is_a_dataclass_with_other_code_is_another_effect(tmp_path):
    def acting(body):
        file = tmp_path / "acting.py"
        file.write_text(
            "from dataclasses import dataclass\n@dataclass(frozen=True)\nclass Acting:\n    by: float = 1.0\n"
            f"    def __call__(self, model, **values):\n        return {body}\n"
        )
        scope = {}
        exec(compile(file.read_text(), str(file), "exec"), scope)
        return replace(CATALOGUE["series_resistance"], on_model=scope["Acting"]())

    one, same, other = (identity(acting(body)) for body in ("model", "model", "None"))
    assert one == same
    assert one != other


def test_an_archive_knows_an_effect_by_what_it_is(path, tmp_path):
    effect = CATALOGUE["series_resistance"]
    wider = {k: replace(p, bounds=(0.0, 0.2)) for k, p in effect.parameters.items()}
    assert identity(effect) == identity(effect)
    assert identity(replace(effect, parameters=wider)) != identity(effect)
    one, two = Archive(tmp_path / "a.jsonl", context_of(path.problem)), None
    one.put("fit", np.array([1.0, 2.0]))
    two = Archive(tmp_path / "a.jsonl", context_of(path.problem))
    assert two.get("fit", 2).tolist() == [1.0, 2.0]
    assert two.get("fit", 3) is None
    other = Archive(tmp_path / "a.jsonl", "another case", other_model=two)
    assert other.get("fit", 2) is None
    assert other.near("fit", 2).tolist() == [1.0, 2.0]
    assert two.near("fit", 2) is None


def test_the_map_gives_the_frequency_that_it_was_fitted_to():
    rng = np.random.default_rng(1)
    margins = rng.normal(0.0, 2.0, 3000)
    right = rng.random(3000) < 1.0 / (1.0 + np.exp(-(0.5 + 0.8 * margins)))
    found = fitted_map(margins.tolist(), right.tolist())
    for margin in (-2.0, 0.0, 2.0):
        assert found.frequency(margin) == pytest.approx(1.0 / (1.0 + np.exp(-(0.5 + 0.8 * margin))), abs=0.04)
    assert FrequencyMap(0.5, 0.8, 0).frequency(20.0) == HIGHEST


def test_an_archive_knows_how_the_current_runs_between_rows(path):
    (record,) = path.problem.records
    other = "linear" if record.thin_hold == "backward" else "backward"
    held = replace(path.problem, records=(replace(record, thin_hold=other),))
    assert context_of(held) != context_of(path.problem)


def test_the_resistance_that_a_file_is_off_by_does_not_come_from_the_joints_of_records(cell, few):
    time = np.arange(0.0, 1500.0, 4.0)

    def discharge(rate_c, soc0):
        current = np.full(len(time), rate_c * cell.nominal_capacity_ah)
        voltage = simulate(cell, time, current, soc0=soc0).voltage_v
        return Measurement(time, current, voltage, name=f"{rate_c}")

    records = prepare_all(cell, [discharge(1.0, 0.6), discharge(0.5, 0.95)], None, 0.0)
    contacts = InverseProblem(cell, records, few, trust="measured").file_errors_v(())[:, 0]
    assert np.abs(contacts).max() < 1e-6  # nothing steps within a record


def test_a_fit_with_the_whole_model_stands_before_a_linear_one_whatever_their_order(path):
    grown = next(one for one in path.steps[0].grown if one.hypothesis == path.chosen.hypothesis)
    again = replace(grown, score=replace(grown.score, total=path.chosen.score.total + 1.0))
    later = replace(path, steps=(*path.steps, Step((path.chosen,), (again,), (), None)))
    told = {one.hypothesis: one for one in later.explanations()}
    assert told[path.chosen.hypothesis] is path.chosen
    assert () in told


def told(hypothesis, total, nats=()):
    score = SimpleNamespace(total=total, log_density={"block": np.array([*nats, 0.0, 0.0])})
    return SimpleNamespace(hypothesis=hypothesis, score=score)


def test_a_name_that_says_little_more_than_none_has_a_small_margin():
    """2 nats are a likelihood ratio statistic of 4, two standard deviations (Wilks)."""
    chosen, base = told(("a",), 2.0), told((), 0.0)
    path = SimpleNamespace(chosen=chosen, explanations=lambda: [base, chosen], steps=(), admission_nats=0.5)
    assert look_alikes(path, Thresholds()) == ((), pytest.approx(2.0))


def test_a_rival_that_lags_makes_the_margin_its_nats_over_their_deviation():
    """Over three blocks of 10, 8 and 6 nats more the difference of 24 scatters by 2 * 3**0.5, 3.46."""
    chosen, other, base = (
        told(("a",), 60.0, (10.0, 8.0, 6.0)),
        told(("b",), 36.0, (0.0, 0.0, 0.0)),
        told((), 0.0),
    )
    for one in (chosen, other):
        one.score.log_density["block"] = one.score.log_density["block"][:3]
    path = SimpleNamespace(
        chosen=chosen, explanations=lambda: [base, chosen, other], steps=(), admission_nats=3.0
    )
    assert look_alikes(path, Thresholds()) == ((), pytest.approx(24.0 / (2.0 * 3**0.5)))


def finding(*effects, sets=()):
    return Verdict("found", effects, sets, 0.8, 1e-4, 6e-4, "made", 2.0)


def test_what_the_other_model_names_in_the_same_place_is_a_look_alike():
    full = finding("series_resistance", "ocp_shape", sets=(("ocp_shape", "electrode_thickness"),))
    single = finding("ocv_hysteresis", "series_resistance", sets=(("ocv_hysteresis", "porosity"),))
    both = across_models(full, single)
    assert both.confidence_sets == (("ocp_shape", "electrode_thickness", "ocv_hysteresis"),)
    assert replace(both, confidence_sets=full.confidence_sets) == full
    alone = across_models(finding("ocp_shape"), finding("electrode_thickness"))
    assert alone.confidence_sets == (("ocp_shape", "electrode_thickness"),)


@pytest.mark.parametrize(
    "other",
    [
        finding("ocp_shape", "series_resistance", sets=(("ocp_shape", "porosity"),)),
        finding("series_resistance"),
        finding("series_resistance", "ocv_hysteresis", "clock_skew"),
        finding("clock_skew", "ocv_hysteresis"),
        replace(finding("series_resistance", "ocv_hysteresis"), word="unknown"),
    ],
)
def test_another_model_adds_no_look_alike_where_it_does_not_explain_the_rest_in_the_same_way(other):
    full = finding("series_resistance", "ocp_shape", sets=(("ocp_shape", "electrode_thickness"),))
    assert across_models(full, other) == full


def test_an_effect_whose_table_or_helper_changed_was_taken_for_what_it_was(path):
    table = SimpleNamespace(scale=1.0)  # stands for what the code of an effect reads elsewhere

    def drop(trace, *, resistance_ohm):
        return Contribution(-table.scale * resistance_ohm * trace.current_a)

    contact = CATALOGUE["series_resistance"]
    own = replace(contact, id="own", on_model=None, on_voltage=drop)
    tried = replace(path.problem, effects={**path.problem.effects, "own": own})
    given = replace(path.problem, fixed=(own.activate(),))
    before = [context_of(problem) for problem in (tried, given)]
    assert [context_of(replace(problem)) for problem in (tried, given)] == before
    table.scale = 4.0
    assert all(context_of(replace(p)) != one for p, one in zip((tried, given), before, strict=True))
