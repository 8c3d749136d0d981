"""One name, one denominator: a candidate's reduction is against the physics that a model's of the same name is."""

import numpy as np
import pytest
from small_experiment import (
    BPX,
    PERIOD_S,
    SOC0,
    build_problem,
    conformalise,
    experiment,
    final_models,
)

from aesi.pipeline.experiment.judging.evaluate import evaluate_models
from aesi.pipeline.experiment.judging.reductions import AGAINST, valid_reductions, valid_shares
from aesi.pipeline.experiment.load import load
from aesi.sparse import Candidate, Genome, evaluate
from aesi.sparse.search.fold_models import fold_samples


def searched(record, **repeats):
    """The experiment on recalibrated physics, loaded, with its problem and one candidate."""
    config = experiment(
        record,
        data={
            "kind": "files",
            "record": str(record),
            "repeats": {"period_s": PERIOD_S, "train": [1, 3, 5], "test": [2, 4], **repeats},
        },
        cell={"bpx": str(BPX), "soc0": SOC0, "start": "recalibrated"},
        models=["ESPM", "AESI I"],
    )
    loaded = load(config)
    problem = build_problem(loaded, config)
    candidate = evaluate(problem, Genome.whole(problem.library, 1.0, 1e-3, 0.5, 1, 1, feedback=False))
    assert isinstance(candidate, Candidate)
    return config, loaded, problem, candidate


def test_a_candidate_was_told_against_another_physics_than_the_model_that_it_became(record):
    config, loaded, problem, candidate = searched(record, valid_share=0.25)
    models = conformalise(
        final_models(problem, candidate, config).fitted, problem, candidate, config, loaded.left_out
    )
    rows = {row["name"]: row["free_run"] for row in evaluate_models(models, loaded.split).rows}
    found = valid_reductions(candidate, valid_shares(problem, loaded.left_out))
    assert candidate.free_run_valid_mser_pct < 50.0  # all but the noise is gone with the recalibration
    assert found["mser_pct"] > 99.0
    # The rows of a model hold the measured sample that a free run begins with, one of 150, and remember it a little.
    for name in AGAINST:
        assert found[name] == pytest.approx(rows["AESI I"][f"valid_{name}"], abs=2.0)
    assert found["mser_recalibrated_pct"] == pytest.approx(candidate.free_run_valid_mser_pct, abs=1e-9)


def test_without_validation_records_the_pieces_count_that_candidates_are_judged_on(record):
    _, loaded, problem, candidate = searched(record)
    shares = valid_shares(problem, loaded.left_out)
    scale = problem.scaling.error_volts_per_unit
    corrected = scale**2 * np.sum(problem.unseen_target**2)
    declared = sum(np.sum(series.left_by("ESPM")[1:] ** 2) for series in loaded.split.train)
    assert shares["mser_pct"] == pytest.approx(corrected / declared)
    assert valid_reductions(candidate, shares)["mser_pct"] > 99.0


@pytest.mark.parametrize("feedback", [False, True])
def test_the_error_that_a_candidate_is_judged_by_was_that_of_physics_that_the_search_did_not_use(
    record, feedback
):
    library = {
        "inputs": ["I"],
        "p_c": [0, 1],
        "d": [1, 1],
        "special": False,
        "fade": False,
        "feedback": feedback,
    }
    data = {"kind": "files", "record": str(record)}
    data |= {"repeats": {"period_s": PERIOD_S, "train": [1, 3, 5], "test": [2, 4]}}
    config = experiment(
        record, data=data, library=library, cell={"bpx": str(BPX), "soc0": SOC0, "start": "recalibrated"}
    )
    loaded = load(config)
    problem = build_problem(loaded, config)
    by_search = (problem.scaling.error_volts_per_unit * problem.unseen_target) ** 2
    declared = sum(
        float(np.sum(part.take(rows).left_by("ESPM") ** 2))
        for (part, rows) in (fold_samples(problem, a, b) for a, b in problem.folds)
    )
    assert valid_shares(problem, loaded.left_out)["mser_pct"] == pytest.approx(
        float(by_search.sum()) / declared, rel=1e-3
    )
