"""Gradient boosting is fitted, weighed and judged as the models that it is compared with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import DataError
from aesi.records import HeldOutDrive, Split
from aesi.sparse import Options, Problem
from aesi.sparse.baselines.boosting import TREES, BoostedErrorModel, gradient_boosting
from aesi.sparse.terms.scaling import Scaling

OPTIONS = Options(p_c=1, d=2, mixed=False, resamples=10, block=60, feedback=False, fade=True)
DRIVES = tuple(make_record(400, seed=seed, name=f"drive {seed}") for seed in range(3))


def test_rows_that_count_nothing_teach_nothing():
    honest = Problem.build(Split(DRIVES, (), ()), OPTIONS)
    ignored = np.arange(len(honest.target)) % 400 < 100
    weighed = replace(honest, row_weights=np.where(ignored, 0.0, honest.row_weights))
    spoilt = np.where(ignored, 9.0, honest.target)
    other = replace(weighed, target=spoilt, fold_targets=np.broadcast_to(spoilt, honest.fold_targets.shape))
    runs = [gradient_boosting(each).free_run(DRIVES[0]).error_v for each in (weighed, other)]
    np.testing.assert_allclose(runs[0], runs[1], atol=1e-12)


@pytest.mark.parametrize("steps", [0, -1, 1.5])
def test_a_step_that_is_none_ended_in_an_index_out_of_bounds(steps):
    scaling = Scaling(np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    model = BoostedErrorModel(None, scaling, ("I",), 1.0, 0.5)
    with pytest.raises(DataError, match=f"gradient boosting: a prediction {steps} steps ahead is none"):
        model.k_step(DRIVES[0], steps)


def flipped(places) -> tuple:
    """The drives, those at the places with the opposite error."""
    return tuple(replace(d, error_v=-d.error_v) if i in places else d for i, d in enumerate(DRIVES))


@pytest.mark.parametrize(("all_of_them", "corrected"), [(False, False), (True, True)])
def test_what_is_learnt_without_a_drive_and_judged_on_it_is_the_error_of_physics_that_has_not_seen_it(
    all_of_them, corrected
):
    """The physics without a drive errs the other way, on that drive alone, or on all of them."""
    left_out = [
        HeldOutDrive.of(flipped(range(3) if all_of_them else [place]), place, slice(0, 400))
        for place in range(3)
    ]
    problem = Problem.build(Split(DRIVES, (), ()), OPTIONS, left_out=left_out)
    given = np.abs(gradient_boosting(problem).free_run(DRIVES[0], 0.0).error_v).max()
    assert given > 5e-3 if corrected else given < 1e-15


def test_the_number_of_trees_is_that_of_the_best_prediction_of_left_out_drives():
    noise = [
        replace(d, error_v=5e-3 * np.random.default_rng(i).normal(size=len(d))) for i, d in enumerate(DRIVES)
    ]
    for drives, trees in ((DRIVES, max(TREES)), (tuple(noise), min(TREES))):
        problem = Problem.build(Split(drives, (), ()), replace(OPTIONS, fade=False))
        assert gradient_boosting(problem).regressor.n_iter_ == trees


def test_far_from_what_they_were_fitted_to_the_trees_give_way_to_the_physics():
    model = gradient_boosting(Problem.build(Split(DRIVES, (), ()), OPTIONS))
    series = DRIVES[0]
    beyond = replace(series, inputs=series.inputs + 3 * np.ptp(series.inputs, axis=0))
    np.testing.assert_allclose(model.free_run(beyond, 0.0).error_v, 0.0, atol=1e-9)
