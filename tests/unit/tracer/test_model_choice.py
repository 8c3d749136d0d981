"""Which model of the cell all hypotheses use: the porous electrode where it matters, the single particle where the data
are one's, or the one that was asked for."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from aesi.physics import Cell, simulate
from aesi.physics.effects import CATALOGUE
from aesi.pipeline.discovery.discover import discovery_content, found_model
from aesi.records import Measurement
from aesi.tracer import discover
from aesi.tracer.case.reduction import Reduction
from aesi.tracer.decide import model_choice
from aesi.tracer.decide.evidence import second_is_believed
from aesi.tracer.decide.model_choice import _likelier, most_effects_of_dfn, with_model
from aesi.tracer.discovery import inverse_problem

from .conftest import CELLS, NOISE_V, steps

FEW = ("series_resistance", "current_sensor_gain", "electrolyte_transport", "reaction_nonuniformity")
NOTABLE_MV = 0.5


@pytest.fixture(scope="module")
def m50():
    return Cell.from_bpx(Path(CELLS) / "lg_m50_chen2020.bpx.json")


def record(cell, model):
    """1,800 s of steps to 2C on a cell whose two models differ by millivolts."""
    rng = np.random.default_rng(5)
    time, current = np.arange(1800.0), steps(1800, 5.0, rng)
    voltage = simulate(cell, time, current, 0.85, model=model).voltage_v
    return Measurement(time, current, voltage + NOISE_V * rng.normal(size=1800), name="made")


def found(cell, data, **options):
    return discover(cell, [data], soc0=0.85, effects={n: CATALOGUE[n] for n in FEW}, **options)


@pytest.mark.parametrize("truth", ["dfn", "espm"])
def test_the_model_is_the_one_that_explains_the_data_and_nothing_is_blamed_on_the_cell(m50, truth):
    tried = []
    one = found(m50, record(m50, truth), progress=tried.append)
    if truth == "dfn":  # no pair is sought with the single particle, which does not fit
        assert max(len(hypothesis.effects) for hypothesis in tried) == 1
    assert one.verdict.word == "none"
    assert one.choice.model == truth
    assert 1e3 * one.choice.reduction.shift_v > NOTABLE_MV
    content = discovery_content(one)
    assert content["model"]["name"] == truth
    assert content["model"]["differ_rms_mv"] == pytest.approx(1e3 * one.choice.reduction.shift_v)
    assert f"{content['model']['differ_rms_mv']:.2f} mV RMS" in " ".join(content["notes"])
    assert "reaction_nonuniformity" not in {c["effect"] for c in content["candidates"]}
    assert found_model(one).model == truth


def test_the_model_that_was_asked_for_is_used(m50):
    one = found(m50, record(m50, "dfn"), model="espm", max_effects=0)
    assert one.choice.model == "espm"
    assert "as asked" in one.choice.sentence


def test_parameters_that_were_fitted_with_one_model_are_searched_with_that_one(m50):
    one = found(replace(m50, fitted_with="espm"), record(m50, "dfn"), max_effects=0)
    assert one.choice.model == "espm"
    assert "with which the parameters of the cell were fitted" in one.choice.sentence


def test_models_that_differ_by_less_than_the_noise_leave_the_single_particle(m50):
    data = record(m50, "espm")
    rough = 1e-2 * np.random.default_rng(6).normal(size=len(data))
    loud = Measurement(
        data.time_s,
        0.1 * data.current_a,
        simulate(m50, data.time_s, 0.1 * data.current_a, 0.85).voltage_v + rough,
        name="loud",
    )
    one = found(m50, loud, max_effects=0)
    assert one.choice.model == "espm"
    assert not one.choice.reduction.notable


def explained(names, total, delta_v=5e-5, word="found"):
    """A search that is over: what it chose, what that says of unseen data, and with which size of the model error."""
    score = SimpleNamespace(total=total, evidence=total, delta_v=delta_v)
    chosen = SimpleNamespace(hypothesis=names, score=score)
    path = SimpleNamespace(chosen=chosen, problem=SimpleNamespace(competing=lambda: range(20)))
    return SimpleNamespace(path=path, verdict=SimpleNamespace(word=word))


def test_the_porous_electrode_is_tried_with_as_many_names_as_could_be_believed():
    assert most_effects_of_dfn(explained(("a",), 100.0), 3) == 1
    assert most_effects_of_dfn(explained((), 100.0, word="none"), 3) == 0
    assert most_effects_of_dfn(explained(("a",), 100.0, 2e-4), 3) == 3  # there is more to explain
    assert most_effects_of_dfn(explained(("a",), 100.0, word="unknown"), 3) == 3


def test_a_difference_far_above_the_noise_was_told_as_a_power_of_ten():
    said = Reduction(8.18e-3, 6.8e-5, "the declared cell").sentence
    assert said.endswith("8.18 mV RMS here, 120 times the noise of the rows that are fitted (0.07 mV)")
    assert "1.5 times" in Reduction(4.29e-3, 2.86e-3, "the declared cell").sentence


def test_a_model_of_an_unknown_was_said_to_explain_the_data():
    assert _likelier(explained(("a",), 100.0)).endswith(" explains these data with fewer or likelier effects")
    assert "neither model explains the data" in _likelier(explained(("a",), 100.0, word="unknown"))


def test_both_kinds_of_evidence_have_to_speak_for_a_further_name():
    def searched(names, total, plausible, word="found"):
        one = explained(names, total, word=word)
        one.path.chosen.score.evidence = plausible + len(names) * np.log(20)
        return one.path, one.verdict

    one = searched(("a",), 100.0, 50.0)
    assert second_is_believed(one, searched(("b", "c"), 110.0, 51.0))
    assert not second_is_believed(one, searched(("b", "c"), 110.0, 49.0))
    assert not second_is_believed(one, searched(("b", "c"), 96.0, 60.0))
    assert second_is_believed(searched(("b", "c"), 110.0, 49.0), one)
    assert second_is_believed(one, searched(("d",), 110.0, 49.0))
    assert second_is_believed(searched((), 120.0, 70.0, "unknown"), one)


def test_the_porous_electrode_is_not_searched_where_the_single_particle_ends_far_beyond_what_they_differ_by(
    m50,
):
    """What is out of the single particle's reach may be what the two models differ by; by a search it is not."""
    reduction = Reduction(2e-3, 1e-4, "the declared cell")
    asked = []

    def answer(model, left_v, beyond_v):
        path = SimpleNamespace(beyond_reach_v=beyond_v, problem=SimpleNamespace(noise_v=1e-4), chosen=left_v)
        verdict = SimpleNamespace(word="unknown")
        return SimpleNamespace(
            path=path, verdict=verdict, paths={"tight": path}, evidence_for=lambda verdict: model
        )

    def search(problem, archive, most, shallower=None):
        asked.append((problem.model, problem.reduced_v))
        return answer(problem.model, 12e-3, None if problem.reduced_v else 1.5e-3)

    problem = inverse_problem(m50, [record(m50, "espm")], 0.85, effects={n: CATALOGUE[n] for n in FEW})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model_choice, "reduction_of", lambda *_: reduction)
        patch.setattr(model_choice, "structured_v", lambda path, chosen: chosen)
        patch.setattr(model_choice, "with_fine_numerics", lambda problem: problem)
        _, choice = with_model(problem, None, search, lambda problem, other: None, 3)
    assert asked == [("espm", 0.0), ("espm", 2e-3)]
    assert choice.model == "espm"
    assert "whose error is far larger than the difference of the two models" in choice.sentence
