"""A generation through the store: nothing is evaluated twice, whoever else is at work."""

import threading

import pytest

from aesi.records import Failed
from flows.evaluation import generation as evaluation
from flows.evaluation.generation import Evaluation, Tally
from flows.evaluation.outcome_database import DatabaseOutcomes
from flows.evaluation.outcome_files import FileOutcomes


class Inline:
    """A pool of one that evaluates when asked to collect."""

    def __init__(self, calls, work=lambda genome: genome * 2):
        self.calls, self.work, self.waiting = calls, work, []

    @property
    def idle(self):
        return 1 - len(self.waiting)

    @property
    def busy(self):
        return len(self.waiting)

    def start(self, tag, genome):
        self.waiting.append((tag, genome))

    def collect(self, timeout_s):
        done, self.waiting = self.waiting, []
        self.calls.extend(genome for _, genome in done)
        return [(tag, self.work(genome)) for tag, genome in done]

    def close(self):
        pass


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr(evaluation, "POLL_S", 0.005)


@pytest.fixture
def made(tmp_path, said):
    def make(calls, study="s", only_of=None, work=lambda genome: genome * 2, lost_again=False):
        pool = Inline(calls, work)
        return Evaluation(
            pool, FileOutcomes(tmp_path / "o"), study, said.append, Tally(), only_of, lost_again
        )

    return make


def test_every_position_gets_its_outcome_and_twins_are_evaluated_once(made):
    calls = []
    found = dict(made(calls)([3, 5, 3, 7]))
    assert found == {0: 6, 1: 10, 2: 6, 3: 14}
    assert sorted(calls) == [3, 5, 7]


def test_a_second_run_evaluates_nothing(made):
    first, second = [], []
    dict(made(first)([1, 2, 3]))
    again = made(second)
    assert dict(again([1, 2, 3, 4])) == {0: 2, 1: 4, 2: 6, 3: 8}
    assert second == [4]
    assert (again.tally.evaluated, again.tally.found) == (1, 3)


def test_another_study_shares_nothing(made):
    calls = []
    dict(made([])([1]))
    dict(made(calls, study="t")([1]))
    assert calls == [1]


def test_without_reuse_everything_is_evaluated_again(made):
    calls = []
    dict(made([])([1, 2]))
    dict(made(calls, only_of="run")([1, 2]))
    assert calls == [1, 2]


def test_a_run_without_reuse_that_was_gone_on_with_took_what_others_had_stored(made):
    dict(made([])([1, 2, 3, 4]))
    begun, resumed, other = [], [], []
    dict(made(begun, only_of="run")([1, 2]))
    dict(made(resumed, only_of="run")([1, 2, 3]))
    dict(made(other, only_of="another run")([1, 2]))
    assert (begun, resumed, other) == ([1, 2], [3], [1, 2])


def test_failures_are_stored_too(made):
    calls = []
    work = {"work": lambda genome: Failed("no")}
    dict(made([], **work)([1]))
    assert dict(made(calls, **work)([1])) == {0: Failed("no")}
    assert calls == []


def test_what_was_lost_to_the_machine_failed_in_every_run_from_then_on(made):
    lost = {"work": lambda genome: Failed("its process was lost (SIGKILL)", of_machine=True)}
    dict(made([], **lost)([1]))
    assert dict(made([])([1]))[0] == lost["work"](1)  # a run that is gone on with, and its workers
    calls = []
    assert dict(made(calls, lost_again=True)([1, 1])) == {0: 2, 1: 2}
    assert calls == [1]
    dict(made([], study="t", **lost)([1]))
    assert dict(made(calls, study="t", lost_again=True, **lost)([1]))[0] == lost["work"](1)
    dict(made([], study="u", work=lambda genome: Failed("no"))([1]))
    assert dict(made([], study="u", lost_again=True)([1])) == {0: Failed("no")}


def test_a_damaged_entry_is_evaluated_again_and_said(made, tmp_path, said):
    calls = []
    dict(made([])([1]))
    (stored,) = (tmp_path / "o").glob("*/*.bin")
    stored.write_bytes(stored.read_bytes()[:-20])
    assert dict(made(calls)([1])) == {0: 2}
    assert calls == [1]
    assert "damaged" in said[0]
    assert dict(made([])([1])) == {0: 2}


def test_a_full_disk_stops_nothing(made, monkeypatch, said):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(FileOutcomes, "put", full)
    assert dict(made([])([1, 2])) == {0: 2, 1: 4}
    assert "No space left on device" in said[0]


def test_a_database_that_was_lost_in_mid_search_ended_the_run(tmp_path, said):
    outcomes, calls = DatabaseOutcomes(f"sqlite:///{tmp_path}/outcomes.db"), []

    def work(genome):
        if genome == 2:
            outcomes._engine.dispose()
            (tmp_path / "outcomes.db").unlink()  # the next connection finds no table
        return genome * 2

    found = dict(Evaluation(Inline(calls, work), outcomes, "s", said.append, Tally())([1, 2, 3, 4]))
    outcomes.close()
    assert found == {0: 2, 1: 4, 2: 6, 3: 8}
    assert sorted(calls) == [1, 2, 3, 4]
    (told,) = said
    assert "no such table" in told
    assert "the search goes on without" in told


def test_two_at_a_time_share_the_work(made):
    calls = [[], []]
    found = [{}, {}]
    genomes = list(range(40))

    def work(i):
        found[i] = dict(made(calls[i])(genomes))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert found[0] == found[1] == {g: 2 * g for g in genomes}
    assert sorted(calls[0] + calls[1]) == genomes
