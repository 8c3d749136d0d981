"""What is learnt without a drive, and judged on it, is the error of physics that has not seen that drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import DataError
from aesi.records import HeldOutDrive, Split
from aesi.sparse import Candidate, Genome, Options, Problem, STRidge, evaluate
from aesi.sparse.search.fold_models import fold_models
from aesi.sparse.search.judge import memory_of

OPTIONS = Options(
    p_c=1, d=2, special=False, mixed=False, resamples=20, block=60, feedback=False, fade=True, balance=False
)
DRIVES = tuple(replace(make_record(600, seed=seed), name=f"drive {seed}") for seed in range(3))


def shifted(by_v: float):
    return tuple(replace(record, error_v=record.error_v + by_v) for record in DRIVES)


def left_out() -> list[HeldOutDrive]:
    """Physics that errs by 1 mV more for each place of the drive that it has not seen."""
    return [HeldOutDrive.of(shifted(1e-3 * (k + 1)), k, slice(0, 600)) for k in range(3)]


def problem(left) -> Problem:
    return Problem.build(Split(DRIVES, (), ()), OPTIONS, left_out=left)


def test_physics_of_too_few_folds_was_passed_over_in_silence():
    with pytest.raises(
        DataError, match="without 2 parts of the training records, but the search leaves out 3"
    ):
        problem(left_out()[:2])


def candidate(of: Problem) -> Candidate:
    found = evaluate(of, Genome.whole(of.library, 1e-3, 1e-6, 0.5, p_c=1, d=2, feedback=False))
    assert isinstance(found, Candidate)
    return found


def test_each_drive_is_judged_by_the_error_of_its_own_physics():
    plain, honest = problem([]), problem(left_out())
    moved_v = plain.scaling.error_volts_per_unit * (honest.unseen_target - plain.target)
    for k, (a, b) in enumerate(honest.spans):
        np.testing.assert_allclose(moved_v[a:b], 1e-3 * (k + 1), rtol=1e-9)
    np.testing.assert_array_equal(honest.target, plain.target)
    np.testing.assert_allclose(
        honest.full_factor.T @ honest.full_factor, plain.full_factor.T @ plain.full_factor
    )


def test_a_fit_without_a_drive_learns_the_error_of_the_physics_without_it():
    honest = problem(left_out())
    active = np.flatnonzero(honest.library.admitted(1, 2, feedback=False))
    solver = STRidge(1e-3, 1e-6)
    for k, (a, b) in enumerate(honest.folds):
        others = np.r_[0:a, b : len(honest.target)]
        shift = 1e-3 * (k + 1) / honest.scaling.error_volts_per_unit
        by_hand = solver.fit(honest.theta(active).T[others], honest.target[others] + shift)
        by_factor = solver.fit_factor(honest.fold_factors[k][:, np.append(active, len(honest.library))])
        np.testing.assert_allclose(by_factor, by_hand, atol=1e-9)


def test_the_model_of_a_fold_is_fitted_as_the_served_one_and_meets_the_drive_under_that_physics():
    honest = problem(left_out())
    for k, (model, series, rows) in enumerate(fold_models(honest, candidate(honest), left_out=left_out())):
        np.testing.assert_array_equal(series.error_v, DRIVES[k].error_v + 1e-3 * (k + 1))
        left = (series.error_v - model.free_run(series).error_v)[rows]
        assert left.mean() == pytest.approx(1e-3 * (k + 1), rel=0.4)


def test_an_error_that_physics_made_worse_by_seeing_nothing_of_it_lowers_the_amplitude():
    # What physics without a drive leaves on it has the opposite sign: the correction does not carry over.
    against = tuple(replace(record, error_v=-record.error_v) for record in DRIVES)
    left = [
        HeldOutDrive.of(tuple(against[i] if i == k else DRIVES[i] for i in range(3)), k, slice(0, 600))
        for k in range(3)
    ]
    assert candidate(problem([])).bagging.fade.amplitude > 0.85
    assert candidate(problem(left)).bagging.fade.amplitude == 0.0


def test_one_fold_that_drifts_away_does_not_set_the_memory():
    honest = problem([])
    rng = np.random.default_rng(0)
    noise = [1e-2 * rng.standard_normal(b - a) for a, b in honest.folds]
    noise[1] += np.linspace(0.0, 10.0, len(noise[1]))
    given = [honest.unseen_target[a:b] - left for (a, b), left in zip(honest.folds, noise, strict=True)]
    assert memory_of(honest, given) == pytest.approx(0.0, abs=0.1)


def test_an_error_that_is_none_under_physics_fitted_without_a_part_is_told():
    left = left_out()
    lacking = left[1].errors_v[2].copy()
    lacking[17] = np.nan
    left[1] = replace(left[1], errors_v=(*left[1].errors_v[:2], lacking))
    with pytest.raises(
        DataError, match=r"without part 2 .* the error of training record 3 is not a number in row 18"
    ):
        problem(left)
