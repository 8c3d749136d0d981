"""The result of the search stage, whoever evaluated its candidates and in whichever order they came."""

from types import SimpleNamespace

from aesi.records import Failed
from flows.search.study import StudyResult


def test_candidates_came_in_the_order_in_which_the_workers_ended():
    """Of those that are equally good on some folds the first is picked for the validation figure."""
    first, second, third = (SimpleNamespace(candidate=name) for name in ("first", "second", "third"))
    scored = {2: third, 0: first, 3: Failed("none"), 1: second}
    assert StudyResult(None, (0,), None, "", scored).candidates() == ("first", "second", "third")
