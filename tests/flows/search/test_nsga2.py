"""The search: deterministic and resumable."""

import numpy as np
import optuna
import pytest
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

from aesi.errors import FitError
from aesi.records import Failed
from aesi.sparse import FitnessWeights, Genome, evaluate, fitness
from flows.search.nsga2 import Constraints, SearchSettings, search


def genomes(result):
    return [trial.genome for trial in result.trials]


def by(evaluate_one):
    """What evaluates a generation one candidate after the other."""
    return lambda batch: ((k, evaluate_one(genome)) for k, genome in enumerate(batch))


def test_the_same_seed_gives_the_same_search(problem):
    one, two = (search(problem, 12, seed=3, settings=SearchSettings(4)) for _ in range(2))
    assert genomes(one) == genomes(two)
    assert [t.losses for t in one.trials] == [t.losses for t in two.trials]
    assert genomes(search(problem, 12, seed=4, settings=SearchSettings(4))) != genomes(one)


def test_an_interrupted_search_goes_on_as_if_it_had_not_been(problem, tmp_path):
    whole = search(problem, 12, seed=3, settings=SearchSettings(4))
    journal = JournalStorage(JournalFileBackend(str(tmp_path / "journal.log")))
    calls = 0

    def stops(genome):
        nonlocal calls
        calls += 1
        if calls == 7:
            raise KeyboardInterrupt
        return evaluate(problem, genome)

    with pytest.raises(KeyboardInterrupt):
        search(problem, 12, seed=3, storage=journal, settings=SearchSettings(4), evaluate_many=by(stops))
    resumed = search(problem, 12, seed=3, storage=journal, settings=SearchSettings(4))
    assert genomes(resumed) == genomes(whole)
    assert [t.losses for t in resumed.trials] == [t.losses for t in whole.trials]


def test_importances_of_genes_come_without_warnings_of_optuna(problem, recwarn):
    shares = search(problem, 24, seed=3, settings=SearchSettings(8)).importances()
    assert sum(shares.values()) == pytest.approx(1.0)
    assert not [str(one.message) for one in recwarn]


def test_the_order_of_evaluation_does_not_matter(problem):
    def backwards(batch):
        return [(k, evaluate(problem, batch[k])) for k in reversed(range(len(batch)))]

    seen = []
    result = search(
        problem,
        8,
        seed=3,
        settings=SearchSettings(4),
        evaluate_many=backwards,
        on_candidate=lambda n, g, o: seen.append(n),
    )
    assert genomes(result) == genomes(search(problem, 8, seed=3, settings=SearchSettings(4)))
    assert seen == [3, 2, 1, 0, 7, 6, 5, 4]


def test_warm_start_and_failures_are_in_the_study(problem):
    good = Genome.whole(problem.library, 1e-2, 1e-3, 0.5, 2, 2, feedback=False)
    empty = Genome.of(np.zeros(len(problem.library), dtype=bool), 1.0, 0.1, 0.5, 1, 1)
    result = search(problem, 4, seed=0, settings=SearchSettings(4, warm_start=(good, empty)))
    assert genomes(result)[:2] == [good, empty]
    assert "no term is left" in result.trials[1].reason
    assert result.study.trials[1].state == optuna.trial.TrialState.PRUNED
    assert result.trials[1].losses is None


def test_a_bug_in_the_evaluation_is_not_swallowed(problem):
    def broken(genome):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        search(problem, 4, seed=0, evaluate_many=by(broken))


def test_all_infeasible_is_one_clear_error(problem):
    result = search(problem, 4, seed=0, settings=SearchSettings(4, Constraints(2.0, 2.0)))
    with pytest.raises(FitError, match=r"none of 4 candidates is feasible .*correlation"):
        result.best()


def test_all_failed_is_one_clear_error(problem):
    result = search(problem, 3, seed=0, evaluate_many=by(lambda _: Failed("out of luck")))
    assert result.failed == {"out of luck": 3}
    with pytest.raises(FitError, match=r"\(3 x out of luck\); see to what they failed of"):
        result.best()


