"""The study outlives the process, under names that a person reads."""

import optuna
import pytest

from aesi.pipeline.experiment.candidate import ScoredCandidate
from aesi.records import Failed
from aesi.sparse import Candidate, Genome, evaluate
from aesi.sparse.search.genome import GENE_WORDS
from aesi.sparse.search.genome_space import GenomeSpace
from flows.search.nsga2 import Constraints
from flows.search.published_study import LOSSES, PublishedStudy, journal, study_storage


@pytest.fixture
def candidate(problem):
    outcome = evaluate(problem, Genome.whole(problem.library, 1e-2, 2e-2, 0.5, 2, 2, feedback=False))
    assert isinstance(outcome, Candidate)
    return outcome


@pytest.fixture
def publish(problem, said):
    def go(name="one"):
        return PublishedStudy(name, None, Constraints(0.5, 0.9), GenomeSpace.of(problem.library), said.append)

    return go


def test_the_study_died_with_the_process(publish, candidate, said):
    study = publish()
    study.add(0, candidate.genome, ScoredCandidate(candidate, coverage_pct=91.0))
    study.add(1, candidate.genome, Failed("took longer than 60 s"))
    again = optuna.load_study(study_name="one", storage=study_storage())
    done, failed = again.get_trials()
    assert tuple(done.values) == candidate.losses
    assert set(done.params) == set(GENE_WORDS.values())
    assert done.params["ridge (lambda1)"] == candidate.genome.lambda1
    assert done.user_attrs["coverage on validation, %"] == 91.0
    assert list(done.constraints) == [
        "correlation on training of at least 0.5",
        "correlation on validation of at least 0.9",
    ]
    assert failed.user_attrs["failed"] == "took longer than 60 s"
    assert again.metric_names == list(LOSSES)
    assert [trial.number for trial in again.best_trials] == [0]
    assert not said


def test_a_resumed_search_writes_no_candidate_twice(publish, candidate):
    publish().add(0, candidate.genome, ScoredCandidate(candidate))
    resumed = publish()
    resumed.add(0, candidate.genome, ScoredCandidate(candidate))
    resumed.add(1, candidate.genome, ScoredCandidate(candidate))
    assert len(optuna.load_study(study_name="one", storage=study_storage()).get_trials()) == 2


def test_a_storage_that_fails_is_said_once_and_stops_nothing(publish, candidate, said):
    study = publish()
    journal().unlink()
    journal().mkdir()
    for number in range(3):
        study.add(number, candidate.genome, ScoredCandidate(candidate))
    assert len(said) == 1
    assert "the search goes on without" in said[0]
