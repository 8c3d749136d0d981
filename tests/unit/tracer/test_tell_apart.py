"""The experiment that is advised for look-alikes."""

from aesi.physics.effect import Effect
from aesi.tracer.report.tell_apart import OTHERWISE, SENSOR, telling_experiment


def advised(*effects):
    return telling_experiment([one.id for one in effects], {one.id: one for one in effects})


def test_two_effects_that_each_say_how_to_tell_the_other_left_a_third_without_a_word():
    lag = Effect("lag", "physics", "", told_apart={"drop": "a pulse at 1 kHz"})
    drop = Effect("drop", "physics", "", told_apart={"lag": "a rest after a pulse"})
    third = Effect("third", "physics", "", experiment="a discharge in the cold")
    assert advised(lag, drop) == "a pulse at 1 kHz; a rest after a pulse"
    assert advised(lag, drop, third) == (
        "a pulse at 1 kHz; a rest after a pulse; for third: a discharge in the cold"
    )


def test_what_tells_all_of_a_group_apart_needs_no_other_experiment():
    one = Effect("one", "physics", "", told_apart={"two": "this", "three": "that"}, experiment="another")
    two, three = (Effect(name, "physics", "", experiment="another") for name in ("two", "three"))
    assert advised(one, two, three) == "this; that"


def test_an_instrument_is_told_by_a_second_one_and_what_says_nothing_by_other_data():
    gain, plain = Effect("gain", "instrument", ""), Effect("plain", "physics", "")
    assert advised(gain, plain) == SENSOR
    assert advised(plain, Effect("other", "physics", "")) == OTHERWISE
