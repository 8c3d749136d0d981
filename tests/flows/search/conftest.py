"""A small problem with a known error, shared by the tests of the search."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "unit" / "sparse"))

from sparse_records import make_record

from aesi.records import Split
from aesi.sparse import Options, Problem


@pytest.fixture(scope="module")
def problem():
    return Problem.build(
        Split((make_record(500, seed=1), make_record(400, seed=2, name="second")), (), ()),
        Options(p_c=2, d=2, mixed=False, resamples=8, block=50),
    )
