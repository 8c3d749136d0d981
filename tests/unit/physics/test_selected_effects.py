"""Which effects are tried: all, those named, or all but those named."""

import pytest

from aesi.errors import EffectError, InputError
from aesi.physics.effects import CATALOGUE, activated, selected


def test_those_named_or_all_but_those_named():
    assert selected(CATALOGUE) == CATALOGUE
    assert list(selected(CATALOGUE, only=["series_resistance"])) == ["series_resistance"]
    assert set(CATALOGUE) - set(selected(CATALOGUE, without=["clock_skew"])) == {"clock_skew"}


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(InputError, match="did you mean 'series_resistance'"):
        selected(CATALOGUE, without=["serie_resistance"])


def test_one_that_is_to_be_tried_and_to_be_left_out_is_refused():
    with pytest.raises(InputError, match="clock_skew is named both"):
        selected(CATALOGUE, only=["clock_skew", "film_growth"], without=["clock_skew"])


def test_an_effect_that_is_named_twice_was_added_twice():
    once = ("series_resistance", {"resistance_ohm": 1e-3})
    with pytest.raises(InputError, match="series_resistance is named 2 times"):
        activated([once, ("film_growth", {}), once])


def test_a_name_that_the_catalogue_does_not_have_is_told_as_a_sentence():
    with pytest.raises(EffectError) as caught:
        CATALOGUE["serie_resistance"]
    assert str(caught.value) == (
        "there is no effect 'serie_resistance' in the catalogue; did you mean 'series_resistance'? "
        "`aesi effects` lists them."
    )
    assert isinstance(caught.value, KeyError)
    with pytest.raises(EffectError, match=r"; of that speaks series_resistance\. `aesi effects` lists them"):
        CATALOGUE["contact"]
    with pytest.raises(EffectError, match=r"'gremlins' in the catalogue\. `aesi effects` lists them"):
        CATALOGUE["gremlins"]
    assert CATALOGUE.get("serie_resistance") is None
    assert "serie_resistance" not in CATALOGUE