def test_of_two_candidates_alike_the_earlier_one_is_picked(problem):
    good = Genome.whole(problem.library, 1e-2, 1e-3, 0.5, 2, 2, feedback=False)
    result = search(problem, 2, seed=0, settings=SearchSettings(2, warm_start=(good, good)))
    assert result.trials[0].losses == result.trials[1].losses
    assert result.best().number == 0
    assert result.fittest(1.0) == (0, 1)


def test_the_front_is_not_dominated_and_the_pick_lies_on_it(problem):
    settings = SearchSettings(10, weights=FitnessWeights(0.3, 0.6, 0.1))
    result = search(problem, 30, seed=1, settings=settings)
    front = result.front()
    assert front
    for trial in front:
        assert not any(
            all(a <= b for a, b in zip(o.losses, trial.losses, strict=True)) and o.losses != trial.losses
            for o in result.feasible
        )
    best = result.best()
    assert best in front

    def score(trial):
        return (
            1 - 0.3 * trial.losses[0] - 0.6 * trial.losses[1] - 0.1 * trial.losses[2] / len(problem.library)
        )

    assert score(best) == pytest.approx(max(score(trial) for trial in front))


def test_parents_are_the_elite_of_all_earlier_generations(problem):
    result = search(problem, 24, seed=3, settings=SearchSettings(4))
    chosen = {
        int(key.rsplit(":", 1)[1]): {result.study.trials[number].user_attrs["index"] for number in numbers}
        for key, numbers in result.study._storage.get_study_system_attrs(result.study._study_id).items()
        if ":parent:" in key
    }
    assert sorted(chosen) == [1, 2, 3, 4, 5]
    assert all(max(indices) < 4 * generation for generation, indices in chosen.items())
    assert any(
        max(indices) >= 4 * (generation - 1) for generation, indices in chosen.items() if generation > 1
    )


def test_evolution_beats_the_random_start(problem):
    result = search(problem, 80, seed=2, settings=SearchSettings(10))
    score = [t.numbers.get("fitness", -np.inf) for t in result.trials]
    assert max(score[10:]) > max(score[:10])


def test_a_study_in_a_database_goes_on_with_other_candidates(problem, tmp_path):
    url = f"sqlite:///{tmp_path / 'study.db'}"
    first, both = (search(problem, n, seed=0, storage=url, settings=SearchSettings(4)) for n in (4, 8))
    assert [trial.number for trial in both.trials] == list(range(8))
    assert genomes(both)[:4] == genomes(first)
    assert len(set(genomes(both))) == 8


def test_the_fittest_are_a_share_of_all_and_begin_with_the_pick(problem):
    result = search(problem, 30, seed=1, settings=SearchSettings(10))
    numbers = result.fittest(0.1)
    assert len(set(numbers)) == len(numbers) == 3
    assert numbers[0] == result.best().number
    fitnesses = {trial.number: trial.numbers["fitness"] for trial in result.feasible}
    others = [value for number, value in fitnesses.items() if number not in numbers]
    assert min(fitnesses[number] for number in numbers) >= max(others)
    assert result.fittest(0.0) == numbers[:1]


def test_candidates_were_ranked_by_the_default_weights_whatever_was_asked(problem):
    weights = FitnessWeights(0.1, 0.1, 2.0)
    result = search(problem, 6, 0, SearchSettings(6, Constraints(-1.0, -1.0), weights))
    kept = [trial for trial in result.trials if trial.losses is not None]
    assert len(kept) > 1
    for trial in kept:
        assert trial.numbers["fitness"] == pytest.approx(fitness(trial.losses, len(problem.library), weights))
    ranked = sorted(kept, key=lambda trial: -fitness(trial.losses, len(problem.library), weights))
    assert result.fittest(1.0) == tuple(trial.number for trial in ranked)
