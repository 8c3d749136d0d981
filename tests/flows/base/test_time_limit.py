"""Work is interrupted after its time, and limits within limits each keep their own."""

import signal
import time
from contextlib import suppress

import pytest

from flows.base.time_limit import Overdue, time_limit


class Late(Exception):
    """The time of an outer limit is over."""


class InnerLate(Exception):
    """The time of an inner limit is over."""


def test_time_is_limited_within_the_block_alone():
    with pytest.raises(Late), time_limit(0.1, Late):
        time.sleep(10)
    with time_limit(None, Late):
        time.sleep(0.01)


def test_where_no_signal_tells_the_time_a_limit_is_none(monkeypatch):
    monkeypatch.delattr("signal.SIGALRM")  # as on Windows
    with time_limit(0.01, Late):
        time.sleep(0.05)


@pytest.mark.parametrize("inner_s", [5.0, None])
def test_an_inner_limit_ended_the_outer_one(inner_s):
    def work():
        with time_limit(inner_s, InnerLate):
            time.sleep(0.01)
        time.sleep(10)

    began = time.monotonic()
    with pytest.raises(Late), time_limit(0.2, Late):
        work()
    assert time.monotonic() - began < 4


def test_an_inner_limit_had_an_outer_one_that_was_over_go_on():
    began = time.monotonic()
    with pytest.raises(Late), time_limit(0.1, Late), time_limit(5.0, InnerLate):
        time.sleep(10)
    assert time.monotonic() - began < 4


def test_an_outer_limit_that_is_over_is_no_reason_of_an_inner_one():
    reasons = []

    def work():
        try:
            with time_limit(5.0, InnerLate):
                time.sleep(10)
        except BaseException as reason:
            reasons.append(type(reason))
            raise

    with pytest.raises(Late), time_limit(0.1, Late):
        work()
    assert reasons == [Overdue]


def test_an_inner_limit_that_is_over_leaves_the_outer_one_its_time():
    ended = []

    def work():
        for _ in range(2):
            with suppress(InnerLate), time_limit(0.05, InnerLate):
                time.sleep(10)
            ended.append(time.monotonic())
        time.sleep(10)

    with pytest.raises(Late), time_limit(1.0, Late):
        work()
    assert len(ended) == 2


def test_a_timer_of_others_goes_on_behind_a_limit():
    rung = []
    before = signal.signal(signal.SIGALRM, lambda number, frame: rung.append(time.monotonic()))
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1)
        with pytest.raises(Late), time_limit(0.3, Late):
            time.sleep(10)  # which goes on after a handler that raises nothing
        assert len(rung) == 1
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with time_limit(5.0, Late):
            time.sleep(0.01)
        time.sleep(0.4)
        assert len(rung) == 2
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_a_limit_leaves_no_timer_and_no_handler():
    before = signal.getsignal(signal.SIGALRM)
    with time_limit(5.0, Late), time_limit(2.0, InnerLate):
        pass
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
    assert signal.getsignal(signal.SIGALRM) is before
