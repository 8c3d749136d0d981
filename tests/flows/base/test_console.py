"""What is said of work that goes on."""

import time

import pytest

from flows.base.console import Console


@pytest.mark.parametrize(
    ("done", "known", "told"),
    [
        (2, 0, "candidates: 2/12, about 50 s left"),
        (4, 2, "candidates: 4/12, about 40 s left"),
        (2, 2, "candidates: 2/12"),
        (1, 2, "candidates: 1/12"),
        (12, 11, "candidates: 12/12 in 10 s"),
    ],
)
def test_a_resumed_search_was_about_to_end_at_once(capsys, done, known, told):
    Console(every_s=0.0).progress("candidates", done, 12, time.monotonic() - 10.0, known=known)
    assert capsys.readouterr().err.strip() == told


def test_what_a_long_stage_does_now_is_a_line(capsys):
    Console().begins("data and physics", "records")
    assert capsys.readouterr().err == "  data and physics: records ...\n"
