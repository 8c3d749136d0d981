"""What a rough look names, on searches whose outcomes are set by hand."""

from dataclasses import replace

import numpy as np
import pytest

from aesi.tracer import rough_look
from aesi.tracer.fit import fit_hypothesis
from aesi.tracer.problem import Problem
from aesi.tracer.records import prepare_all
from aesi.tracer.search import Admission, Archive, Scored, Search
from aesi.tracer.verdict import Verdict

BASE_V = 70e-3
ADMITTED = Admission(True, "", 100.0, 1e-2, 1e-3, 10.0)
UNKNOWN = Verdict("unknown", (), (), 0.9, 20e-3, 5e-3, "20 mV are left")


@pytest.fixture
def search(cell, few, make):
    """search({effect: (nats over the base, V left)}): what is not given brings nothing."""
    problem = Problem(cell, prepare_all(cell, [make(n=900)], 0.9, 0.0), few)
    empty = fit_hypothesis(problem, ())
    unit = empty.residual_v / np.sqrt(np.mean(empty.residual_v**2))

    def build(outcomes):
        made = Search(problem, np.random.default_rng(0), Archive(None, ""))
        for name in ("", *few):
            nats, left_v = outcomes.get(name, (0.0, BASE_V))
            hypothesis = (name,) if name else ()
            fit = replace(
                empty,
                hypothesis=hypothesis,
                residual_v=left_v * unit,
                log_evidence=empty.log_evidence + nats,
            )
            made.scored[frozenset(hypothesis)] = Scored(fit, left_v, left_v)
            made.admissions[frozenset(), frozenset(hypothesis)] = ADMITTED
        return made

    return build


def test_the_one_effect_that_takes_up_most_is_named_with_what_explains_it_as_well(search):
    rough = rough_look.most_of_it(
        search({"series_resistance": (180.0, 25e-3), "current_sensor_gain": (175.0, 28e-3)})
    )
    assert rough.best.hypothesis == ("series_resistance",)
    verdict = rough_look.named(UNKNOWN, rough)
    assert verdict.word == "unknown"
    assert verdict.effects == ("series_resistance",)
    assert verdict.groups == (("series_resistance", "current_sensor_gain"),)
    assert "87 %" in verdict.reason


def test_an_effect_far_ahead_stands_alone(search):
    rough = rough_look.most_of_it(
        search({"series_resistance": (180.0, 25e-3), "current_sensor_gain": (150.0, 40e-3)})
    )
    assert rough_look.named(UNKNOWN, rough).groups == ()


@pytest.mark.parametrize(
    ("outcomes", "why"),
    [
        ({"series_resistance": (180.0, 45e-3)}, "leaves four tenths of the variance"),
        ({"series_resistance": (5.0, 25e-3)}, "brings no evidence"),
        (
            {
                name: (180.0 - k, 25e-3)
                for k, name in enumerate(
                    ("series_resistance", "current_sensor_gain", "ocv_hysteresis", "solid_diffusivity")
                )
            },
            "four are alike",
        ),
    ],
)
def test_otherwise_nothing_is_named(search, outcomes, why):
    assert rough_look.most_of_it(search(outcomes)) is None, why


def test_a_look_alike_on_a_bound_silences(search):
    made = search({"series_resistance": (180.0, 25e-3), "current_sensor_gain": (175.0, 28e-3)})
    rival = made.scored[frozenset({"current_sensor_gain"})]
    knobs = made.problem.knobs(("current_sensor_gain",))
    x = np.array([0.0] * (len(knobs) - 1) + [knobs[-1].working_bounds[1]])
    made.scored[frozenset({"current_sensor_gain"})] = replace(
        rival, fit=replace(rival.fit, knobs=tuple(knobs), x=x)
    )
    assert rough_look.most_of_it(made) is None


def test_it_is_due_where_even_the_best_leaves_far_more_than_a_calibrated_model(search):
    assert rough_look.is_due(search({"series_resistance": (180.0, 25e-3)}))
    assert not rough_look.is_due(search({"series_resistance": (180.0, 5e-3)}))
