"""Errors on what chose nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from aesi.records import Measurement
from aesi.tracer.report import outcome

OFF_V = 10e-3
"""On what no fit has seen; the fitted rows are met exactly."""


def prepared(n, n_fit, lead=0, good=False):
    """A record of `n` rows that is off by OFF_V behind its fitted rows, or behind those that only lead to it."""
    seen = np.arange(n) < (lead or n_fit)
    thin = Measurement(np.arange(n), np.ones(n), np.where(seen, 0.0, OFF_V))
    return SimpleNamespace(thin=thin, n_fit=n_fit, lead_rows_thin=lead, good=good)


STATE = SimpleNamespace(
    simulated=lambda record, index, thin: SimpleNamespace(voltage_v=np.zeros(len(record.thin)))
)


def error_v(records, tests=()):
    return outcome.held_out_rmse_v(STATE, records, tests)


def test_fitted_rows_of_good_records_were_among_those_that_judge_a_candidate():
    kept_back, good = prepared(1000, 700), prepared(960, 960, good=True)
    assert error_v([kept_back, good]) == pytest.approx(OFF_V)


def test_a_candidate_is_judged_by_what_lies_behind_the_rows_that_lead_to_it():
    fitted, led = prepared(600, 600), prepared(900, 900, lead=600)
    assert error_v([fitted], [led]) == pytest.approx(OFF_V)


def test_a_candidate_is_judged_by_no_row_that_was_fitted():
    whole = prepared(500, 500)
    whole.thin.voltage_v[:] = 3e-3
    assert error_v([whole]) is None
    assert error_v([whole, prepared(1000, 700)]) == pytest.approx(OFF_V)
