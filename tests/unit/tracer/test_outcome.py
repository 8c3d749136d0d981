"""Errors on what chose nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from aesi.errors import SimulationError
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


def part_of(*, simulated):
    """The outcome on a test record on which only some states can be simulated, each at its own state of charge."""

    class Model:
        def __init__(self, soc):
            self.soc = soc

        def simulated(self, record, index, thin):
            if self.soc is None:
                raise SimulationError("no number at 3 s.")
            n = len(record.data)
            series = {"soc": np.full(n, self.soc), "depleted": np.zeros(n)}
            return type("Run", (), {"voltage_v": np.zeros(n), "series": series, "__len__": lambda _: n})()

        def start_slope_v(self, record):
            raise SimulationError("no number at 3 s.")

    data = Measurement(np.arange(9.0), np.ones(9), np.full(9, 3.7), name="t")
    record = SimpleNamespace(
        data=data, name="t", lead_rows=0, noise_full_v=1e-3, hold="linear", continues=None
    )
    socs = {"before": 0.2, "recalibrated": 0.5, "after": 0.8}
    states = {name: Model(soc if name in simulated else None) for name, soc in socs.items()}
    (found,) = outcome.outcomes((), states, (record,), np.random.default_rng(0))
    return found


@pytest.mark.parametrize(
    ("simulated", "soc"),
    [(("before", "recalibrated", "after"), 0.8), (("before", "recalibrated"), 0.2), (("recalibrated",), 0.5)],
)
def test_a_part_that_the_recalibrated_model_alone_can_run_had_no_state_of_charge(simulated, soc):
    assert part_of(simulated=simulated).soc == pytest.approx(soc)


def test_where_no_model_can_be_simulated_the_state_of_charge_is_not_known():
    assert np.isnan(part_of(simulated=()).soc).all()
