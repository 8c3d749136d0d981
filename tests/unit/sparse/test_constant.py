"""The constant that any correction has to beat."""

from dataclasses import replace

import numpy as np
import pytest
from sparse_records import make_record

from aesi.errors import FitError
from aesi.records import Split
from aesi.sparse import Options, Problem
from aesi.sparse.baselines.constant import constant
from aesi.sparse.terms.library import Library, Term


def fitted(shift_v: float):
    record = make_record(700, seed=1)
    train = replace(record, error_v=record.error_v + shift_v)
    return constant(
        Problem.build(Split((train,), (), ()), Options(p_c=1, d=2, mixed=False, resamples=4, block=60))
    )


def said(model):
    run = model.free_run(make_record(120, seed=4), 0.003).error_v
    assert run[0] == 0.003
    assert np.ptp(run[1:]) == 0.0
    return run[1]


def test_an_offset_of_the_errors_is_found_whole():
    np.testing.assert_allclose(said(fitted(0.005)) - said(fitted(0.0)), 0.005, rtol=1e-6)


def test_it_lies_at_the_mean_of_the_errors():
    error_v = make_record(700, seed=1).error_v
    assert abs(said(fitted(0.0)) - error_v.mean()) < 0.1 * error_v.std()  # rows count by their weights


def test_nothing_measured_moves_it():
    series = make_record(120, seed=4)
    np.testing.assert_array_equal(fitted(0.0).one_step(series)[1:], said(fitted(0.0)))


def test_a_library_without_the_constant_was_told_by_a_tuple():
    record = make_record(700, seed=1)
    whole = Library.build(record.input_names, p_c=1, d=1, special=False, mixed=False)
    without = whole.take(j for j, term in enumerate(whole.terms) if term != Term())
    problem = Problem.build(Split((record,), (), ()), Options(resamples=4, block=60), without)
    with pytest.raises(FitError, match="constant needs the constant term of the library"):
        constant(problem)
