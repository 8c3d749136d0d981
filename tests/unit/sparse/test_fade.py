"""The correction gives way to the physics outside its range and where left-out drives do not bear it out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from sparse_records import make_record

from aesi.records import Split
from aesi.sparse import Candidate, Genome, Options, Problem, SparseModel, evaluate
from aesi.sparse.baselines.dmd_c import dmd_with_control
from aesi.sparse.baselines.pysindy_ensemble import pysindy_ensemble
from aesi.sparse.fade import DOUBT, shrunken_slope
from aesi.sparse.search.pick.nested import nested_shares, picked

OPTIONS = Options(p_c=2, d=2, special=False, mixed=False, resamples=20, block=60, fade=True)


def drives(seeds, **changes):
    return tuple(replace(make_record(600, seed=seed), name=f"drive {seed}", **changes) for seed in seeds)


def fitted(records) -> tuple[Problem, Candidate]:
    problem = Problem.build(Split(records, (), ()), OPTIONS)
    candidate = evaluate(problem, Genome.whole(problem.library, 1e-1, 1e-3, 0.5, p_c=2, d=2, feedback=False))
    assert isinstance(candidate, Candidate)
    return problem, candidate


def sums(slopes, size=1.0):
    """(n_drives, 3) of corrections of that size relative to the error."""
    return np.array([[1.0, slope * size, size] for slope in slopes])


def test_an_amplitude_that_drives_agree_on_is_kept_and_one_they_dispute_is_not():
    four = np.arange(4)
    assert shrunken_slope(sums([0.8] * 4), four) == pytest.approx(0.8 / (1.0 + DOUBT))
    assert shrunken_slope(sums([2.0, -1.8, 2.0, -1.8]), four) == 0.0
    assert shrunken_slope(sums([-1.0] * 4), four) == 0.0


def test_what_left_out_drives_hardly_see_is_not_believed():
    assert shrunken_slope(sums([1.0] * 4, size=1e-3), np.arange(4)) < 0.05


def test_halves_of_two_drives_are_two_witnesses_and_not_four():
    slopes, halves = [0.9, 0.9, 0.7, 0.7], np.array([0, 0, 1, 1])
    # Two drives: the slopes without either differ by 0.2 / (1 + DOUBT), so the standard error is half of that, and
    # Student's t with one degree of freedom, the Cauchy distribution, has tan(pi (p - 1 / 2)) for its quantile.
    error = 0.5 * 0.2 / (1.0 + DOUBT)
    expected = 0.8 / (1.0 + DOUBT) - np.tan(np.pi * (norm.cdf(1.0) - 0.5)) * error
    assert shrunken_slope(sums(slopes), halves) == pytest.approx(expected)
    assert shrunken_slope(sums(slopes), halves) < shrunken_slope(sums(slopes), np.arange(4))


def test_pieces_of_a_single_drive_stand_for_drives():
    one = np.zeros(4, dtype=int)
    assert shrunken_slope(sums([2.0, -1.8, 2.0, -1.8]), one) == 0.0
    assert shrunken_slope(sums([0.5]), one[:1]) == pytest.approx(0.5 / (1.0 + DOUBT))


def test_a_slope_that_one_drive_alone_determines_was_no_number():
    alone = np.array([[1.0, 0.9, 0.9], [0.0, 0.0, 0.0]])
    assert shrunken_slope(alone, np.arange(2)) == 0.0
    assert shrunken_slope(np.vstack([alone, alone[1:]]), np.arange(3)) == 0.0


def test_records_are_the_folds_and_a_true_error_is_kept():
    problem, candidate = fitted(drives(range(4)))
    assert problem.folds == problem.spans
    assert candidate.bagging.fade.amplitude > 0.85
    assert nested_shares(problem, [candidate], 0).max() < 0.2


def test_an_error_that_no_other_drive_has_is_left_to_the_physics():
    rng = np.random.default_rng(0)
    # Each drive has an error of its own sign: nothing carries over.
    records = tuple(
        replace(record, error_v=sign * record.error_v + 1e-4 * rng.normal(size=len(record)))
        for record, sign in zip(drives(range(4)), (1, -1, 1, -1), strict=True)
    )
    problem, candidate = fitted(records)
    assert candidate.bagging.fade.amplitude == 0.0
    fresh = make_record(300, seed=9)
    np.testing.assert_allclose(candidate.bagging.free_run(fresh, 0.0).error_v, 0.0, atol=1e-12)
    np.testing.assert_allclose(nested_shares(problem, [candidate], 0), 1.0)


def test_a_drive_that_the_physics_errs_nowhere_on_divided_by_zero():
    exact, *others = drives(range(4))
    exact = replace(exact, error_v=np.zeros(len(exact)))
    problem, candidate = fitted((exact, *others))
    with np.errstate(divide="raise", invalid="raise"):
        shares = nested_shares(problem, [candidate], 0)
    assert shares[0] == 1.0
    assert np.isfinite(shares).all()


def test_a_correction_that_feeds_back_was_shrunk_where_it_was_judged_by_folds_apart_and_not_where_it_is_used():
    records = tuple(replace(make_record(600, seed=s, feedback=0.8), name=f"drive {s}") for s in range(4))
    problem = Problem.build(Split(records, (), ()), OPTIONS)
    candidate = evaluate(problem, Genome.whole(problem.library, 1e-1, 1e-3, 0.5, p_c=2, d=2))
    assert candidate.bagging.fade is None
    every = np.ones(len(problem.folds), dtype=bool)
    assert picked(problem, [candidate], 0, every).amplitude == 1.0
    squared, crossed, own = candidate.fold_sums[0].T
    shares = nested_shares(problem, [candidate], 0)
    np.testing.assert_allclose(shares, (squared - 2.0 * crossed + own) / squared)


def test_far_outside_the_range_little_of_the_correction_is_left():
    _, candidate = fitted(drives(range(3)))
    model = candidate.bagging
    record = make_record(300, seed=9)
    shifted = replace(record, inputs=record.inputs + 5.0 * np.ptp(record.inputs, axis=0))
    assert np.abs(model.free_run(shifted, 0.0).error_v).max() < 0.01 * np.abs(record.error_v).max()
    again = SparseModel.from_dict(model.to_dict())
    np.testing.assert_array_equal(again.free_run(record).error_v, model.free_run(record).error_v)


def test_what_is_kept_is_all_at_the_fitted_rows_and_the_part_of_the_correction_that_is_seen_elsewhere():
    _, candidate = fitted(drives(range(3)))
    model, record = candidate.bagging, make_record(300, seed=9)
    unfaded = replace(model, fade=None, memory=0.0)
    model = replace(model, memory=0.0, fade=replace(model.fade, amplitude=1.0))
    shifted = replace(record, inputs=record.inputs + 0.7 * np.ptp(record.inputs, axis=0))
    kept = model.kept(shifted)
    assert 0.0 < kept.min() < kept.max() < 1.0
    whole, part = (each.free_run(shifted, 0.0).error_v[1:] for each in (unfaded, model))
    np.testing.assert_allclose(part, kept[:-1] * whole, atol=1e-12)
    np.testing.assert_array_equal(unfaded.kept(shifted), 1.0)


def test_peers_fit_the_same_rows():
    problem, _ = fitted(drives(range(3)))
    record = make_record(300, seed=9)
    bare = np.mean(record.error_v**2)
    ensemble = pysindy_ensemble(problem, seed=0)
    assert np.mean((record.error_v - ensemble.free_run(record).error_v) ** 2) < 0.5 * bare
    linear = dmd_with_control(problem)
    assert linear.has_feedback
    assert set(linear.terms) <= {"1", *(f"T1({name})" for name in problem.library.variables)}


def test_each_fold_knows_the_drive_that_it_is_a_part_of():
    problem = Problem.build(Split(drives(range(3)), (), ()), replace(OPTIONS, cuts=2))
    assert problem.fold_drives.tolist() == [0, 0, 1, 1, 2, 2]
