"""What the search itself costs a candidate, against Optuna's NSGA-II with one parameter a term.

Both ask and tell the same number of candidates that cost nothing to evaluate, so what is left is the search:
selection, crossover, and the storage of the trials. Processor milliseconds a candidate, of one run; `ratio` is
the peer's over ours. `ours_stored` and `peer_stored` are the parameters and attributes that a candidate leaves in
the storage. `storage` is "memory", where an experiment keeps its own search, or "SQLite", which workers can share.
"""

from __future__ import annotations

import tempfile
import time
import warnings
from collections.abc import Iterator, Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import optuna
from optuna.storages import BaseStorage, InMemoryStorage
from pydantic import NonNegativeInt, PositiveInt

from aesi.bench import AtLeastTwo
from aesi.constants import MILLI
from aesi.sparse import Candidate, Genome, Problem
from aesi.sparse.search.genome_space import GenomeSpace
from flows.search.nsga2 import SearchSettings, search

SHARED_CANDIDATES = 10
"""On SQLite, where the peer takes seconds for one."""
SHARED = "SQLite"


def run(
    terms: PositiveInt = 626,
    candidates: PositiveInt = 60,
    population: AtLeastTwo = 20,
    seed: NonNegativeInt = 0,
) -> Iterator[dict[str, Any]]:
    """One line a storage."""
    # What loads at the first call is loaded before the clock starts.
    _ours(terms, population, population, seed, InMemoryStorage())
    for storage, number in (("memory", candidates), (SHARED, min(candidates, SHARED_CANDIDATES))):
        with tempfile.TemporaryDirectory(prefix="aesi-bench-") as folder:
            ours_in, peer_in = _storage(storage, folder, "ours"), _storage(storage, folder, "peer")
            ours = _ours(terms, number, population, seed, ours_in)
            peer = _peer(terms, number, population, seed, peer_in)
            stored = {"ours_stored": _stored(ours_in), "peer_stored": _stored(peer_in)}
        yield {
            "storage": storage,
            "terms": terms,
            "candidates": number,
            "ours_ms": ours,
            "peer_ms": peer,
            "ratio": peer / ours,
            **stored,
        }


def _storage(storage: str, folder: str, name: str) -> str | BaseStorage:
    return f"sqlite:///{folder}/{name}.db" if storage == SHARED else InMemoryStorage()


def _stored(storage: str | BaseStorage) -> float:
    """Parameters and attributes a trial, mean."""
    trials = optuna.load_study(study_name=None, storage=storage).trials
    return float(np.mean([len(t.params) + len(t.user_attrs) + len(t.system_attrs) for t in trials]))


def _ours(terms: int, candidates: int, population: int, seed: int, storage: str | BaseStorage) -> float:
    rng = np.random.default_rng(seed)

    def evaluate_many(genomes: Sequence[Genome]) -> list[tuple[int, Candidate]]:
        return [(k, _free_of_charge(genome, rng)) for k, genome in enumerate(genomes)]

    problem = cast(Problem, SimpleNamespace(library=range(terms)))
    started = time.process_time()
    settings = SearchSettings(population, space=GenomeSpace(terms))
    search(problem, candidates, seed, settings, storage=storage, evaluate_many=evaluate_many)
    return MILLI * (time.process_time() - started) / candidates


def _free_of_charge(genome: Genome, rng: np.random.Generator) -> Candidate:
    """An outcome with losses at random."""
    figures = {
        "genome": genome,
        "losses": tuple(rng.random(3)),
        "fitness": 0.0,
        "pearson_train": 1.0,
        "pearson_valid": 1.0,
        "free_run_valid_mser_pct": 0.0,
        "one_step_valid_rmse_v": 0.0,
    }
    return cast(Candidate, SimpleNamespace(**figures))


def _peer(terms: int, candidates: int, population: int, seed: int, storage: str | BaseStorage) -> float:
    rng = np.random.default_rng(seed)

    def losses(trial: optuna.Trial) -> tuple[float, ...]:
        for k in range(terms):
            trial.suggest_categorical(f"term_{k}", [False, True])
        for gene in ("lambda1", "lambda2", "tau"):
            trial.suggest_float(gene, 1e-6, 1.0, log=True)
        return tuple(rng.random(3))

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        sampler = optuna.samplers.NSGAIISampler(population_size=population, seed=seed)
    started = time.process_time()
    study = optuna.create_study(storage=storage, directions=["minimize"] * 3, sampler=sampler)
    study.optimize(losses, n_trials=candidates)
    return MILLI * (time.process_time() - started) / candidates
