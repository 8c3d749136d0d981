"""Problems over small records with a known error, shared by the tests of the sparse room."""

import sys
from pathlib import Path

import pytest

from aesi.records import Split
from aesi.sparse import Options, Problem

sys.path.insert(0, str(Path(__file__).parent))  # pytest's importlib mode does not add the folder of a test

from sparse_records import make_record


@pytest.fixture(scope="session")
def split() -> Split:
    return Split((make_record(seed=1), make_record(600, seed=2, name="second")), (), (make_record(seed=3),))


@pytest.fixture(scope="session")
def problem(split: Split) -> Problem:
    return Problem.build(split, Options(p_c=2, d=2, mixed=False, resamples=20, block=60))


@pytest.fixture(scope="session")
def feedback_problem() -> Problem:
    train = (make_record(seed=1, feedback=0.8), make_record(600, seed=2, feedback=0.8, name="second"))
    return Problem.build(Split(train, (), ()), Options(p_c=2, d=2, mixed=False, resamples=20, block=60))
