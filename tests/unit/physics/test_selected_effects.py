"""Which effects are tried: all, those named, or all but those named."""

import pytest

from aesi.errors import InputError
from aesi.physics.effects import CATALOGUE, selected


def test_those_named_or_all_but_those_named():
    assert selected(CATALOGUE) == CATALOGUE
    assert list(selected(CATALOGUE, only=["series_resistance"])) == ["series_resistance"]
    assert set(CATALOGUE) - set(selected(CATALOGUE, without=["clock_skew"])) == {"clock_skew"}


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'series_resistance'"):
        selected(CATALOGUE, without=["serie_resistance"])
