"""What is compared with the search has its library and is picked by its weights and constraints."""

from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.records import Split
from aesi.sparse import FitnessWeights, Options, Problem
from aesi.sparse.baselines import BASELINES, Judge, Tuning, plain_ridge

GRIDS = ("PySINDy ensemble", "ridge", "gradient boosting")
"""Those that try each setting of a grid."""
DRIVES = tuple(make_record(400, seed=seed, feedback=0.9, name=f"drive {seed}") for seed in range(2))
OPTIONS = Options(p_c=1, d=2, mixed=False, special=False, resamples=10, block=60)


def test_ridge_fed_the_error_back_where_the_library_forbids_it():
    """Of an error that mostly repeats itself, which the terms of the error take up."""
    free, forbidden = (
        plain_ridge(Problem.build(Split(DRIVES, (), ()), replace(OPTIONS, feedback=feedback)))
        for feedback in (True, False)
    )
    assert free.has_feedback
    assert not forbidden.has_feedback


class Watching(Judge):
    """Remembers the fitness of what it is asked about, and admits all of it or that of one fitness."""

    def __init__(self, weights: FitnessWeights, only: float | None = None):
        super().__init__(weights)
        object.__setattr__(self, "only", only)
        object.__setattr__(self, "asked", [])

    def admits(self, one):
        self.asked.append(one.fitness)
        return self.only is None or one.fitness == self.only


@pytest.fixture(scope="module")
def problem():
    return Problem.build(Split(DRIVES, (), ()), replace(OPTIONS, feedback=False))


@pytest.mark.parametrize("name", ["SINDy-C", *GRIDS])
def test_peers_were_weighed_by_other_weights_than_the_search(problem, name):
    judge = Watching(FitnessWeights(0.0, 0.0, 0.0))
    BASELINES[name](problem, Tuning(candidates=4, population=4, judge=judge))
    assert set(judge.asked) == {1.0}


@pytest.mark.parametrize("name", GRIDS)
def test_peers_were_picked_without_the_constraints_of_the_search(problem, name):
    free = Watching(FitnessWeights())
    fittest = BASELINES[name](problem, Tuning(judge=free))
    bound = BASELINES[name](problem, Tuning(judge=Watching(FitnessWeights(), only=min(free.asked))))
    said = [model.free_run(DRIVES[0]).error_v for model in (fittest, bound)]
    assert np.abs(said[0] - said[1]).max() > 1e-5


def test_sindy_c_fed_the_error_back_where_the_library_forbids_it(problem):
    model = BASELINES["SINDy-C"](problem, Tuning(candidates=4, population=4))
    assert not model.has_feedback


def test_the_ensemble_of_pysindy_keeps_a_measured_error_as_ridge_does(problem):
    """One step ahead of an error that mostly repeats itself. Judged with a memory and used without one, it repeated its
    free run."""
    drive = make_record(400, seed=5, feedback=0.9, name="another drive")
    for name in ("ridge", "PySINDy ensemble"):
        model = BASELINES[name](problem, Tuning())
        one_step, free = (
            np.mean((drive.error_v - said) ** 2)
            for said in (model.one_step(drive), model.free_run(drive).error_v)
        )
        assert one_step < 0.8 * free
